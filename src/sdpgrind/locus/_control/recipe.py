"""Recipe of a controller on the locus: its step, and readings of parts for the self-test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Role, Signal
from sdpgrind.locus._path import law_kernels as core
from sdpgrind.locus._path import walk_kernels as kernels
from sdpgrind.locus._problem.tape_lines import straight_lines
from sdpgrind.locus._trace.table_kernels import look_up

_TOLD = {
    "coordinate": "command along the locus",
    "slack": "limit - response of the last used reading; NaN before the first",
    "saturated": "1 when that reading demanded a coordinate beyond the end of the stretch, else 0",
}
_TABLES = {
    "walk_table": "by the coordinate, packed as a locus table: controls, hidden state, limit, loop slope",
    "law_slopes": "by the coordinate, packed as a locus table: loop slope",
    "walk_tape": "limit by controls and hidden state; the C has it written out",
}
_STATUS = (
    "the reading waits, or there is none: the command stays",
    "the reading was used",
    f"limit exceeded in {kernels.PATIENCE} readings in a row at an end of the stretch; used",
)
_PLACES = {
    "coordinate": core.PLACE, "error": core.LAST, "error_before": core.LAST_BUT_ONE, "updates": core.UPDATES,
    "samples": core.SAMPLES, "actual": core.ACTUAL, "waited": core.WAITED, "held": core.HELD,
}  # fmt: skip
_KINDS = ("near", "lagging", "lost", "beyond", "below", "waiting", "wild")
_LENGTH = 64  # chosen: samples of a part of the self-test: three times the patience with a coordinate
# chosen: shares of the greatest limit by which readings are off
_CLOSE, _OFF = 0.02, 0.3
_NEAR_END = 0.05  # chosen: share of a cell of the table; a wrong start of its search shows at its ends
_LAGGED = 0.5  # chosen: share of the way to its command that a lagging coordinate takes in a sample


def recipe_of(controller: Any) -> Recipe:
    """Return the recipe of a controller, in the user's units."""
    stretch, walk, law = controller.stretch, controller.walk, controller.law
    _check(controller)
    measured = walk.column >= 0
    checks.unique("names", [*controller.commands, *controller.reports])
    start = controller.fresh_state()
    part = _ReadParts(law, walk, start, float(np.max(np.abs(stretch.limit))), measured)
    return Recipe(
        "locus",
        kernels.exported_step,
        *_signals(controller, part.spread),
        law=(law, walk),
        after=() if measured else (nan,),
        state=start,
        tables=_TABLES,
        period=controller.period,
        status=_STATUS,
        places=_PLACES,
        written_out={kernels.limit_at: _limit_at(walk, len(stretch.names))},
        equations="Koren (1989), section 5 and (36).",
        vectors=part.chains,
        kind=type(controller).__name__,
        role=Role(
            reads=controller.reads,
            commands=controller.commands,
            answer=lambda status, found: {name: found[name] for name in controller.commands},
            report=lambda status, given, found: {name: found[name] for name in controller.reports},
            reports=controller.reports,
            job=controller.job,
        ),
    )


def _check(controller: Any) -> None:
    """Refuse what has no kernel, or no start of its own."""
    if controller.method != "feedback":
        rule = "'feedback' for an export: the inversion is solved in Python"
        raise checks.refuse("method", rule, controller.method)
    if controller.start == "learned":
        rule = "a coordinate for an export, which keeps none after a reset: hand over the learned one"
        raise checks.refuse("start", rule, controller.start)
    if not controller.walk.tape.size:
        rule = "a locus for an export, or its stretch: the limit of this one is a function in Python"
        raise checks.refuse("curve", rule, type(controller.stretch).__name__)


def _signals(controller: Any, spread: Sequence[float]) -> tuple[dict[str, Signal], dict[str, Signal]]:
    """Return inputs, varied by their `spread`, and outputs, in their units."""
    stretch, inputs = controller.stretch, dict(controller.reads)
    told = {name: f"{name.replace('_', ' ')} to command" for name in controller.commands} | _TOLD
    told[stretch.response] = "response as measured, to be kept below its limit"
    told[stretch.hidden_name] = f"{stretch.hidden_name.replace('_', ' ')} with this optimum"
    if controller.walk.column >= 0:
        inputs[stretch.along], words = stretch.unit, stretch.along.replace("_", " ")
        told[stretch.along] = f"{words}: as an input as measured, as an output to command"
    each, outputs = zip(inputs.items(), spread, strict=True), {**controller.commands, **controller.reports}
    return (
        {name: Signal(unit, told[name], missing=True, spread=wide) for (name, unit), wide in each},
        {name: Signal(unit, told[name]) for name, unit in outputs.items()},
    )


