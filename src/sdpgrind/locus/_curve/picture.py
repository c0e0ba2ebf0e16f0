"""Pictures of a locus."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import checks, pictures
from sdpgrind.base.extras import need

if TYPE_CHECKING:
    from sdpgrind.locus._curve.area import Area
    from sdpgrind.locus._curve.locus import Locus

_BEHIND = {"facecolor": "w", "edgecolor": "none", "alpha": 0.7, "pad": 0.3}
COLOURS = {"interior": "#8a8a8a", "locus": pictures.ACTUAL, "bound": "#b08a3a", "vertex": "#7a5aa0"}
FLAT = 1e-2  # chosen: least height of an axis relative to its values; less would show rounding
APART = 0.13  # chosen: least distance of two numbers along the locus, in spans of the picture; fewer overlap


def picture(curve: "Locus") -> Any:
    """Draw the locus between two controls, and controls and responses over the hidden state."""
    n = len(curve.names)
    figure, axes = pictures.subplots(n + 1, 2 if n > 1 else 1, (10, 2.1 * (n + 1)), squeeze=False)
    right = axes[:, -1]
    for k, name in enumerate(curve.names):
        _over_hidden(right[k], curve, [piece.table.controls[:, k] for piece in curve.pieces])
        right[k].set(ylabel=_label(curve, name))
        right[k].tick_params(which="both", labelbottom=False)
    for j, name in enumerate(curve.responses):
        _over_hidden(right[n], curve, [piece.table.response[:, j] for piece in curve.pieces])
        for k, piece in enumerate(curve.best):
            told = "limit" if k == j == 0 else None
            limit = {"color": pictures.LIMIT, "lw": 1.0, "dashes": (4, 4), "label": told}
            right[n].plot(piece.table.hidden, piece.table.limit[:, j], "--", **limit)
        right[n].set(ylabel=_label(curve, name), xlabel=_label(curve, curve.hidden_name))
    _spread_out(right[n])
    pictures.legend(right[n])
    if n > 1:
        for axis in axes[1:, 0]:
            axis.remove()
        axes[0, 0].remove()
        _between(figure.add_subplot(axes[0, 0].get_gridspec()[:, 0]), curve)
    figure.suptitle(curve.status, fontsize=9)
    return figure


def _over_hidden(axis: Any, curve: "Locus", columns: list[checks.Floats]) -> None:
    for piece, column in zip(curve.pieces, columns, strict=True):
        style = "-" if piece.is_global else ":"
        axis.plot(
            piece.table.hidden, column, style, color=COLOURS[piece.kind], lw=1.6 if piece.is_global else 1.0
        )
    for event in curve.events:
        axis.axvline(event.hidden, color="0.85", lw=0.7, zorder=0)
    _spread_out(axis)
    low, high = curve.problem.hidden[curve.hidden_name]
    if low > 0 and high > 20 * low:
        axis.set_xscale("log")
        _few_ticks(axis.xaxis)


def _few_ticks(axis: Any) -> None:
    """Set ticks at 1, 2 and 5 of each decade, as plain numbers."""
    ticker = need("matplotlib.ticker", "plot")
    axis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    axis.set_minor_formatter(ticker.NullFormatter())


def _spread_out(axis: Any) -> None:
    """Widen the axis of nearly constant values, so that they appear level."""
    axis.ticklabel_format(axis="y", useOffset=False)
    low, high = axis.get_ylim()
    middle = 0.5 * (low + high)
    if high - low < FLAT * abs(middle):
        axis.set_ylim(middle - 0.5 * FLAT * abs(middle), middle + 0.5 * FLAT * abs(middle))


def _between(axis: Any, curve: "Locus") -> None:
    """Draw the first two controls, with values of the hidden state along the curve."""
    first, second = curve.names[:2]
    seen = set()
    for piece in curve.pieces:
        style = "-" if piece.is_global else ":"
        label = None if piece.kind in seen else piece.kind
        seen.add(piece.kind)
        marker = (
            "o"
            if piece.kind == "interior" and len(set(map(tuple, piece.table.controls.round(9)))) == 1
            else None
        )
        x, y = piece.table.controls[:, 0], piece.table.controls[:, 1]
        axis.plot(
            x,
            y,
            style,
            marker=marker,
            ms=5,
            color=COLOURS[piece.kind],
            lw=1.8 if piece.is_global else 1.0,
            label=label,
        )
    for state, place in _numbered(curve):
        axis.annotate(
            f"{state:.3g}",
            place,
            xytext=(5, 0),
            textcoords="offset points",
            fontsize=7,
            va="center",
            bbox=_BEHIND,
        )
    axis.margins(x=0.12)  # room for the numbers
    axis.set(xlabel=_label(curve, first), ylabel=_label(curve, second))
    axis.set_title(f"numbers: {_label(curve, curve.hidden_name)}", fontsize=8, color="0.4")
    pictures.legend(axis)


def _numbered(curve: "Locus") -> list[tuple[float, checks.Floats]]:
    """Return hidden states and places of the numbers, `APART` from each other."""
    places = np.concatenate([piece.table.controls[:, :2] for piece in curve.best])
    hidden = np.concatenate([piece.table.hidden for piece in curve.best])
    span = np.maximum(np.ptp(places, axis=0), 1e-300)
    kept: list[int] = []
    for k in range(len(places)):
        if all(np.hypot(*((places[k] - places[j]) / span)) > APART for j in kept):
            kept.append(k)
    return [(float(hidden[k]), places[k]) for k in kept]


def area_picture(curve: "Area") -> Any:
    """Draw each control over the first two hidden states, at the middle of the others."""
    first, second = curve.problem.hidden_names[:2]
    data = curve.dataset
    for name in curve.problem.hidden_names[2:]:
        data = data.isel({name: data.sizes[name] // 2})
    figure, axes = pictures.subplots(1, len(curve.names), (4 * len(curve.names), 3.4), squeeze=False)
    for axis, name in zip(axes[0], curve.names, strict=True):
        values = data.controls.sel(control=name).transpose(second, first)
        drawn = axis.contourf(data[first], data[second], values, levels=16, cmap="viridis")
        figure.colorbar(drawn, ax=axis, label=_label(curve, name))
        axis.set(xlabel=_label(curve, first), ylabel=_label(curve, second))
    return figure


def _label(curve: "Locus | Area", name: str) -> str:
    return pictures.label(name, curve.problem.unit(name))
