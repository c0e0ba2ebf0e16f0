"""A Hilbert path over a surface: ``python benchmarks/finishing_path.py [--times N] [--order n]``. Medians of
interleaved runs.

Ours is the whole path: nodes, points, all derivatives to order two, directions and frames. Peers do their
part of it alone.
"""

import argparse
from collections.abc import Callable
from time import process_time

import geomdl.BSpline
import numpy as np
from hilbertcurve.hilbertcurve import HilbertCurve
from measure import clock, median
from scipy.interpolate import BSpline, NdBSpline
from scipy.spatial import cKDTree

from sdpgrind.finishing import Path, Surface, hilbert, zigzag
from sdpgrind.finishing.path import _geodesic as geodesic
from sdpgrind.finishing.path import _geodesic_passes as geodesic_passes
from sdpgrind.finishing.path import hilbert_lsystem, hilbert_nodes
from sdpgrind.finishing.path._equal_area import equal_area
from sdpgrind.finishing.surface import nominal_surface, uneven_surfaces

SLOW = 1
"""Runs of peers that take seconds."""
ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
MAX_MS, MIN_TIMES, MAX_ERROR = 20.0, 150.0, 1e-10


def whole(surface: Surface, order: int, mapping: str) -> Path:
    """Nodes, surface with derivatives, frames."""
    path = hilbert(surface, order, mapping=mapping)
    path.derivatives()
    path.frames()
    return path


def by_ndbspline(surface: Surface, uv: np.ndarray) -> list[np.ndarray]:
    spline = NdBSpline(surface.knots, surface.control_points, surface.degree)
    return [spline(uv, nu=order) for order in ORDERS]


def by_grid(surface: Surface, u: np.ndarray, v: np.ndarray) -> list[np.ndarray]:
    """Points and derivatives on a grid by scipy: a basis for each side, and their products."""
    net = np.moveaxis(surface.control_points, -1, 0)
    across, along = (
        [BSpline(surface.knots[k], np.eye(net.shape[k + 1]), surface.degree[k])(x, nu=nu) for nu in range(3)]
        for k, x in enumerate((u, v))
    )
    return [np.moveaxis(across[m] @ net @ along[n].T, 0, -1) for m, n in ORDERS]


def by_nodes(surface: Surface, order: int) -> list[np.ndarray]:
    """Points and derivatives at the nodes of a parametric path, which lie on a grid."""
    side, (i, j) = (np.arange(2**order) + 0.5) / 2**order, hilbert_nodes(order).T
    return [each[i, j] for each in by_grid(surface, side, side)]


def by_geomdl(surface: Surface, order: int) -> np.ndarray:
    """Nodes of hilbertcurve, and the surface at each with derivatives to order two, point by point."""
    curve = HilbertCurve(order, 2)
    nodes = np.array(curve.points_from_distances(list(range(4**order))))
    twin = geomdl.BSpline.Surface()
    twin.degree_u, twin.degree_v = surface.degree
    nu, nv = surface.control_points.shape[:2]
    twin.set_ctrlpts(surface.control_points.reshape(-1, 3).tolist(), nu, nv)
    twin.knotvector_u, twin.knotvector_v = (knots.tolist() for knots in surface.knots)
    places = ((nodes + 0.5) / 2**order).tolist()
    return np.array([twin.derivatives(u, v, order=2) for u, v in places])


def once(run: Callable[[], object]) -> float:
    begin = clock()
    run()
    return clock() - begin


def interleaved(runs: dict[str, Callable[[], object]], times: int) -> dict[str, float]:
    """Median of each, ms, taken in turns after one warm-up, so that all see the same load."""
    for run in runs.values():
        run()
    found: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(times):
        for name, run in runs.items():
            found[name].append(once(run))
    return {name: 1e3 * float(np.median(each)) for name, each in found.items()}


def tell(rows: dict[str, float], unit: float) -> None:
    print("| what | median [ms] | times ours |\n|---|---|---|")
    for name, took in rows.items():
        print(f"| {name} | {took:.2f} | {took / unit:.2f} |")


