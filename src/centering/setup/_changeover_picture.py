"""Picture of a changeover: both rules, the distribution of the population, this part."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.setup._allowance import probability_text
from sdpgrind.base import pictures

if TYPE_CHECKING:
    from centering.setup._changeover import Changeover

PARTS, PART, RULE = pictures.ACTUAL, pictures.ALARM, "0.25"
_BEHIND = {"facecolor": "w", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
REACH = 4.5  # chosen: half width of the drawn distribution in standard deviations
LEAST = 1e-4  # chosen: least standard deviation drawn, mm


def plot(change: "Changeover", ax: Any = None) -> Any:
    """Figure of a changeover; see `Changeover.plot`."""
    if ax is None:
        ax = pictures.axes_of(8, 3.6)
    _population(ax, change)
    _part(ax, change)
    side = "left" if change.internal else "right"
    _rule(ax, change.population_position, 0.92, "rule of the population", side)
    _rule(ax, change.position, 0.74, "rule of this part", side)
    ax.axvline(change.finish_radius, color="k", lw=1.2)
    ax.annotate("finished", (change.finish_radius, 0.02), rotation=90, ha="right", va="bottom", fontsize=8)
    ax.annotate(
        "",
        (change.position, 0.6),
        (change.population_position, 0.6),
        arrowprops={"arrowstyle": "->", "color": RULE},
    )
    ax.margins(x=0.1)
    ax.set(xlabel="radius about the grinder's axis [mm]", yticks=[], ylim=(0, 1.05), title=_told(change))
    ax.legend(loc="center left", fontsize=8, framealpha=0.9)
    return ax.figure


def _population(ax: Any, change: "Changeover") -> None:
    """Normal distribution of the largest radius over the parts, scaled to the axes."""
    outward = -1.0 if change.internal else 1.0
    mean, sd = change.finish_radius + outward * change.stock.height, max(change.stock.height_sd, LEAST)
    radius = np.linspace(mean - REACH * sd, mean + REACH * sd, 301)
    density = 0.55 * np.exp(-0.5 * ((radius - mean) / sd) ** 2)
    what = "smallest radius" if change.internal else "largest radius"
    ax.fill_between(radius, density, color=PARTS, alpha=0.35, lw=0, label=f"{what} over the population")


def _part(ax: Any, change: "Changeover") -> None:
    """Radius of this part with its allowance."""
    half = change.part_sigmas * change.radius_sd
    ax.axvspan(change.largest_radius - half, change.largest_radius + half, color=PART, alpha=0.25, lw=0)
    ax.axvline(change.largest_radius, color=PART, lw=1.5, label=_part_label(change))


def _part_label(change: "Changeover") -> str:
    beyond = probability_text(change.contact_probability.part)
    return f"this part, ± {change.part_sigmas:.3g} sd: beyond in {beyond} at most"


def _rule(ax: Any, at: float, height: float, name: str, side: str) -> None:
    """One rule, with its text on the side of the other radii."""
    ax.plot([at, at], [0.0, height], color=RULE, lw=1.2, ls="--")
    ax.annotate(f"{name}: {at:.4f} mm", (at, height), ha=side, va="bottom", fontsize=8, bbox=_BEHIND)


def _told(change: "Changeover") -> str:
    saved = f"saved {1e3 * change.length_saved:.4g} µm = {change.time_saved:.3g} s of air"
    contact = probability_text(change.contact_probability.population)
    return f"{saved}; contact of the population's rule: {contact}"
