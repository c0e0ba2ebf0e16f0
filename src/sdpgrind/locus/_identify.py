"""Fields of a problem's model from its measured responses, by nonlinear least squares."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks, serial
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.gauge import step_of
from sdpgrind.base.doubts.words import amount, in_one_unit
from sdpgrind.base.frozen import inside
from sdpgrind.base.lack_of_fit import Rest, rest
from sdpgrind.base.quantities import trusted, units_of
from sdpgrind.base.tables import command_in, table_of
from sdpgrind.locus._problem.problem import Problem

_TIER = "controller"
_RANK = 1e-6  # chosen: singular value over the greatest, of relative values; less moves no reading
_SHARE = 1e-3  # chosen: component along an undetermined direction that names a field; less is rounding
_SPARE = 3  # derived: readings beyond the values, for the variance and the correlation of the noise
_ROUNDS = 2  # measured: fits with the noise of the responses; a third moves no interval by 1 %
_MADE = "_laws"  # attribute of a problem that keeps its laws by the names of their fields
_EXACT = 1e-9  # chosen: least noise of a response over its size; less is rounding
_LATE = "leave out the rows in which it still follows a change"
_WRONG = "other values are wrong, too, or the law is another; problem.doubts(data) tries pairs of values"


def identify(
    data: Any,
    names: str | Sequence[str],
    *,
    problem: Problem,
    part: int | str | Sequence[int | str] | None = None,
    throw: bool = True,
) -> idf.Estimate:
    """Estimate fields of a problem's model, for `Problem.updated`, from what was measured of its responses.

    Least squares of every response that `data` hold and that depends on one of the fields, over the controls
    and hidden states on which it depends itself; several responses are weighted by the noise that each of
    them shows. The noise is of first order over time, and white where `data` have no time.

    A field is a number of the model or of its inner objects, such as the ``specific_energy`` of the power of
    `processes.Grinding`. A hidden state must be measured, too, or given as a column of its own: a wheel that
    dulls in proportion to the stock is ``table.assign(wear_flat_area=0.006 + 3e-4 * table.removed)``.

    Parameters
    ----------
    data : mapping of arrays, table of a log, or log
        Responses, controls and hidden states by name, in the units of the problem, with time (s) and part if
        there are any; or a log whose only table, or table "controller", holds them, or that table. Rows of a
        log without a reading are left out and counted. A control that was not measured is the command that
        led to the row. The laws are those of steady cuts: leave out approach, touch-in, and rows in which a
        gauge still follows a change.
    names : str or sequence of str
        Fields of the model; they begin at the model's values.
    problem : Problem
        Problem with a model.
    part : int, str or sequence of them, optional
        Numbers (unit 1) of the parts, or their words in the file. Default: all.
    throw : bool
        Raise when the readings do not determine the fields, no model can have them, or the responses do not
        follow the model with them; else the status says so.

    Returns
    -------
    Estimate
        Fields by name, in their units, with their covariance. A field is not determined, and named, where the
        readings move along it by less than 1e-6 of the most that they move, relative to the fields' values.
        The model does not fit where a smooth surface over controls and hidden states, or changes of the
        response (of a gauge that lags), take more from the residuals than noise gives them (F test, once in
        1000; of 40 rows of noise with a correlation of 0.9 once in 50), and the variance about the model
        exceeds that of the noise by a quarter; then the covariance does not hold.

    Raises
    ------
    ValueError, TypeError
        For missing or bad data, no response, an unknown field, too few readings or, with `throw`, a failed
        estimate.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> problem = locus.preset("grinding")
    >>> rate, area = np.meshgrid([0.01, 0.015, 0.02], [0.006, 0.007, 0.008, 0.009])
    >>> data = {"infeed_rate": rate.ravel(), "work_rotation": np.full(12, 10.0),
    ...         "wear_flat_area": area.ravel()}
    >>> sharper = problem.model.replace(specific_energy=12.0)
    >>> data["grinding_power"] = sharper.grinding_power(*data.values())
    >>> found = locus.identify(data, ("specific_energy", "pressure"), problem=problem)
    >>> found.value.round(6).tolist(), found.units  # 7.55 N/mm^2 is the model's pressure
    ([12.0, 7.55], ('J/mm^3', 'N/mm^2'))
    >>> problem.updated(found).model.power.specific_energy.__round__(6)
    12.0
    >>> locus.identify(data, ("width", "u0"), problem=problem, throw=False).message[-20:]
    '(not determined: u0)'
    """
    checks.kind("problem", problem, Problem, " (see locus.preset)")
    wanted = checks.unique("names", (names,) if isinstance(names, str) else tuple(names))
    if not wanted:
        raise checks.refuse("names", "at least one field of the model", wanted)
    begin, units = _fields(problem.model, wanted)
    fit = _ResponseFit(data, problem, wanted, begin, part)
    options: dict[str, Any] = {"scale": fit.scale, "jacobian": fit.slopes}
    options |= {"names": wanted, "units": units, "throw": False}
    first: dict[str, Any] = {"noise": "white"} if fit.time is None else {"time": fit.time}
    found = idf.output_error(fit.residual, begin, **first, **options)
    for _ in range(_ROUNDS if len(fit.read) > 1 else 0):
        fit.weigh(found.value)
        found = idf.output_error(fit.residual, found.value, noise="white", **options)
        found = found.replace(freedom=fit.freedom, noise_sd=0.0)  # of several units: not told
    found = _judged(found, fit, problem)
    if throw and not found.ok:
        raise ValueError(found.message)
    return found


def moved(problem: Problem, name: str) -> tuple[str, ...]:
    """Return the names of the responses that depend on a field of the model; private to this package."""
    return tuple(law.name for law in _laws(problem, (name,)) if law.moves)


def _fields(model: Any, names: Sequence[str]) -> tuple[Floats, tuple[str, ...]]:
    """Values and units of fields of a model."""
    if not dataclasses.is_dataclass(model) or not hasattr(model, "replace"):
        raise checks.refuse(
            "problem.model", "an object with fields to estimate, such as a locus.processes.Grinding", model
        )
    values, units = [], []
    for name in names:
        owner: Any = _owner(model, name)
        value = getattr(owner, name, None)
        model.replace(**{name: value})  # refuses an unknown name, and one of several objects
        if type(value) not in (float, int):
            raise checks.refuse("names", "numbers of the model", f"{name} = {checks.shown(value)}")
        values.append(value)
        units.append(units_of(type(owner)).get(name, ""))
    return np.array(values, dtype=float), tuple(units)


def _owner(thing: Any, name: str) -> Any:
    """The object, or the inner one, that has a field; None: none has."""
    if not dataclasses.is_dataclass(thing) or name in {field.name for field in dataclasses.fields(thing)}:
        return thing if dataclasses.is_dataclass(thing) else None
    found = (_owner(getattr(thing, inner, None), name) for inner in inside(thing))
    return next((owner for owner in found if owner is not None), None)


def _with_symbols(thing: Any, symbols: Mapping[str, Any]) -> Any:
    """Copy of an object, unchecked, with symbols as fields of its own or of its inner objects."""
    values = {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing) if field.init}
    for name, value in values.items():
        if name in symbols:
            values[name] = symbols[name]
        elif name in inside(thing) and dataclasses.is_dataclass(value):
            values[name] = _with_symbols(value, symbols)
    return trusted(type(thing), **values)


class _Law(NamedTuple):
    """A response: the controls and hidden states it depends on, and its value and slopes by the fields."""

    name: str
    inputs: tuple[str, ...]
    function: Any
    moves: bool  # whether it depends on one of the fields

    def at(self, values: Floats, read: idf.Readings) -> tuple[Floats, Floats]:
        """Return the response (n,) and its slopes (n, p) at each row."""
        columns = np.array([read[name] for name in self.inputs])
        response, slopes = (np.asarray(out) for out in self.function(values, columns))
        return response.ravel(), slopes.reshape(-1, values.size)


def _laws(problem: Problem, names: Sequence[str]) -> list[_Law]:
    """Return the laws of all responses, with symbols as fields; a problem keeps them."""
    made: dict[tuple[str, ...], list[_Law]] = problem.__dict__.setdefault(_MADE, {})
    if (key := tuple(names)) not in made:
        made[key] = _made(problem, key)
    return made[key]


def _made(problem: Problem, names: Sequence[str]) -> list[_Law]:
    """Laws of all responses, with symbols as fields."""
    fields = ca.SX.sym("fields", len(names))
    model = _with_symbols(problem.model, dict(zip(names, ca.vertsplit(fields), strict=True)))
    given = {name: ca.SX.sym(name) for name in (*problem.names, *problem.hidden_names)}
    states, controls = (
        SimpleNamespace(**{name: given[name] for name in group})
        for group in (problem.hidden_names, problem.names)
    )
    laws = []
    for one in model.constraints:
        response = ca.SX(one.response(states, controls))
        inputs = tuple(name for name, symbol in given.items() if ca.depends_on(response, symbol))
        slopes = ca.densify(ca.jacobian(response, fields))
        arguments = [fields, ca.vertcat(*(given[name] for name in inputs))]
        moves = bool(ca.depends_on(response, fields))
        laws.append(_Law(one.name, inputs, ca.Function("law", arguments, [response, slopes]), moves))
    return laws


class _Noise(NamedTuple):
    """Noise of a response: sd, correlation from step to step, steps before each reading, freedom."""

    sd: float
    rho: float
    apart: Floats
    freedom: float = np.inf


class _ResponseFit:
    """Readings of each measured response, with its law and its noise."""

    def __init__(self, data: Any, problem: Problem, names: Sequence[str], begin: Floats, part: Any) -> None:
        table, _ = table_of(data, _TIER)
        measured = [law for law in _laws(problem, names) if law.name in table]
        if not measured:
            known = ", ".join(checks.with_unit(name, problem.unit(name)) for name in problem.responses)
            held = ", ".join(map(str, table)) or "nothing"
            raise ValueError(f"data must hold a response, {known}; it holds {held}")
        measured = [law for law in measured if law.moves] or measured  # others tell nothing of the fields
        self.scale = np.where(begin == 0, 1.0, np.abs(begin))
        self.read = [(law, _read(data, law, problem, begin, part)) for law in measured]
        sizes = [_size(read[law.name]) if len(measured) > 1 else 1.0 for law, read in self.read]
        steps = (serial.gaps(read.arrays.get("time"), read.points) for _, read in self.read)
        self.noises = [_Noise(size, 0.0, apart) for size, apart in zip(sizes, steps, strict=True)]
        count = sum(read.points for _, read in self.read)
        if count < len(names) + _SPARE:
            raise checks.refuse("data", f"at least {len(names) + _SPARE} rows with a response", count)

    @property
    def time(self) -> Floats | None:
        """Time of each residual, s; None: not measured."""
        if any("time" not in read.arrays for _, read in self.read):
            return None
        return np.concatenate([read["time"] for _, read in self.read])

    def residual(self, values: Floats) -> Floats:
        """Readings minus responses, weighted and white as far as is known, shape (n,)."""
        return self._white(read[law.name] - law.at(values, read)[0] for law, read in self.read)

    def slopes(self, values: Floats) -> Floats:
        """Slopes of `residual` by the fields, shape (n, p)."""
        return self._white(-law.at(values, read)[1] for law, read in self.read)

    def _white(self, each: Iterable[Floats]) -> Floats:
        pairs = zip(each, self.noises, strict=True)
        return np.concatenate([serial.filtered(one.T, n.rho, n.apart).T / n.sd for one, n in pairs])

    def weigh(self, values: Floats) -> None:
        """Take the noise of each response from its residuals at these values."""
        self.noises = [
            _noise(read, law, values, noise.apart)
            for (law, read), noise in zip(self.read, self.noises, strict=True)
        ]

    def rests(self, values: Floats) -> Iterable[tuple[str, Rest | None]]:
        """Yield the name of each response, and its rest at these values."""
        for (law, read), noise in zip(self.read, self.noises, strict=True):
            response, slopes = law.at(values, read)
            inputs = np.array([read[name] for name in law.inputs])
            least = max(step_of(read[law.name]) / np.sqrt(12), _EXACT * _size(read[law.name]))
            ordered = response if "time" in read.arrays else None
            left = rest(read[law.name] - response, slopes, inputs, noise.apart, least, ordered)
            yield law.name, left

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the response that has fewest."""
        return min(noise.freedom for noise in self.noises)


