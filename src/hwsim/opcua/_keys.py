"""Keys and certificates of servers and clients in a folder, and the passwords of users.

``certificate.der`` and ``private_key.pem`` are one's own; ``trusted/`` has the certificates of peers.
"""

import hmac
import os
import secrets
import socket
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from hashlib import scrypt
from pathlib import Path
from typing import Any, Final, NamedTuple

from asyncua.crypto.permission_rules import User, UserRole
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from sdpgrind.base import checks

ROLES: Final = ("observer", "operator")
_BITS, _EXPONENT = 2048, 65537  # source: OPC 10000-7, Basic256Sha256 takes 2048 to 4096 bits
_VALID = timedelta(days=1826)  # chosen: five years, a machine outlives it
_COST = {"n": 1 << 14, "r": 8, "p": 1}  # source: RFC 7914; 16 MiB and some 50 ms a login


class Own(NamedTuple):
    """A pair of one's own."""

    certificate: x509.Certificate
    key: rsa.RSAPrivateKey
    folder: Path
    uri: str  # of the application, as the certificate says


class Keys(NamedTuple):
    """A folder of keys that was read."""

    own: Own
    trusted: Mapping[bytes, Path]  # certificate -> its file

    def refusal(self, certificate: bytes | None) -> str:
        """Why the certificate of a peer is refused; "": it is not."""
        file = self.trusted.get(certificate or b"")
        folder = self.own.folder / "trusted"
        if file is None or certificate is None:
            return f"its certificate is not in {folder}"
        return _out_of_date(x509.load_der_x509_certificate(certificate), file)


class ServerKeys(NamedTuple):
    """Keys and users of a server."""

    keys: Keys
    users: "Users"

    @property
    def own(self) -> Own:
        """The server's own pair."""
        return self.keys.own


