"""Beginning of a live part: what is refused before anything moves, pauses, a session where there is none."""

from collections.abc import Mapping

from hwsim._live.live import Live
from hwsim._live.machine import LiveMachine
from hwsim.opcua._declaration import Declaration
from hwsim.opcua._gated import GatedPart, gate_of
from hwsim.opcua._live_part import RemotePart
from hwsim.opcua._machine import RemoteMachine
from hwsim.opcua._pauses import Pauses
from hwsim.opcua._shadow import followed
from sdpgrind.base import checks
from sdpgrind.base.warned import warn

_EXCHANGES = 3  # round trips that a deadline must be longer than; chosen: read, write, one that is late


def begun(
    remote: RemoteMachine,
    told: Declaration,
    names: Mapping[str, str],
    live: Live,
    period: int | None,
    seed: str,
) -> LiveMachine:
    """Start a part on a machine with its own time, or follow one in shadow."""
    link = remote.link
    if told.speed is None:
        raise ValueError(f"live must be None: the machine at {link.url} is in lockstep and has no clock")
    remote.check(told, live, period)
    check_safe(told, live)
    if remote.table is not None and not live.shadow:
        remote.written(live.safe, None)  # refuses what its types do not hold
    if not link.alive:
        link.reconnect()
        again = link.loop.run(remote.declaration())
        if again != told:
            raise ValueError(f"the machine at {link.url} is another one than before the link was cut")
    _, stops, _ = link.loop.run(remote.operator())
    pauses = Pauses(remote, live, stops)
    if live.shadow:
        return followed(remote, told, names, live, period, pauses)
    gate = gate_of(remote, told) if live.gate else None
    if gate is None:
        link.close_gate()
    if not live.compared:  # once: a link that is slow by now does not refuse a later part
        check_deadline(remote, live, told.timeout)
        live.compared = True
    link.loop.run(pauses.begin())
    live.wait_while_paused(live.part)
    part = link.loop.run(remote.last_part()) + 1
    if gate is not None:
        gate.begin(part, seed, live, tuple(told.accepts))
        remote.began(part)
        return GatedPart(gate, remote, told, names, live, period, part, pauses)
    link.loop.run(remote.start(part, seed))
    return RemotePart(remote, told, names, live, period, part, pauses)


def check_safe(told: Declaration, live: Live) -> None:
    """Refuse a safe command outside the ranges of the machine."""
    for name, value in live.safe.items():
        low, high = told.ranges.get(name, (value, value))
        checks.within(f"safe[{name!r}]", value, low, high, told.accepts[name])


def check_deadline(remote: RemoteMachine, live: Live, watchdog: float) -> None:
    """Refuse a deadline that the link cannot keep; warn of one beyond the machine's watchdog (s)."""
    if 0 < watchdog < live.deadline:
        warn(
            f"deadline is longer than the time limit of the machine's own watchdog, {watchdog:g} s, "
            f"which comes first; got {live.deadline:g}"
        )
    trip = remote.link.loop.run(remote.round_trip())
    if live.deadline <= _EXCHANGES * trip:
        raise ValueError(
            f"deadline must be > {_EXCHANGES} round trips of {1e3 * trip:.3g} ms to {remote.link.url} (s); "
            f"got {live.deadline:g}"
        )
