"""The optimization problem with hidden states: controls, hidden states, cost, varying constraints."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property, lru_cache
from typing import Any, Self

import casadi as ca

from sdpgrind.base import checks, stored
from sdpgrind.base.doubts.record import Doubts, asked
from sdpgrind.base.quantities import Described, custom, described
from sdpgrind.identify import Estimate
from sdpgrind.locus._problem.process import Function, Ranges, Varying, check_function, check_name
from sdpgrind.locus._problem.system import System, system_of

BEYOND = 0.05  # chosen: share of its range; a measured control may overshoot by it, more is another machine


def _ranges(owner: str, given: Any) -> dict[str, tuple[float, float]]:
    if not isinstance(given, Mapping) or not given:
        raise TypeError(
            f"{owner} must be a mapping of names to (least, greatest), with one name at least;"
            f" got {checks.shown(given)}"
        )
    found = {}
    for name, ends in given.items():
        check_name(owner, name)
        try:
            low, high = ends
        except (TypeError, ValueError):
            raise TypeError(
                f"{owner}[{name!r}] must be (least, greatest); got {checks.shown(ends)}"
            ) from None
        low, high = checks.number(f"{owner}[{name!r}][0]", low), checks.number(f"{owner}[{name!r}][1]", high)
        if not low < high:
            raise checks.refuse(f"{owner}[{name!r}]", "(least, greatest) with least < greatest", (low, high))
        found[name] = (low, high)
    return found


def _constraints(name: str, given: Any) -> tuple[Varying, ...]:
    if isinstance(given, Varying):
        return (given,)
    return tuple(
        checks.kind(f"{name}[{k}]", one, Varying, " (see locus.Varying)") for k, one in enumerate(given)
    )


@described("locus.problem")
class Problem(Described):
    """Minimise a cost under constraints that drift with hidden states.

    For every hidden state: minimise ``cost(s, c)`` over the controls in their ranges, with response <= limit
    for every constraint. Functions use operators, ``**`` and functions of numpy or CasADi that take symbols.

    Parameters
    ----------
    model : process, optional
        A built-in process with cost, constraints and units; see `preset`.
    controls : mapping
        Name of each control to (least, greatest), in the user's units.
    hidden : mapping
        Name of each hidden state to (least, greatest).
    cost : callable, optional
        phi(s, c), Koren (2), (14); it may depend on the hidden states. Maximise: with its sign changed.
    constraints : sequence of Varying
        Constraints, Koren (16), (19).
    units : mapping, optional
        Unit of each control, hidden state and of ``"cost"``, for labels.

    Raises
    ------
    ValueError
        When a range is empty or reversed, a name is no identifier or not unique, or the cost is missing.
    TypeError
        When a value is of another type.

    Examples
    --------
    >>> problem = Problem(
    ...     controls={"u": (0.0, 5.0), "v": (0.0, 10.0)},
    ...     hidden={"x": (0.2, 20.0)},
    ...     cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
    ...     constraints=[Varying(response=lambda s, c: s.x * c.v, limit=lambda s, c: 1 + c.u)],
    ... )
    >>> problem.names, problem.hidden_names
    (('u', 'v'), ('x',))
    """

    _: KW_ONLY
    model: Any = custom(default=None)
    controls: Ranges = custom(_ranges)
    hidden: Ranges = custom(_ranges)
    cost: Function | None = custom(default=None)
    constraints: Sequence[Varying] = custom(_constraints, default=())
    units: Mapping[str, str] = custom(default_factory=dict)

    def _check(self) -> None:
        if self.model is None:
            check_function("cost", self.cost)
        elif self.cost is not None or self.constraints:
            raise ValueError(
                "cost and constraints must be left out where a model is given, which brings them; got both"
            )
        elif hasattr(self.model, "check"):
            self.model.check(self.controls, self.hidden)
        checks.unique(
            "names of controls, hidden states and constraints",
            [*self.controls, *self.hidden, *self.responses],
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controls."""
        return tuple(self.controls)

    @property
    def hidden_names(self) -> tuple[str, ...]:
        """Names of the hidden states."""
        return tuple(self.hidden)

    @cached_property
    def varying(self) -> tuple[Varying, ...]:
        """Constraints of the model or the user, with their units."""
        return tuple(self.constraints) if self.model is None else tuple(self.model.constraints)

    @property
    def objective(self) -> Function:
        """Cost of the model or the user (any unit)."""
        cost: Function | None = self.cost if self.model is None else self.model.cost
        assert cost is not None  # checked by _check
        return cost

    def control(self, name: str, value: float) -> float:
        """Return a measured control (in its unit) at most `BEYOND` its range; private to this package."""
        low, high = self.controls[name]
        room = BEYOND * (high - low)
        least = max(low - room, 0.0) if low > 0 else low - room
        return checks.within(name, value, least, high + room, self.unit(name))

    def unit(self, name: str) -> str:
        """Return the unit of a control, hidden state, response or ``"cost"`` by name; empty: unknown."""
        units = {one.name: one.unit for one in self.varying}
        if self.model is not None:
            units.update(self.model.units)
        units.update(self.units)
        return units.get(name, "")

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the measured responses; their units: `unit`."""
        return tuple(one.name for one in self.varying)

    @property
    def system(self) -> System:
        """Expressions with exact derivatives, made once; private to this package."""
        return system_of(self)

    def updated(self, estimate: Estimate) -> Self:
        """Return the problem with estimated fields of its model.

        Parameters
        ----------
        estimate : Estimate
            Fields of the model, or of its inner objects, by name, in their units; see `locus.identify`.

        Raises
        ------
        ValueError
            When the estimate failed or names other fields, or the problem has no model.
        """
        checks.kind("estimate", estimate, Estimate, " (see sdpgrind.identify)")
        if self.model is None:
            raise ValueError(
                "estimate must be of fields of a model, and this problem has none: give it other functions"
            )
        if not estimate.ok:
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        return self.replace(model=self.model.replace(**{name: estimate[name] for name in estimate.names}))

    def doubts(self, data: Any) -> Doubts:
        """Return what measured responses say about the model of this problem, and what they do not.

        Each number of the model with its interval, all others as believed; the least cost at the middle of
        the hidden states, planned again at both ends of each interval. Where the responses do not follow the
        model with one number changed, the numbers that explain them best are fitted along: one, or a pair.

        Parameters
        ----------
        data : mapping of arrays, log, or table of a log
            As for `locus.identify`: responses, controls and hidden states by name, in their units.

        Returns
        -------
        Doubts
            Rows, sentences and stakes; ``print`` shows the page.

        Raises
        ------
        ValueError, TypeError
            For missing or bad data, or a problem without a model.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import locus
        >>> problem, rng = locus.preset("grinding"), np.random.default_rng(0)
        >>> rate, area = np.meshgrid([0.01, 0.015, 0.02], [0.006, 0.007, 0.008, 0.009])
        >>> data = {"infeed_rate": rate.ravel(), "work_rotation": np.full(12, 10.0),
        ...         "wear_flat_area": area.ravel()}
        >>> power = problem.model.replace(specific_energy=12.0).grinding_power(*data.values())
        >>> found = problem.doubts(data | {"grinding_power": power + rng.normal(0.0, 1.0, 12)})
        >>> found["specific_energy"].verdict, round(found["specific_energy"].told, 1)
        ('differs', 12.0)
        """
        if self.model is None:
            raise ValueError(
                "doubts need a problem with a model, whose fields are compared; this one has none"
            )
        return asked("sdpgrind.locus._doubts.doubts:doubts", self, data)

    def __deepcopy__(self, memo: object) -> Self:
        return self  # immutable

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as text: CasADi expressions cannot be pickled."""
        return read_problem, (written(self),)


