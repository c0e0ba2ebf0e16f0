"""Style of all pictures: colours by meaning, blank figures, labels with units.

A result does not import its picture, nor matplotlib: `drawn` imports the picture by name.
"""

from typing import Any

from sdpgrind.base.by_name import called
from sdpgrind.base.extras import need

ACTUAL = "#4878a8"
"""Blue: actual or expected values."""
LIMIT = "#b04a3a"
"""Red: limits and demands."""
TRACKED, ALARM = "#31527a", "#b4462d"
"""Monitoring over parts: filtered level, and alarms."""
SMALL = 8  # size of a legend's text, points; chosen: smaller than axis labels


def drawn(picture: str, thing: Any, *options: Any) -> Any:
    """Draw an object by the function named ``"package.module:function"``; return the figure."""
    return called(picture, thing, *options)


def figure(width: float | None = None, height: float | None = None) -> Any:
    """Return a blank figure of a size in inches, or of matplotlib's default size."""
    size = None if width is None else (width, height)
    return need("matplotlib.pyplot", "plot").figure(figsize=size, layout="constrained")


def axes_of(width: float, height: float) -> Any:
    """Return the only axes of a blank figure of a size in inches."""
    return figure(width, height).add_subplot()


def subplots(
    rows: int, columns: int = 1, size: tuple[float, float] | None = None, **options: Any
) -> tuple[Any, Any]:
    """Return figure (size in inches) and axes; options as for `matplotlib.pyplot.subplots`."""
    plt: Any = need("matplotlib.pyplot", "plot")
    blank, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", **options)
    return blank, axes


def lay_out(blank: Any) -> None:
    """Lay out a figure for its canvas; `savefig` would draw all of it for that, and then once more."""
    if (engine := blank.get_layout_engine()) is not None:
        engine.execute(blank)
        blank.set_layout_engine(None)


def label(name: str, unit: str = "") -> str:
    """Return the label of an axis: name in words, unit in brackets."""
    words = name.replace("_", " ")
    return f"{words} [{unit}]" if unit else words


def legend(axis: Any, **options: Any) -> None:
    """Add a small legend without a frame."""
    axis.legend(**{"frameon": False, "fontsize": SMALL} | options)


def opened(axes: Any, *, grid: bool = True) -> None:
    """Remove the upper and right frame of axes, and add a pale grid."""
    for axis in axes:
        if grid:
            axis.grid(alpha=0.25, lw=0.5)
        axis.spines[["top", "right"]].set_visible(False)
