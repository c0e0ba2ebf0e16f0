"""Picture of a planned sequence."""

from typing import Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need

# chosen: share of the penalties that may be one colour; least coloured penalty over the greatest
_LOWEST, _DECADES = 0.02, 1e-6


def plot_policy(policy: Any, height: Floats, time: Floats) -> Any:
    """Draw expected penalty, duration and force of a policy over height, mm, and time left, s; grey: stop.

    Time left falls to the right. A plan for a stage holds until the next one: its cell reaches up to the
    stage above.
    """
    plt = need("matplotlib.pyplot", "plot")
    colors = need("matplotlib.colors", "plot")
    states = {"height": height[1:, None], "time_left": time[None, :-1]}
    action, value = policy.action(**states), policy.value(**states)
    durations = np.asarray(policy.problem.durations)
    low = _least(value)
    panels: tuple[tuple[Any, str, str, Any], ...] = (
        (value, "expected penalty [$]", "viridis", colors.LogNorm(low, value.max() or 1.0, clip=True)),
        (
            np.where(action.stop, np.nan, action.duration),
            "next pass [s] (grey: stop)",
            "plasma",
            colors.BoundaryNorm(_ends(durations), 256),
        ),
        (action.normal_force, "normal force [N]", "cividis", None),
    )
    figure, axes = pictures.subplots(1, 3, (13, 3.9), sharex=True, sharey=True)
    for ax, (field, label, name, norm) in zip(axes, panels, strict=True):
        cmap = plt.get_cmap(name).with_extremes(bad="0.88")
        image = ax.pcolormesh(
            time, height, np.ma.masked_invalid(field), cmap=cmap, norm=norm, rasterized=True
        )
        bar = figure.colorbar(
            image, ax=ax, extend="min" if field is value and low and value.min() < low else "neither"
        )
        if name == "plasma" and durations.size <= 12:
            bar.set_ticks(durations)
            bar.minorticks_off()
        ax.set(title=label, xlabel="time left [s]")
    axes[0].set_ylabel("height [mm]")
    axes[0].invert_xaxis()
    return figure


def _least(value: Floats) -> float | None:
    """Low end of the colours of a penalty, $, above its few lowest values; None where all are 0."""
    known = value[value > 0]
    return max(float(np.quantile(known, _LOWEST)), _DECADES * float(known.max())) if known.size else None


def _ends(durations: Floats) -> Floats:
    """Ends of the colours: half way between durations, and as far beyond the first and last."""
    inner = (durations[1:] + durations[:-1]) / 2
    low, high = (inner[0], inner[-1]) if inner.size else (durations[0] - 1, durations[-1] + 1)
    return np.concatenate([[2 * durations[0] - low - 1e-9], inner, [2 * durations[-1] - high + 1e-9]])