def paths(order: int, times: int) -> None:
    surface = nominal_surface()
    print(f"\n## Order {order}, {4**order} nodes, nominal surface")
    path = whole(surface, order, "parametric")
    fast = interleaved(
        {
            "whole path, parametric, with frames": lambda: whole(surface, order, "parametric"),
            "whole path, equal areas, map at hand": lambda: whole(surface, order, "equal_area"),
            "NdBSpline, points and derivatives alone": lambda: by_ndbspline(surface, path.uv),
            "BSpline products on the nodes' grid, the same alone": lambda: by_nodes(surface, order),
        },
        times,
    )
    slow = interleaved(
        {"geomdl with hilbertcurve, points and derivatives alone": lambda: by_geomdl(surface, order)}, SLOW
    )
    ours = fast["whole path, parametric, with frames"]
    tell({**fast, **slow}, ours)
    error = max(
        np.abs(a - b).max() for a, b in zip(path.derivatives(), by_ndbspline(surface, path.uv), strict=True)
    )
    place = np.abs(path.points - by_ndbspline(surface, path.uv)[0]).max()
    ratio = next(iter(slow.values())) / ours
    print("\n| bar | here | to be | holds |\n|---|---|---|---|")
    print(f"| whole path | {ours:.2f} ms | <= {MAX_MS:g} ms | {ours <= MAX_MS} |")
    print(
        f"| over geomdl with hilbertcurve | {ratio:.0f} times | >= {MIN_TIMES:g} times | {ratio >= MIN_TIMES} |"
    )
    print(f"| points from NdBSpline | {place:.1e} mm | <= {MAX_ERROR:g} mm | {place <= MAX_ERROR} |")
    grid = max(np.abs(a - b).max() for a, b in zip(path.derivatives(), by_nodes(surface, order), strict=True))
    print(f"| points and derivatives from BSpline products | {grid:.1e} | | |")
    print(f"| derivatives from NdBSpline, mm a unit of the parameter (squared) | {error:.1e} | | |")


def alike(order: int, times: int) -> None:
    surface, side = nominal_surface(), (np.arange(2**order) + 0.5) / 2**order
    uv = hilbert(surface, order, mapping="parametric").uv
    u, v = (np.ascontiguousarray(x) for x in uv.T)
    spline, few = NdBSpline(surface.knots, surface.control_points, surface.degree), uv[:: uv.shape[0] // 256]
    each = few.tolist()
    print(
        f"\n## The surface alone, like with like: {len(uv)} places at once or on a grid, {len(each)} singly"
    )
    pairs: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
        "points, NdBSpline": (lambda: surface.point(u, v), lambda: spline(uv)),
        "points and derivatives, NdBSpline": (
            lambda: surface.derivatives(u, v),
            lambda: [spline(uv, nu=o) for o in ORDERS],
        ),
        "the same on a grid, products of BSpline": (
            lambda: surface.grid(side, side),
            lambda: by_grid(surface, side, side),
        ),
        "a point a call, NdBSpline": (
            lambda: [surface.point(*at) for at in each],
            lambda: [spline(at) for at in few],
        ),
        "a point with derivatives a call, NdBSpline": (
            lambda: [surface.derivatives(*at) for at in each],
            lambda: [[spline(at, nu=o) for o in ORDERS] for at in few],
        ),
    }
    print("| what, and by what of scipy | ours [ms] | scipy [ms] | times ours |\n|---|---|---|---|")
    for name, (ours, theirs) in pairs.items():
        took = interleaved({"ours": ours, "theirs": theirs}, 3 * times)
        print(f"| {name} | {took['ours']:.2f} | {took['theirs']:.2f} | {took['theirs'] / took['ours']:.2f} |")
    there, net = surface.derivatives(u, v), surface.grid(side, side)
    error = max(np.abs(a - spline(uv, nu=o)).max() for a, o in zip(there, ORDERS, strict=True))
    on_grid = max(np.abs(a - b).max() for a, b in zip(net, by_grid(surface, side, side), strict=True))
    print(f"largest difference, mm a unit of the parameter (squared): {error:.1e}, on the grid {on_grid:.1e}")


