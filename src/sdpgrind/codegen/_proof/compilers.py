"""Compilers of this computer, and shared libraries of exports by them."""

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from sdpgrind.base import checks
from sdpgrind.codegen._translate.runtime import FLAGS

_TOLD = 20  # chosen: lines of a compiler's words; the first ones name what is wrong
STRICT = ("-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-pedantic", "-Werror")


def found(compilers: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return which compilers are there, and which are not."""
    there = [one for one in compilers if shutil.which(one)]
    return there, [one for one in compilers if one not in there]


def compiled(compiler: str, sources: Sequence[Path], out: Path, *flags: str) -> None:
    """Compile sources into a file; raise with the compiler's words."""
    command = [compiler, *FLAGS, *flags, *map(str, sources), "-lm", "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        told = "\n".join(done.stderr.strip().splitlines()[:_TOLD])
        raise RuntimeError(f"{compiler} refused the export: {told}")


def sources_of(folder: Path, name: str) -> list[Path]:
    """Return the sources of an export that are compiled, but for its self-test."""
    usual = [folder / f"{name}.c", folder / f"{name}_program.c"]
    return [*(one for one in usual if one.exists()), *sorted(folder.glob(f"{name}_math_*.c"))]


def links(compiler: str, *flags: str) -> bool:
    """Whether a program is built and runs with these flags: libraries of sanitizers come apart."""
    with tempfile.TemporaryDirectory() as kept:
        source, program = Path(kept) / "empty.c", Path(kept) / "empty"
        source.write_text("int main(void)\n{\n    return 0;\n}\n")
        command = [compiler, *flags, str(source), "-o", str(program)]
        built = subprocess.run(command, capture_output=True, check=False).returncode == 0
        return built and subprocess.run([str(program)], capture_output=True, check=False).returncode == 0


def needed(compiler: str) -> str:
    """Return the compiler, which must be there."""
    if not shutil.which(compiler):
        raise checks.refuse("compiler", "a C compiler on this computer", compiler)
    return compiler
