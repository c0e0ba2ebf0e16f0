"""Placements of finishing: ``python benchmarks/finishing_place.py [NAME ...]``. Library surfaces in two sizes on three
robots: placed and planned along the whole path, proved impossible, or not found; CPU seconds each.
"""

import argparse
import time
from collections.abc import Iterator

from sdpgrind import finishing
from sdpgrind.finishing import FinishingProblem, Surface
from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

BAR = 60.0  # s CPU a search, one thread
SHARE = 0.9  # of all searches: placed or proved
SCALES = (1.0, 4.0)  # sizes: some 50 mm and some 200 mm
PASSES = 10.0  # passes over a side of 50 mm


def scaled(surface: Surface, factor: float) -> Surface:
    """The same surface, larger."""
    net = factor * surface.control_points
    if surface.weights is None:
        return Surface.bspline(net, surface.degree, surface.knots)
    return Surface.nurbs(net, surface.weights, surface.degree, surface.knots, outward=surface.outward)


def surfaces() -> dict[str, Surface]:
    """Surfaces of the library."""
    return {
        "flat": flat_surface(50.0),
        "nominal": nominal_surface(),
        "cylinder": cylinder_surface(40.0, 60.0),
        "cylinder, inside": cylinder_surface(40.0, 60.0, inside=True),
        "sphere": sphere_surface(25.0),
        "sphere, inside": sphere_surface(25.0, inside=True),
        **uneven_surfaces(),
    }


def robots() -> dict[str, finishing.Robot]:
    """Robots of the library, with a tool of 150 mm where there is a flange."""
    return {
        "generic": finishing.robot("generic"),
        "ur10": finishing.robot("ur10").replace(tool=finishing.tool(length=150.0)),
        "irb2400": finishing.robot("irb2400").replace(tool=finishing.tool(length=150.0, axis="x")),
    }


def cases(names: list[str]) -> Iterator[tuple[str, Surface, float]]:
    """Name, surface and pitch (mm); the wide flat of the spec first."""
    if not names or "wide" in names:
        yield "wide flat, 500 mm", flat_surface(500.0), 50.0
    for scale in SCALES:
        for name, surface in surfaces().items():
            if not names or name in names:
                pitch = scale * (4.0 if name.startswith("sphere") else 50.0 / PASSES)
                yield f"{name}, x {scale:g}", scaled(surface, scale), pitch


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="surfaces; default: all")
    given, done, worst, good = parser.parse_args(), 0, 0.0, 0
    print("| surface | robot | outcome | worth | CPU s |\n|---|---|---|---|---|")
    for name, surface, pitch in cases(given.names):
        path = finishing.zigzag(surface, pitch=pitch)
        for kind, robot in robots().items():
            begin = time.process_time()
            found = finishing.place(FinishingProblem(path, robot=robot), progress=lambda share, text: None)
            took = time.process_time() - begin
            outcome = "placed" if found.found else found.proof or f"not found: {found.why}"
            print(f"| {name} | {kind} | {outcome} | {found.worth:.3f} | {took:.1f} |", flush=True)
            done, worst, good = done + 1, max(worst, took), good + (found.found or found.proof is not None)
    held = "yes" if good >= SHARE * done and worst <= BAR else "NO"
    print(
        f"\n{good} of {done} placed or proved, at most {worst:.1f} s CPU: {held}. Collisions are not looked at."
    )


if __name__ == "__main__":
    main()
