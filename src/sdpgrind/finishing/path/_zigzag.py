"""Zigzag paths: passes along u or v with at most a pitch between them on the surface."""

from typing import overload

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._geodesic_passes import geodesic_nodes
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._passes import PathPass, joined
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._pieces import lifted, patch_of
from sdpgrind.finishing.path._shock_passes import on_the_work
from sdpgrind.finishing.path._spacing import Gaps, equal_spacing, even_spacing
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.path._trimmed import LONGEST, TrimmedSquare, trimmed_passes
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

MAPPINGS = ("equal_spacing", "parametric", "equal_area", "geodesic")
DENSEST = 1e4  # chosen: ratio of widest to mean gap, of lines evenly apart in the square, that means a pole
NODES_MAX = 4**12  # chosen: the nodes of a Hilbert curve of the greatest order


@overload
def zigzag(
    surface: Surface, pitch: float, *, mapping: str = ..., along: str = ..., radius: float = ...
) -> Path: ...
@overload
def zigzag(
    surface: Surface | Patch,
    pitch: float,
    *,
    mapping: str = ...,
    along: str = ...,
    radius: float = ...,
    lift: Lift | None = ...,
    margin: float | None = ...,
) -> Path | LiftedPath: ...
def zigzag(
    surface: Surface | Patch,
    pitch: float,
    *,
    mapping: str = "equal_spacing",
    along: str = "u",
    radius: float = 0.0,
    lift: Lift | None = None,
    margin: float | None = None,
) -> Path | LiftedPath:
    """Lay passes over a surface that turn back at its edges.

    The gap of the passes v = v1 and v = v2 at a place u is their perpendicular distance,
    int sqrt(EG - F^2)/sqrt(E) dv at that u; no gap on the whole line exceeds the pitch. Passes stay half a
    pitch away from all four edges. Nodes along the passes are at most a pitch apart.

    On a trimmed patch passes are cut at the trimming. A pass goes on to the next one where a straight move
    between their ends keeps the margin, too, if need be with ends drawn back by up to half a pitch; else the
    tool is lifted over to the next piece. Where a trimming within 45 degrees of the passes cuts one off, the
    pass follows the trimming, a 20th of a pitch farther inside than the margin, until the next pass is half a
    pitch from it. Slots below 0.02 mm may be crossed. No pass is laid across a bridge that is
    narrower than some one and a half pitches: lay passes along it.

    Parameters
    ----------
    surface : Surface or Patch
        Surface to cover, or its trimmed part.
    pitch : float
        Greatest gap between neighbouring passes on the surface, mm.
    mapping : {"equal_spacing", "parametric", "equal_area", "geodesic"}
        Spacing of the passes. ``"equal_spacing"``: the fewest lines of the surface, with the widest gaps of
        all pairs equal. ``"parametric"``: lines evenly apart in the parameter. ``"equal_area"``: strips of
        the same area. ``"geodesic"``: curves of constant distance from the border v = 0, with a constant gap;
        where they meet the other border passes end, and a last pass follows that border. Turns of more than
        0.3 rad in a node are sharp corners. Where fronts from two parts of the border meet, along a shock,
        passes have kinks. Where gaps would exceed 1.03 pitches by that, or as nodes a pitch apart cut bends
        off, nodes are closer together, and pieces of their own go along the shocks: on the work, beginning at
        the end of the last pass, or with `lift` by lifts.
    along : {"u", "v"}
        Direction of the passes. "v": u and v change places in this text.
    radius : float
        Radius of the arcs between passes and straight connectors, mm; 0: sharp corners. Arcs are round in the
        tangent plane at the corner, joined with continuous curvature. Geodesic passes that end on the other
        border keep sharp corners.
    lift : Lift, optional
        How the tool comes, is lifted and leaves. Default: `Lift` where pieces are cut, else none. Where it is
        given, a move on the work from a pass to the next one is at most three pitches long, else the tool is
        lifted: a longer one, as beside a step of the edge, leads along a pass for more than sqrt(3^2 - 1) =
        2.8 pitches, whose strip is polished twice. Steps at edges of 45 degrees take sqrt(2) pitches.
    margin : float, optional
        Least distance of the path from the trimming and from the border of the surface, mm, within 1 um and
        the tolerance of the trimming itself. Default: on a trimmed patch a quarter of a pitch, and passes end
        another quarter before; at an edge across them that makes half a pitch, their footprint.

    Returns
    -------
    Path or LiftedPath
        Path of pattern ``"zigzag"``; with lifts where asked for, on a trimmed patch, or where a margin cuts
        it.

    Raises
    ------
    ValueError
        When the pitch is not less than the sides of the surface, the radius does not fit between passes,
        geodesic passes would turn back or cross a crease, a pole crowds lines of equal areas, or a value is
        out of range.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> path = fin.zigzag(fin.surface.flat_surface(50.0), pitch=6.25)
    >>> len(path.nodes), round(path.length, 6)  # 8 by 8 nodes; mm: 8 passes of 43.75 and 7 steps of 6.25
    (64, 393.75)
    """
    patch = patch_of(surface)
    surface = patch.surface
    pitch = checks.positive("pitch", pitch, "mm")
    checks.one_of("mapping", mapping, MAPPINGS)
    checks.one_of("along", along, ("u", "v"))
    radius = checks.nonnegative("radius", radius, "mm")
    square = Square(surface, "equal_area" if mapping == "equal_area" else "parametric", along)
    across, lengthwise = square.gaps(), square.gaps(across=False)
    _refuse_pitch(pitch, mapping, across, lengthwise)
    place = even_spacing if mapping in ("parametric", "equal_area") else equal_spacing
    lines, columns = place(across, pitch), place(lengthwise, pitch)
    if patch.trim or margin is not None:
        _refuse_trimmed(mapping, radius, "on a trimmed patch" if patch.trim else "with a margin")
        away, pull = (pitch / 4,) * 2 if margin is None else (checks.nonnegative("margin", margin, "mm"), 0.0)
        longest = np.inf if lift is None else LONGEST * pitch
        found = trimmed_passes(TrimmedSquare(patch, square, away, pull), lines, columns, pitch, longest)
        return lifted(patch, [square.nodes(*each.T) for each in found], square.mapping, "zigzag", lift)
    if mapping == "geodesic":
        return _geodesic(patch, square, pitch, columns, float(lines[-1]), radius, lift)
    places, corners = joined(square, [PathPass.straight(columns, line) for line in lines], radius)
    nodes, given = square.nodes(*places.T), corners if radius else None
    path = Path(
        surface, nodes, mapping=square.mapping, pattern="zigzag", corners=given, smooth=given is not None
    )
    return path if lift is None else LiftedPath(patch, path, lift=checks.kind("lift", lift, Lift))


