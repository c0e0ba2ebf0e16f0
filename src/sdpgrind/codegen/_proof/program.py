"""An export as a program of its own: for sanitizers, and for other processors by an emulator."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.codegen._files.vectors import Answers
from sdpgrind.codegen._proof.compilers import compiled, sources_of
from sdpgrind.codegen._proof.library import many_steps

_MAIN = """
#include <stdio.h>
#include <stdlib.h>

static int answered(FILE *in, FILE *out)
{{
    {name}_state state;
    int64_t count;
    double row[{inputs}];
    uint8_t reset;
    double after[{states}];
    double outs[{outputs}];
    int64_t code;
    if ((fread(&count, sizeof count, 1, in) != 1) || (fread(&state, sizeof state, 1, in) != 1)) {{
        return 1;
    }}
    for (; count > 0; count--) {{
        if ((fread(&reset, sizeof reset, 1, in) != 1) || (fread(row, sizeof row, 1, in) != 1)) {{
            return 1;
        }}
        {name}_many(&state, 1, row, &reset, after, outs, &code);
        (void)fwrite(after, sizeof after, 1, out);
        (void)fwrite(outs, sizeof outs, 1, out);
        (void)fwrite(&code, sizeof code, 1, out);
    }}
    return 0;
}}

int main(int count, char **names)
{{
    FILE *in = (count == 3) ? fopen(names[1], "rb") : NULL;
    FILE *out = (count == 3) ? fopen(names[2], "wb") : NULL;
    int wrong = ((in == NULL) || (out == NULL)) ? 1 : answered(in, out);
    if (in != NULL) {{
        (void)fclose(in);
    }}
    if ((out != NULL) && (fclose(out) != 0)) {{
        wrong = 1;
    }}
    return wrong;
}}
"""


class ProgramRun:
    """Export with a main function that takes rows from a file; run by itself, or by an emulator.

    Parameters
    ----------
    sizes : tuple of int
        Numbers of inputs, outputs and entries of the state.
    emulator : str
        Command that runs the program; "": itself.
    """

    def __init__(
        self,
        source: Path,
        folder: Path,
        name: str,
        sizes: tuple[int, int, int],
        state: Floats,
        emulator: str,
        compiler: str,
        flags: Sequence[str],
    ) -> None:
        self._folder, self._sizes, self.state = folder, sizes, state.copy()
        inputs, outputs, states = sizes
        driver, program = folder / f"{name}_main.c", folder / "program"
        main = _MAIN.format(name=name, inputs=inputs, outputs=outputs, states=states)
        driver.write_text(many_steps(name, sizes) + main)
        compiled(compiler, [*sources_of(source, name), driver], program, f"-I{source}", *flags)
        self._command = [*([emulator] if emulator else []), str(program)]

    def take(self, rows: Floats, resets: Bools) -> Answers:
        """Return what follows on rows, the state going on from the rows before."""
        inputs, outputs, states = self._sizes
        given, answered = self._folder / "rows.bin", self._folder / "answers.bin"
        records = np.empty(len(rows), dtype=[("reset", "u1"), ("row", "<f8", (inputs,))])
        records["reset"], records["row"] = resets, rows
        head = np.array([len(rows)], dtype="<i8").tobytes() + self.state.astype("<f8").tobytes()
        given.write_bytes(head + records.tobytes())
        done = subprocess.run(
            [*self._command, str(given), str(answered)], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(f"the export failed ({' '.join(self._command)}): {done.stderr.strip()}")
        kinds = [("states", "<f8", (states,)), ("outputs", "<f8", (outputs,)), ("code", "<i8")]
        found = np.fromfile(answered, dtype=kinds)
        self.state = found["states"][-1].copy()
        each = (np.ascontiguousarray(found[key]) for key in ("states", "outputs", "code"))
        return Answers(*each)
