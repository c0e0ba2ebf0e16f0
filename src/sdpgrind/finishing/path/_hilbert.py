"""Hilbert curves: by the index of a node, by the strings of an L-system, and over a surface."""

from typing import overload

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.finishing.path._hilbert_kernels import nodes_by_index
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._mappings import MAPPINGS
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._pieces import lifted, patch_of, trimmed_curve
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

Nodes = npt.NDArray[np.int32]
ORDER_MAX = 12  # chosen: 17 million nodes
LONGEST = 8  # chosen: order of a string of 10^5 symbols
_RULES = str.maketrans({"L": "+RF-LFL-FR+", "R": "-LF+RFR+FL-"})  # source: Wang and Jan (2001), section 3
_PRINTED = str.maketrans({"L": "+F-F-F+", "R": "-F+F-F-"})
_DRAWN = str.maketrans({"L": "", "R": ""})


@overload
def hilbert(surface: Surface, order: int, *, mapping: str = ..., edge: bool = ...) -> Path: ...
@overload
def hilbert(
    surface: Surface | Patch,
    order: int,
    *,
    mapping: str = ...,
    edge: bool = ...,
    lift: Lift | None = ...,
    margin: float = ...,
) -> Path | LiftedPath: ...
def hilbert(
    surface: Surface | Patch,
    order: int,
    *,
    mapping: str = "equal_area",
    edge: bool = False,
    lift: Lift | None = None,
    margin: float = 0.0,
) -> Path | LiftedPath:
    """Lay a Hilbert curve over a surface.

    Parameters
    ----------
    surface : Surface or Patch
        Surface to cover, or its trimmed part: nodes outside are dropped, and the tool is lifted between the
        pieces that remain. Mappings are those of the whole surface.
    order : int
        n, from 1 to 12: 2^n by 2^n nodes. The source's order, 0 for 4 nodes, is one less.
    mapping : {"equal_area", "parametric"}
        Unit square on the surface: cells of equal area, or by the parameters (the source).
    edge : bool
        Whether the outer nodes lie on the edge of the surface; False: each node in the middle of its cell.
    lift : Lift, optional
        How the tool comes, is lifted and leaves. Default: `Lift` where pieces are cut, else none.
    margin : float
        Least distance of the path from the trimming and from the border of the surface, mm, within 1 um.

    Returns
    -------
    Path or LiftedPath
        Path of pattern ``"hilbert<n>"``; with lifts where asked for, on a trimmed patch, or where a margin
        cuts it.

    Raises
    ------
    ValueError
        When the order or the margin is out of range, or the margin leaves nothing.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> path = finishing.hilbert(finishing.surface.flat_surface(8.0), 3, mapping="parametric")
    >>> path.points[:3]  # mm
    array([[0.5, 0.5, 0. ],
           [0.5, 1.5, 0. ],
           [1.5, 1.5, 0. ]])
    >>> round(path.length, 9)  # mm: (2^3 - 2^-3) 8
    63.0
    """
    places = hilbert_nodes(order)
    cells = 2**order
    nodes = places / (cells - 1.0) if edge else (places + 0.5) / cells
    patch, pattern = patch_of(surface), f"hilbert{order}"
    away = checks.nonnegative("margin", margin, "mm")
    if not patch.trim and lift is None and not away:
        return Path(patch.surface, nodes, mapping=mapping, pattern=pattern)
    checks.one_of("mapping", mapping, MAPPINGS)
    return lifted(patch, trimmed_curve(patch, mapping, nodes, away), mapping, pattern, lift)


def hilbert_nodes(order: int) -> Nodes:
    """Return the nodes (4^n, 2) of a Hilbert curve by index, whole number pairs from (0, 0) to (2^n - 1, 0).

    Parameters
    ----------
    order : int
        n, from 1 to 12.

    Raises
    ------
    ValueError
        When the order is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> finishing.path.hilbert_nodes(1).tolist()
    [[0, 0], [0, 1], [1, 1], [1, 0]]
    """
    nodes = np.empty((4 ** _order(order, ORDER_MAX), 2), dtype=np.int32)
    nodes_by_index(order, nodes)
    return nodes


def hilbert_lsystem(order: int, *, printed: bool = False) -> Nodes:
    """Return the nodes (4^n, 2) of a Hilbert curve, steps of one unit, by an L-system (Wang, section 3).

    L becomes +RF-LFL-FR+, R becomes -LF+RFR+FL-; F is a step, - a quarter turn counter-clockwise, +
    clockwise; L and R draw nothing. The first string is L, below the x axis; it is mirrored here.

    Parameters
    ----------
    order : int
        n, from 1 to 8.
    printed : bool
        Whether L and R draw +F-F-F+ and -F+F-F- after n - 1 substitutions, as printed in the source. The R is
        misprinted (correct: -F+F+F-), and the curve crosses itself.

    Raises
    ------
    ValueError
        When the order is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> finishing.path.hilbert_lsystem(1).tolist() == finishing.path.hilbert_nodes(1).tolist()
    True
    >>> nodes = finishing.path.hilbert_lsystem(2, printed=True).tolist()
    >>> len(nodes), len(set(map(tuple, nodes)))
    (16, 14)
    """
    text = "L"
    for _ in range(_order(order, LONGEST) - printed):
        text = text.translate(_RULES)
    return _drawn(text.translate(_PRINTED if printed else _DRAWN))


def _drawn(text: str) -> Nodes:
    """Nodes along the steps of a string, with y mirrored."""
    symbols = np.frombuffer(text.encode(), dtype=np.uint8)
    # + is clockwise, and counter-clockwise when mirrored
    turns = np.cumsum((symbols == ord("+")).astype(int) - (symbols == ord("-")))
    heading = turns[symbols == ord("F")] % 4
    steps = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])[heading]
    return np.concatenate([np.zeros((1, 2), np.int32), np.cumsum(steps, axis=0, dtype=np.int32)])


def _order(order: int, largest: int) -> int:
    """Check the order of a curve."""
    if checks.count("order", order) > largest:
        raise checks.refuse("order", f"<= {largest}", order)
    return order
