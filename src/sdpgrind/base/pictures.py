"""One style for all pictures: colours by what they mean, blank figures, labels with units.

A result does not import its picture, and needs no matplotlib until somebody draws: `drawn` finds the picture
by its name.
"""

from importlib import import_module
from typing import Any

from sdpgrind.base.extras import need

ACTUAL = "#4878a8"
"""Blue: what happens or is expected to happen."""
LIMIT = "#b04a3a"
"""Red: what must not be exceeded, or is demanded."""
TRACKED, ALARM = "#31527a", "#b4462d"
"""Of what is watched over the parts: the filtered level, and what calls for somebody."""
SMALL = 8
"""Size of a legend's text, points."""


def drawn(picture: str, thing: Any, *options: Any) -> Any:
    """Draw a thing by the function that ``"package.module:function"`` names; return the figure."""
    module, _, function = picture.partition(":")
    return getattr(import_module(module), function)(thing, *options)


def figure(width: float | None = None, height: float | None = None) -> Any:
    """Return a blank figure, inches wide and high, or of matplotlib's own size."""
    size = None if width is None else (width, height)
    return need("matplotlib.pyplot", "plot").figure(figsize=size, layout="constrained")


def axes_of(width: float, height: float) -> Any:
    """Return the only axes of a blank figure, inches wide and high."""
    return figure(width, height).add_subplot()


def subplots(
    rows: int, columns: int = 1, size: tuple[float, float] | None = None, **options: Any
) -> tuple[Any, Any]:
    """Return a figure, its size in inches, and its axes; options as those of `matplotlib.pyplot.subplots`."""
    plt: Any = need("matplotlib.pyplot", "plot")
    blank, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", **options)
    return blank, axes


def label(name: str, unit: str = "") -> str:
    """Return the label of an axis: the name in words, the unit in brackets where there is one."""
    words = name.replace("_", " ")
    return f"{words} [{unit}]" if unit else words


def legend(axis: Any, **options: Any) -> None:
    """Name what is drawn, small and without a frame."""
    axis.legend(**{"frameon": False, "fontsize": SMALL} | options)


def opened(axes: Any, *, grid: bool = True) -> None:
    """Leave axes without a frame above and to the right, with a pale grid."""
    for axis in axes:
        if grid:
            axis.grid(alpha=0.25, lw=0.5)
        axis.spines[["top", "right"]].set_visible(False)
