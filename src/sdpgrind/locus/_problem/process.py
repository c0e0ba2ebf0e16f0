"""Parts of a problem: functions of hidden states and controls, varying constraints, built-in processes."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, Protocol, TypeAlias

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described

Function: TypeAlias = Callable[[Any, Any], Any]
"""Function ``f(s, c)`` of hidden states and controls, both with named attributes."""
Ranges: TypeAlias = Mapping[str, tuple[float, float]]


def check_function(name: str, value: Any) -> Any:
    """Return a callable, or raise TypeError."""
    if not callable(value):
        raise TypeError(
            f"{name} must be a function f(s, c) of hidden states and controls; got {checks.shown(value)}"
        )
    return value


def check_name(owner: str, value: Any) -> str:
    """Return an identifier, or raise ValueError."""
    if not isinstance(value, str) or not value.isidentifier():
        raise ValueError(f"{owner} must be named by identifiers; got {checks.shown(value)}")
    return value


def _function_of_varying(name: str, value: Any) -> Any:
    return check_function(f"Varying.{name}", value)


@described()
class Varying(Described):
    """A constraint that varies with a hidden state: response <= limit, Koren (19).

    Parameters
    ----------
    response : callable
        P_c(s, c): measured response as a function of hidden states ``s`` and controls ``c``.
    limit : callable
        P_b(s, c): computed limit, in the same unit.
    name : str
        Name of the response.
    unit : str
        Unit of response and limit.

    Raises
    ------
    TypeError
        When a function is not callable.

    Examples
    --------
    >>> Varying(response=lambda s, c: s.x * c.v, limit=lambda s, c: 17 + c.u).name
    'response'
    """

    _: KW_ONLY
    response: Function = custom(_function_of_varying)
    limit: Function = custom(_function_of_varying)
    name: str = custom(check_name, default="response")
    unit: str = custom(default="")


class Process(Protocol):
    """A built-in process: cost, constraints and units. An optional method `check` validates the ranges.

    Attributes
    ----------
    constraints : tuple of Varying
        All constraints.
    units : mapping
        Name of each control, each hidden state and ``"cost"`` to its unit.
    """

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """Constraints, with their units."""

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each control, each hidden state and ``"cost"``."""

    def cost(self, s: Any, c: Any) -> Any:
        """Return the cost for hidden states ``s`` and controls ``c`` (units: see `units`)."""
