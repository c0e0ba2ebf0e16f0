"""Recipe of the table of a locus: its look-up, and keys that reach every interval."""

from collections.abc import Mapping

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe
from sdpgrind.locus._trace.table_kernels import exported_look_up

_BEYOND = 0.1  # chosen: share of the range by which keys lie outside


def recipe_of(packed: Floats, key: Floats, width: int, units: Mapping[str, str]) -> Recipe:
    """Return the recipe of a table; names and units of key and columns where they are known."""
    named = list(units.items()) or [("key", ""), *((f"column_{k}", "") for k in range(width))]
    inputs, outputs = dict(named[:1]), _apart(named[1:], named[0][0])
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
        inputs,
        outputs,
        law=(packed,),
        meanings={name: f"{name.replace('_', ' ')} at the key, clamped at the ends" for name in outputs}
        | dict.fromkeys(inputs, "key of the table; a NaN is refused (-1)"),
        tables={"packed": "head, keys, values and slopes node by node, guide of whole numbers by their bits"},
        status=("inside", "below the table: its first row", "above the table: its last row"),
        equations="cubic Hermite interpolation with exact slopes",
        vectors=keys,
        spread=(0.5 * span,),
        kind="LocusTable",
    )


def _apart(named: list[tuple[str, str]], key: str) -> dict[str, str]:
    """Return the outputs; one that bears the name of the key gets another."""
    return {f"{name}_at" if name == key else name: unit for name, unit in named}