def _limit_at(walk: kernels.Walk, count: int) -> str:
    """Return the text of the kernel with its tape written out."""
    names = ["base" if k == walk.column else f"x{k}" for k in range(count + 1)]
    read = [f"x{k} = row[{k}]" for k in range(count + 1) if k != walk.column]
    lines, limits = straight_lines(walk.tape, names, [walk.limit])
    told = '"""Return the limit at the controls of a row with the coordinate at `base`."""'
    return "\n    ".join(["def limit_at(walk, row, base):", told, *read, *lines, f"return {limits[0]}", ""])


@dataclass(frozen=True)
class _ReadParts:
    """Parts whose readings lie about the limit, with a coordinate that lags, and what may go wrong."""

    law: core.WalkLaw
    walk: kernels.Walk
    start: Floats
    limit: float
    measured: bool

    @property
    def spread(self) -> tuple[float, ...]:
        """Half-width by which the self-test varies readings, in their units."""
        return (_CLOSE * self.limit, _CLOSE * (self.law.high - self.law.low))[: 1 + self.measured]

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return the readings of parts, about `count` samples at least, each kind once at least."""
        parts = max(-(-count // _LENGTH), len(_KINDS))
        found = [self._readings(rng, _KINDS[k % len(_KINDS)]) for k in range(parts)]
        return [np.array(list(one))[:, : 1 + self.measured] for one in (*found, self._along(rng))]

    def _along(self, rng: np.random.Generator) -> Iterator[tuple[float, float]]:
        """Yield readings that lead to both ends of each cell of the table, from the greatest on."""
        state, law, walk, row = self.start.copy(), self.law, self.walk, np.empty(self._width)
        cells = int(walk.table[:3].view(np.int64)[2])
        width = (walk.greatest - walk.least) / cells
        places = (
            np.arange(cells)[:, None]
            + rng.uniform(0.0, _NEAR_END, cells)[:, None] * [[1.0, -1.0]]
            + [[0.0, 1.0]]
        )
        for target in walk.greatest - width * places.ravel():
            place = float(state[core.PLACE])
            kernels.row_at(walk, place, row)
            reading = float(row[-2]) - walk.margin - self._error(state, target - place)
            yield reading, place
            kernels.walk_step(state, law, walk, reading, place if self.measured else nan, row)

    def _error(self, state: Floats, change: float) -> float:
        """Return the error, limit - response, by which the law changes the coordinate so."""
        law, last, before = self.law, float(state[core.LAST]), float(state[core.LAST_BUT_ONE])
        kp = law.proportional if state[core.UPDATES] >= 1.0 else 0.0
        kd = law.derivative if state[core.UPDATES] >= 2.0 else 0.0
        kept = kp * last + kd * (2.0 * last - before)
        return (law.direction * change + kept) / (self._gain(float(state[core.PLACE])) + kp + kd)

    def _gain(self, place: float) -> float:
        """Return the integral gain at a coordinate."""
        if not self.law.scheduled:
            return self.law.integral
        slope = np.empty(1)
        look_up(self.law.slopes, place, slope)
        return self.law.integral / abs(float(slope[0]))

    def _readings(self, rng: np.random.Generator, kind: str) -> Iterator[tuple[float, float]]:
        state, walk = self.start.copy(), self.walk
        row, actual = np.empty(self._width), float(state[core.PLACE])
        for _ in range(_LENGTH):
            place = float(state[core.PLACE])
            actual += (1.0 if kind == "near" else _LAGGED) * (place - actual)
            kernels.row_at(walk, place, row)
            off = {"beyond": -_OFF, "below": _OFF}.get(kind, rng.normal(0.0, _CLOSE))
            off *= 1.0 / _CLOSE if kind == "wild" and rng.random() < _OFF else 1.0
            reading = float(row[-2]) - walk.margin - off * self.limit
            seen = actual if kind != "waiting" else actual * (1.0 + rng.choice([0.0, _OFF]))
            lost = kind == "lost" and rng.random() < _OFF
            given = nan if lost else reading, nan if kind in ("beyond", "wild") else seen
            yield given
            kernels.walk_step(state, self.law, walk, given[0], given[1] if self.measured else nan, row)

    @property
    def _width(self) -> int:
        """Number of columns of the table."""
        return int(self.walk.table[:2].view(np.int64)[1])
