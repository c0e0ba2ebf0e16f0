"""`Recipe` of an export: the step as a kernel, the constants, the state, signals, role in a run."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.compiling.compiled import Kernel
from sdpgrind.codegen._names import c_name
from sdpgrind.codegen._program import StepProgram

_FINGERPRINT = 16  # chosen: hexadecimal digits
_STATE = (0.0,)  # chosen: an unused entry, since C has no empty structure
BOUND = 1e9  # chosen: in mm, N, W, s, rad: beyond what any machine measures; its cube is far from overflow


@dataclass(frozen=True)
class Signal:
    """Input or output of a step. Of an output unit and meaning count alone.

    Parameters
    ----------
    unit, meaning : str
        Its unit ("": a pure number); what it is, and which direction is positive, for header, manifest, FMU.
    low, high : float
        Least and greatest value, in its unit; outside the status is -1, and the step does not run. Where an
        end is infinite any number is taken; infinity itself where the input may be missing.
    missing : bool
        Whether it may be NaN, no reading: the step decides. At others the status is then -1.
    default : float
        Value where `Exported.controller` is not given one, in its unit.
    spread : float
        Half-width by which the self-test varies it, in its unit.
    """

    unit: str = ""
    meaning: str = ""
    low: float = -BOUND
    high: float = BOUND
    missing: bool = False
    default: float = nan
    spread: float = 1.0


@dataclass(frozen=True, eq=False)
class Role:
    """Role of a step in `hwsim.run`: what `Exported.controller` is asked for beyond the C.

    Parameters
    ----------
    reads, commands, reports : mapping of str to str, optional
        Name of each measurement that a plant must have, of each command and each report to its unit. Default:
        inputs, outputs, none.
    answer : callable(status, outputs), optional
        Makes the command of status and outputs. Default: the outputs.
    report : callable(status, inputs, outputs), optional
        What the plan expects of the step that was taken (inputs and outputs by name), for the log; it comes
        from the library and decides nothing.
    stands_for, tier : str
        Class of the controller that steps so, and its tier, for the log. Default: the `kind` of the recipe.
    job, description : mapping
        As the thing's own.
    """

    reads: Mapping[str, str] | None = None
    commands: Mapping[str, str] | None = None
    reports: Mapping[str, str] = field(default_factory=dict)
    answer: Callable[[int, dict[str, float]], dict[str, Any]] | None = None
    report: Callable[[int, dict[str, float], dict[str, float]], dict[str, float]] | None = None
    stands_for: str = ""
    tier: str = "controller"
    job: Mapping[str, object] = field(default_factory=dict)
    description: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Recipe:
    """Step of a controller, or a look-up, as a kernel with all that it needs.

    ``step(state, *law, *inputs, *after, out)`` updates `state` (an array), fills `out` (one entry an output)
    and returns a whole number: the place in `status`, or < 0: an input is out of range. It is decorated by
    `compiled(error_model="numpy")`, as all kernels that it calls. Whether the state may be changed by a step
    that returns < 0 does not matter: it is put back.

    Parameters
    ----------
    name : str
        Name of the thing, for files and functions.
    step : Kernel
        The step.
    inputs, outputs : mapping of str to Signal
        By name, in the order of the arguments and of `out`; a text is the unit of a `Signal`.
    law : tuple
        Constants: numbers, arrays, NamedTuples of these.
    after : tuple
        Constants that stand behind the inputs.
    state : array
        State after a reset; without one an unused entry.
    settings : sequence of int
        Places in `state` that the step only reads: their numbers are constants of the C, and may be sizes.
    program : StepProgram, optional
        Program that a step may ask for: `step` then has its room in place of `out`, and returns 1 where it is
        to be solved, else 0; the program's `finish` ends the step.
    start : Kernel, optional
        ``start(state, *law)``, which resets the state. Default: `state` is copied.
    tables : mapping of str to str
        What a constant is, by the name of its parameter in `step`, for the comment at its table.
    period : float, optional
        Time between two steps, s.
    status : sequence of str
        Names of the results from 0 on.
    places : mapping of str to int
        Named entries of the state.
    written_out : mapping of Kernel to str
        Kernels that the C has written out for these constants, as a tape in straight lines: text of a
        function of the same name and parameters, in the subset, with the same bits.
    equations : str
        Source and numbers of the equations.
    vectors : callable(rng, n), optional
        Returns about `n` inputs in chains, arrays (m, inputs): the state is reset before each. Inputs that
        reach every branch of the step. Default: normal deviates.
    kind : str
        What it is, for the manifest.
    role : Role
        What a run of `Exported.controller` needs beyond the C.
    notes : mapping
        Further entries of the manifest, as JSON has them.
    library_law : tuple, optional
        The same numbers, for steps of the library: with wider ones where `law` has narrow tables, one kernel
        serves all widths, as C computes with eight bytes anyway. Default: `law`.

    Raises
    ------
    ValueError
        For a name that is no identifier of C, or what is not as said above.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind.base.compiling.compiled import compiled
    >>> from sdpgrind.codegen import Recipe, Signal
    >>> @compiled(error_model="numpy")
    ... def low_pass(state, share, reading, out):
    ...     state[0] += share * (reading - state[0])
    ...     out[0] = state[0]
    ...     return 0
    >>> reading = Signal("N", "reading of the sensor, > 0 for pressure", -1e3, 1e3, spread=5.0)
    >>> recipe = Recipe("low_pass", low_pass, inputs={"reading": reading}, outputs={"force": "N"}, law=(0.1,))
    >>> recipe.state
    array([0.])
    """

    name: str
    step: Kernel
    inputs: Mapping[str, Any]
    outputs: Mapping[str, Any]
    law: tuple[Any, ...] = ()
    after: tuple[Any, ...] = ()
    state: Any = _STATE
    settings: Sequence[int] = ()
    program: StepProgram | None = None
    start: Kernel | None = None
    tables: Mapping[str, str] = field(default_factory=dict)
    period: float | None = None
    status: Sequence[str] = ("go on",)
    places: Mapping[str, int] = field(default_factory=dict)
    written_out: Mapping[Kernel, str] = field(default_factory=dict)
    equations: str = ""
    vectors: Callable[[np.random.Generator, int], Sequence[Floats]] | None = None
    kind: str = "step"
    role: Role = field(default_factory=Role)
    notes: Mapping[str, Any] = field(default_factory=dict)
    library_law: tuple[Any, ...] | None = None

    def __post_init__(self) -> None:
        c_name("name", self.name)
        finish = self.step if self.program is None else self.program.finish
        kernels = {"step": self.step, "start": self.start or self.step, "finish of the program": finish}
        for what, thing in kernels.items():
            checks.kind(what, thing, Kernel, ", decorated by sdpgrind.base.compiling.compiled.compiled")
        for thing in self.written_out:
            checks.kind("written_out", thing, Kernel, " as key")
        for what in ("inputs", "outputs"):
            object.__setattr__(self, what, _signals(what, getattr(self, what)))
        state = np.array(self.state, dtype=float)
        if state.ndim != 1 or not state.size:
            raise checks.refuse("state", "a row of numbers", state.shape)
        if self.start is not None and self.settings:
            raise checks.refuse("settings", "left out where a kernel starts the state", list(self.settings))
        object.__setattr__(self, "state", state)
        for name in ("law", "after"):
            object.__setattr__(self, name, tuple(_plain(one) for one in getattr(self, name)))
        if self.library_law is not None:
            object.__setattr__(self, "library_law", _plain(tuple(self.library_law)))
            if not _same_numbers(self.law, self.library_law):
                raise checks.refuse("library_law", "of the numbers of law", self.library_law)

    @property
    def taken(self) -> tuple[Any, ...]:
        """Constants of the step in the library, in the units of the step (mm, s, N ...)."""
        return self.law if self.library_law is None else self.library_law

    def entry(self) -> Callable[..., Any]:
        """Return the step compiled for the constants (mm, s, N ...) of the library; it guards no types."""
        row = [0.0] * len(self.inputs)
        out = np.zeros(len(self.outputs) if self.program is None else self.program.width)
        return self.step.entry(self.state, *self.taken, *row, *self.after, out)

    def take(self, state: Floats, row: Sequence[float], out: Floats) -> int:
        """Advance `state` by a row of inputs (mm, s, N ...), fill `out`; return the status."""
        if self.program is None or self.program.finish is None:
            return int(self.step(state, *self.taken, *row, *self.after, out))
        room = np.zeros(self.program.width)
        if self.step(state, *self.taken, *row, *self.after, room):
            self.program.solve(room)
        return int(self.program.finish(state, *self.taken, room, out))

    @property
    def finite(self) -> tuple[bool, ...]:
        """Whether each input, in its unit (mm, s, N ...), must be a finite number."""
        return tuple(not one.missing for one in self.inputs.values())

    @property
    def limits(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest value of each input, in its unit (mm, s, N ...)."""
        return tuple((float(one.low), float(one.high)) for one in self.inputs.values())

    def usable(self, rows: Floats) -> Bools:
        """Return for each of the `rows` of inputs (mm, s, N ...) whether the step runs on it, as in C."""
        low, high = np.array(self.limits).T
        # a NaN is neither below nor above: it is left to the step where it may be missing
        inside = ~((rows < low) | (rows > high)) & (np.isfinite(rows) | ~np.array(self.finite))
        found: Bools = inside.all(axis=1)
        return found

    @property
    def fingerprint(self) -> str:
        """Digest of constants, state and interface, 16 hexadecimal digits; mm and s count as text."""
        units = (units_of(one) for one in (self.inputs, self.outputs))
        face = (self.kind, *units, self.finite, self.limits, self.period)
        total = hashlib.sha256(repr(face).encode())
        program = () if self.program is None else self.program.constants
        for one in leaves((*self.law, *self.after, self.state, *program)):
            array = np.asarray(one)
            total.update(repr((array.dtype.str, array.shape)).encode() + array.tobytes())
        return total.hexdigest()[:_FINGERPRINT]

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` inputs in chains drawn by `rng`, arrays (m, inputs), in their units."""
        if self.vectors is None:
            return [rng.standard_normal((count, len(self.inputs)))]
        return [np.array(one, dtype=float).reshape(-1, len(self.inputs)) for one in self.vectors(rng, count)]


def units_of(signals: Mapping[str, Signal]) -> dict[str, str]:
    """Return the unit of each signal."""
    return {name: one.unit for name, one in signals.items()}


def _signals(what: str, given: Mapping[str, Any]) -> dict[str, Signal]:
    """Return inputs or outputs as signals; refuse names and ranges that are none."""
    if not given:
        raise checks.refuse(what, "one at least", dict(given))
    found = {}
    for name, one in given.items():
        place = f"{what}[{c_name('inputs, outputs', name)!r}]"
        signal = Signal(one) if isinstance(one, str) else checks.kind(place, one, Signal, " or a unit")
        if not signal.low <= signal.high:
            raise checks.refuse(place, "of low <= high", (signal.low, signal.high), signal.unit)
        found[name] = signal
    return found


def leaves(things: Any) -> list[Any]:
    """Return numbers and arrays of nested tuples, in their order."""
    if isinstance(things, tuple):
        return [leaf for one in things for leaf in leaves(one)]
    return [things]


def _same_numbers(first: Any, second: Any) -> bool:
    """Whether the numbers of nested tuples are equal, of whatever width they are."""
    ones, others = (list(map(np.asarray, leaves(one))) for one in (first, second))
    return len(ones) == len(others) and all(
        np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        for one, other in zip(ones, others, strict=True)
    )


def _plain(thing: Any) -> Any:
    """Return a constant as kernels take it: arrays of their own that can be written to."""
    if isinstance(thing, tuple):
        items = [_plain(one) for one in thing]
        return type(thing)(*items) if hasattr(thing, "_fields") else tuple(items)
    if isinstance(thing, np.generic):
        return thing.item()
    if isinstance(thing, bool | int | float):
        return thing
    return np.array(thing, order="C")


def shown(number: float) -> str:
    """Return a number in its shortest form that reads back as the same."""
    short = f"{number:g}"
    return short if float(short) == number else repr(float(number))
