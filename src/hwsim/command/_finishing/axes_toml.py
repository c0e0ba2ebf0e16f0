"""Axes that carry the work in a finishing job: tables [robot.turntable] and [robot.rail]."""

from typing import Any

from hwsim.command._toml import Table
from sdpgrind import finishing
from sdpgrind.base.quantities import Spec, specs

KINDS = {"turntable": finishing.arm.Turntable, "rail": finishing.arm.LinearTable}
_CANDIDATES = {"angles": "rad", "positions": "mm"}  # source: their classes, which take numbers or their count


def axes_of(table: Table) -> dict[str, Any]:
    """Return the axes in the table of a robot by name, as the file has them: the first stands in the base."""
    given = [key for key in KINDS if table.has(key)]
    every = [_axis(table.table(key), key) for key in sorted(given, key=list(table.entries).index)]
    axes = dict(every)
    if len(axes) < len(every):
        raise ValueError(f"names in [{table.name}] must differ; got {', '.join(name for name, _ in every)}")
    return axes


def _axis(table: Table, kind: str) -> tuple[str, Any]:
    """An axis with its name, that of its table unless another is given."""
    made, name = KINDS[kind], _name(table, kind)
    listed = {key: spec.unit for key, spec in specs(made).items() if _is_listed(table, key, spec)}
    values = {key: _numbers(table, key, unit) for key, unit in listed.items()} | table.values(made)
    table.done()
    return name, table.made(made, **values)


def _name(table: Table, usual: str) -> str:
    name = table.take("name") if table.has("name") else usual
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"{table.path('name')} must be a name, as of a joint; got {name!r}")
    return name


def _is_listed(table: Table, key: str, spec: Spec) -> bool:
    """Whether a field is a list of numbers that the table has, or has to have."""
    return spec.kind == "custom" and (spec.required or table.has(key))


def _numbers(table: Table, key: str, unit: str) -> int | tuple[float, ...]:
    """Numbers of a list; of candidates their count may stand instead."""
    if key in _CANDIDATES and isinstance(table.take(key), int):
        return int(table.take(key))
    return tuple(table.list_of(key, _CANDIDATES.get(key, unit)))