def _noise(read: idf.Readings, law: _Law, values: Floats, apart: Floats) -> _Noise:
    response, slopes = law.at(values, read)
    off, fitted = read[law.name] - response, int(np.sum(np.any(slopes != 0, axis=0)))
    ordered = "time" in read.arrays and off.size >= fitted + _SPARE
    rho = serial.correlation(off, fitted, apart) if ordered else 0.0
    white = serial.filtered(off, rho, apart)
    sd = float(np.sqrt(white @ white / max(white.size - fitted, 1)))
    least = _EXACT * _size(read[law.name])
    return _Noise(max(sd, least), rho, apart, serial.effective(off.size, fitted, rho))


def _size(values: Floats) -> float:
    """Root mean square, 1 of zeros."""
    return float(np.sqrt(np.mean(values**2))) or 1.0


def _read(data: Any, law: _Law, problem: Problem, begin: Floats, part: Any) -> idf.Readings:
    """Readings of a response and what it depends on, where the law has a value."""
    table, _ = table_of(data, _TIER)
    for name in law.inputs:
        if command_in(table, name) not in table:
            hidden = name in problem.hidden_names
            told = ", a hidden state: measured, or given as a column of its own" if hidden else ""
            raise ValueError(
                f"data must hold {checks.with_unit(name, problem.unit(name))}, on which {law.name} depends"
                f"{told}; it holds {', '.join(map(str, table))}"
            )
    units = {name: problem.unit(name) for name in (law.name, *law.inputs)}
    units |= {"time": "s"} if "time" in table else {}
    read = idf.readings(data, units, tier=_TIER, part=part)
    response, slopes = law.at(begin, read)
    return read.only(np.isfinite(response) & np.all(np.isfinite(slopes), axis=1))


