"""URLs of machines: ``opc.tcp://host:port``."""

import ipaddress
from typing import NamedTuple
from urllib.parse import urlsplit

from sdpgrind.base import checks

_LARGEST = 65535  # source: RFC 9293, 16 bits
_DEFAULT = 4840  # source: IANA, port of opc.tcp


class Address(NamedTuple):
    """Host and port of a machine."""

    host: str
    port: int

    @property
    def loopback(self) -> bool:
        """Whether nothing outside this computer reaches it."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False

    @property
    def url(self) -> str:
        """The address as a URL."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"opc.tcp://{host}:{self.port}"


def _without_user(url: str) -> str:
    """A URL as messages show it: no password stands in them."""
    scheme, there, rest = url.partition("://")
    return f"{scheme}{there}...@{rest.rpartition('@')[2]}" if "@" in rest else url


def address_of(url: object) -> Address:
    """Return host and port of a URL."""
    rule = "such as opc.tcp://127.0.0.1:4840"
    if not isinstance(url, str):
        raise TypeError(f"url must be a text {rule}; got {checks.shown(url)}")
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", _DEFAULT if parts.port is None else parts.port
    except ValueError:
        raise checks.refuse("url", rule, _without_user(url)) from None
    if parts.scheme != "opc.tcp" or not 0 <= port <= _LARGEST or parts.username or parts.password:
        raise checks.refuse("url", rule, _without_user(url))
    return Address(host, port)
