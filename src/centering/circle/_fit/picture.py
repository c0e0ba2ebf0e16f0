"""Pictures: readings with model and residuals; the path of the centre on a log-polar chart."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures, units
from sdpgrind.base.checks import Complex, Floats

if TYPE_CHECKING:
    from centering.circle._fit.estimate import CircleEstimate

BLUE, RED, GREEN, GREY = pictures.ACTUAL, pictures.LIMIT, "#3f8f5f", "0.45"
_ROOM = 0.06  # chosen: room of a number, relative to the chart's radius
_STEPS = 33  # chosen: points between two centres, to find crossings of their path
FINE = 721  # chosen: points of a drawn turn
SPARE = 0.5  # chosen: decades between the middle of the chart and the smallest of tolerance and offsets


def plot_fit(circle: "CircleEstimate", angle: Floats, reading: Floats) -> Any:
    """Draw readings, the model over at least a turn, and residuals in µm; return the figure."""
    figure = pictures.figure(7.5, 5.2)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    above.plot(angle / units.deg(1.0), reading, ".", color=BLUE, ms=4, label=f"{angle.size} readings")
    _draw_model(above, circle, angle)
    above.set(ylabel="reading [mm]", title=_title(circle))
    pictures.legend(above)
    _draw_residuals(below, circle, angle, reading)
    return figure


def _title(circle: "CircleEstimate") -> str:
    """Estimate in one line."""
    direction = (
        f" at {circle.offset_angle / units.deg(1.0):.2f} deg"
        if circle.angle_known
        else ", direction not known"
    )
    centre = f"centre ± {told_length(circle.center_sd)}"
    return f"radius {circle.radius:.4f} mm, offset {circle.offset:.4f} mm{direction}; {centre}"


def _draw_model(axis: Any, circle: "CircleEstimate", angle: Floats) -> None:
    """Draw the model over the readings, dashed over the rest of a turn."""
    low, high = float(angle.min()), float(angle.max())
    turn = np.linspace(low, max(high, low + 2 * np.pi), FINE)
    axis.plot(turn / units.deg(1.0), circle.reading(turn), color=GREY, lw=0.8, ls="--")
    covered = np.linspace(low, high, FINE)
    axis.plot(
        covered / units.deg(1.0), circle.reading(covered), color=RED, lw=1.0, label=f"{circle.model} model"
    )


def _draw_residuals(axis: Any, circle: "CircleEstimate", angle: Floats, reading: Floats) -> None:
    """Draw the residuals with two standard deviations of a reading."""
    left = (reading - circle.reading(angle)) / units.um(1.0)
    band = 2 * circle.noise_sd / units.um(1.0)
    axis.axhspan(-band, band, color=RED, alpha=0.1, lw=0, label="two standard deviations of a reading")
    axis.axhline(0.0, color=RED, lw=0.8)
    axis.plot(angle / units.deg(1.0), left, ".", color=BLUE, ms=3)
    axis.set(xlabel="spindle angle [deg]", ylabel="residual [µm]")
    pictures.legend(axis)


def plot_centers(
    centers: "npt.ArrayLike | Sequence[CircleEstimate]",
    tolerance: float,
    *,
    shown: int | None = None,
    ax: Any = None,
) -> Any:
    """Draw the centres, push by push, on a log-polar chart with the circle of tolerance; return the figure.

    The radial coordinate is the logarithm of the offset: millimetres and micrometres show at once.

    Parameters
    ----------
    centers : sequence of CircleEstimate, or array_like, shape (n, 2)
        Centres in their order; an array holds x and y, mm. Estimates are drawn with their standard
        deviations.
    tolerance : float
        Offset of a centred part, mm, > 0.
    shown : int, optional
        Number of centres to draw, on the scale of all, as for the frames of a film.
    ax : matplotlib axes, optional
        Polar axes to draw into.

    Raises
    ------
    ValueError, TypeError
        For no centre, or values that are not finite.

    Examples
    --------
    >>> figure = plot_centers([[3.0, 2.0], [0.1, -0.05], [0.001, 0.001]], tolerance=0.0025)  # doctest: +SKIP
    """
    line, widths = _centers(centers)
    wanted = checks.positive("tolerance", tolerance, "mm")
    count = len(line) if shown is None else checks.count("shown", shown)
    offset = np.hypot(line[:, 0], line[:, 1])
    middle = np.log10(min(wanted, float(offset[offset > 0].min(initial=wanted)))) - SPARE
    if ax is None:
        ax = pictures.figure(6, 6).add_subplot(projection="polar")
    places = np.asarray(
        _height(offset, middle) * np.exp(1j * np.arctan2(line[:, 1], line[:, 0])), dtype=complex
    )
    _draw_paper(ax, middle, np.log10(max(wanted, float(offset.max()))) + 0.2 - middle, places)
    _draw_tolerance(ax, wanted, np.log10(wanted) - middle)
    _draw_path(ax, line[:count], widths[:count], middle)
    ax.set_title("centre of the part about the spindle, its offset on a log scale", fontsize=10)
    pictures.legend(ax, loc="lower left", bbox_to_anchor=(-0.1, -0.1))
    return ax.figure


def _draw_paper(axis: Any, middle: float, top: float, places: Complex) -> None:
    """Draw rings at decades, labelled in a direction without path."""
    decades = np.arange(np.ceil(middle), middle + top)
    axis.set_rlim(0.0, top)
    legible = {"fontsize": 8, "bbox": {"facecolor": "w", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}}
    axis.set_rticks(decades - middle, labels=[told_length(10.0**decade) for decade in decades], **legible)
    axis.set_rlabel_position(_freest(places, decades - middle, top))


def _freest(places: Complex, rings: Floats, top: float) -> float:
    """Direction (deg) between the chart's lines where the rings are crossed farthest from the path."""
    directions = np.arange(22.5, 360.0, 45.0)
    crossings = np.multiply.outer(np.exp(1j * np.radians(directions)), rings)
    path = (
        np.concatenate([np.linspace(*pair, _STEPS) for pair in pairwise(places)])
        if len(places) > 1
        else places
    )
    room = np.abs(crossings[..., None] - path).min(axis=-1)
    return float(directions[np.minimum(room, 2 * _ROOM * top).sum(axis=-1).argmax()])


