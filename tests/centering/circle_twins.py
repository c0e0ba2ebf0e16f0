"""Profiles, and reference circles found by slow and obvious ways."""

from itertools import combinations

import cvxpy as cp
import numpy as np
from scipy.spatial import ConvexHull, Voronoi

SAMPLINGS = ("even", "uneven", "gap", "turns", "repeated")


def directions(rng, n, sampling):
    if sampling == "even":
        return np.arange(n) * 2 * np.pi / n
    if sampling == "uneven":
        return (np.arange(n) + rng.uniform(0, 0.9, n)) * 2 * np.pi / n
    if sampling == "gap":
        return np.linspace(0, rng.uniform(1.1 * np.pi, 1.9 * np.pi), n)
    if sampling == "turns":
        return np.arange(n) * 4 * np.pi / n  # for even n every direction twice
    return np.repeat((np.arange(n // 2) + rng.uniform(0, 0.8, n // 2)) * 4 * np.pi / n, 2)


def on_rays(angle, radius, center=(0.0, 0.0)):
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]) + center


def random_profile(rng, n, sampling, form):
    """Points about (3, -2) mm at 60 mm, off by form (relative, peak to valley) at random."""
    angle = directions(rng, n, sampling)
    return on_rays(angle, 60.0 * (1 + form * rng.uniform(-0.5, 0.5, angle.size)), (3.0, -2.0))


def smooth_profile(rng, n, sampling="even", form=1e-4, noise=0.0):
    """Points about (3, -2) mm at 60 mm with some lobes."""
    angle = directions(rng, n, sampling)
    lobes = sum(rng.normal() / upr * np.cos(upr * angle + rng.uniform(0, 7)) for upr in range(2, 12))
    return on_rays(angle, 60.0 * (1 + form * lobes) + noise * rng.normal(size=angle.size), (3.0, -2.0))


def distances(points, centers):
    centers = np.atleast_2d(centers)
    return np.hypot(centers[:, :1] - points[:, 0], centers[:, 1:] - points[:, 1])


def crossings(points, one, two):
    """Centers as far from both points of a pair of `one` as from each other, and so for the pair of `two`."""
    a, b = points[one[:, 1]] - points[one[:, 0]], points[two[:, 1]] - points[two[:, 0]]
    p = 0.5 * np.sum(a * (points[one[:, 1]] + points[one[:, 0]]), axis=1)
    q = 0.5 * np.sum(b * (points[two[:, 1]] + points[two[:, 0]]), axis=1)
    det = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    good = np.abs(det) > 1e-12 * np.hypot(*a.T) * np.hypot(*b.T)
    a, b, p, q, det = a[good], b[good], p[good], q[good], det[good]
    return np.column_stack([p * b[:, 1] - q * a[:, 1], q * a[:, 0] - p * b[:, 0]]) / det[:, np.newaxis]


def _pairs(n):
    return np.array(list(combinations(range(n), 2)))


def _circumcenters(points):
    triples = np.array(list(combinations(range(len(points)), 3)))
    return crossings(points, triples[:, :2], triples[:, [0, 2]])


def brute_zone(points, center, within):
    """Least width over all crossings of two bisectors no further than `within` from a center."""
    pairs = _pairs(len(points))
    i, j = np.triu_indices(len(pairs), 1)
    centers = crossings(points, pairs[i], pairs[j])
    away = distances(points, centers[np.hypot(*(centers - center).T) <= within])
    return float(np.min(np.ptp(away, axis=1)))


def brute_circumscribed(points):
    """Radius of the smallest circle on two points or through three that holds all."""
    pairs = _pairs(len(points))
    centers = np.concatenate([points[pairs].mean(axis=1), _circumcenters(points)])
    return float(np.min(distances(points, centers).max(axis=1)))


def brute_inscribed(points):
    """Radius of the largest empty circle through three points about a center in the hull, and of that about
    one on its border.
    """
    hull = ConvexHull(points)
    centers = _circumcenters(points)
    centers = centers[(centers @ hull.equations[:, :2].T + hull.equations[:, 2] <= 1e-9).all(axis=1)]
    inside = distances(points, centers).min(axis=1).max() if len(centers) else 0.0
    one, two = points[_pairs(len(points)).T]
    border = [_on_edge(points, *points[edge], one, two) for edge in hull.simplices]
    return float(inside), float(max(border))


def _on_edge(points, begin, end, one, two):
    along, apart = end - begin, two - one
    slope = apart @ along
    place = (0.5 * np.sum(apart * (one + two), axis=1) - apart @ begin) / np.where(
        np.abs(slope) > 1e-12, slope, np.nan
    )
    place = place[(place >= 0) & (place <= 1)]
    return distances(points, begin + place[:, np.newaxis] * along).min(axis=1).max(initial=0.0)


def voronoi_inscribed(points):
    """Radius of the largest empty circle about a vertex of the Voronoi diagram in the hull."""
    hull, vertices = ConvexHull(points), Voronoi(points).vertices
    inside = (vertices @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0).all(axis=1)
    return float(distances(points, vertices[inside]).min(axis=1).max())


def voronoi_zone(points, center, within):
    """Least width where edges of the nearest point Voronoi diagram cross those that any farthest point
    diagram can have.
    """
    ridges, hull = Voronoi(points).ridge_points, ConvexHull(points).vertices
    far = hull[_pairs(len(hull))]
    near, far = np.repeat(ridges, len(far), axis=0), np.tile(far, (len(ridges), 1))
    centers = crossings(points, near, far)
    away = distances(points, centers[np.hypot(*(centers - center).T) <= within])
    return float(np.min(np.ptp(away, axis=1)))


def welzl(points, rng):
    """Radius of the smallest circle that holds all points, by Welzl's way: in random order, those outside are
    made contacts.
    """
    order = points[rng.permutation(len(points))]
    center, radius = order[0], 0.0
    for i, p in enumerate(order):
        if np.hypot(*(p - center)) > radius * (1 + 1e-14):
            center, radius = _through_one(order[:i], p)
    return radius


def _through_one(points, p):
    center, radius = p, 0.0
    for j, q in enumerate(points):
        if np.hypot(*(q - center)) > radius * (1 + 1e-14):
            center, radius = _through_two(points[:j], p, q)
    return center, radius


def _through_two(points, p, q):
    center = 0.5 * (p + q)
    radius = 0.5 * np.hypot(*(p - q))
    for s in points:
        if np.hypot(*(s - center)) > radius * (1 + 1e-14):
            three = np.array([p, q, s])
            center = crossings(three, np.array([[0, 1]]), np.array([[0, 2]]))[0]
            radius = np.hypot(*(p - center))
    return center, radius


def linear_zone(points):
    """Width by linear programs about the last center, until that stands still."""
    center = points.mean(axis=0)
    for _ in range(12):
        away = points - center
        radius = np.hypot(*away.T)
        scale = np.ptp(radius)
        move, outer, inner = cp.Variable(2), cp.Variable(), cp.Variable()
        seen = (radius - radius.mean()) / scale - (away / radius[:, np.newaxis]) @ move
        cp.Problem(cp.Minimize(outer - inner), [seen <= outer, seen >= inner]).solve(solver=cp.HIGHS)
        center = center + scale * move.value
        if np.hypot(*move.value) * scale < 1e-12:
            break
    return float(np.ptp(distances(points, center)))


def cone_circle(points):
    """Radius of the smallest circle that holds all points: a second order cone program, scaled to radius 1
    about the origin.
    """
    middle = points.mean(axis=0)
    scale = distances(points, middle).max()
    unit = (points - middle) / scale
    center, radius = cp.Variable(2), cp.Variable()
    away = cp.norm(unit - cp.reshape(center, (1, 2), order="C"), axis=1)
    cp.Problem(cp.Minimize(radius), [away <= radius]).solve(solver=cp.CLARABEL)
    return float(radius.value * scale)
