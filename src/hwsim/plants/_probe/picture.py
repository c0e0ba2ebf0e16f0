"""Picture of a run on the probe: readings and their model, residuals, error of the estimated centre."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import columns, part_named, parts_named
from hwsim.protocols import PartLog
from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DATA, _MODEL, _ERROR, _BAND, _TRUE = "0.55", "tab:blue", "tab:blue", "tab:orange", "0.15"
_TURN = 2 * math.pi
_TOP = 1e4  # largest error drawn, µm; chosen: the first estimates are far off
_LINE = 400  # points on the curve of the model; chosen: fewer show corners
_NOTE: dict[str, Any] = {
    "textcoords": "offset points",
    "fontsize": 8,
    "ha": "right",
    "xycoords": ("axes fraction", "data"),
}


_COLUMNS = ("angle", "reading", "radius_planned", "center_x_planned", "center_y_planned", "band_planned")


def picture(log: PartLog) -> "Figure":
    """Draw a log of `Probe`: readings of the last part, error of its centre by sample, all parts."""
    figure: Figure = pictures.figure(11.5, 6.8)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.15, 1))
    pair, panels = grid[0].subgridspec(2, 1, height_ratios=(2, 1), hspace=0.0), grid[1].subgridspec(2, 1)
    last = columns(log, _COLUMNS)
    reading = figure.add_subplot(pair[0])
    below = figure.add_subplot(pair[1], sharex=reading)
    _readings(reading, below, last, float(log.outcome.attrs["tip_radius"]), part_named(log).capitalize())
    _history(figure.add_subplot(panels[0]), last, log)
    _parts(figure.add_subplot(panels[1]), log)
    pictures.opened(figure.axes)
    figure.suptitle(_title(log))
    return figure


def _title(log: PartLog) -> str:
    out = log.outcome
    parts = f"{len(log)} parts" if len(log) > 1 else "1 part"
    return f"{parts}: {out.turns.values.mean():.2f} turns and {out.time.values.mean():.2f} s each"


def _known(last: dict[str, Floats]) -> Any:
    """Rows with a reported centre."""
    return np.flatnonzero(np.isfinite(last["center_x_planned"]))


def _model(last: dict[str, Floats], row: int, angle: Floats, tip_radius: float) -> Floats:
    """Readings predicted by the estimate of a row."""
    from centering.circle import circle_reading

    x, y = last["center_x_planned"][row], last["center_y_planned"][row]
    return circle_reading(angle, last["radius_planned"][row], math.hypot(x, y), math.atan2(y, x), tip_radius)


def _readings(above: Any, below: Any, last: dict[str, Floats], tip_radius: float, part: str) -> None:
    turns, known = last["angle"] / _TURN, _known(last)
    above.plot(turns, last["reading"], ".", color=_DATA, ms=3, label="read")
    if known.size:
        angle = np.linspace(last["angle"][0], last["angle"][-1], _LINE)
        above.plot(
            angle / _TURN,
            _model(last, known[-1], angle, tip_radius),
            color=_MODEL,
            lw=1,
            label="model at the end",
        )
        left = last["reading"] - _model(last, known[-1], last["angle"], tip_radius)
        below.plot(turns, UM * left, ".", color=_DATA, ms=3)
    above.set(ylabel="reading [mm]")
    above.set_title(part, loc="left")
    above.tick_params(labelbottom=False)
    pictures.legend(above)
    below.axhline(0, color=_TRUE, lw=1)
    below.set(ylabel="residual [µm]", xlabel="angle of the spindle [turns]")


def _history(axis: Any, last: dict[str, Floats], log: PartLog) -> None:
    """Error of the centre at each sample, and the reported band."""
    known, out = _known(last), log.outcome
    axis.set_title(f"Centre of {part_named(log)}", loc="left")
    axis.set(xlabel="angle of the spindle [turns]", ylabel="distance [µm]", yscale="log")
    if not known.size:
        return
    error = np.hypot(
        last["center_x_planned"] - out.true_center_x.values[-1],
        last["center_y_planned"] - out.true_center_y.values[-1],
    )
    turns = last["angle"] / _TURN
    axis.plot(
        turns[known],
        UM * last["band_planned"][known],
        color=_BAND,
        label="band: as sure as this it was said to be",
    )
    axis.plot(turns[known], UM * error[known], color=_ERROR, label="from the true centre")
    axis.set_ylim(top=min(axis.get_ylim()[1], _TOP))
    pictures.legend(axis)


def _parts(axis: Any, log: PartLog) -> None:
    """Final error of the centre over its band; above 1 the band was wrong."""
    parts = np.arange(len(log))
    ratio = np.array([_ratio(log, part) for part in range(len(log))])
    wrong = ratio > 1
    axis.plot(parts[~wrong], ratio[~wrong], "o", color=_ERROR, ms=3.5)
    axis.plot(parts[wrong], ratio[wrong], "o", color="tab:red", ms=3.5)
    axis.axhline(1, color=_TRUE, lw=1, ls="--")
    axis.annotate("beyond: further off than was said", (0.99, 1), (0, 3), **_NOTE)
    axis.set_title(f"{parts_named(log)}, at its end", loc="left")
    axis.set(xlabel="part", ylabel="error of the centre / band")
    axis.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
    axis.set_ylim(bottom=0)


def _ratio(log: PartLog, part: int) -> float:
    """Final error of the centre of a part over its band; NaN: no estimate."""
    last, out = columns(log, _COLUMNS, part), log.outcome
    known = _known(last)
    if not known.size:
        return math.nan
    x, y, band = (float(last[f"{name}_planned"][known[-1]]) for name in ("center_x", "center_y", "band"))
    return (
        math.hypot(x - float(out.true_center_x.values[part]), y - float(out.true_center_y.values[part]))
        / band
    )
