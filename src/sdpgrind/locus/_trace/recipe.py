"""Recipe of the table of a locus: its look-up, and keys that reach every interval."""

from collections.abc import Mapping

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe, Signal
from sdpgrind.locus._trace.table_kernels import exported_look_up

_BEYOND = 0.1  # chosen: share of the range by which keys lie outside


def recipe_of(packed: Floats, key: Floats, width: int, units: Mapping[str, str]) -> Recipe:
    """Return the recipe of a table; names and units of key and columns where they are known."""
    named = list(units.items()) or [("key", ""), *((f"column_{k}", "") for k in range(width))]
    (name, unit), *columns = named
    nodes, span = np.sort(key), float(np.ptp(key))

    def keys(rng: np.random.Generator, count: int) -> list[Floats]:
        """Return keys at nodes, on both sides of them, between and outside."""
        near = np.concatenate([nodes, np.nextafter(nodes, np.inf), np.nextafter(nodes, -np.inf)])
        near = near if near.size <= count else rng.choice(near, count, replace=False)
        ends = np.concatenate([nodes[[0, -1]], nodes[[0, -1]] + np.array([-1.0, 1.0]) * _BEYOND * span])
        inside = rng.uniform(nodes[0] - _BEYOND * span, nodes[-1] + _BEYOND * span, count)
        return [np.concatenate([ends, near, inside])]

    return Recipe(
        "locus_table",
        exported_look_up,
        {name: Signal(unit, "key of the table; a NaN is refused (-1)", spread=0.5 * span)},
        dict(_column(one, unit, name) for one, unit in columns),
        law=(packed,),
        tables={"packed": "head, keys, values and slopes node by node, guide of whole numbers by their bits"},
        status=("inside", "below the table: its first row", "above the table: its last row"),
        equations="cubic Hermite interpolation with exact slopes",
        vectors=keys,
        kind="LocusTable",
    )


def _column(name: str, unit: str, key: str) -> tuple[str, Signal]:
    """Return name and signal of an output; one that bears the name of the key gets another."""
    apart = f"{name}_at" if name == key else name
    return apart, Signal(unit, f"{apart.replace('_', ' ')} at the key, clamped at the ends")
