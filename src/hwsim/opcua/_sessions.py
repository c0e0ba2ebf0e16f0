"""Sessions of the server: who may read, who commands; every write list and every call goes through here."""

from typing import Protocol

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import User
from asyncua.server.internal_session import InternalSession

from hwsim.opcua._space import StandardNodes


class Desk(Protocol):
    """What the sessions of a server share: the machine, and the rules of access."""

    async def write(self, session: "Session", params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Take a write list as one command; return a status an entry."""

    async def call(self, session: "Session", request: ua.CallMethodRequest) -> ua.CallMethodResult:
        """Call a method."""

    def activate(self, session: "Session", certificate: bytes | None) -> None:
        """Refuse a session whose certificate is not trusted, or one too many."""

    def failed(self, session: "Session", certificate: bytes | None) -> None:
        """Note a failed login."""

    def closed(self, session: "Session") -> None:
        """Note that a session has ended."""


class SessionServer(StandardNodes):
    """Internal server whose sessions ask its desk."""

    desk: Desk

    def create_session(self, name: str, user: User = User(), external: bool = False) -> InternalSession:  # noqa: B008
        """Return a new session."""
        return Session(self, self.aspace, self.subscription_service, name, user=user, external=external)

    def lookup_external_session(self, auth_token: ua.NodeId) -> None:
        """Find no session of another connection: two connections would command as one operator."""


class Session(InternalSession):  # type: ignore[misc]  # asyncua is not followed
    """A session of a client."""

    iserver: SessionServer

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Write a list of values."""
        return await self.iserver.desk.write(self, params)

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Call methods."""
        return [await self.iserver.desk.call(self, request) for request in params]

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        """Admit the user of a session."""
        self.iserver.desk.activate(self, peer_certificate)
        try:
            return super().activate_session(params, peer_certificate)
        except (ServiceError, ua.uaerrors.UaStatusCodeError):
            self.iserver.desk.failed(self, peer_certificate)
            raise

    async def close_session(self, delete_subs: bool = True) -> None:
        """End the session."""
        await super().close_session(delete_subs)
        self.iserver.desk.closed(self)
