"""Whether another processor's C library computes elementary functions with the bits of this computer's."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

from sdpgrind.codegen._files.vector_kernels import BASIS
from sdpgrind.codegen._files.vectors import SEED
from sdpgrind.codegen._proof.compilers import compiled
from sdpgrind.codegen._translate.prototypes import arguments
from sdpgrind.codegen._translate.runtime import BITS_OF, HASHED

_PROGRAM = f"""\
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static uint64_t seed = UINT64_C({SEED});

static double drawn(double scale)
{{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return scale * ((double)(seed >> 11) * 0x1p-52 - 1.0);
}}

{BITS_OF}

{HASHED}

int main(void)
{{
    static const double scales[4] = {{0.01, 1.0, 30.0, 1e6}};
    uint64_t total;
    int k;
@
    return 0;
}}
"""
_FUNCTION = """\
    total = UINT64_C({basis});
    for (k = 0; k < {count}; k++) {{
        volatile double x = drawn(scales[k & 3]);
        volatile double y = drawn(scales[(k >> 2) & 3]);
        (void)y;
        total = hashed(total, bits_of({name}({arguments})));
    }}
    printf("%" PRIx64 "\\n", total);"""
_COUNT = 100_000  # chosen: arguments of each function; hypot of glibc differs in one of some hundred


def other_functions(names: Sequence[str], folder: Path, here: str, there: str, emulator: str) -> list[str]:
    """Return those of the functions whose bits differ between this computer and an emulated one."""
    source = folder / "functions.c"
    parts = [
        _FUNCTION.format(name=one, arguments=", ".join(arguments(one)), count=_COUNT, basis=BASIS)
        for one in names
    ]
    source.write_text(_PROGRAM.replace("@", "\n".join(parts)))
    found = []
    for compiler, flags, command in ((here, [], []), (there, ["-static"], [emulator])):
        program = folder / f"functions_of_{compiler}"
        compiled(compiler, [source], program, "-O1", *flags)
        done = subprocess.run([*command, str(program)], capture_output=True, text=True, check=True)
        found.append(done.stdout.split())
    return [name for name, *pair in zip(names, *found, strict=True) if pair[0] != pair[1]]
