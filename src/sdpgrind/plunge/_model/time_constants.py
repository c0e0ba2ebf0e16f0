"""Time constant of the deflection of a model, and that which a problem assumes."""

from typing import Any, Protocol, Self, TypeVar

from sdpgrind.plunge._model.model import PlungeModel


class Lagging(Protocol):
    """A plunge problem: model, rates (mm/s) between which the secant lies, and the time constant (s)."""

    @property
    def model(self) -> PlungeModel:
        """Wheel, work and machine."""

    @property
    def command_rate_max(self) -> float:
        """Greatest command, mm/s."""

    @property
    def time_constant(self) -> float | None:
        """Time constant that is assumed, s."""

    @property
    def final_rate(self) -> float:
        """Infeed rate at the end, mm/s."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values; in their own units."""


_Problem = TypeVar("_Problem", bound=Lagging)
_SAME = 1e-3  # chosen: share below which a value is that of the deflection, written with four digits


def secant(model: PlungeModel, low: float, command_rate_max: float) -> float:
    """Slope of the deflection (s) from a final rate to the burn rate or the greatest command, mm/s."""
    high = min(model.burn_rate, command_rate_max)
    if high <= low * (1 + 1e-9):
        return float(model.local_time_constant(low))
    return float((model.deflection(high) - model.deflection(low)) / (high - low))


def of_deflection(problem: Lagging) -> float:
    """Time constant of the deflection (s), on which plans rest, whatever the problem assumes."""
    return secant(problem.model, problem.final_rate, problem.command_rate_max)


def contradiction(problem: Lagging) -> str:
    """Sentence where the time constant of a problem is not that of its deflection; else empty."""
    given, own = float(problem.time_constant or 0.0), of_deflection(problem)
    if abs(given - own) <= _SAME * own:
        return ""
    if problem.model.linear_time_constant is not None:
        instead = f"linear_time_constant = {given:.4g}"
    else:
        instead = f"stiffness = {problem.model.stiffness * own / given:.4g} (N/mm)"
    return (
        f"a time_constant of {given:g} s changes no plan: plans rest on the deflection, of {own:.4g} s, and"
        f" only a controller with sparkout='printed' takes another; {instead} gives the deflection another,"
        " as problem.updated(plunge.identify(log, 'time_constant')) does"
    )


def with_time_constant(problem: _Problem, value: float) -> _Problem:
    """Return a problem whose machine and controller have a time constant, s."""
    if problem.model.linear_time_constant is not None:
        return problem.replace(linear_time_constant=value, time_constant=value)
    stiffness = problem.model.stiffness * of_deflection(problem) / value
    return problem.replace(stiffness=stiffness, time_constant=value)
