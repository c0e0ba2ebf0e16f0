"""Picture of a drift track: readings with their level, the cumulative sum below."""

from typing import TYPE_CHECKING, Any

import numpy as np

from centering.monitoring._alarm import with_space
from sdpgrind.base import pictures

if TYPE_CHECKING:
    from centering.monitoring._alarm import DriftAlarm
    from centering.monitoring._drift import DriftTrack

READ, LEVEL, ALARM = "0.6", pictures.TRACKED, pictures.ALARM


def plot(track: "DriftTrack") -> Any:
    """Figure of a drift track; see `DriftTrack.plot`."""
    data, names = track.dataset, list(track.estimate.names)
    figure, axes = pictures.subplots(
        2, len(names), (1.5 + 4.0 * len(names), 4.6), sharex=True, squeeze=False, height_ratios=(2, 1)
    )
    part = data["part"].values
    for (top, low), name in zip(axes.T, names, strict=True):
        _levels(
            top,
            part,
            data[name].values,
            data[f"{name}_level"].values,
            _labelled(name, data[name].attrs["units"]),
        )
        low.step(part, data[f"{name}_sum"].values, where="mid", color=LEVEL, lw=1.0)
        limit = data[f"{name}_limit"].values
        for sign in (1, -1):
            low.step(
                part,
                sign * np.where(np.isfinite(limit), limit, np.nan),
                where="mid",
                color=ALARM,
                lw=0.8,
                ls="--",
            )
        low.set(xlabel="part", ylabel="sum [sd]" if low is axes[1, 0] else "")
        for alarm in track.history:
            if alarm.quantity == name:
                _alarm(top, low, alarm.since, alarm.part)
        for alarm in track.alarms:
            if alarm.quantity == name:
                _unwatched(low, alarm, track.count)
    return figure


def _labelled(name: str, unit: str) -> str:
    return pictures.label(name, with_space(unit).strip())


def _levels(ax: Any, part: Any, reading: Any, level: Any, label: str) -> None:
    ax.plot(part, reading, ".", color=READ, ms=3, label="read")
    ax.plot(part, level, color=LEVEL, lw=1.3, label="tracked")
    ax.set_ylabel(label)
    if np.isfinite(reading).any():
        ax.legend(loc="best", fontsize=8)


def _alarm(top: Any, low: Any, since: int, part: int) -> None:
    """Span between the step and its alarm."""
    for ax in (top, low):
        ax.axvspan(since - 0.5, part + 0.5, color=ALARM, alpha=0.15, lw=0)
    top.annotate(
        f"since {since}",
        (since, 1.0),
        xycoords=("data", "axes fraction"),
        va="bottom",
        ha="center",
        fontsize=8,
    )


def _unwatched(ax: Any, alarm: "DriftAlarm", count: int) -> None:
    """Parts from an alarm until its acknowledgement."""
    ax.axvspan(alarm.part + 0.5, max(count, alarm.part + 1) - 0.5, color=READ, alpha=0.25, lw=0)
    ax.annotate(alarm.unwatched, (0.5, 0.12), xycoords="axes fraction", ha="center", va="bottom", fontsize=8)
