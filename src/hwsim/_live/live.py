"""Options of a run against a real clock (`Live`), and the operator's pause, resume and abort."""

import time
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from hwsim._log.acts import OperatorAct
from hwsim._part.part import LivePart
from sdpgrind.base import checks

if TYPE_CHECKING:
    from hwsim._log.log import Log

DEADLINE = 0.05  # s; chosen: a step takes milliseconds, and a machine moves little meanwhile
_POLL = 0.02  # s; chosen: below what an operator notices


class Aborted(RuntimeError):  # noqa: N818  an outcome of the operator, not a fault
    """A run was stopped, and its machine made safe, or the message says that this is not known.

    `log` has the finished parts and the rows of the last one.

    Parameters
    ----------
    message : str
        What happened.
    part : LivePart, optional
        The aborted part (private to this package). None: it was not begun.

    Examples
    --------
    >>> import hwsim
    >>> issubclass(hwsim.Aborted, RuntimeError)
    True
    """

    log: "Log"
    """Everything up to the safe command; the last part has ``aborted`` = 1 and ``abort_reason``."""

    def __init__(self, message: str, part: LivePart | None = None) -> None:
        super().__init__(message)
        self.part = part


class Live:
    """How `run` meets a real clock: ``hwsim.run(plant, controller, live=hwsim.Live(safe={"stop": 1.0}))``.

    Steps are released on an absolute grid of a monotonic clock; releases that fall into a late step are
    missed and counted. Whatever goes wrong, the machine gets the safe command first; then the rows of the
    part are kept and `Aborted` is raised. A simulated plant keeps wall time: where nothing was late, its log
    has the same numbers as without `live`.

    **This is no safety function.** It replaces no interlock, limit switch or emergency stop of a machine; a
    general-purpose computer keeps no hard deadline.

    Parameters
    ----------
    safe : mapping
        Command that makes the machine safe, in names and units that the plant accepts: {"stop": 1.0}.
        Required but in shadow.
    deadline : float
        Longest step of the controller, s; after it the machine is made safe. It bounds the step, not the
        period: waiting counts as life.
    stale : float, optional
        Age at which readings of a real machine count as stale and abort the part, s. Default: two periods.
    overruns : {"count", "abort"}
        What a missed release does.
    shadow : bool
        Listen only: nothing is written to the machine, whose own control commands. The log holds what the
        controller would have commanded.
    stuck : mapping, optional
        Measured name -> number of equal readings in a row that abort the part while the machine is commanded:
        {"size": 20}.
    gate : bool
        Send commands to a machine behind OPC UA through a process of its own, which makes it safe within the
        deadline also when this process is killed or holds the interpreter's lock. It starts with the first
        part, in some seconds, and ends with the plant.

    Raises
    ------
    ValueError
        When a value is out of range, `safe` is missing, or there is a gate or a `safe` in shadow.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class Leave:
    ...     period = None
    ...     def reset(self): ...
    ...     def step(self, **measured):
    ...         return {"stop": 1.0}
    >>> live = hwsim.Live(safe={"stop": 1.0}, deadline=0.5)
    >>> log = hwsim.run(hwsim.WeldBeadStand(weldbead.preset("P1")), Leave(), live=live)
    >>> log.outcome[["aborted", "overruns"]].to_array().values.ravel(), live.state
    (array([0., 0.]), 'idle')
    """

    def __init__(
        self,
        *,
        safe: Mapping[str, float] | None = None,
        deadline: float = DEADLINE,
        stale: float | None = None,
        overruns: str = "count",
        shadow: bool = False,
        stuck: Mapping[str, int] | None = None,
        gate: bool = False,
    ) -> None:
        self.safe = _checked_safe(safe, shadow=shadow)
        self.deadline = checks.positive("deadline", deadline, "s")
        self.stale = None if stale is None else checks.positive("stale", stale, "s")
        self.overruns = checks.one_of("overruns", overruns, ("count", "abort"))
        self.shadow = checks.kind("shadow", shadow, bool)
        self.gate = checks.kind("gate", gate, bool)
        if gate and shadow:
            raise ValueError("gate must be False in shadow, where nothing is written")
        counts = checks.kind("stuck", stuck or {}, Mapping, ', such as {"size": 20}')  # type: ignore[type-abstract]
        self.stuck = {name: checks.count(f"stuck[{name!r}]", n, 2) for name, n in counts.items()}
        self._acts: list[OperatorAct] = []
        self._written = 0  # of them, to the journal
        self.part = 0
        """Number of the part under way."""
        self.reason: str | None = None
        """Why the run is to be aborted; None: it is not."""
        self.compared = False
        """Whether the deadline was compared with the round trips of the link."""
        self.tripped = False
        """Whether the machine was made safe in the part under way."""
        self._running = self._paused = False

    @property
    def state(self) -> str:
        """``"idle"``, ``"running"``, ``"paused"`` or ``"aborted"``; the last for good."""
        if self.reason is not None:
            return "aborted"
        if self._paused:
            return "paused"
        return "running" if self._running else "idle"

    @property
    def acts(self) -> tuple[OperatorAct, ...]:
        """Acts of the operator so far: part, civil and monotonic time (ns), who, what."""
        return tuple(self._acts)

    def pause(self, who: str = "program") -> None:
        """Finish the part under way and begin none; callable from any thread.

        Parameters
        ----------
        who : str
            Who asked, for the journal.

        Examples
        --------
        >>> live = Live(safe={"stop": 1.0})
        >>> live.pause()
        >>> live.state
        'paused'
        """
        self._act("pause", who)
        self._paused = True

    def resume(self, who: str = "program") -> None:
        """Go on after a pause; callable from any thread.

        Parameters
        ----------
        who : str
            Who asked, for the journal.

        Examples
        --------
        >>> live = Live(safe={"stop": 1.0})
        >>> live.pause(), live.resume(), live.state
        (None, None, 'idle')
        """
        self._act("resume", who)
        self._paused = False

    def abort(self, reason: str = "asked by the operator", who: str = "program") -> None:
        """Make the machine safe at once and end the run; callable from any thread and signal handler.

        Parameters
        ----------
        reason : str
            For the log.
        who : str
            Who asked, for the journal.

        Examples
        --------
        >>> live = Live(safe={"stop": 1.0})
        >>> live.abort("door open")
        >>> live.state, live.reason
        ('aborted', 'door open')
        """
        self._act(f"abort: {reason}", who)
        self.reason = self.reason or reason

    def _act(self, what: str, who: str) -> None:
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._acts.append(OperatorAct(self.part, now, time.monotonic_ns(), who, what))

    def begin(self) -> None:
        """Begin a run (private to this package); a `Live` that was aborted stays so."""
        if self.reason is not None:
            raise ValueError(f"live must be a new Live: this one was aborted ({self.reason})")
        if self._running:
            raise ValueError("live must not be in another run: each has its own Live")
        self._running, self.compared = True, False

    def end(self) -> None:
        """End a run (private to this package)."""
        self._running = False

    def wait_while_paused(self, part: int) -> None:
        """Wait until a part may begin (private to this package); `Aborted` when none may."""
        self.part = part
        while self._paused and self.reason is None:
            time.sleep(_POLL)
        if self.reason is not None:
            raise Aborted(f"no part was begun: {self.reason}")

    def unwritten_acts(self) -> tuple[OperatorAct, ...]:
        """Acts that are not in the journal yet (private to this package)."""
        return tuple(self._acts[self._written :])  # another thread may append

    def note_written(self, acts: int) -> None:
        """Note that the journal has so many more acts (private to this package); after it has them."""
        self._written += acts

    def __repr__(self) -> str:
        return f"<hwsim.Live: {self.state}, deadline {self.deadline:g} s>"


def _checked_safe(safe: Any, *, shadow: bool) -> dict[str, float]:
    if shadow:
        if safe is not None:
            raise ValueError(f"safe must not be given in shadow, where nothing is written; got {safe}")
        return {}
    if not isinstance(safe, Mapping) or not safe:
        raise ValueError(
            "safe must be the command that makes the machine safe, such as {'stop': 1.0}; "
            f"got {checks.shown(safe)}"
        )
    return {name: checks.number(f"safe[{name!r}]", value) for name, value in safe.items()}
