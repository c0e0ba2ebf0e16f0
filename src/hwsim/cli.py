"""Command line ``hwsim``, one command an area: ``hwsim weldbead examples/weldbead.toml --out runs/bead``."""

import argparse
import atexit
import gc
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import redirect_stdout, suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from hwsim.command._demo.command import add_demo
from hwsim.command._export import add_export
from hwsim.command._in_words import as_text
from hwsim.command._keys import add_keys
from hwsim.command._roundness.command import add_roundness
from hwsim.command._statuses import (
    WRONG_INPUT,
    UnreadOutput,
    catch_signals,
    ended,
    ignore_signals,
    print_to_end,
    say,
)
from hwsim.command._verify import add_verify
from hwsim.command._warm import add_warm
from hwsim.command._work import add_to
from sdpgrind import __version__

# Modules with an ``AREA`` (see `hwsim.command.base`).
_AREAS = (
    "hwsim.command._weldbead.command",
    "hwsim.command._plunge.command",
    "hwsim.command._locus.command",
    "hwsim.command._finishing.command",
    "hwsim.command._centering.command",
)

# Thresholds of garbage collection, new objects and rounds; measured: by default collectors walk through all
# that was imported and logged, 1.3 of 18 s of CPU time of eight weld beads with their page; cycles are few
_SELDOM = (50_000, 20, 50)
_REAL_TIME = ("machine", "serve")  # a collection of many objects is a longer pause


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0: done; 1: a part was broken off or aborted, a limit is not known to be kept, or a page was
    changed or comes out otherwise; 2: wrong input; 3: the environment (disk, permission, memory, another run,
    a damaged file); 70: a fault of this program; 130, 143: interrupted, terminated. From 2 on with a line of
    text.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments. None: those of the process.

    Examples
    --------
    >>> from hwsim.cli import main
    >>> main(["weldbead", "--preset", "P1", "--parts", "20"])  # doctest: +SKIP
    0
    """
    if argv is None:  # as a command, not from Python
        _open_streams()
        catch_signals()
        atexit.register(gc.freeze)  # else collectors walk twice through all that goes with the process anyway
    arguments = None
    output: Any = UnreadOutput(sys.stdout)  # ``hwsim weldbead ... | head`` closes it
    try:
        with redirect_stdout(output), warnings.catch_warnings():
            warnings.showwarning = _warn
            arguments = _parser().parse_args(argv)
            if argv is None and not any(getattr(arguments, name, None) for name in _REAL_TIME):
                gc.set_threshold(*_SELDOM)
            status: int = arguments.work(arguments)
        output.flush()
        print_to_end()
    except SystemExit:  # --help, --version, or wrong arguments
        try:
            output.flush()
        except OSError as error:
            return ended(error)
        raise
    except BaseException as error:
        if argv is None:
            ignore_signals()
        with suppress(OSError):  # as of a disk that is full, which is told already
            output.flush()
        return ended(error, arguments)
    return status


def _open_streams() -> None:
    """Open the streams that a service, or ``2>&-``, did not give: no line goes elsewhere then."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115


def _warn(message: Warning | str, *where: Any, **more: Any) -> None:
    """Print a warning in one line, without its place in the source."""
    say(f"warning: {as_text(' '.join(str(message).split()))}")


class _Parser(argparse.ArgumentParser):
    """Reports an error in one line; argparse would print the usage first."""

    def error(self, message: str) -> NoReturn:
        self.exit(WRONG_INPUT, f"{self.prog}: {message}; {self.prog} --help says more\n")


def arguments_of(argv: Sequence[str]) -> argparse.Namespace:
    """Return the arguments of a command; other processes find this function by its name."""
    return _parser().parse_args(argv)


def _parser() -> argparse.ArgumentParser:
    return _parser_of(_AREAS)


@lru_cache(maxsize=1)  # some 3 ms: programs call `main` again and again
def _parser_of(areas: tuple[str, ...]) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="hwsim",
        description="Plan grinding and centering jobs, run them on simulated or real machines, and check what"
        " they wrote. hwsim COMMAND --help says more.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    add_demo(commands)
    known = [import_module(module).AREA for module in areas]
    for area in known:
        add_to(commands, area)
    named = {area.name: area for area in known}
    add_roundness(commands)
    add_keys(commands)
    add_warm(commands, named, arguments_of)
    add_verify(commands, named, parser.parse_args)
    add_export(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
