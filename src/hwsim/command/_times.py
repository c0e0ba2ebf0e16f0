"""How long a command takes: its first line, printed before anything heavy is imported or compiled.

Times are CPU seconds of one thread on the example files; ``benchmarks/times.py`` checks them (factor 2).
"""

import argparse
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import sdpgrind
from hwsim.command._statuses import say
from sdpgrind.base.brief import counted


class Times(NamedTuple):
    """Times (s) of a command: plan, one part, the rest (imports, report, pictures), compiling at a first use.

    `kernel`: source file and name of a kernel that is compiled late; on disk, so are the others.
    """

    plan: float
    part: float
    rest: float
    compiling: float
    kernel: str

    @property
    def on_disk(self) -> bool:
        """Whether its kernels were compiled after the last change of the file of that kernel."""
        path, name = self.kernel.split(":")
        source = Path(sdpgrind.__file__).parents[1] / path
        return any(found.stat().st_mtime >= source.stat().st_mtime for found in _kept(source, name))


ON = "on an idle core"
"""What the times are meant on: where other processes take turns, they are a multiple."""
_CENTERING = "centering/_plant/measure_kernels.py:measure"
_EXPORT = "sdpgrind/codegen/_files/vector_kernels.py:digest"
_FINISHING = "sdpgrind/finishing/_plant/kernels.py:finish"

# measured: benchmarks/times.py, on one core of a machine that others used too; the latest ones scaled to a
# core that squares and adds 10 million numbers in a plain loop in 0.9 s (there 1.5 to 2 s)
TIMES: Mapping[str, Times] = {
    "weldbead": Times(6.0, 0.7, 4.5, 17.0, "sdpgrind/weldbead/_plant/force_table_kernels.py:sample"),
    "weldbead --simple": Times(6.0, 0.03, 6.0, 9.0, "sdpgrind/sdp/_policy/look_up_kernels.py:act"),
    "demo": Times(0.0, 0.0, 5.0, 12.0, "sdpgrind/plunge/_plant/part_kernels.py:grind"),
    "roundness": Times(0.0, 0.0, 5.0, 13.0, "centering/roundness/_lsc_kernels.py:algebraic_centre"),
    "export": Times(0.0, 0.0, 4.5, 9.0, _EXPORT),
    "export --lost-max": Times(0.0, 0.0, 34.0, 11.0, _EXPORT),
    "plunge": Times(0.3, 0.06, 4.7, 11.0, "sdpgrind/plunge/_plant/part_kernels.py:grind"),
    "locus": Times(0.5, 0.04, 5.0, 30.0, "sdpgrind/locus/_trace/table_kernels.py:look_up"),
    "finishing": Times(1.8, 0.05, 4.3, 17.0, _FINISHING),
    "finishing --study": Times(9.0, 0.0, 0.0, 20.0, _FINISHING),
    "centering": Times(9.0, 0.04, 6.0, 43.0, _CENTERING),
    "centering --source": Times(20.0, 0.0, 0.0, 46.0, _CENTERING),
}


class Outlook(NamedTuple):
    """Seconds that a command will take: before and after its plan and parts, for them, and to compile."""

    plan: float
    run: float
    rest: float
    compiling: float

    @classmethod
    def of(cls, name: str, arguments: argparse.Namespace, parts: int, plan_file: str) -> "Outlook | None":
        """Look ahead for the command of an area; None: its times are unknown. No parts: no plant compiles."""
        switches = [f"{name} --{key}" for key, given in vars(arguments).items() if given is True]
        times = next((TIMES[each] for each in (*switches, name) if each in TIMES), None)
        if times is None:
            return None
        kept = arguments.plan is not None or (
            arguments.out is not None and (arguments.out / plan_file).exists()
        )
        compiling = 0.0 if times.on_disk or not parts else times.compiling
        return cls(0.0 if kept else times.plan, times.part * parts, times.rest, compiling)

    @classmethod
    def alone(cls, name: str) -> "Outlook":
        """Look ahead for a command that has no plan and no parts of its own."""
        times = TIMES[name]
        return cls(0.0, 0.0, times.rest, 0.0 if times.on_disk else times.compiling)

    def foretell(self, parts: int = 0, part: str = "part") -> None:
        """Print the first line of a command on standard error; of nothing known there is none."""
        if not self.whole:
            return
        known = ", measured on the example" if self.plan or self.run else ""
        say(f"{self.line(parts, part)} ({ON}{known})")

    def line(self, parts: int = 0, part: str = "part") -> str:
        """Return the time to come in words; `part` is what one of `parts` is called."""
        run = (counted(parts, part), "takes" if parts == 1 else "take", self.run)
        told = [("planning", "takes", self.plan), run, ("the rest", "takes", self.rest)]
        steps = [(what, verb, _seconds(time)) for what, verb, time in told if time > 0]
        what, verb, time = steps[0] if len(steps) > 1 else ("this", "takes", steps[0][2])
        words = [f"{what} {verb} {time}", *(f"{what} {time}" for what, _, time in steps[1:])]
        compiling = f"; compiling, once on this machine, {_seconds(self.compiling)} more"
        return ", ".join(words) + (compiling if self.compiling else "")

    def ends(self) -> tuple[float, float]:
        """Return the shares of the whole at which the plan and the run end."""
        whole = max(self.whole, 1e-9)
        before = 0.5 * self.rest
        return (before + self.plan) / whole, (before + self.plan + self.run) / whole

    @property
    def whole(self) -> float:
        """Seconds of all steps without compiling."""
        return self.plan + self.run + self.rest


UNKNOWN = Outlook(1.0, 1.0, 0.2, 0.0)
"""Portions of a command without times."""


def _seconds(time: float) -> str:
    return f"about {round(time)} s" if time >= 1 else "less than 1 s"


def _kept(source: Path, name: str) -> Iterator[Path]:
    """Give the index files of a kernel, in the folders in which numba keeps them."""
    index = f"{source.stem}.{name}-*.nbi"
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        yield from Path(given).glob(f"*/{index}")
        return
    yield from (source.parent / "__pycache__").glob(index)
    home = Path.home()
    users = {"darwin": home / "Library/Caches/numba", "win32": home / "AppData/Local/numba/numba/Cache"}
    yield from users.get(sys.platform, home / ".cache/numba").glob(f"*/{index}")
