"""Manifest of an export: what it is, what its bits depend on, where each function comes from."""

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

from sdpgrind.codegen._files.shell import CSource
from sdpgrind.codegen._files.vectors import STEPS, Vectors
from sdpgrind.codegen._recipe import Recipe, Signal
from sdpgrind.codegen._translate.runtime import FLAGS

_OWN = 96  # chosen: bytes of stack of `step` beside its copy of the state and the outputs
_PROMISES = {
    "none": "same bits on every IEEE 754 target: no libm function is used",
    "libm": "same bits where the C library computes {functions} as that of this computer;"
    " the self-test tells",
    "folder": "same bits on every IEEE 754 target: {functions} from the sources in math/;"
    " last digits of the library's own differ, from_library of the manifest says how much",
}


_PROGRAM = "; the quadratic program is solved by code that OSQP generates (Apache License 2.0)"


def math_of(source: CSource) -> str:
    """Return what the bits depend on: "none", "libm" or "folder"."""
    return ("folder" if source.program.outside else "libm") if source.libm else "none"


def promise(recipe: Recipe, source: CSource) -> str:
    """Return the promise in a sentence."""
    program = "" if recipe.program is None else _PROGRAM
    names = list(source.libm)
    functions = " and ".join([", ".join(names[:-1])] * (len(names) > 1) + names[-1:])
    return _PROMISES[math_of(source)].format(functions=functions) + program


def manifest(
    recipe: Recipe, name: str, version: str, source: CSource, vectors: Vectors, notes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the manifest without the files' digests; `notes`: entries beside those of the recipe."""
    functions, program = source.program.written, source.program
    bounds = [
        {"function": one.name, "file": one.source.file, **bound} for one in functions for bound in one.bounds
    ]
    if recipe.program is not None:
        solver = {"function": f"{name}_solve", "file": f"{name}_program.c", "line": 0}
        bounds.append({**solver, "at_most": recipe.program.iterations})
    return {
        "name": name,
        "kind": recipe.kind,
        "version": version,
        "fingerprint": recipe.fingerprint,
        "digest": f"{source.digest:016x}",
        "equations": recipe.equations,
        "inputs": _inputs(recipe),
        "outputs": [_signal(name, one) for name, one in recipe.outputs.items()],
        "state": {
            "size": recipe.state.size,
            "places": dict(recipe.places),
            "reset": _plain(vectors.fresh),
        },
        "period": recipe.period,
        "status": list(recipe.status),
        "math": math_of(source),
        "libm": list(source.libm),
        "promise": promise(recipe, source),
        "flags": list(FLAGS),
        "precision": "double",
        "functions": [one.record for one in functions],
        "loop_bounds": bounds,
        "sizes": {"tables": program.table_bytes, "functions": len(functions)},
        "stack": source.step.stack + 8 * (recipe.state.size + len(recipe.outputs)) + _OWN,
        "selftest": {"vectors": len(vectors.rows), "blocks": len(vectors.digests), "steps": STEPS},
        **recipe.notes,
        **notes,
    }


def _inputs(recipe: Recipe) -> list[dict[str, Any]]:
    return [
        {**_signal(name, one), "range": _plain((one.low, one.high)), "may_be_missing": one.missing}
        for name, one in recipe.inputs.items()
    ]


def _signal(name: str, one: Signal) -> dict[str, Any]:
    return {"name": name, "unit": one.unit or "1", "meaning": one.meaning}


def _plain(numbers: Any) -> list[float | str]:
    """Return numbers as JSON has them; NaN and infinities as text."""
    return [float(one) if math.isfinite(one) else str(float(one)) for one in numbers]


def text_of(told: Mapping[str, Any], files: Mapping[str, bytes]) -> str:
    """Return the manifest as JSON, with the files' digests."""
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}
    return json.dumps({**told, "files": digests}, indent=1, sort_keys=True) + "\n"