@dataclass(frozen=True)
class Expression:
    """One function of a stored problem: the k-th output of a CasADi function."""

    text: str = field(repr=False)
    k: int
    names: tuple[str, ...]
    hidden: tuple[str, ...]

    def __call__(self, s: Any, c: Any) -> Any:
        """Return its value for hidden states and controls by name."""
        given = [[getattr(c, name) for name in self.names], [getattr(s, name) for name in self.hidden]]
        return _function(self.text)(*(ca.vertcat(*values) for values in given))[self.k]


@lru_cache
def _function(text: str) -> Any:
    return ca.Function.deserialize(text)


def written(problem: Problem) -> str:
    """Return the problem as text."""
    if problem.model is not None:
        return stored.encode(problem)
    ranges = {
        "controls": dict(problem.controls),
        "hidden": dict(problem.hidden),
        "units": dict(problem.units),
    }
    named = [[one.name, one.unit] for one in problem.varying]
    return json.dumps({"function": system_of(problem).function.serialize(), "constraints": named, **ranges})


def read_problem(text: str) -> Problem:
    """Return the problem from the text of `written`."""
    known = json.loads(text)
    if "function" not in known:
        problem: Problem = stored.decode(text)
        return problem
    ranges = {key: {name: tuple(ends) for name, ends in known[key].items()} for key in ("controls", "hidden")}
    names, m = (tuple(ranges["controls"]), tuple(ranges["hidden"])), len(known["constraints"])
    cost, *rest = (Expression(known["function"], k, *names) for k in range(1 + 2 * m))
    constraints = [
        Varying(response=rest[j], limit=rest[m + j], name=name, unit=unit)
        for j, (name, unit) in enumerate(known["constraints"])
    ]
    return Problem(**ranges, cost=cost, constraints=constraints, units=known["units"])