def _judged(found: idf.Estimate, fit: _ResponseFit, problem: Problem) -> idf.Estimate:
    """The estimate with what it comes from; failed where a field is not determined, or no model has it."""
    if loose := _loose(fit.slopes(found.value) * fit.scale):
        named = ", ".join(name for name, free in zip(found.names, loose, strict=True) if free)
        endless = np.diag(np.full(len(found.names), np.inf))
        message = f"{idf.Status.UNDETERMINED} (not determined: {named})"
        return found.replace(covariance=endless, status=idf.Status.UNDETERMINED, message=message)
    told = "; ".join(f"{law.name} {read.message}" for law, read in fit.read)
    found = found.replace(message=told if found.ok else f"{found.message} ({told})")
    failed = _failed(found, fit, problem) if found.ok else None
    if failed is None:
        return found
    status, why = failed
    why = f": {why} ({told})" if status is idf.Status.MISFIT else f" ({why})"
    return found.replace(status=status, message=f"{status}{why}")


def _failed(found: idf.Estimate, fit: _ResponseFit, problem: Problem) -> tuple[idf.Status, str] | None:
    """Status and reason of a fit that is no estimate; None: it is one."""
    if wrong := _misfit(found.value, fit, problem):
        return idf.Status.MISFIT, wrong
    try:
        problem.updated(found)
    except ValueError as error:
        noise = _by_noise(found, problem)
        return (idf.Status.UNDETERMINED, noise) if noise else (idf.Status.IMPOSSIBLE, str(error))
    return None


