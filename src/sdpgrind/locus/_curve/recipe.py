"""Recipe of an inversion: its search and look-up, and readings for the self-test."""

from bisect import bisect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal
from sdpgrind.locus._curve import inversion_kernels as kernels
from sdpgrind.locus._curve.response import Response
from sdpgrind.locus._problem import tape_kernels
from sdpgrind.locus._problem.tape_lines import straight_lines
from sdpgrind.locus._trace.table import LocusTable

_STEPS = {1: kernels.exported_of_one, 2: kernels.exported_of_two, 3: kernels.exported_of_three}
_BEYOND = 0.15  # chosen: share of the ranges by which controls and states of the self-test lie outside
_NEAR = 0.02  # chosen: share of the responses by which the self-test varies them
_FAR, _ROUNDING = 100.0, 4e-16  # chosen: shares by which no state answers a response, and by which one does
# chosen: share of the response by which the self-test is off it -> share of its readings
_OFF = {0.0: 0.5, _NEAR: 0.1, -_NEAR: 0.1, _FAR: 0.1, -_FAR: 0.1, _ROUNDING: 0.05, -_ROUNDING: 0.05}
_OFFS, _SUMS = list(_OFF), np.cumsum(list(_OFF.values())).tolist()
_HARD, _SORTS = 120, 3  # chosen: readings that Newton's method alone does not answer, of three sorts
_FALLING = 0.1  # chosen: share of the readings with controls of the other sign: the response may fall
_TABLES = {
    "search_tape": "responses and their slopes by controls and hidden state; the C has it written out",
    "search_table": "by the hidden state, packed as a locus table: the columns",
}


def recipe_of(packed: Floats, table: LocusTable, units: Mapping[str, str]) -> Recipe:
    """Return the recipe of an inversion; names and units of response and controls where known."""
    search, n = _search(packed, table), int(packed.view(np.int64)[kernels.CONTROLS])
    if n not in _STEPS:
        raise TypeError(f"an Inversion of {n} controls is not exported; of 1 to 3 it is")
    named = dict(table.units) or {"state": "", **{f"column_{k}": "" for k in range(table.width)}}
    state, *columns = named
    controls = columns if table.units and len(columns) == n else [f"control_{k}" for k in range(n)]
    response = dict(units) or {"measured": ""}
    inputs = response | {name: named.get(name, "") for name in controls}
    apart = {f"{name}_at" if name in inputs else name: named[name] for name in columns}
    sizes = tape_kernels.work_size(search.tape), tape_kernels.output_size(search.tape)
    readings = _AboutNodes(Response(search, sizes), table, n)
    return Recipe(
        "inversion",
        _STEPS[n],
        _inputs(inputs, readings.spread),
        _outputs({state: named[state], **apart}),
        law=(search, *map(int, sizes)),
        tables=_TABLES,
        status=("inside", "below the range: clamped", "above the range: clamped"),
        written_out={tape_kernels.run: _run(search, n)},
        equations="Newton's method within a bracket; then a look-up by the hidden state",
        vectors=readings.chains,
        kind="Inversion",
    )


def _search(packed: Floats, table: LocusTable) -> kernels.Search:
    whole, (low, high) = packed.view(np.int64), map(float, packed[[kernels.LOW, kernels.HIGH]])
    return kernels.Search(
        tape=packed[kernels.HEAD : kernels.HEAD + whole[kernels.TAPE]].copy(),
        table=table.packed,
        response=int(whole[kernels.RESPONSE]),
        slope=int(whole[kernels.SLOPE]),
        low=low,
        high=high,
        direction=float(packed[kernels.DIRECTION]),
        guess=float(packed[kernels.GUESS]),
        covered=bool(table.key[0] <= low and high <= table.key[-1]),
    )


def _inputs(units: Mapping[str, str], spread: Sequence[float]) -> dict[str, Signal]:
    """Return response and controls, each varied by its `spread`, in its unit."""
    told = {name: f"{name.replace('_', ' ')} at which it was measured" for name in units}
    told[next(iter(units))] = "response as measured; refused (-1) where the model has none at the controls"
    each = zip(units.items(), spread, strict=True)
    return {name: Signal(unit, told[name], spread=wide) for (name, unit), wide in each}


def _outputs(units: Mapping[str, str]) -> dict[str, Signal]:
    """Return hidden state and columns, in their units."""
    told = {name: f"{name.removesuffix('_at').replace('_', ' ')} at this state" for name in units}
    told[next(iter(units))] = "hidden state that explains it, clamped to its range"
    return {name: Signal(unit, told[name]) for name, unit in units.items()}


def _run(search: kernels.Search, count: int) -> str:
    """Return the text of the kernel that runs the tape, for response and slope."""
    places = [search.response, search.slope]
    names = [f"x{k}" for k in range(count + 1)]
    lines, found = straight_lines(search.tape, names, places)
    read = [f"x{k} = inputs[{k}]" for k in range(count + 1)]
    told = '"""Return response and slope at controls and hidden state."""'
    filled = [f"out[{place}] = {name}" for place, name in zip(places, found, strict=True)]
    return "\n    ".join(["def run(tape, inputs, work, out):", told, *read, *lines, *filled, ""])


@dataclass(frozen=True)
class _AboutNodes:
    """Responses of the model, and others, at controls about those of the table."""

    response: Response
    table: LocusTable
    controls: int

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` readings, in their units."""
        rows = [self._row(rng) for _ in range(count)]
        few = min(count, _HARD) // _SORTS
        return [np.array([*rows, *self.response.hard(self._known(rng), few, rng)])]

    def _row(self, rng: np.random.Generator) -> list[float]:
        search, controls = self.response.search, self._controls(rng)
        margin = _BEYOND * (search.high - search.low)
        states = rng.uniform(search.low - margin, search.high + margin), search.low, search.high
        response = self.response.at(controls, states[rng.integers(len(states))])[0]
        off = _OFFS[bisect(_SUMS, rng.random())]
        return [response * (1.0 + off) if np.isfinite(response) else 1.0, *controls]

    def _known(self, rng: np.random.Generator) -> Floats:
        """Return controls of a node; 1 where the table does not tell them."""
        node = self.table.columns[rng.integers(len(self.table.columns))]
        return np.array(node) if node.size == self.controls else np.ones(self.controls)

    def _controls(self, rng: np.random.Generator) -> Floats:
        """Return controls about those of a node."""
        known = self._known(rng)
        sign = np.where(rng.random(self.controls) < _FALLING, -1.0, 1.0)
        found: Floats = sign * known * rng.uniform(1.0 - _BEYOND, 1.0 + _BEYOND, self.controls)
        return found

    @property
    def spread(self) -> tuple[float, ...]:
        """Half-width by which the self-test varies readings, in their units."""
        rows = np.abs(np.array([self._row(np.random.default_rng(k)) for k in range(32)]))
        return tuple(map(float, _NEAR * np.median(rows, axis=0)))
