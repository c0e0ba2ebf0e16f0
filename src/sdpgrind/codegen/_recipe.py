"""What is exported of a thing: its step as a kernel, the constants, the state, inputs and outputs."""

import hashlib
import keyword
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import Kernel
from sdpgrind.codegen._translate.body import RESERVED

_FINGERPRINT = 16  # chosen: hexadecimal digits
_STATE = (0.0,)  # chosen: an unused entry, since C has no empty structure


@dataclass(frozen=True, eq=False)
class Recipe:
    """Step of a controller, or a look-up, as a kernel with all that it needs.

    ``step(state, *law, *inputs, out)`` updates `state` (an array), fills `out` (one entry an output) and
    returns a whole number: the place in `status`, or < 0: an input is out of range. It is decorated by
    `compiled(error_model="numpy")`, as all kernels that it calls. Whether the state may be changed by a step
    that returns < 0 does not matter: it is put back.

    Parameters
    ----------
    name : str
        Name of the thing, for files and functions.
    step : Kernel
        The step.
    inputs, outputs : mapping of str to str
        Name to unit, in the order of the arguments and of `out`.
    law : tuple
        Constants: numbers, arrays, NamedTuples of these.
    state : array
        State after a reset; without one an unused entry.
    start : Kernel, optional
        ``start(state, *law)``, which resets the state. Default: `state` is copied.
    missing : sequence of str
        Inputs that may be NaN or infinite: the step decides. At others the status is then -1.
    period : float, optional
        Time between two steps, s.
    status : sequence of str
        Names of the results from 0 on.
    places : mapping of str to int
        Named entries of the state.
    equations : str
        Source and numbers of the equations.
    vectors : callable(rng, n), optional
        Returns about `n` inputs in chains, arrays (m, inputs): the state is reset before each. Inputs that
        reach every branch of the step. Default: normal deviates.
    spread : sequence of float, optional
        Half-width by which the self-test varies each input of `vectors`, in its unit. Default: 1.
    kind : str
        What it is, for the manifest.
    answer : callable(status, outputs), optional
        Makes the command that `Exported.controller` returns of status and outputs. Default: the outputs.
    commands : mapping of str to str, optional
        Name of each command to its unit. Default: the outputs.
    job, description : mapping
        As the thing's own, for `Exported.controller`.

    Raises
    ------
    ValueError
        For a name that is no identifier of C, or what is not as said above.

    Examples
    --------
    >>> import numpy as np
    >>> from sdpgrind.base.compiling.compiled import compiled
    >>> from sdpgrind.codegen import Recipe
    >>> @compiled(error_model="numpy")
    ... def low_pass(state, share, reading, out):
    ...     state[0] += share * (reading - state[0])
    ...     out[0] = state[0]
    ...     return 0
    >>> recipe = Recipe("low_pass", low_pass, inputs={"reading": "N"}, outputs={"force": "N"}, law=(0.1,))
    >>> recipe.state
    array([0.])
    """

    name: str
    step: Kernel
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]
    law: tuple[Any, ...] = ()
    state: Any = _STATE
    start: Kernel | None = None
    missing: Sequence[str] = ()
    period: float | None = None
    status: Sequence[str] = ("go on",)
    places: Mapping[str, int] = field(default_factory=dict)
    equations: str = ""
    vectors: Callable[[np.random.Generator, int], Sequence[Floats]] | None = None
    spread: Sequence[float] | None = None
    kind: str = "step"
    answer: Callable[[int, dict[str, float]], dict[str, Any]] | None = None
    commands: Mapping[str, str] | None = None
    job: Mapping[str, object] = field(default_factory=dict)
    description: Mapping[str, float | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        c_name("name", self.name)
        for thing in (self.step, self.start):
            if thing is not None:
                checks.kind("step", thing, Kernel, ", decorated by sdpgrind.base.compiling.compiled.compiled")
        for name in [*self.inputs, *self.outputs]:
            c_name("inputs, outputs", name)
        for what, names in (("inputs", self.inputs), ("outputs", self.outputs)):
            if not names:
                raise checks.refuse(what, "one at least", dict(names))
        if strange := set(self.missing) - set(self.inputs):
            raise checks.refuse("missing", "names of inputs", sorted(strange))
        state = np.array(self.state, dtype=float)
        if state.ndim != 1 or not state.size:
            raise checks.refuse("state", "a row of numbers", state.shape)
        object.__setattr__(self, "state", state)
        object.__setattr__(self, "law", tuple(_plain(one) for one in self.law))

    @property
    def finite(self) -> tuple[bool, ...]:
        """Whether each input, in its unit (mm, s, N ...), must be a finite number."""
        return tuple(name not in self.missing for name in self.inputs)

    @property
    def fingerprint(self) -> str:
        """Digest of constants, state and interface, 16 hexadecimal digits; mm and s count as text."""
        total = hashlib.sha256(repr((self.kind, dict(self.inputs), dict(self.outputs), self.period)).encode())
        for one in leaves((*self.law, self.state)):
            array = np.asarray(one)
            total.update(repr((array.dtype.str, array.shape)).encode() + array.tobytes())
        return total.hexdigest()[:_FINGERPRINT]

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` inputs in chains drawn by `rng`, arrays (m, inputs), in their units."""
        if self.vectors is None:
            return [rng.standard_normal((count, len(self.inputs)))]
        return [np.array(one, dtype=float).reshape(-1, len(self.inputs)) for one in self.vectors(rng, count)]


def leaves(things: Any) -> list[Any]:
    """Return numbers and arrays of nested tuples, in their order."""
    if isinstance(things, tuple):
        return [leaf for one in things for leaf in leaves(one)]
    return [things]


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


def c_name(argument: str, name: str) -> str:
    """Return a name that C allows; refuse others."""
    plain = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)
    if not plain or name in RESERVED or keyword.iskeyword(name):
        raise checks.refuse(argument, "an identifier of C and Python and no keyword", name)
    return name
