"""Axes that carry the work in a finishing job: tables [robot.turntable] and [robot.rail]."""

from typing import Any

from hwsim.command._toml import Table
from sdpgrind import finishing
from sdpgrind.base.quantities import specs, units_of

KINDS = {"turntable": finishing.arm.Turntable, "rail": finishing.arm.LinearTable}
_CANDIDATES = {"angles": "rad", "positions": "mm"}  # source: their classes
_VECTORS = ("origin", "axis", "direction", "travel")  # source: likewise, lists of numbers


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
    made, units = KINDS[kind], units_of(KINDS[kind])
    name = table.take("name") if table.has("name") else kind
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"{table.path('name')} must be a name, as of a joint; got {name!r}")
    fields = specs(made)
    values: dict[str, Any] = {
        key: tuple(table.list_of(key, units.get(key, "")))
        for key in _VECTORS
        if key in fields and table.has(key)
    }
    for key in _CANDIDATES.keys() & fields.keys():
        if table.has(key):
            whole = isinstance(table.entries[key], int)
            values[key] = table.take(key) if whole else tuple(table.list_of(key, _CANDIDATES[key]))
    for key in ("origin", "direction", "travel"):
        if key in fields:
            table.take(key)  # missing: refused with its name
    values |= table.values(made)
    table.done()
    return name, table.made(made, **values)
