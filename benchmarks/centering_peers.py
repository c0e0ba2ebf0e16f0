"""What other packages do of the same: recursive least squares, circle fits, circles of roundness."""

import circle_fit
import cvxpy as cp
import numpy as np
import padasip
from filterpy.kalman import KalmanFilter
from scipy import linalg, optimize, spatial

FLAT = 1e6
"""Inverse information of a recursion that knows nothing yet."""


def by_padasip(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Recursive least squares, one sample after the other."""
    found = padasip.filters.FilterRLS(rows.shape[1], mu=1.0, eps=1.0 / FLAT)
    for row, target in zip(rows, reading, strict=True):
        found.adapt(target, row)
    return found.w


def by_filterpy(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """A Kalman filter whose state stands still: recursive least squares."""
    found = KalmanFilter(dim_x=rows.shape[1], dim_z=1)
    found.P *= FLAT
    found.Q *= 0.0
    for k in range(reading.size):
        found.predict()
        found.update(reading[k], H=rows[k : k + 1])
    return found.x[:, 0]


def by_numpy(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """The same recursion with matrices of numpy."""
    p, b = FLAT * np.eye(rows.shape[1]), np.zeros(rows.shape[1])
    for row, target in zip(rows, reading, strict=True):
        gain = p @ row
        share = 1.0 + row @ gain
        b = b + gain * ((target - row @ b) / share)
        p = p - np.outer(gain, gain) / share
    return b


def streamed_numpy(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """The same, each reading handed over in a call of its own, as a machine would."""
    p, b = FLAT * np.eye(rows.shape[1]), np.zeros(rows.shape[1])

    def update(row: np.ndarray, target: float) -> None:
        nonlocal p, b
        gain = p @ row
        share = gain / (1.0 + row @ gain)
        b = b + share * (target - row @ b)
        p = p - gain[:, None] * share

    for row, target in zip(rows, reading, strict=True):
        update(row, target)
    return b


def by_sums(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Values after each of all readings, at once: running sums of the normal equations."""
    size = rows.shape[1]
    information = np.cumsum(rows[:, :, None] * rows[:, None], axis=0) + np.eye(size) / FLAT
    return np.linalg.solve(information, np.cumsum(rows * reading[:, None], axis=0)[..., None])[..., 0]


def by_refits(rows: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """All data once more after each sample: what Mears calls PRLS."""
    found = np.zeros(rows.shape[1])
    for m in range(rows.shape[1], reading.size + 1):
        found = np.linalg.solve(rows[:m].T @ rows[:m], rows[:m].T @ reading[:m])
    return found


def fit_by_scipy(angle: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Radius and centre from the exact curve, by a general least-squares routine."""
    cos, sin = np.cos(angle), np.sin(angle)

    def off(value: np.ndarray) -> np.ndarray:
        radius, x, y = value
        return x * cos + y * sin + np.sqrt(radius**2 - (x * sin - y * cos) ** 2) - reading

    return optimize.least_squares(off, [reading.mean(), 0.0, 0.0], method="lm").x


def fits(points: np.ndarray) -> dict:
    """Circle fits of circle-fit, by name: each gives x, y, radius and more."""
    return {
        "circle-fit hyperLSQ": lambda: circle_fit.hyperLSQ(points),
        "circle-fit taubinSVD": lambda: circle_fit.taubinSVD(points),
        "circle-fit kmh": lambda: circle_fit.kmh(points),
    }


def zone_by_cvxpy(points: np.ndarray, solver: str) -> float:
    """Least distance of two circles about one centre, linear in the centre about the mean, scaled; one linear
    programme.
    """
    beta, height, scale = _scaled(points)
    x, y, low, high = cp.Variable(), cp.Variable(), cp.Variable(), cp.Variable()
    left = height - x * np.cos(beta) - y * np.sin(beta)
    cp.Problem(cp.Minimize(high - low), [left <= high, left >= low]).solve(solver=solver)
    return float(high.value - low.value) * scale


def zone_by_scipy(points: np.ndarray) -> float:
    """The same by scipy's HiGHS."""
    beta, height, scale = _scaled(points)
    cos, sin, one, none = np.cos(beta), np.sin(beta), np.ones_like(beta), np.zeros_like(beta)
    outer = np.column_stack([-cos, -sin, none, -one])
    inner = np.column_stack([cos, sin, one, none])
    found = optimize.linprog(
        [0.0, 0.0, -1.0, 1.0],
        np.vstack([outer, inner]),
        np.concatenate([-height, height]),
        bounds=(None, None),
        method="highs",
    )
    return float(found.fun) * scale


def zone_by_generation(points: np.ndarray) -> float:
    """The same with the few points that matter: solve, add the farthest outside and inside, solve again."""
    beta, height, scale = _scaled(points)
    directions = np.column_stack([np.cos(beta), np.sin(beta)])
    kept, charges = np.arange(0, beta.size, max(beta.size // 8, 1)), [0.0, 0.0, -1.0, 1.0]
    while True:
        d, h, none = directions[kept], height[kept], np.zeros(kept.size)
        rows = np.vstack([np.column_stack([-d, none, none - 1.0]), np.column_stack([d, none + 1.0, none])])
        found = optimize.linprog(charges, rows, np.append(-h, h), bounds=(None, None), method="highs")
        left = height - directions @ found.x[:2]
        worst = [left.argmax(), left.argmin()]
        if np.isin(worst, kept).all():
            return float(np.ptp(left)) * scale
        kept = np.append(kept, worst)


def zone_by_exchange(points: np.ndarray) -> float:
    """The same by exchange of one point of four, with numpy alone: the strongest simple rival."""
    around = points - points.mean(axis=0)
    radius = np.hypot(*around.T)
    rows, height = np.column_stack([around / radius[:, None], np.ones_like(radius)]), radius - radius.mean()
    kept = np.arange(4) * radius.size // 4
    balance = np.linalg.svd(rows[kept].T)[2][3]  # weights, some negative, of which the rows' sum is 0
    side = np.sign(balance) * np.sign(balance @ height[kept])
    while True:
        inverse = np.linalg.inv(np.column_stack([rows[kept], side]))
        value = inverse @ height[kept]  # centre, middle radius and half the zone
        left = height - rows @ value[:3]
        worst = np.abs(left).argmax()
        if abs(left[worst]) <= value[3] + 1e-14 * radius.max():
            return 2.0 * float(value[3])
        entering = np.sign(left[worst])
        gain = (inverse.T @ np.append(entering * rows[worst], 1.0)) * side
        leaves = np.where(gain > 0.0, inverse[3] * side / np.where(gain > 0.0, gain, 1.0), np.inf).argmin()
        kept[leaves], side[leaves] = worst, entering


def _scaled(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Directions from the mean, distances less their mean over their spread, and that spread (mm)."""
    around = points - points.mean(axis=0)
    radius = np.hypot(*around.T)
    spread = float(np.ptp(radius))
    return np.arctan2(around[:, 1], around[:, 0]), (radius - radius.mean()) / spread, spread


def enclosing_by_cvxpy(points: np.ndarray) -> float:
    """Radius of the smallest circle around the points, by Clarabel, scaled to a unit radius."""
    middle = points.mean(axis=0)
    scale = float(np.max(np.hypot(*(points - middle).T)))
    center, radius = cp.Variable(2), cp.Variable()
    around = (points - middle) / scale
    cp.Problem(cp.Minimize(radius), [cp.norm(around - center[None, :], axis=1) <= radius]).solve(
        solver="CLARABEL"
    )
    return float(radius.value) * scale


def inscribed_by_scipy(points: np.ndarray) -> float:
    """Radius of the largest circle without a point inside whose centre is inside the hull: corners of a
    Voronoi diagram.
    """
    corners = spatial.Voronoi(points).vertices
    hull = spatial.ConvexHull(points)
    inside = corners[np.all(corners @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0, axis=1)]
    return float(spatial.cKDTree(points).query(inside)[0].max())


def filter_by_matrix(deviation: np.ndarray, upr: float) -> np.ndarray:
    """Gaussian filter as a circular convolution with its weights, written out."""
    count = deviation.size
    places = np.arange(count)
    waves = np.fft.fftfreq(count, 1.0 / count)
    weights = np.real(np.fft.ifft(2.0 ** -((waves / upr) ** 2)))
    return weights[(places[:, None] - places) % count] @ deviation


def harmonics_by_scipy(beta: np.ndarray, deviation: np.ndarray, ratio: float, upr_max: int) -> np.ndarray:
    """One least-squares fit of harmonics and the roller's tone, the ratio being known."""
    order = np.append(np.arange(1, upr_max + 1), ratio)
    waves = np.outer(beta, order)
    return linalg.lstsq(np.column_stack([np.ones_like(beta), np.cos(waves), np.sin(waves)]), deviation)[0]