def _geodesic(
    patch: Patch,
    square: Square,
    pitch: float,
    columns: Floats,
    top: float,
    radius: float,
    lift: Lift | None,
) -> Path | LiftedPath:
    """Passes of equal distance, then those along shocks: on the work, or by lifts where these are given."""
    places, corners, shocks = geodesic_nodes(square, pitch, columns, top, radius)
    starts = tuple(np.cumsum([0, len(places), *(len(each) for each in shocks[:-1])]).tolist())
    if lift is None:
        places, corners = on_the_work(square, places, corners, shocks, pitch)
    else:
        places = np.concatenate([places, *shocks])
        corners = np.concatenate([corners, np.zeros(len(places) - len(corners), bool)])
    nodes = square.nodes(*places.T)
    path = Path(square.surface, nodes, mapping=square.mapping, pattern="zigzag", corners=corners, smooth=True)
    if lift is None:
        return path
    lift = checks.kind("lift", lift, Lift)
    return LiftedPath(patch, path, starts=starts if shocks else (0,), lift=lift)


def _refuse_trimmed(mapping: str, radius: float, where: str) -> None:
    """Raise for what passes that are cut cannot be."""
    if mapping == "geodesic":
        raise checks.refuse("mapping", f"one of {', '.join(MAPPINGS[:-1])} {where}", mapping)
    if radius:
        raise checks.refuse("radius", f"0 {where}; blended() rounds its corners", radius, "mm")


def _refuse_pitch(pitch: float, mapping: str, across: Gaps, lengthwise: Gaps) -> None:
    widths = across.width, lengthwise.width
    if not np.isfinite(widths).all() or (
        mapping == "equal_area" and max(across.densest, lengthwise.densest) > DENSEST
    ):
        raise checks.refuse(
            "mapping", "another one for a zigzag on a surface with a pole, where lines would crowd", mapping
        )
    if pitch >= min(widths):
        raise checks.refuse("pitch", f"< {min(widths):.4g}, the lesser side of the surface", pitch, "mm")
    if np.prod(widths) / pitch**2 > NODES_MAX:
        least = float(np.sqrt(np.prod(widths) / NODES_MAX))
        raise checks.refuse(
            "pitch", f">= {least:.2g}: else a path has more than {NODES_MAX} nodes", pitch, "mm"
        )
