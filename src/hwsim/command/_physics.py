"""Laws of grinding in a TOML file: power with its sliding law, and what burns; for every area that grinds."""

from collections.abc import Callable, Mapping

from hwsim.command._toml import Table
from sdpgrind import physics

_POWER = {"specific_energy": "J/mm^3", "ploughing_force": "N/mm"}
_SLIDING: Mapping[str, tuple[Callable[..., physics.SlidingLaw], Mapping[str, str]]] = {
    "dong": (physics.DongSliding, {"coefficient": "N/mm^2.7", "exponent": ""}),
    "malkin": (physics.MalkinSliding, {"pressure": "N/mm^2", "curvature_pressure": "N/mm"}),
}


def power(table: Table) -> physics.GrindingPower:
    """Power of chips, ploughing and sliding."""
    make, units = _SLIDING[table.text("sliding", _SLIDING)]
    law = table.made(make, **table.given(units))
    found = table.made(physics.GrindingPower, sliding=law, **table.given(_POWER))
    table.done()
    return found


def burning(table: Table) -> physics.BurningLimit:
    """Power that the work stands."""
    limit = table.made(physics.BurningLimit, table.number("u0", "J/mm^3"), table.number("B", "J/(mm^2 s^(1/2))"))
    table.done()
    return limit


def flag(table: Table, key: str) -> bool:
    """True or false."""
    return table.flag(key)
