"""An export as a shared library, called through ctypes: one step, or many rows."""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.codegen._files.vectors import Answers
from sdpgrind.codegen._proof.compilers import compiled, sources_of
from sdpgrind.codegen._recipe import Recipe

_MANY = """\
#include "{name}.h"
#include <string.h>

void {name}_many({name}_state *state, int64_t count, const double *rows, const uint8_t *resets,
                 double *states, double *outs, int64_t *codes);

void {name}_many({name}_state *state, int64_t count, const double *rows, const uint8_t *resets,
                 double *states, double *outs, int64_t *codes)
{{
    int64_t k;
    for (k = 0; k < count; k++) {{
        {name}_input in;
        {name}_output out;
        (void)memset(&out, 0, sizeof out);
        (void)memcpy(&in, &rows[k * {inputs}], sizeof in);
        if (resets[k] != 0U) {{
            {name}_reset(state);
        }}
        codes[k] = {name}_step(state, &in, &out);
        (void)memcpy(&outs[k * {outputs}], &out, sizeof out);
        (void)memcpy(&states[k * {states}], state->s, sizeof state->s);
    }}
}}
"""


def sizes_of(recipe: Recipe) -> tuple[int, int, int]:
    """Return the numbers of inputs, outputs and entries of the state."""
    return len(recipe.inputs), len(recipe.outputs), recipe.state.size


def many_steps(name: str, sizes: tuple[int, int, int]) -> str:
    """Return the C of a loop over rows, for numbers of inputs, outputs and entries of the state."""
    inputs, outputs, states = sizes
    return _MANY.format(name=name, inputs=inputs, outputs=outputs, states=states)


class Library:
    """Functions of an export, compiled into a folder.

    Parameters
    ----------
    name : str
        Prefix of the functions.
    sizes : tuple of int
        Numbers of inputs, outputs and entries of the state.
    """

    def __init__(
        self, source: Path, folder: Path, name: str, sizes: tuple[int, int, int], compiler: str, *flags: str
    ):
        self.name, self._sizes = name, sizes
        driver, built = folder / f"{name}_many.c", folder / f"{name}.so"
        driver.write_text(many_steps(name, sizes))
        include = f"-I{source}"
        compiled(compiler, [*sources_of(source, name), driver], built, "-shared", "-fPIC", include, *flags)
        self._library = ctypes.CDLL(str(built))
        self._step = getattr(self._library, f"{name}_step")
        self._step.restype = ctypes.c_int32
        self.state = np.zeros(sizes[2])
        self.reset(self.state)
        self.fresh = self.state.copy()

    def reset(self, state: Floats) -> None:
        """Reset a state, an array."""
        getattr(self._library, f"{self.name}_reset")(_pointer(state))

    def step(self, state: Floats, inputs: Floats, outputs: Floats) -> int:
        """Advance a state; fill the outputs; return the status."""
        return int(self._step(_pointer(state), _pointer(inputs), _pointer(outputs)))

    def take(self, rows: Floats, resets: Bools) -> Answers:
        """Return what follows on rows, the state going on from the rows before."""
        count, (_, outputs, states) = len(rows), self._sizes
        found = Answers(
            np.zeros((count, states)), np.zeros((count, outputs)), np.zeros(count, dtype=np.int64)
        )
        many = getattr(self._library, f"{self.name}_many")
        flags = resets.astype(np.uint8)
        given = np.ascontiguousarray(rows)
        arrays = (given, flags, found.states, found.outputs, found.codes)
        many(_pointer(self.state), ctypes.c_int64(count), *map(_pointer, arrays))
        return found


def _pointer(array: Any) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
