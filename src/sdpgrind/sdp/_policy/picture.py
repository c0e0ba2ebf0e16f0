"""Pictures of a policy."""

from typing import Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.extras import need
from sdpgrind.sdp._policy.table import Solution


def plot(policy: Solution, mode: int) -> Any:
    """Draw value-to-go and chosen move: over (stages left, axis), or over two axes in the last slice."""
    layout, t, grid = policy.layout, policy.table, policy.grid
    figure, (left, right) = pictures.subplots(1, 2, (10, 4))
    skip = 1 if layout.has_base else 0
    if len(grid.axes) == 1 and layout.count > 0:
        x = policy.countdown.time(np.arange(skip, t.value.shape[0]))
        y, value, best = grid.coordinates[0], t.value[skip:, mode].T, t.best[skip:, mode].T
        names = (f"{layout.stage_name} [{layout.stage_unit}]", _label(policy, 0))
    elif len(grid.axes) == 1:
        return _curves(policy, figure, left, right, mode)
    elif len(grid.axes) >= 2:
        x, y = grid.coordinates[0], grid.coordinates[1]
        middle = (..., grid.shape[2] // 2) if len(grid.axes) == 3 else ...
        value, best = (each[-1, mode].reshape(grid.shape)[middle].T for each in (t.value, t.best))
        names = (_label(policy, 0), _label(policy, 1))
    else:
        x, y = policy.countdown.time(np.arange(skip, t.value.shape[0])), np.arange(float(len(layout.modes)))
        value, best = t.value[skip:, :, 0].T, t.best[skip:, :, 0].T
        names = (f"{layout.stage_name} [{layout.stage_unit}]", "mode")
    image = left.pcolormesh(x, y, value, shading="nearest", cmap="viridis", rasterized=True)
    figure.colorbar(image, ax=left, label="expected penalty-to-go [$]")
    _moves(policy, figure, right, x, y, best)
    for ax in (left, right):
        ax.set(xlabel=names[0], ylabel=names[1])
        if len(grid.axes) < 2:
            ax.invert_xaxis()  # stages left fall to the right
    return figure


def _label(policy: Solution, k: int) -> str:
    axis = policy.layout.axes[k]
    return f"{axis.name} [{axis.unit}]" if axis.unit else axis.name


def _moves(policy: Solution, figure: Any, ax: Any, x: Any, y: Any, best: Any) -> None:
    """Colour each state by its stop or move; list those that occur."""
    plt = need("matplotlib.pyplot", "plot")
    labels = [*policy.layout.stops, *(m.name for m in policy.layout.moves)]
    which = np.where(best < 0, -1 - best, best + len(policy.layout.stops))
    used = np.unique(which)
    colours = [
        (0.88, 0.88, 0.88)
        if k < len(policy.layout.stops)
        else plt.cm.plasma(0.1 + 0.8 * i / max(1, len(used) - 1))
        for i, k in enumerate(used)
    ]
    cmap = need("matplotlib.colors", "plot").ListedColormap(colours)
    image = ax.pcolormesh(
        x,
        y,
        np.searchsorted(used, which),
        shading="nearest",
        cmap=cmap,
        vmin=-0.5,
        vmax=used.size - 0.5,
        rasterized=True,
    )
    bar = figure.colorbar(image, ax=ax, ticks=range(used.size))
    bar.ax.set_yticklabels([labels[k] for k in used])


def _curves(policy: Solution, figure: Any, left: Any, right: Any, mode: int) -> Any:
    x, t, axis = policy.grid.coordinates[0], policy.table, policy.layout.axes[0]
    left.plot(x, t.value[0, mode])
    left.set(xlabel=_label(policy, 0), ylabel="expected penalty-to-go [$]", xscale=axis.scale)
    controls = policy.controls(t.best[0, mode], t.entry[0, mode], t.control[0, mode])
    for name, values in controls.items():
        right.plot(x, values, ".", ms=3, label=name)
    right.set(xlabel=_label(policy, 0), ylabel="control", xscale=axis.scale)
    right.legend(frameon=False)
    return figure
