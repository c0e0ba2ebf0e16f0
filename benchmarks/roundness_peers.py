"""The strongest simple rivals of the roundness tester: the same numbers in about 20 lines of numpy and scipy."""

import cvxpy as cp
import numpy as np
from scipy import optimize

DEGREE_2 = 0.7309134281  # source: half-width constant of the Gaussian regression of degree 2
SEED = 12181  # that of the library, so that the draws, and both intervals, are the same


def least_squares_by_numpy(points: np.ndarray) -> float:
    """RONt about the least squares circle: three Gauss-Newton steps on true distances."""
    center = points.mean(axis=0)
    for _ in range(3):
        around = points - center
        radius = np.sqrt((around * around).sum(axis=1))
        rows = np.column_stack([around / radius[:, None], np.ones_like(radius)])
        center = center + np.linalg.solve(rows.T @ rows, rows.T @ radius)[:2]
    return float(np.ptp(np.hypot(*(points - center).T)))


def one_sided_by_exchange(points: np.ndarray, outer: bool) -> float:
    """Radius of the smallest circle around the points or the largest within: exchange of one point of three."""
    center, sign = points.mean(axis=0), 1.0 if outer else -1.0
    for _ in range(3):  # distances linear in the centre, each time about the last one
        around = points - center
        radius = np.sqrt((around * around).sum(axis=1))
        rows = np.column_stack([sign * around / radius[:, None], np.ones_like(radius)])
        kept = np.arange(3) * radius.size // 3
        while True:
            inverse = np.linalg.inv(rows[kept])
            value = inverse @ (sign * radius[kept])
            over = sign * radius - rows @ value
            worst = over.argmax()
            if over[worst] <= 1e-14 * radius[0]:
                break
            share = rows[worst] @ inverse
            kept[np.where(share > 0.0, inverse[2] / np.where(share > 0.0, share, 1.0), np.inf).argmin()] = (
                worst
            )
        center = center + value[:2]
    return sign * float(value[2])


def inscribed_by_cvxpy(points: np.ndarray) -> float:
    """Radius of the largest circle within, distances linear in the centre about the mean, scaled."""
    around = points - points.mean(axis=0)
    radius = np.hypot(*around.T)
    scale, x, least = float(np.ptp(radius)), cp.Variable(2), cp.Variable()
    height = (radius - radius.mean()) / scale
    cp.Problem(cp.Maximize(least), [height - (around / radius[:, None]) @ x >= least]).solve(solver="HIGHS")
    return float(least.value) * scale + float(radius.mean())


def gaussian_by_numpy(deviation: np.ndarray, upr: float) -> np.ndarray:
    """Gaussian filter of an even turn, or of many."""
    waves = np.fft.rfft(deviation)
    return np.fft.irfft(waves * np.exp2(-((np.arange(waves.shape[-1]) / upr) ** 2)), deviation.shape[-1])


