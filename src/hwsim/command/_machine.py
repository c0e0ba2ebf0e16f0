"""``hwsim AREA job.toml --machine URL --safe NAME=VALUE``: the plan on a machine behind OPC UA."""

import argparse
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from hwsim.command._passwords import password_of
from hwsim.command._serving import add_serving

_OF_MACHINE = ("safe", "deadline", "stale", "overruns", "nodes", "shadow", "gate", "user")
_OF_SERVER = ("speed", "own_control")


class Stage(NamedTuple):
    """Where parts are made: the stand of the job, or a machine with a clock."""

    plant: Any
    live: Any = None  # hwsim.Live; None: a simulation


def add_machine(parser: argparse.ArgumentParser) -> None:
    """Add the options of machines behind OPC UA."""
    group = parser.add_argument_group(
        "machines behind OPC UA", "no safety function: they replace no interlock and no emergency stop"
    )
    add_serving(group)
    group.add_argument("--machine", metavar="URL", help="run on the machine at opc.tcp://HOST:PORT")
    group.add_argument(
        "--safe",
        nargs="+",
        metavar="NAME=VALUE",
        help="of --machine: the command that makes it safe: retract=1, 'velocity=0 mm/s'",
    )
    group.add_argument(
        "--deadline", metavar="S", help="of --machine: longest step of the controller (0.05 s)"
    )
    group.add_argument(
        "--stale", metavar="S", help="of --machine: age at which readings abort the part (two periods)"
    )
    group.add_argument(
        "--overruns", choices=("count", "abort"), help="of --machine: what a missed release does (count)"
    )
    group.add_argument(
        "--nodes",
        type=Path,
        metavar="FILE",
        help="of --machine: table of nodes of a machine that is not ours",
    )
    group.add_argument("--shadow", action="store_true", help="of --machine: listen to its own control")
    group.add_argument(
        "--gate", action="store_true", help="of --machine: send commands through a process of its own"
    )
    group.add_argument(
        "--user",
        metavar="NAME",
        help="of --machine (operator, with --shadow observer), see its documentation",
    )
    group.add_argument(
        "--security", metavar="KEYS", help="folder of hwsim keys; none: neither signed nor encrypted"
    )


def check_machine(arguments: argparse.Namespace) -> None:
    """Refuse options that do not go together."""
    serve, machine = arguments.serve is not None, arguments.machine is not None
    if serve and machine:
        raise ValueError("either --serve or --machine must be given, not both")
    for name in _OF_MACHINE:
        if getattr(arguments, name) and not machine:
            raise ValueError(f"--{name} needs --machine")
    for name in _OF_SERVER:
        if getattr(arguments, name) and not serve:
            raise ValueError(f"--{name.replace('_', '-')} needs --serve")
    if arguments.security and not (serve or machine):
        raise ValueError("--security needs --serve or --machine")
    if serve and (arguments.parts is not None or arguments.out is not None):
        raise ValueError("--serve runs nothing: --parts and --out must not be given")


@contextlib.contextmanager
def staged(stand: Any, arguments: argparse.Namespace) -> Iterator[Stage]:
    """Give the stand, or connect to the machine; the session ends with the block."""
    if arguments.machine is None:
        yield Stage(stand)
        return
    import hwsim

    plant = hwsim.OpcuaPlant(
        arguments.machine, nodes=arguments.nodes, security=arguments.security, user=_user(arguments)
    )
    with contextlib.closing(plant):
        yield Stage(plant, _live(plant, arguments))


def _user(arguments: argparse.Namespace) -> tuple[str, str] | None:
    if arguments.security == "none" and arguments.user is None:
        return None
    name = arguments.user or ("observer" if arguments.shadow else "operator")
    return name, password_of(name)


def _live(plant: Any, arguments: argparse.Namespace) -> Any:
    """How the run meets the clock of the machine; None: it has none."""
    from hwsim._live.live import DEADLINE, Live
    from sdpgrind.base.unit_text import quantity

    if plant.lockstep:
        return None
    if not (arguments.safe or arguments.shadow):
        raise ValueError(f"--safe NAME=VALUE or --shadow must be given: {plant!r} keeps its own time")
    deadline = quantity("--deadline", arguments.deadline or DEADLINE, "s")
    safe = None if arguments.safe is None else dict(_told(each, plant.accepts) for each in arguments.safe)
    return Live(
        safe=safe,
        shadow=arguments.shadow,
        deadline=deadline,
        stale=None if arguments.stale is None else quantity("--stale", arguments.stale, "s"),
        overruns=arguments.overruns or "count",
        gate=arguments.gate,
    )


def _told(text: str, accepts: Any) -> tuple[str, float]:
    """A command of --safe: its name and its value in the machine's unit."""
    from sdpgrind.base.unit_text import quantity

    name, sign, value = text.partition("=")
    if not sign:
        raise ValueError(f"--safe must be NAME=VALUE, such as retract=1; got {text!r}")
    if name not in accepts:
        raise ValueError(f"--safe must name commands of the machine: {', '.join(accepts)}; got {name!r}")
    return name, quantity(f"--safe {name}", value, accepts[name])