def _centers(centers: Any) -> tuple[Floats, Floats]:
    """Centres (n, 2) and their standard deviations (n,), 0 where unknown."""
    if not isinstance(centers, np.ndarray) and all(hasattr(each, "center_sd") for each in centers):
        line = np.array([[each.center_x, each.center_y] for each in centers]).reshape(-1, 2)
        widths = np.array([each.center_sd for each in centers])
    else:
        line = checks.finite_array("centers", centers, "mm")
        widths = np.zeros(line.shape[:1])
    if line.ndim != 2 or line.shape[1] != 2 or not len(line):
        raise checks.refuse("centers", "of shape (n, 2), at least one centre", line.shape, "mm")
    return line, widths


def _draw_tolerance(axis: Any, wanted: float, height: float) -> None:
    """Draw the filled circle of tolerance."""
    turn = np.linspace(0.0, 2 * np.pi, FINE)
    axis.fill_between(turn, 0.0, height, color=GREEN, alpha=0.15, lw=0)
    axis.plot(turn, np.full(FINE, height), color=GREEN, lw=1.2, label=f"tolerance {told_length(wanted)}")


def _draw_path(axis: Any, line: Floats, widths: Floats, middle: float) -> None:
    """Draw the centres in order with standard deviations, numbered where there is room."""
    angle, offset = np.arctan2(line[:, 1], line[:, 0]), np.hypot(line[:, 0], line[:, 1])
    height = _height(offset, middle)
    axis.plot(angle, height, color=BLUE, lw=0.8, alpha=0.7)
    low, high = _height(offset - widths, middle), _height(offset + widths, middle)
    axis.errorbar(
        angle, height, yerr=[height - low, high - height], fmt="o", color=BLUE, ms=4, lw=1, label="centre"
    )
    axis.plot(angle[-1:], height[-1:], "o", color=BLUE, ms=7)
    for k in _apart(np.asarray(height * np.exp(1j * angle), dtype=complex), _ROOM * float(height.max())):
        axis.annotate(str(k), (angle[k], height[k]), xytext=(6, 6), textcoords="offset points", fontsize=8)


def _apart(places: Complex, room: float) -> list[int]:
    """Last and first place, and each that is at least `room` from all places taken before."""
    taken = [len(places) - 1]
    for k in range(len(places) - 1):
        if np.abs(places[taken] - places[k]).min() >= room:
            taken.append(k)
    return sorted(taken)


def _height(offset: Floats, middle: float) -> Floats:
    """Distance from the middle of the chart, decades."""
    return np.asarray(np.maximum(np.log10(np.maximum(offset, 10.0**middle)) - middle, 0.0))


def told_length(value: float) -> str:
    """Text of a length (mm)."""
    return f"{value:.4g} mm" if value >= 0.1 else f"{value / units.um(1.0):.3g} µm"
