"""Picture of the worst parts: that of the plant, of these parts alone, with their own numbers."""

from collections.abc import Sequence
from typing import Any

from hwsim._log.log import of_parts
from sdpgrind.base.sheets.blocks import Picture

_FIRST_IN_DETAIL = ("ForceTableStand",)  # plants whose picture has the first part in detail, not the last
_RANKED = 2  # chosen: reasons named, as parts alike in two are seldom
_NUMBERED = ("part", "bead")  # labels of axes of part numbers


def worst_picture(log: Any, worst: Sequence[int], by: Sequence[str]) -> Picture:
    """Return the picture of some parts, given and named worst first, and by what."""
    first = str(log.outcome.attrs.get("plant", "")) in _FIRST_IN_DETAIL
    order = list(worst) if first else list(worst)[::-1]

    def draw() -> Any:
        figure = of_parts(log, order).plot()
        for axis in figure.axes:
            if axis.get_xlabel() in _NUMBERED:
                axis.set_xticks(range(len(order)), list(map(str, order)))
        return figure

    ranked = ", then ".join(by[:_RANKED])
    told = f"The {len(worst)} worst parts" + (f" (by {ranked})" if ranked else "")
    return Picture(f"{told}, worst first: {', '.join(map(str, worst))}", draw)
