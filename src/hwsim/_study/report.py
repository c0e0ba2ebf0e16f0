"""Report of a designed experiment in the finishing cell: runs, analysis, confirmation, planned passes."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sdpgrind.base.rng import Seed
from sdpgrind.base.units import UM

_PASSES, _PLACES = 3, 2001  # passes and roughnesses tried; chosen: limits are exact to 1/2000 of the range
_HEADS = (
    "run",
    "tool mm",
    "pattern",
    "feed mm/s",
    "force N",
    "held N",
    "sd N",
    "no contact",
    "fed mm/s",
    "off path mm",
    "Ra µm",
)


def report(found: Any, rng: Seed) -> str:
    """Text of a `FinishingStudy`."""
    parts = [
        "\n".join(_runs(found)),
        found.study.report(rng=rng),
        "\n".join(_confirmation(found)),
        "\n".join(_handed_on(found)),
    ]
    return "\n\n".join(parts)


def _runs(found: Any) -> Iterator[str]:
    """Settings and outcome of each run."""
    out, settings = found.outcome, found.study.settings
    hours = (out["time"].sum() + found.confirmation.outcome.time.values.sum()) / 3600
    yield (
        "What the cell did: "
        f"{out['time'].size + len(found.confirmation)} specimens, {hours:.2f} h of its time"
    )
    yield "  ".join(f"{head:>11}" for head in _HEADS)
    for k in range(found.study.runs):
        row = [settings[name][k] for name in ("tool_diameter", "pattern", "feed_rate", "normal_force")]
        names = ("normal_force", "normal_force_sd", "lift_off", "feed", "path_deviation", "roughness_ra")
        held, sd, off, fed, away, rough = (float(np.mean(out[name][k])) for name in names)
        made = f"{held:.3f}", f"{sd:.3f}", f"{off:.3f}", f"{fed:.1f}", f"{away:.3f}", f"{UM * rough:.2f}"
        cells = (k + 1, *map(_shown, row), *made)
        yield "  ".join(f"{cell:>11}" for cell in cells)
    shares = out["feed"].mean(axis=1) / settings["feed_rate"]
    yield (
        f"Feed achieved: {100 * shares.min():.0f} to {100 * shares.max():.0f} % of what was commanded, "
        "mean over a path"
    )


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _confirmation(found: Any) -> Iterator[str]:
    """Result of the confirmation next to its prediction."""
    read = UM * found.confirmation.outcome.roughness_ra.values
    force = found.confirmation.outcome.normal_force.values
    levels = ", ".join(f"{name} {_shown(value)}" for name, value in found.best.items())
    yield f"Confirmation at {levels}"
    yield f"expected: {found.prediction!r}"
    spread = f", {read.min():.2f} to {read.max():.2f}" if read.size > 1 else ""
    made = f"Ra {read.mean():.3f} µm{spread}; force {force.mean():.3f} N"
    yield f"found in {found.prediction.confirm} runs: {found.confirmed:.3f} dB ({made})"
    if found.prediction.ci_confirm is None:
        yield "the experiment left no error to judge it by"
    else:
        yield (
            "within the interval"
            if found.held
            else "NOT within the interval: something that was not varied matters"
        )


def _handed_on(found: Any) -> Iterator[str]:
    """Cost of the remaining scatter, with and without a reading of each specimen."""
    try:
        model = found.model
        policy = found.refinishing(passes=_PASSES)
    except ValueError as error:
        yield f"Handed on to the planner of sequences: nothing, as {error}"
        return
    tolerance = UM * float(found.prediction.response or 0.0)
    yield (
        "Handed on to the planner of sequences: "
        f"{100 * model.residual_sd:.1f} % of scatter that no setting takes away"
    )
    yield (
        f"(10 $ for each µm above {tolerance:.2f} µm, 60 $ an hour; "
        "after each pass one may deliver or finish again)"
    )
    high = float(policy.grid.axes[0].high)
    places = np.linspace(0.0, high, _PLACES)
    for left in range(_PASSES - 1, 0, -1):
        delivered = places[policy.action(roughness=places, passes_left=left).stop]
        yield f"with time for {left} more: deliver below {UM * delivered.max(initial=0.0):.2f} µm"
    once, often = (float(policy.value(roughness=high, passes_left=k)) for k in (1, _PASSES))
    yield (
        f"a specimen costs {once:.3f} $ finished once whatever comes, "
        f"{often:.3f} $ with up to {_PASSES} passes"
    )
