"""Command line ``hwsim``, one command an area: ``hwsim weldbead examples/weldbead.toml --out runs/bead``."""

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

from hwsim.command._demo.command import add_demo
from hwsim.command._keys import add_keys
from hwsim.command._roundness.command import add_roundness
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
REFUSED, INTERRUPTED = 2, 130  # exit status; source: argparse, and 128 + SIGINT of a shell


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status.

    0: done; 1: every part was broken off, a limit is not known to be kept, or a page was changed or comes out
    otherwise; 2: wrong input, with one line of text; 130: interrupted.

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
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit:  # --help, --version, or wrong arguments
        _finish_output()
        raise
    except BrokenPipeError:  # of --help; later versions of argparse ignore it too
        _forget_output()
        return 0
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            status: int = arguments.work(arguments)
    except BrokenPipeError:
        _forget_output()
        return 0
    except (ValueError, OSError, ImportError) as error:
        print(f"hwsim: {_one_line(error)}", file=sys.stderr)
        return REFUSED
    except KeyboardInterrupt:
        print("hwsim: interrupted; the same command with the same --out goes on from here", file=sys.stderr)
        return INTERRUPTED
    _finish_output()
    return status


def _warn(message: Warning | str, *where: Any, **more: Any) -> None:
    """Print a warning in one line, without its place in the source."""
    print(f"hwsim: warning: {' '.join(str(message).split())}", file=sys.stderr)


def _finish_output() -> None:
    """Flush the output; the reader of ``hwsim weldbead ... | head`` may have closed it."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _forget_output()


def _forget_output() -> None:
    """Redirect the output to the null device, so that the interpreter does not fail at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """Reports an error in one line; argparse would print the usage first."""

    def error(self, message: str) -> NoReturn:
        self.exit(REFUSED, f"{self.prog}: {message}; {self.prog} --help says more\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="hwsim", description="Run controllers on simulated machines.")
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    areas = parser.add_subparsers(title="areas", required=True, metavar="AREA")
    known = [import_module(module).AREA for module in _AREAS]
    for area in known:
        add_to(areas, area)
    named = {area.name: area for area in known}
    add_demo(areas)
    add_roundness(areas)
    add_keys(areas)
    add_warm(areas, named, parser.parse_args)
    add_verify(areas, named, parser.parse_args)
    return parser


def _one_line(error: Exception) -> str:
    notes = ", ".join(getattr(error, "__notes__", []))
    text = " ".join(str(error).split())
    if isinstance(error, OSError) and error.filename is not None:
        text = f"{error.filename}: {error.strerror}"  # without the number of the error
    return f"{text} ({notes})" if notes else text


if __name__ == "__main__":
    sys.exit(main())
