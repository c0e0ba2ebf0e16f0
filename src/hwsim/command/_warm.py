"""``hwsim warm``: compile the kernels of an area's first use, its simulated machine included."""

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

from hwsim.command._statuses import INTERRUPTED, OK
from hwsim.command.base import AreaCommand
from sdpgrind.base.progress import Portions, Progress, Speaker, Told, silent

_COARSE = "1e-2"  # $, chosen: a plan at full accuracy calls the same kernels, and takes 8 s more
# measured: kernels that one part compiles after the first use (benchmarks/times.py); shares follow them
KERNELS = {"weldbead": 46, "plunge": 18, "locus": 1, "finishing": 73, "centering": 124}
_EVERY = 2.0  # s between lines in a pipe; chosen: work says what it does within two seconds


def add_warm(
    subparsers: Any, areas: dict[str, AreaCommand], arguments_of: Callable[[list[str]], argparse.Namespace]
) -> None:
    """Add the command to the subparsers; `arguments_of` parses the line of an area's own command."""
    about = "compile what the first use of an area needs, once on a machine, so that it need not wait"
    parser = subparsers.add_parser("warm", help=about, description=about.capitalize() + ".")
    parser.add_argument("area", nargs="?", choices=list(areas), help="all areas by default")
    parser.set_defaults(work=lambda arguments: work(areas, arguments.area, arguments_of))


def work(
    areas: dict[str, AreaCommand], name: str | None, arguments_of: Callable[[list[str]], argparse.Namespace]
) -> int:
    """Warm one area, or all, and return the exit status."""
    try:
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


def _warmed(
    area: AreaCommand, tell: Progress, arguments_of: Callable[[list[str]], argparse.Namespace]
) -> str:
    begin = time.monotonic()
    tell(0.0, f"{area.name}: first use")
    from sdpgrind.base.compiling import warm
    from sdpgrind.base.compiling.compile_line import listener

    before, portions, own = listener.count, Portions(tell), KERNELS[area.name]
    warm.first_use(area.name, portions.next(warm.KERNELS[area.name], own))
    with listener.of(area.name, portions.next(own), own):
        _one_part(area, arguments_of)
    count, lasted = listener.count - before, time.monotonic() - begin
    return (
        f"{area.name}: compiled {count} kernels in {lasted:.0f} s"
        if count
        else f"{area.name}: compiled already"
    )


def _one_part(area: AreaCommand, arguments_of: Callable[[list[str]], argparse.Namespace]) -> None:
    """Plan the area's first preset, coarsely where it can be, and run one part."""
    from hwsim._loop.loop import run

    name = area.presets.replace(",", " ").split()[0]
    coarse = ["--tolerance", _COARSE] if area.tolerance else []
    arguments = arguments_of([area.name, "--preset", name, *coarse])
    job: Any = area.job_of(area.preset(name), arguments)
    controller = job.controller(area.plan(job, arguments, silent))
    run(job.stand, controller, parts=1, rng=0, adapt=area.adaptation(job, arguments))
