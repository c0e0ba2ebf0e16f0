"""``hwsim warm``: compile the kernels of an area's first use, its simulated machine included."""

import argparse
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from hwsim.command._statuses import INTERRUPTED, OK
from hwsim.command.base import AreaCommand
from sdpgrind.base.progress import Portions, Progress, Speaker, Told, silent

_COARSE = "1e-2"  # $, chosen: a plan at full accuracy calls the same kernels, and takes 8 s more
# measured: kernels that one part compiles after the first use (benchmarks/times.py); shares follow them
KERNELS = {"weldbead": 46, "plunge": 18, "locus": 1, "finishing": 73, "centering": 124}
_MOST = 3  # processes for all areas; chosen: centering alone takes nearly half of the time
_EVERY = 2.0  # s between lines in a pipe; chosen: work says what it does within two seconds

ArgumentsOf = Callable[[list[str]], argparse.Namespace]


def add_warm(subparsers: Any, areas: dict[str, AreaCommand], arguments_of: ArgumentsOf) -> None:
    """Add the command to the subparsers; `arguments_of` parses the line of an area's own command."""
    about = "compile what the first use of an area needs, once on a machine, so that it need not wait"
    parser = subparsers.add_parser("warm", help=about, description=about.capitalize() + ".")
    parser.add_argument("area", nargs="?", choices=list(areas), help="all areas by default")
    parser.set_defaults(work=lambda arguments: work(areas, arguments.area, arguments_of))


def work(areas: dict[str, AreaCommand], name: str | None, arguments_of: ArgumentsOf) -> int:
    """Warm one area, or all, and return the exit status."""
    try:
        if name is None and (processes := min(_cores(), _MOST)) > 1:
            with Speaker(every=_EVERY) as line:
                texts = _all_warmed(areas, processes, Told(line), arguments_of)
            print("\n".join(texts), flush=True)
            return OK
        for area in [areas[name]] if name is not None else areas.values():
            with Speaker(every=_EVERY) as line:
                text = _warmed(area, Told(line), arguments_of)
            print(text, flush=True)
    except KeyboardInterrupt:
        print(
            "hwsim: interrupted; what is compiled stays, and the same command goes on from here",
            file=sys.stderr,
        )
        return INTERRUPTED
    return OK


def _cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _all_warmed(
    areas: dict[str, AreaCommand], processes: int, tell: Progress, arguments_of: ArgumentsOf
) -> list[str]:
    """Warm all areas side by side."""
    from hwsim.command._side_by_side import SideBySide

    tell(0.0, f"{', '.join(areas)}: first use")
    kernels, stages = {name: _kernels(name) for name in areas}, partial(_stage, areas, arguments_of)
    counts = SideBySide(stages, kernels, tell).carried_out(processes)
    return [_said(name, counts[name]) for name in areas]


def _warmed(area: AreaCommand, tell: Progress, arguments_of: ArgumentsOf) -> str:
    begin, portions = time.monotonic(), Portions(tell)
    tell(0.0, f"{area.name}: first use")
    first, own = _kernels(area.name)
    areas = {area.name: area}
    count = _stage(areas, arguments_of, area.name, 0, portions.next(first, own))
    count += _stage(areas, arguments_of, area.name, 1, portions.next(own))
    return _said(area.name, count, f" in {time.monotonic() - begin:.0f} s")


def _kernels(name: str) -> tuple[int, int]:
    """Return the number of kernels of an area's first use, and of one part after it."""
    from sdpgrind.base.compiling import warm

    return warm.KERNELS[name], KERNELS[name]


def _stage(
    areas: dict[str, AreaCommand], arguments_of: ArgumentsOf, name: str, number: int, tell: Progress
) -> int:
    """Carry out the first use of an area (0), or one part after it (1); return the kernels it compiled."""
    from sdpgrind.base.compiling import warm
    from sdpgrind.base.compiling.compile_line import listener

    before = listener.count
    if number == 0:
        warm.first_use(name, tell)
    else:
        with listener.of(name, tell, KERNELS[name]):
            _one_part(areas[name], arguments_of)
    return listener.count - before


def _said(name: str, count: int, lasted: str = "") -> str:
    return f"{name}: compiled {count} kernels{lasted}" if count else f"{name}: compiled already"


def _one_part(area: AreaCommand, arguments_of: ArgumentsOf) -> None:
    """Plan the area's first preset, coarsely where it can be, and run one part."""
    from hwsim._loop.loop import run

    name = area.presets.replace(",", " ").split()[0]
    coarse = ["--tolerance", _COARSE] if area.tolerance else []
    arguments = arguments_of([area.name, "--preset", name, *coarse])
    job: Any = area.job_of(area.preset(name), arguments)
    controller = job.controller(area.plan(job, arguments, silent))
    run(job.stand, controller, parts=1, rng=0, adapt=area.adaptation(job, arguments))
