"""``hwsim AREA job.toml --serve URL``: the simulated machine of a job as an OPC UA server, until Ctrl-C."""

import argparse
import contextlib
import sys
import time
from typing import Any

from hwsim.command._passwords import known, password_of
from hwsim.command._statuses import Terminated

LOCKSTEP = "lockstep"
_LOOK = 0.1  # s; chosen: the end of a server is seen as soon


def add_serving(group: Any) -> None:
    """Add the options of a server to a group of arguments."""
    group.add_argument(
        "--serve", metavar="URL", help="serve the simulated machine at opc.tcp://HOST:PORT, and run nothing"
    )
    group.add_argument(
        "--speed", metavar="X", help=f"of --serve: simulated time over wall time (1), or {LOCKSTEP}"
    )
    group.add_argument(
        "--own-control",
        action="store_true",
        help="of --serve: the machine's own control makes parts, and clients listen",
    )


def serve_job(stand: Any, controller: Any, arguments: argparse.Namespace) -> int:
    """Serve a stand until the command is interrupted, and return the exit status."""
    import hwsim

    server = hwsim.serve(
        stand,
        arguments.serve,
        speed=_speed(arguments.speed),
        controller=controller,
        security=arguments.security,
        users=_users(arguments),
        rng=arguments.rng,
    )
    with server, contextlib.suppress(KeyboardInterrupt, Terminated):
        how = "in lockstep" if arguments.speed == LOCKSTEP else "keeping wall time"
        print(f"hwsim: {type(stand).__name__} at {server.url}, {how}; Ctrl-C ends it", file=sys.stderr)
        while True:
            time.sleep(_LOOK)
    state = server.state
    print(f"{state['parts']} parts finished, {state['aborts']} aborted")
    return 0


def _speed(text: str | None) -> float | None:
    if text == LOCKSTEP:
        return None
    try:
        return 1.0 if text is None else float(text)
    except ValueError:
        raise ValueError(f"--speed must be a number or {LOCKSTEP}; got {text!r}") from None


def _users(arguments: argparse.Namespace) -> dict[str, str] | None:
    """Passwords of the users; the observer's only where it is known."""
    if arguments.security == "none":
        return None
    names = ("operator", *(name for name in ("observer",) if known(name)))
    return {name: password_of(name) for name in names}
