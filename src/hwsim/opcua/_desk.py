"""Rules of access to a served machine: one operator, ranges of commands, methods."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from math import inf, isfinite
from time import monotonic
from typing import Any, Final

from asyncua import ua

from hwsim.opcua._declaration import Declaration
from hwsim.opcua._driver import Driver, Refused
from hwsim.opcua._keys import ServerKeys
from hwsim.opcua._produced import Produced
from hwsim.opcua._sample import widened
from hwsim.opcua._sessions import Session
from hwsim.opcua._space import Space

_LONGEST = 1000  # nodes a call; chosen: far above any plant
_SESSIONS = 16  # chosen: a controller, screens and recorders
_FAILED, _MINUTE = 5, 60.0  # logins, s; chosen: a person mistypes less, a program tries more
_log = logging.getLogger(__name__)
Method = Callable[..., Awaitable[list[ua.Variant]]]
_DOUBLE, _INT, _BOOL, _TEXT = (
    ua.VariantType.Double,
    ua.VariantType.Int64,
    ua.VariantType.Boolean,
    ua.VariantType.String,
)
_MOVES: Final = ("Start", "Advance", "Reset")
"""Methods of the one operator session; the others stop or hold a machine, from any operator's session."""


class FrontDesk:
    """Sessions, write lists and calls of one machine."""

    def __init__(
        self,
        space: Space,
        told: Declaration,
        driver: Driver,
        produced: Produced,
        keys: ServerKeys | None,
    ) -> None:
        self.writes = 0
        self._keys, self._failed = keys, Failures()
        self._space, self._told, self._driver, self._produced = space, told, driver, produced
        self._holder: Session | None = None
        self._starter: Session | None = None  # of the last part
        self._sessions: set[Session] = set()
        self._commands = {space.node_id(f"Commands.{name}"): name for name in told.accepts}
        self._heartbeat = space.node_id("Commands.heartbeat")
        self._methods: dict[ua.NodeId, tuple[str, Method, int]] = {}

    async def add_methods(self, plant: Any) -> None:
        """Add the methods to the object of the plant."""
        answer = {"values[]": _DOUBLE, "time": _INT, "event": _BOOL, "done": _BOOL, "refused": _TEXT}
        known: dict[str, tuple[Method, dict[str, ua.VariantType], dict[str, ua.VariantType]]] = {
            "Start": (self._start, {"part": _INT, "seed": _TEXT}, {"refused": _TEXT}),
            "Advance": (self._advance, {"values[]": _DOUBLE, "ticks": _INT}, answer),
            "Pause": (self._pause, {}, {}),
            "Resume": (self._resume, {}, {}),
            "Abort": (self._abort, {"reason": _TEXT}, {}),
            "Reset": (self._reset, {}, {"refused": _TEXT}),
        }
        for name, (method, inputs, outputs) in known.items():
            await self._space.method(plant, name, method, inputs, outputs)
            self._methods[self._space.node_id(name)] = name, method, len(inputs)

    def activate(self, session: Session, certificate: bytes | None) -> None:
        """Refuse a peer that is not trusted or failed to log in too often, and a session too many."""
        if self._keys is not None:
            self._failed.refuse(session, certificate)
            if said := self._keys.keys.refusal(certificate):
                _log.info("%s was refused: %s", called(session), said)
                raise ua.uaerrors.BadCertificateUntrusted
        self._sessions.add(session)
        if len(self._sessions) > _SESSIONS:
            self._sessions.discard(session)
            raise ua.uaerrors.BadTooManySessions

    def failed(self, session: Session, certificate: bytes | None) -> None:
        """Count a failed login."""
        self._sessions.discard(session)
        self._failed.count(session, certificate)

    @property
    def operator(self) -> str:
        """Name of the session that commands; "": none."""
        return "" if self._holder is None else called(self._holder)

    def closed(self, session: Session) -> None:
        """Forget a session that has ended."""
        self._sessions.discard(session)
        if session is self._holder:
            self._holder = None
            self._left = asyncio.ensure_future(self._space.show("Production.operator", ""))

    async def _holds(self, session: Session) -> bool:
        """Whether a session is that of the one operator, or becomes it."""
        if not may_operate(session):
            return False
        if self._holder is None:
            self._holder = session
            await self._space.show("Production.operator", called(session))
        return self._holder is session

    async def write(self, session: Session, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Take a write list as one command."""
        self.writes += 1
        entries = params.NodesToWrite
        if len(entries) > _LONGEST:
            raise ua.uaerrors.BadTooManyOperations
        if not await self._holds(session):
            return _all(entries, ua.StatusCodes.BadUserAccessDenied)
        states = [self._state(session, entry) for entry in entries]
        if any(state.is_bad() for state in states):
            return states  # a list is one command: all of it or nothing
        command = {
            self._commands[entry.NodeId]: entry.Value.Value.Value
            for entry in entries
            if entry.NodeId in self._commands
        }
        try:
            if command:
                await self._driver.take(command)
            await self._beat(entries)
        except Refused as error:
            await self._beat(entries)
            await self._space.show("Production.refused", str(error))
            return [
                ua.StatusCode(ua.StatusCodes.BadInvalidState if e.NodeId in self._commands else 0)
                for e in entries
            ]
        for name, value in command.items():
            await self._space.show(f"Commands.{name}", value)
        return states

    async def _beat(self, entries: list[ua.WriteValue]) -> None:
        """Note the heartbeat, after the command of its list: time begins with the first one of a part."""
        for entry in entries:
            if entry.NodeId == self._heartbeat:
                self._driver.beat(entry.Value.Value.Value)
                await self._space.show("Commands.heartbeat", entry.Value.Value.Value)

    def _state(self, session: Session, entry: ua.WriteValue) -> ua.StatusCode:
        """Status of one entry of a write list."""
        value = entry.Value.Value if entry.Value else None
        if entry.AttributeId != ua.AttributeIds.Value or value is None:
            return ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)
        if entry.NodeId == self._heartbeat:
            if self._starter not in (None, session):  # it is no sign of life of who started the part
                return ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)
            counts = isinstance(value.Value, int) and not isinstance(value.Value, bool)
            return ua.StatusCode(0 if counts else ua.StatusCodes.BadTypeMismatch)
        name = self._commands.get(entry.NodeId)
        if name is None:
            return ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)
        if value.VariantType is not _DOUBLE:
            return ua.StatusCode(ua.StatusCodes.BadTypeMismatch)
        low, high = widened(self._told.ranges.get(name, (-inf, inf)))
        inside = all(isfinite(number) and low <= number <= high for number in _numbers(value.Value))
        return ua.StatusCode(0 if inside else ua.StatusCodes.BadOutOfRange)

    async def call(self, session: Session, request: ua.CallMethodRequest) -> ua.CallMethodResult:
        """Call a method of the machine."""
        self.writes += 1
        result = ua.CallMethodResult()
        name, method, number = self._methods.get(request.MethodId, ("", None, 0))
        given = [argument.Value for argument in request.InputArguments or ()]
        if method is None:
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadMethodInvalid)
        elif not (await self._holds(session) if name in _MOVES else may_operate(session)):
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)
        elif len(given) != number:
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadArgumentsMissing)
        else:
            try:
                result.OutputArguments = await (
                    self._started(session, *given) if name == "Start" else method(*given)
                )
            except Exception:
                _log.exception("%s was not carried out", name)
                result.StatusCode = ua.StatusCode(ua.StatusCodes.BadInvalidArgument)
        return result

    async def _started(self, session: Session, part: Any, seed: Any) -> list[ua.Variant]:
        """Start a part: it is that of this session, also where it leaves before the answer."""
        before, self._starter = self._starter, session
        try:
            told = await self._start(part, seed)
        except Exception:
            self._starter = before
            raise
        if told[0].Value:
            self._starter = before
        return told

    async def _start(self, part: Any, seed: Any) -> list[ua.Variant]:
        return await _answered(self._driver.start(int(part), str(seed or "")))

    async def _advance(self, values: Any, ticks: Any) -> list[ua.Variant]:
        try:
            flat, time, event, done, refused = await self._driver.advance(values or [], int(ticks))
        except Refused as error:
            flat, time, event, done, refused = [], 0, False, False, str(error)
        return [
            ua.Variant(flat, _DOUBLE, is_array=True),
            ua.Variant(time, _INT),
            ua.Variant(event, _BOOL),
            ua.Variant(done, _BOOL),
            ua.Variant(refused, _TEXT),
        ]

    async def _pause(self) -> list[ua.Variant]:
        await self._driver.pause(True)
        return []

    async def _resume(self) -> list[ua.Variant]:
        await self._driver.pause(False)
        return []

    async def _abort(self, reason: Any) -> list[ua.Variant]:
        said = str(reason or "asked by the operator of the machine")
        self._produced.asked = said
        await self._driver.abort(said)
        await self._produced.stopped()
        return []

    async def _reset(self) -> list[ua.Variant]:
        return await _answered(self._driver.reset())


class Failures:
    """Failed logins within a minute, of one address with one certificate.

    Who guesses locks out himself: not another address, nor one who came by the same address with a
    certificate of his own. A peer without a trusted certificate is refused before, and is not counted.
    """

    def __init__(self) -> None:
        self._at: dict[tuple[str, bytes | None], list[float]] = {}

    def count(self, session: Session, certificate: bytes | None) -> None:
        """Count a failed login."""
        self._forget()
        self._at.setdefault((_host(session), certificate), []).append(monotonic())

    def refuse(self, session: Session, certificate: bytes | None) -> None:
        """Refuse one who failed too often; attempts meanwhile do not count."""
        self._forget()
        if len(self._at.get((_host(session), certificate), ())) >= _FAILED:
            raise ua.uaerrors.BadUserAccessDenied

    def _forget(self) -> None:
        """Drop what is older than a minute."""
        since = monotonic() - _MINUTE
        recent = {peer: [at for at in times if at > since] for peer, times in self._at.items()}
        self._at = {peer: times for peer, times in recent.items() if times}


async def _answered(work: Awaitable[None]) -> list[ua.Variant]:
    try:
        await work
    except Refused as error:
        return [ua.Variant(str(error), _TEXT)]
    return [ua.Variant("", _TEXT)]


def may_operate(session: Session) -> bool:
    """Whether the user of a session may command."""
    return session.user is not None and session.user.name in ("operator", None)


def called(session: Session) -> str:
    """Name of a session: where it came from."""
    peer = session.name
    return f"{peer[0]}:{peer[1]}" if isinstance(peer, tuple) else str(peer)


def _host(session: Session) -> str:
    return called(session).rpartition(":")[0]


def _all(entries: list[Any], code: int) -> list[ua.StatusCode]:
    return [ua.StatusCode(code) for _ in entries]


def _numbers(value: Any) -> list[Any]:
    """All numbers of a value, a list or a list of lists."""
    if isinstance(value, list):
        return [number for each in value for number in _numbers(each)]
    return [value]
