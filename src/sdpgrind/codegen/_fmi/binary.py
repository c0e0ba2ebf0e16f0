"""Binary of an FMU for this computer."""

import platform
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from sdpgrind.codegen._files.folder import lay_out
from sdpgrind.codegen._proof import compilers

COMPILER = "gcc"
FOLDER = "binaries/linux64"
_FLAGS = ("-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-s", "-Wl,--build-id=none")
"""Only functions of the standard are seen from outside: two FMUs in a process have equal names inside."""


def compiled_of(sources: Iterable[str]) -> list[str]:
    """Return the files that are compiled by themselves: foreign ones, in folders, are included by these."""
    return sorted(one for one in sources if one.endswith(".c") and "/" not in one)


def binary_of(name: str, sources: Mapping[str, bytes]) -> tuple[bytes | None, str]:
    """Return the shared library of the sources, or None and why there is none."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return None, "binaries are built on Linux (x86-64) alone"
    if compilers.found((COMPILER,))[1]:
        return None, f"{COMPILER} was not found on this computer"
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        lay_out(folder, sources)
        units = [folder / file for file in compiled_of(sources)]
        compilers.compiled(COMPILER, units, folder / f"{name}.so", *_FLAGS)
        return (folder / f"{name}.so").read_bytes(), ""
