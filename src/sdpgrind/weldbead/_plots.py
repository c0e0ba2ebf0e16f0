"""Pictures of a planned sequence."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.weldbead._policy import SequencePolicy


def plot_policy(policy: "SequencePolicy") -> Any:
    """Draw expected penalty, duration and force; lines mark where the policy stops."""
    plt = need("matplotlib.pyplot", "plot")
    height, time = policy.states()
    states = {"height": height[1:, None], "time_left": time[None, :]}
    action = policy.action(**states)
    duration = np.where(action.stop, np.nan, action.duration)
    figure, axes = plt.subplots(1, 3, figsize=(12.5, 3.9), sharey=True, layout="constrained")
    panels = (
        (policy.value(**states), "expected penalty [$]", "viridis", None),
        (duration, "duration of the next pass [s]", "plasma", len(policy.problem.durations)),
        (action.normal_force, "normal force [N]", "cividis", None),
    )
    for ax, (field, label, name, steps) in zip(axes, panels, strict=True):
        cmap = (plt.get_cmap(name, steps) if steps else plt.get_cmap(name)).with_extremes(bad="0.88")
        limits = _centred(policy.problem.durations) if steps else (None, None)
        image = ax.pcolormesh(
            time, height[1:], field, shading="nearest", cmap=cmap, vmin=limits[0], vmax=limits[1], rasterized=True
        )
        figure.colorbar(image, ax=ax, label=label, ticks=policy.problem.durations if steps and steps <= 12 else None)
        ax.set_xlabel("time left [s]")
    axes[0].set_ylabel("height [mm]")
    axes[1].set_title("grey: stop", fontsize=9)
    return figure


def _centred(durations: Any) -> tuple[float, float]:
    half = (durations[-1] - durations[0]) / max(1, len(durations) - 1) / 2 or 0.5
    return durations[0] - half, durations[-1] + half
