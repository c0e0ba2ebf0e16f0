"""Laws of grinding in a TOML file: power with its sliding law, and what burns; for every area that grinds."""

from hwsim.command._toml import Table
from sdpgrind import physics


def power(table: Table) -> physics.GrindingPower:
    """Power of chips, ploughing and sliding."""
    return table.one(physics.GrindingPower)


def burning(table: Table) -> physics.BurningLimit:
    """Limit of the power, above which the work burns."""
    return table.one(physics.BurningLimit)


def flag(table: Table, key: str) -> bool:
    """True or false."""
    return table.flag(key)
