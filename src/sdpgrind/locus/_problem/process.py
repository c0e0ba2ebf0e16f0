"""What a problem is made of: functions of hidden states and controls, varying constraints, built-in processes."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, Protocol, TypeAlias

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, custom, described

Function: TypeAlias = Callable[[Any, Any], Any]
"""Of hidden states and controls, both by name: ``f(s, c)``."""
Ranges: TypeAlias = Mapping[str, tuple[float, float]]


def check_function(name: str, value: Any) -> Any:
    """Return a function f(s, c)."""
    if not callable(value):
        raise TypeError(
            f"{name} must be a function f(s, c) of hidden states and controls; got {checks.shown(value)}"
        )
    return value


def check_name(owner: str, value: Any) -> str:
    """Return a name that can stand in code."""
    if not isinstance(value, str) or not value.isidentifier():
        raise ValueError(f"{owner} must be named by identifiers; got {checks.shown(value)}")
    return value


def _function_of_varying(name: str, value: Any) -> Any:
    return check_function(f"Varying.{name}", value)


@described()
class Varying(Described):
    """A constraint that varies with a hidden state: what is measured must stay under what can be computed, Koren (19).

    Parameters
    ----------
    response : callable
        P_c(s, c): what a sensor would read, of the hidden states ``s`` and the controls ``c``.
    limit : callable
        P_b(s, c): what it must stay under, in the same unit.
    name : str
        Of the measurement; a controller is given it by this name.
    unit : str
        Of both.

    Raises
    ------
    TypeError
        When a function is none.

    Examples
    --------
    >>> Varying(response=lambda s, c: s.x * c.v + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v).name
    'response'
    """

    _: KW_ONLY
    response: Function = custom(_function_of_varying)
    limit: Function = custom(_function_of_varying)
    name: str = custom(check_name, default="response")
    unit: str = custom(default="")


class Process(Protocol):
    """A built-in process: what it costs, what limits it, and in which units; it may `check` the ranges too.

    Attributes
    ----------
    constraints : tuple of Varying
        All of them.
    units : mapping
        Name of each control and hidden state, and ``"cost"``, to its unit.
    """

    @property
    def constraints(self) -> tuple[Varying, ...]:
        """All varying constraints, with their units."""

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each control and hidden state, and of the cost."""

    def cost(self, s: Any, c: Any) -> Any:
        """Return what is minimised, of hidden states ``s`` and controls ``c`` (units: see `units`)."""