def eccentric_by_numpy(angle: np.ndarray, reading: np.ndarray, upr: float) -> np.ndarray:
    """Gaussian filter of an even turn of a ring off its axis, about its own centre; twice by the slope."""
    points, center = reading * np.exp(1j * angle), 0j
    for _ in range(2):  # the least squares circle, to the square of the offset over the radius
        around = points - center
        center += 2 * np.mean(np.abs(around) * np.exp(1j * angle))
    around = (points - center) * np.exp(-1j * angle)
    shift, deviation = np.angle(around), np.abs(around)
    deviation = deviation - deviation.mean()
    slope, moved = 1j * np.arange(deviation.size // 2 + 1), deviation
    for _ in range(2):
        moved = deviation - shift * np.fft.irfft(slope * np.fft.rfft(moved), deviation.size)
    return gaussian_by_numpy(moved, upr)


def robust_by_numpy(deviation: np.ndarray, upr: float) -> np.ndarray:
    """Robust Gaussian regression of degree 2 of an even turn, all moments by FFT."""
    size, change = deviation.size, np.inf
    place = np.fft.fftfreq(size) * upr / DEGREE_2  # in widths of the kernel
    kernel = np.exp(-np.pi * place**2) * place ** np.arange(5)[:, None]
    kernel[1::2, size // 2] = 0.0
    waves, weights, form = np.conj(np.fft.rfft(kernel)), np.ones(size), np.zeros(size)
    while change > 1e-9 * max(np.ptp(form), 1e-300):
        a, b, c, d, e = np.fft.irfft(np.fft.rfft(weights) * waves, size)
        p, q, r = np.fft.irfft(np.fft.rfft(weights * deviation) * waves[:3], size)
        first, second, third = c * e - d * d, b * e - c * d, b * d - c * c
        new = (p * first - q * second + r * third) / (a * first - b * second + c * third)
        change, form = np.abs(new - form).max(), new
        left = np.abs(deviation - form)
        limit = 4.4478 * np.median(left)
        weights = np.where(left < limit, (1.0 - (left / limit) ** 2) ** 2, 0.0)
    return form


def zones_by_numpy(forms: np.ndarray) -> np.ndarray:
    """Minimum zones of forms of an even turn, all at once: exchange of one point of four in each."""
    count, size = forms.shape
    angle, which = np.arange(size) * 2 * np.pi / size, np.arange(count)
    rows = np.column_stack([np.cos(angle), np.sin(angle), np.ones(size)])
    kept = np.tile(np.arange(4) * size // 4, (count, 1))
    side = np.array([1.0, -1.0, 1.0, -1.0]) * np.sign(forms[:, kept[0]] @ [1.0, -1.0, 1.0, -1.0])[:, None]
    found, open_ = np.zeros(count), np.arange(count)
    while open_.size:
        at, sides = kept[open_], side[open_]
        inverse = np.linalg.inv(np.concatenate([rows[at], sides[..., None]], axis=2))
        value = (inverse @ np.take_along_axis(forms[open_], at, 1)[..., None])[..., 0]
        left = forms[open_] - value[:, :3] @ rows.T
        worst = np.abs(left).argmax(axis=1)
        far = left[which[: open_.size], worst]
        found[open_] = 2.0 * value[:, 3]
        gain = (np.column_stack([np.sign(far)[:, None] * rows[worst], np.ones(far.size)])[:, None] @ inverse)[
            :, 0
        ]
        gain *= sides
        price = inverse[:, 3] * sides
        leaves = np.where(gain > 1e-12, price / np.where(gain > 1e-12, gain, 1.0), np.inf).argmin(axis=1)
        side[open_, leaves], kept[open_, leaves] = np.sign(far), worst
        open_ = open_[np.abs(far) > value[:, 3] + 1e-12 * np.abs(value[:, 3])]
    return found


def interval_by_numpy(filtered: np.ndarray, noise_sd: float, upr: float, zone: bool) -> tuple[float, float]:
    """Calibrated interval of 95 % after a Gaussian, all draws at once; `noise_sd` is of a reading, mm."""
    size, width = filtered.size, zones_by_numpy if zone else lambda forms: np.ptp(forms, axis=-1)
    passed = np.exp2(-((np.arange(2, size // 2) / upr) ** 2))
    sd = noise_sd * np.sqrt(2.0 / size) * passed[passed > 0.013 * passed[0]]
    count, turn = sd.size, 1 << int(np.ceil(np.log2(8 * (sd.size + 1))))

    def values(waves: np.ndarray) -> np.ndarray:
        return np.fft.irfft(np.pad(waves, [(0, 0)] * (waves.ndim - 1) + [(2, 0)]) * turn / 2, turn)

    drawn = np.random.default_rng(SEED).standard_normal((100, count, 2)) @ [1.0, -1j]
    noise = values(sd * drawn)
    noise, spread = np.concatenate([noise, -noise]), np.sqrt(sd @ sd)
    measured = 2 * np.fft.rfft(filtered)[2 : count + 2] / size
    form = values(np.where(np.abs(measured) ** 2 > 2 * sd**2 * np.log(count), measured, 0.0))
    flat = np.fft.rfft(np.clip(form, form.min() + 1.5 * spread, form.max() - 1.5 * spread))
    flat[:2] = 0.0
    value = width(np.fft.irfft(np.fft.rfft(filtered) * (np.arange(size // 2 + 1) > 1), size)[None])[0]
    bases = [form, np.fft.irfft(flat, turn)] + ([values(measured)] if value < 24 * spread else [])
    lifts = [width(base + noise) - width(base[None]) for base in bases]
    low, middle, high = np.quantile(lifts[0], (0.025, 0.5, 0.975))
    lower = min(value - middle - 1.3 * (high - middle), value - np.quantile(lifts[1], 0.975))
    upper = [
        value - middle + 1.15 * (middle - low),
        *(value - np.quantile(each, 0.025) for each in lifts[2:]),
    ]
    return max(lower, 0.0), max(upper)


def _distances(points: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances from the axis (x, y, u, v), tilted by half the length at the end, and slopes over it."""
    half = np.ptp(points[:, 2]) / 2
    z = (points[:, 2] - points[:, 2].min()) / half - 1.0
    shift = points[:, :2] - place[:2] - z[:, None] * place[2:]
    along = np.append(place[2:] / half, 1.0) / np.sqrt(1.0 + place[2:] @ place[2:] / half**2)
    foot = shift @ along[:2]
    distance = np.sqrt((shift * shift).sum(axis=1) - foot * foot)
    level = -(shift - foot[:, None] * along[:2]) / distance[:, None]
    return distance, np.column_stack([level, level * (z + foot * along[2] / half)[:, None]])


def cylinder_by_numpy(points: np.ndarray) -> np.ndarray:
    """Axis of the least squares cylinder: Gauss-Newton on true distances."""
    place = np.append(points[:, :2].mean(axis=0), [0.0, 0.0])
    for _ in range(5):
        distance, slope = _distances(points, place)
        rows = np.column_stack([slope, -np.ones(distance.size)])
        place = place + np.linalg.solve(rows.T @ rows, -rows.T @ distance)[:4]
    return place


def cylinder_zone_by_generation(points: np.ndarray) -> float:
    """Minimum zone cylinder: linear programs on true distances, each with the few points that matter."""
    place, box, kept = cylinder_by_numpy(points), 4.0, np.arange(0, len(points), len(points) // 12)
    distance, slope = _distances(points, place)
    width = unit = np.ptp(distance)
    while True:
        height = (distance - distance.mean()) / unit
        while True:
            ones, h = np.ones((kept.size, 1)), height[kept]
            rows = np.vstack(
                [np.hstack([slope[kept], -ones, 0 * ones]), np.hstack([-slope[kept], 0 * ones, ones])]
            )
            bounds = [(-box, box)] * 4 + [(None, None)] * 2
            found = optimize.linprog(
                [0, 0, 0, 0, 1, -1], rows, np.append(-h, h), bounds=bounds, method="highs-ds"
            )
            moved = height + slope @ found.x[:4]
            worst = [moved.argmax(), moved.argmin()]
            if moved[worst[0]] <= found.x[4] + 1e-7 and moved[worst[1]] >= found.x[5] - 1e-7:
                break
            kept = np.append(kept, worst)
        tried, slopes = _distances(points, place + unit * found.x[:4])
        if width - unit * found.fun < 1e-6 * unit or box < 1e-9:
            return float(width)
        if np.ptp(tried) < width:
            place, width, distance, slope = place + unit * found.x[:4], np.ptp(tried), tried, slopes
        else:
            box /= 4.0


def cylinder_zone_by_cvxpy(points: np.ndarray) -> float:
    """The same with all points and cvxpy; three programs suffice where both ends are held."""
    place = cylinder_by_numpy(points)
    unit = float(np.ptp(_distances(points, place)[0]))
    for _ in range(3):
        distance, slope = _distances(points, place)
        step, top, bottom = cp.Variable(4), cp.Variable(), cp.Variable()
        moved = (distance - distance.mean()) / unit + slope @ step
        rows = [moved <= top, moved >= bottom, cp.abs(step) <= 4.0]
        cp.Problem(cp.Minimize(top - bottom), rows).solve(solver="HIGHS")
        place = place + unit * step.value
    return float(np.ptp(_distances(points, place)[0]))