def parts(order: int, times: int) -> None:
    surface = nominal_surface()
    print(f"\n## Parts, order {order}")

    def fresh_length(mapping: str) -> float:
        return hilbert(surface, order, mapping=mapping).length

    rounded = hilbert(surface, order, mapping="parametric")
    runs = {
        "nodes by index": lambda: hilbert_nodes(order),
        "nodes by strings": lambda: hilbert_lsystem(order),
        "length, parametric": lambda: fresh_length("parametric"),
        "length, equal areas": lambda: fresh_length("equal_area"),
        "corners rounded, with frames": lambda: rounded.blended(0.01).frames(),
        "samples, 8 a leg": rounded.sample,
    }
    for name, run in runs.items():
        print(f"{name}: {1e3 * median(run, times):.2f} ms")


def maps(times: int) -> None:
    print(
        "\n## Maps of equal areas\n| surface | densities' ratio | map made [ms] | error of the density |\n|---|---|---|---|"
    )
    at = np.linspace(0.0, 1.0, 101)
    for name, surface in {"nominal": nominal_surface(), **uneven_surfaces()}.items():
        density = surface.area_density(at[:, None], at)
        took = median(lambda surface=surface: equal_area.__wrapped__(surface), times)
        print(
            f"| {name} | {density.max() / density.min():.1f} | {1e3 * took:.1f} | {equal_area(surface).error:.1e} |"
        )


def bumps(seed: int) -> Surface:
    """A random surface of 50 by 50 mm, 9 mm up and down."""
    x, y = np.meshgrid(*2 * [np.linspace(0.0, 50.0, 9)], indexing="ij")
    return Surface.bspline(
        np.stack([x, y, 9.0 * np.random.default_rng(seed).uniform(-1, 1, (9, 9))], axis=-1)
    )


def widest(path: Path, pitch: float, count: int = 401) -> float:
    """Widest gap in pitches, a pitch and more away from the border, at places of a grid."""
    side = np.linspace(0.0, 1.0, count)
    point = path.surface.grid(side, side).point
    border = cKDTree(np.concatenate([point[0], point[-1], point[:, 0], point[:, -1]]))
    inner = point.reshape(-1, 3)[border.query(point.reshape(-1, 3))[0] > 1.01 * pitch]
    return float(2 * cKDTree(path.sample(pitch / 50).point).query(inner)[0].max() / pitch)


def by_level_sets(surface: Surface, pitch: float) -> Path:
    """The path without passes along shocks and nodes in kinks."""
    kept, geodesic_passes._missed = geodesic_passes._missed, lambda *_: False
    try:
        return zigzag(surface, pitch, mapping="geodesic")
    finally:
        geodesic_passes._missed = kept


def gaps() -> None:
    print(
        "\n## Gaps of geodesic passes, pitches\n| surface | pitch [mm] | level sets alone | with shocks |"
        " CPU [s] |\n|---|---|---|---|---|"
    )
    bend = [[[x, low + 45 * c, 0.0] for c in (0.0, 1.0)] for x, low in ((-25, 25), (0, -25), (25, 25))]
    for name, surface, pitch in (
        ("parabola", Surface.bspline(bend, degree=(2, 1)), 2.0),
        ("steep", uneven_surfaces()["steep"], 1.0),
        ("random", bumps(0), 2.0),
    ):
        geodesic.distance_field.cache_clear()
        begin = process_time()
        path = zigzag(surface, pitch, mapping="geodesic")
        took = process_time() - begin
        alone = by_level_sets(surface, pitch)
        print(f"| {name} | {pitch:g} | {widest(alone, pitch):.3f} | {widest(path, pitch):.3f} | {took:.1f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=15, help="runs of which the median is told")
    parser.add_argument("--order", type=int, default=7, help="of the curve")
    given = parser.parse_args()
    paths(given.order, given.times)
    alike(given.order, given.times)
    parts(given.order, given.times)
    maps(max(given.times // 5, 1))
    gaps()


if __name__ == "__main__":
    main()