def _by_noise(found: idf.Estimate, problem: Problem) -> str:
    """Words on fields beyond their ranges, which an end of each interval is not; empty: one is."""
    told = []
    for name, unit, value, ends in zip(found.names, found.units, found.value, found.interval(), strict=True):
        can_be = [_possible(problem, name, float(each)) for each in (value, *ends)]
        if not any(can_be):
            return ""
        if not can_be[0]:
            at, *span = (amount(float(each), unit) for each in (value, *ends))
            told.append(f"{name} = {at}, {' to '.join(span)} at 95 %: noise takes it beyond its range")
    return "; ".join(told)


def _possible(problem: Problem, name: str, value: float) -> bool:
    """Whether the model can have a value of a field."""
    try:
        problem.model.replace(**{name: value})
    except ValueError:
        return False
    return True


def _misfit(values: Floats, fit: _ResponseFit, problem: Problem) -> str:
    """What the fields leave of the responses beyond their noise; empty: nothing."""
    told, advice = [], _WRONG
    for name, left in fit.rests(values):
        if left is not None and not left.fits:
            about, noise = in_one_unit((left.sd, left.noise_sd), problem.unit(name))
            late = ", but it follows changes late, as after a filter" * left.late
            advice = _LATE if left.late else advice
            told.append(f"{name} leaves an sd of {about} about the model, and its noise is {noise}{late}")
    return f"{'; '.join(told)}: {advice}" if told else ""


def _loose(slopes: Floats) -> list[bool]:
    """Whether each field lies along a direction that does not move the responses; empty: none does."""
    _, s, vt = np.linalg.svd(slopes, full_matrices=False)
    free = vt[s <= _RANK * s[0]] if s[0] > 0 else vt
    return np.any(np.abs(free) > _SHARE, axis=0).tolist() if free.size else []
