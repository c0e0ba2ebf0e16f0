"""Picture of a part before and after grinding: both forms, and their harmonics."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from sdpgrind.base import pictures
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from centering.roundness._form_change import FormChange

_PLACES = 16  # chosen: points for each wave of the highest harmonic
_BESIDE = 0.15  # chosen: upr; distance of the lines of before and after
_COLOURS = {"before": "0.6", "after": pictures.ACTUAL}


def plot(change: "FormChange") -> Any:
    """Draw both forms and their amplitudes; return the figure."""
    figure = pictures.figure(11, 5.2)
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.25))
    _draw_forms(figure.add_subplot(grid[0], projection="polar"), change)
    _draw_harmonics(figure.add_subplot(grid[1]), change)
    figure.suptitle(change._told().replace("; turned", "\nturned"), fontsize=9)
    figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, 0.93))  # room for the labels of the polar picture
    return figure


def _draw_forms(axis: Any, change: "FormChange") -> None:
    turn = np.linspace(0.0, 2 * np.pi, int(_PLACES * change.before.upr[-1]), endpoint=False)
    forms = {name: getattr(change, name).deviation(turn) for name in _COLOURS}
    both = np.concatenate(list(forms.values()))
    scale = polar_scale(both)
    polar_axes(scale, both, axis)
    draw_circle(axis, scale, color=pictures.LIMIT, linewidth=0.9, linestyle="--")
    for name, form in forms.items():
        draw_profile(axis, scale, turn, form, color=_COLOURS[name], label=name)
    pictures.legend(axis, loc="lower left", bbox_to_anchor=(-0.2, -0.1))


def _draw_harmonics(axis: Any, change: "FormChange") -> None:
    for name, side in (("before", -_BESIDE), ("after", _BESIDE)):
        found = getattr(change, name)
        axis.vlines(found.upr + side, 0, UM * found.amplitude, color=_COLOURS[name], lw=2.0, label=name)
    axis.set(
        xlabel=pictures.label("undulations per revolution", "upr"), ylabel=pictures.label("amplitude", "µm")
    )
    axis.set_ylim(0, None)
    pictures.opened([axis], grid=False)
    pictures.legend(axis)
