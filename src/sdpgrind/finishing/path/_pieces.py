"""Paths in several pieces on a patch: from nodes that are inside its trimming."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.path._trimmed import TrimmedSquare
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

STEP = 0.02  # mm, chosen: places on a leg that must be inside; a narrower slot may be missed
MOST = 10_000_000  # chosen: such places in all


def patch_of(surface: Surface | Patch) -> Patch:
    """Return a patch, of a surface without trimming."""
    if isinstance(surface, Patch):
        return surface
    return Patch(checks.kind("surface", surface, Surface, " or a Patch"))


def lifted(
    patch: Patch, pieces: list[Floats], mapping: str, pattern: str, lift: Lift | None
) -> Path | LiftedPath:
    """Return the path through the nodes of pieces in the unit square; without lifts where none is needed."""
    if not pieces:
        raise ValueError(
            "surface must be wide enough for a path: its trimming leaves no part longer than the margin and a"
            " pitch; take a smaller pitch (mm) or margin (mm)"
        )
    nodes, starts = pieces_joined(pieces)
    path = Path(patch.surface, nodes, mapping=mapping, pattern=pattern)
    if not patch.trim and len(pieces) == 1 and lift is None:
        return path
    how = Lift() if lift is None else checks.kind("lift", lift, Lift)
    return LiftedPath(patch, path, starts=starts, lift=how)


def pieces_joined(pieces: Sequence[Floats]) -> tuple[Floats, tuple[int, ...]]:
    """Return the nodes of all pieces in sequence, and the index of each first one."""
    sizes = np.array([len(each) for each in pieces])
    return np.concatenate(list(pieces)), tuple(int(k) for k in np.cumsum(sizes) - sizes)


def trimmed_curve(patch: Patch, mapping: str, nodes: Floats, margin: float) -> list[Floats]:
    """Return the pieces (n, 2) of a curve in the unit square with nodes and legs a margin (mm) inside."""
    region = TrimmedSquare(patch, Square(patch.surface, mapping, "u"), margin)
    if not patch.trim and not margin:
        return [nodes]
    longest = float(np.hypot(*np.diff(nodes, axis=0).T).max()) * patch.surface.size
    per_leg = int(np.clip(np.ceil(longest / STEP), 4, max(4, MOST // len(nodes))))
    inside = region.inside(nodes)
    joined = inside[1:] & inside[:-1]
    share = np.linspace(0.0, 1.0, per_leg + 1)[1:-1, None]
    places = nodes[:-1, None] + share * (nodes[1:] - nodes[:-1])[:, None]
    joined[joined] = region.inside(places[joined].reshape(-1, 2)).reshape(-1, per_leg - 1).all(axis=1)
    runs = np.split(nodes, np.flatnonzero(~joined) + 1)
    return [run for run in runs if len(run) > 1]
