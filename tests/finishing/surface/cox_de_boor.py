"""B-splines as they are written down, slowly: the twin of the kernels. And surfaces by chance."""

import numpy as np

from sdpgrind.finishing import Surface

ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def ratio(a, b):
    return a / b if b else 0.0  # 0/0 := 0


def basis(knots, i, degree, x, order=0):
    """N_{i, degree}(x), or a derivative of it, by the recursion of Cox and de Boor."""
    if order:
        return degree * (
            ratio(basis(knots, i, degree - 1, x, order - 1), knots[i + degree] - knots[i])
            - ratio(basis(knots, i + 1, degree - 1, x, order - 1), knots[i + degree + 1] - knots[i + 1])
        )
    if degree == 0:
        return float(i == span(knots, x))
    return ratio((x - knots[i]) * basis(knots, i, degree - 1, x), knots[i + degree] - knots[i]) + ratio(
        (knots[i + degree + 1] - x) * basis(knots, i + 1, degree - 1, x), knots[i + degree + 1] - knots[i + 1]
    )


class Knots(list):
    """Knots with the end of their domain, whose last span that is not empty takes it."""

    end: float


def span(knots, x):
    spans = [k for k in range(len(knots) - 1) if knots[k] < knots[k + 1]]
    if x >= knots.end:
        return max(k for k in spans if knots[k + 1] <= knots.end)
    return next(k for k in spans if knots[k] <= x < knots[k + 1])


def row(knots, degree, x, order):
    if order > degree:
        return np.zeros(len(knots) - degree - 1)
    listed = Knots(knots)
    listed.end = knots[-degree - 1]
    return np.array([basis(listed, i, degree, x, order) for i in range(len(knots) - degree - 1)])


def derivatives(surface, u, v):
    """Six vectors at one place; rational ones by Leibniz, solved for the highest."""
    weights = np.ones(surface.control_points.shape[:2]) if surface.weights is None else surface.weights
    net = np.concatenate([surface.control_points * weights[..., None], weights[..., None]], axis=-1)
    rows = [
        [row(knots, p, x, k) for k in range(3)]
        for knots, p, x in zip(surface.knots, surface.degree, (u, v), strict=True)
    ]
    A = {(a, b): np.einsum("i,j,ijc->c", rows[0][a], rows[1][b], net) for a, b in ORDERS}
    w = {k: A[k][3] for k in A}
    S = {}
    for a, b in ORDERS:
        known = np.zeros(3)
        for i in range(a + 1):
            for j in range(b + 1):
                if i or j:
                    known += binomial(a, i) * binomial(b, j) * w[i, j] * S[a - i, b - j]
        S[a, b] = (A[a, b][:3] - known) / w[0, 0]
    return np.array([S[k] for k in ORDERS])


def binomial(n, k):
    return (1, n, 1)[k] if n == 2 else 1


def some_knots(rng, n, degree):
    """Knots by chance: clamped or not, some of them double or more."""
    inner = np.sort(np.round(rng.uniform(0, 1, n - degree - 1), 1))
    clamped = rng.random() < 0.5
    ends = np.zeros(degree) if clamped else np.sort(rng.uniform(-1, -0.05, degree))
    behind = np.zeros(degree) if clamped else np.sort(rng.uniform(0.05, 1, degree))
    knots = np.concatenate([ends, [0.0], np.clip(inner, 0.1, 0.9), [1.0], 1.0 + behind])
    return (
        knots if np.unique(knots, return_counts=True)[1].max() <= degree + 1 else some_knots(rng, n, degree)
    )


def some_surface(seed, degree=None, rational=None):
    """A surface by chance: a net of about 10 mm a step, bent and twisted, of any degree up to 4."""
    rng = np.random.default_rng(seed)
    p, q = degree or rng.integers(1, 5, 2)
    nu, nv = p + 1 + rng.integers(0, 4), q + 1 + rng.integers(0, 4)
    x, y = np.meshgrid(10.0 * np.arange(nu), 10.0 * np.arange(nv), indexing="ij")
    net = np.stack([x, y, 0.0 * x], axis=-1) + rng.uniform(-3, 3, (nu, nv, 3))
    knots = some_knots(rng, nu, p), some_knots(rng, nv, q)
    rational = rng.random() < 0.5 if rational is None else rational
    weights = rng.uniform(0.3, 3.0, (nu, nv)) if rational else None
    return Surface(net, (int(p), int(q)), knots, weights, int(rng.choice([-1, 1])))


def places(surface, seed, n):
    """Parameters within the domain, its corners among them."""
    rng = np.random.default_rng(seed)
    (u0, u1), (v0, v1) = surface.domain
    corners = np.array([[u0, v0], [u1, v0], [u0, v1], [u1, v1]])
    return np.concatenate([corners, rng.uniform((u0, v0), (u1, v1), (n, 2))]).T