class Users:
    """Names and scrypt hashes of passwords; all logins take the same time."""

    def __init__(self, passwords: Mapping[str, str]) -> None:
        self._hashed = {name: _hashed(password) for name, password in passwords.items()}
        self._nobody = _hashed(secrets.token_hex())

    def get_user(
        self, server: Any, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> User | None:
        """Return the user with a name and a password; None: refused."""
        salt, wanted = self._hashed.get(username or "", self._nobody)
        same = hmac.compare_digest(_hash(password or "", salt), wanted)
        return User(role=UserRole.User, name=username) if same and username in self._hashed else None


def _hashed(password: str) -> tuple[bytes, bytes]:
    salt = secrets.token_bytes(16)
    return salt, _hash(password, salt)


def _hash(password: str, salt: bytes) -> bytes:
    return scrypt(password.encode(), salt=salt, **_COST)


def make_keys(folder: str | os.PathLike[str]) -> list[Path]:
    """Make a pair of 2048 bits, and a folder ``trusted`` that holds its certificate.

    To let two computers talk, copy the ``certificate.der`` of each to ``trusted`` of the other, under a name
    of its own.

    Parameters
    ----------
    folder : path
        Folder of the keys; made where it is missing.

    Returns
    -------
    list of pathlib.Path
        Certificate and private key.

    Raises
    ------
    FileExistsError
        When there are keys already; they are never overwritten.

    Examples
    --------
    >>> import tempfile
    >>> import hwsim
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in hwsim.opcua.make_keys(folder)]
    ['certificate.der', 'private_key.pem']
    """
    home = checks.path("folder", folder)
    certificate, private = home / "certificate.der", home / "private_key.pem"
    for path in (certificate, private):
        if path.exists():
            raise FileExistsError(f"{path} is there already; keys are never overwritten")
    (home / "trusted").mkdir(parents=True, exist_ok=True)
    key = rsa.generate_private_key(_EXPONENT, _BITS)
    signed = _signed(key).public_bytes(serialization.Encoding.DER)
    told = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    with os.fdopen(os.open(private, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(told)
    certificate.write_bytes(signed)
    (home / "trusted" / f"own-{socket.gethostname()}.der").write_bytes(signed)
    return [certificate, private]


def _signed(key: rsa.RSAPrivateKey, begins: datetime | None = None, valid: timedelta = _VALID) -> Any:
    """A certificate signed by itself, for servers and clients."""
    host = socket.gethostname()
    uri = f"urn:sdpgrind:hwsim:{host}:{secrets.token_hex(4)}"
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"hwsim on {host}"[:64])])
    begins = begins or datetime.now(UTC) - timedelta(minutes=5)  # clocks of two computers differ
    alternatives = x509.SubjectAlternativeName([x509.UniformResourceIdentifier(uri), x509.DNSName(host)])
    use = (
        "digital_signature",
        "content_commitment",
        "key_encipherment",
        "data_encipherment",
        "key_cert_sign",
    )
    uses = {
        name: name in use for name in (*use, "key_agreement", "crl_sign", "encipher_only", "decipher_only")
    }
    roles = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH])
    return (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(begins + valid)
        .add_extension(alternatives, critical=False)
        .add_extension(x509.KeyUsage(**uses), critical=True)
        .add_extension(roles, critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )


def read_keys(security: object) -> Keys | None:
    """Read a folder of keys; None: security="none"."""
    if security == "none":
        return None
    if security is None:
        raise ValueError(
            "security must be a folder of certificates, which `hwsim keys FOLDER` makes, "
            'or "none" on a loopback address; got None'
        )
    home = checks.path("security", security)  # type: ignore[arg-type]
    return Keys(_own(home), _trusted(home / "trusted"))


def _own(home: Path) -> Own:
    path, private = home / "certificate.der", home / "private_key.pem"
    certificate = _certificate(path)
    if said := _out_of_date(certificate, path):
        raise ValueError(said)
    try:
        key = serialization.load_pem_private_key(_read(private), None)
    except (ValueError, TypeError):
        raise ValueError(f"{private} must be a private key in PEM without a password") from None
    if not isinstance(key, rsa.RSAPrivateKey):
        raise ValueError(f"{private} must be an RSA key; `hwsim keys` makes such a one")
    public = serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo
    if key.public_key().public_bytes(*public) != certificate.public_key().public_bytes(*public):
        raise ValueError(f"{private} must be the key of {path}; it is another one")
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        return Own(certificate, key, home, names.get_values_for_type(x509.UniformResourceIdentifier)[0])
    except (x509.ExtensionNotFound, IndexError):
        raise ValueError(
            f"{path} must have the URI of an application; `hwsim keys` makes such a one"
        ) from None


def _trusted(folder: Path) -> dict[bytes, Path]:
    found = sorted(path for path in folder.glob("*") if path.suffix in (".der", ".pem", ".crt", ".cer"))
    return {_certificate(path).public_bytes(serialization.Encoding.DER): path for path in found}


def _certificate(path: Path) -> x509.Certificate:
    data = _read(path)
    try:
        if data.lstrip().startswith(b"-----"):
            return x509.load_pem_x509_certificate(data)
        return x509.load_der_x509_certificate(data)
    except ValueError:
        raise ValueError(f"{path} must be a certificate in DER or PEM") from None


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise ValueError(f"{path} is missing; `hwsim keys {path.parent}` makes a pair of keys") from None


def _out_of_date(certificate: x509.Certificate, path: Path) -> str:
    """Why a certificate is not valid now; "": it is."""
    now = datetime.now(UTC)
    if now < certificate.not_valid_before_utc:
        return f"{path} is not valid before {certificate.not_valid_before_utc:%Y-%m-%d %H:%M} UTC"
    if now > certificate.not_valid_after_utc:
        return f"{path} is not valid after {certificate.not_valid_after_utc:%Y-%m-%d %H:%M} UTC"
    return ""


def server_keys(security: object, users: Mapping[str, str] | None) -> ServerKeys | None:
    """Keys and users of a server; None: security="none"."""
    keys = read_keys(security)
    if keys is None:
        if users is not None:
            raise ValueError('users must be None with security="none", which would send passwords in clear')
        return None
    if not isinstance(users, Mapping) or "operator" not in users:
        given = f"names {sorted(map(str, users))}" if isinstance(users, Mapping) else type(users).__name__
        raise ValueError(f'users must be passwords by name: {{"operator": ...}}; got {given}')
    for name, password in users.items():
        checks.one_of("a name in users", name, ROLES)
        if not isinstance(password, str) or not password:
            raise ValueError(f"users[{name!r}] must be a password, a text that is not empty")
    return ServerKeys(keys, Users(users))
