"""Picture of a strategy: expected time, best push and stroke over the offset, and narrowing of the belief."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from centering.cycle._strategy.outcomes import PushKind
    from centering.cycle._strategy.strategy import Strategy

_MAPS = {
    ("trapezoid", True): "Blues",
    ("trapezoid", False): "Greens",
    ("gentle", True): "Oranges",
    ("gentle", False): "Purples",
}
_PALE = 0.15  # chosen: share of a map that is too pale
_BOX: dict[str, Any] = {"edgecolor": "none", "framealpha": 0.8, "fontsize": 9}


def plot(strategy: "Strategy") -> Any:
    """Draw a strategy; return the figure."""
    figure, axes = pictures.subplots(2, 2, (11, 7))
    data = strategy.dataset
    _draw_value(axes[0, 0], strategy, data)
    _draw_kinds(axes[0, 1], strategy, data)
    _draw_aim(axes[1, 0], strategy, data)
    _draw_belief(axes[1, 1], strategy)
    return figure


def _draw_value(ax: Any, strategy: "Strategy", data: Any) -> None:
    """Expected time before any push, and with well-known friction."""
    offset, middle = 1e3 * data.offset.values, data.sizes["friction"] // 2
    for pushes, style in zip(sorted({0, data.sizes["pushes"] - 1}), ("-", "--"), strict=False):
        ax.semilogx(
            offset,
            data["value"].values[pushes, :, middle],
            style,
            color="#08519c",
            label=f"{pushes} pushes seen",
        )
    _mark(ax, strategy)
    ax.set(xlabel="offset [µm]", ylabel="time from the next touch to the end [s]", ylim=(0, None))
    ax.legend(**_BOX)


def _draw_kinds(ax: Any, strategy: "Strategy", data: Any) -> None:
    """Best kind of push over offset and believed friction."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    count, seen = len(strategy.kinds), min(1, data.sizes["pushes"] - 1)
    colors = ListedColormap(_colours(strategy.kinds))
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
    image = ax.pcolormesh(
        1e3 * data.offset, data.friction, data["kind"].values[seen].T, cmap=colors, norm=norm, rasterized=True
    )
    bar = ax.figure.colorbar(image, ax=ax, ticks=range(count))
    bar.ax.set_yticklabels([kind.name for kind in strategy.kinds], fontsize=8)
    ax.set(
        xscale="log",
        xlim=(None, 1e3 * strategy.problem.offset_max),
        xlabel="offset [µm]",
        ylabel="believed friction over the model's",
        title=f"best push, {'1 push' if seen else 'no push'} seen",
    )


def _colours(kinds: "Sequence[PushKind]") -> list[Any]:
    """A colour for each shape, drawn back or not; darker is faster."""
    from matplotlib import colormaps

    groups = [(kind.shape, kind.retract) for kind in kinds]
    speeds = {
        group: sorted(k.push_speed for k, of in zip(kinds, groups, strict=True) if of == group)
        for group in groups
    }
    shares = [
        (speeds[of].index(k.push_speed) + 1) / (len(speeds[of]) + 1)
        for k, of in zip(kinds, groups, strict=True)
    ]
    return [
        colormaps[_MAPS[of]](_PALE + (1 - _PALE) * share) for of, share in zip(groups, shares, strict=True)
    ]


def _draw_aim(ax: Any, strategy: "Strategy", data: Any) -> None:
    """Tip stroke and aimed travel over the offset."""
    offset = data.offset.values[1:]
    choices = [strategy.push(offset=float(d), evidence=1) for d in offset]
    ax.semilogx(
        1e3 * offset,
        [c.stroke / d for c, d in zip(choices, offset, strict=True)],
        color="0.6",
        label="travel of the tip",
    )
    ax.semilogx(
        1e3 * offset,
        [c.aim / d for c, d in zip(choices, offset, strict=True)],
        color="#e6550d",
        label="aimed travel of the part",
    )
    ax.axhline(1.0, color="k", lw=0.6)
    _mark(ax, strategy)
    ax.set(xlabel="offset [µm]", ylabel="travel over the offset", ylim=(0, 2.5))
    ax.legend(**_BOX)


def _draw_belief(ax: Any, strategy: "Strategy") -> None:
    """Narrowing of the belief: standard deviation of the next push's friction."""
    pushes = range(10)
    belief = strategy.belief
    ax.plot(pushes, [100 * belief.sd(n) for n in pushes], "o-", color="#08519c", label="friction of the part")
    ax.plot(
        pushes,
        [100 * belief.next_sd(n) for n in pushes],
        "o-",
        color="#e6550d",
        label="friction of the next push",
    )
    ax.set(xlabel="pushes seen", ylabel="standard deviation [%]", ylim=(0, None))
    ax.legend(**_BOX)


def _mark(ax: Any, strategy: "Strategy") -> None:
    """Tolerance and half the stick-slip jump; the axis ends at the greatest offset of the problem."""
    ax.axvline(1e3 * strategy.problem.tolerance, color="k", lw=0.8, ls=":", label="tolerance")
    half = 0.5 * strategy.problem.model.stick_slip_quantum
    ax.axvline(1e3 * half, color="#a63603", lw=0.8, ls="-.", label="half a jump of stick and slip")
    ax.set_xlim(right=1e3 * strategy.problem.offset_max)
