"""Certificates, users and addresses: who is let in, and the sentence for whom it is not."""

import shutil
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from asyncua import ua
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from opcua_fakes import ANY, Axis, Drive, live

import hwsim
from hwsim import cli
from hwsim.opcua import _desk, _keys
from hwsim.opcua._desk import Failures

pytestmark = pytest.mark.usefixtures("nothing_collected")

USERS = {"operator": "correct horse", "observer": "battery"}


@pytest.fixture(scope="module", autouse=True)
def cheaply_hashed():
    """Passwords hashed at a thousandth of the cost that is chosen, whose value no refusal depends on."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(_keys._COST, "n", 1 << 4)
        yield


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("machine") / "keys"
    hwsim.opcua.make_keys(folder)
    return folder


@pytest.fixture(scope="module")
def server(keys):
    with hwsim.serve(Axis(length=0.2), ANY, security=keys, users=USERS) as server:
        yield server


@pytest.fixture(scope="module")
def strangers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stranger") / "keys"
    hwsim.opcua.make_keys(folder)
    return folder


def copied(folder, to):
    shutil.copytree(folder, to)
    return to


def write_certificate(folder, **when):
    """A certificate of another validity, with the same key."""
    key = serialization.load_pem_private_key((folder / "private_key.pem").read_bytes(), None)
    data = _keys._signed(key, **when).public_bytes(serialization.Encoding.DER)
    (folder / "certificate.der").write_bytes(data)
    return data


def test_an_operator_with_trusted_keys_runs_a_part_encrypted(server, keys):
    plant = hwsim.OpcuaPlant(server.url, security=keys, user=("operator", USERS["operator"]))
    log = hwsim.run(plant, Drive(), live=live(deadline=0.5))
    assert log.outcome.aborted.values.tolist() == [0.0]
    plant.close()


def test_an_observer_reads_and_does_not_command(server, keys):
    plant = hwsim.OpcuaPlant(server.url, security=keys, user=("observer", USERS["observer"]))
    assert plant.look().keys() == {"place", "speed"}
    with pytest.raises(
        PermissionError, match=f"user must be the operator to command {server.url}; got 'observer'"
    ):
        hwsim.run(plant, Drive(), live=live(deadline=0.5))
    plant.close()


def test_a_user_that_is_not_known_is_refused_and_after_five_failed_logins_all_of_an_address(keys):
    wrong = [
        None,
        ("operator", "wrong"),
        ("nobody", "correct horse"),
        ("operator", ""),
        ("operator", "guess"),
    ]
    with hwsim.serve(Axis(), ANY, security=keys, users=USERS) as own:
        for user in (*wrong, ("operator", USERS["operator"])):
            with pytest.raises(PermissionError) as error:
                hwsim.OpcuaPlant(own.url, security=keys, user=user)
            assert str(error.value) == (
                f"user must be one that {own.url} knows, with its password, "
                "or too many failed logins came from this address: wait a minute"
            )


class Peer:
    """A session as the desk names it."""

    def __init__(self, host):
        self.name = (host, 50000)


def test_who_guesses_locks_out_himself_and_for_a_minute_only(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(_desk, "monotonic", lambda: now[0])
    failures, guesser = Failures(), Peer("10.0.0.5")
    for _ in range(4):
        failures.count(guesser, b"his")
    failures.refuse(guesser, b"his")  # four are borne
    failures.count(guesser, b"his")
    with pytest.raises(ua.uaerrors.BadUserAccessDenied):
        failures.refuse(guesser, b"his")
    failures.refuse(Peer("10.0.0.6"), b"his")  # another address
    failures.refuse(guesser, b"the operator's")  # by the same router
    now[0] += 59.0
    with pytest.raises(ua.uaerrors.BadUserAccessDenied):
        failures.refuse(guesser, b"his")  # which does not count: he waits no longer for it
    now[0] += 1.0
    failures.refuse(guesser, b"his")
    assert not failures._at  # nothing is kept of who has gone


def test_a_server_that_is_not_trusted_is_refused(server, strangers):
    said = f"the server at {server.url} is not trusted: its certificate is not in {strangers / 'trusted'}"
    with pytest.raises(PermissionError, match=said):
        hwsim.OpcuaPlant(server.url, security=strangers, user=("operator", USERS["operator"]))


def test_a_client_that_is_not_trusted_is_refused(server, keys, strangers, tmp_path):
    folder = copied(strangers, tmp_path / "keys")
    shutil.copy(keys / "certificate.der", folder / "trusted" / "machine.der")
    with pytest.raises(PermissionError, match=f"{server.url} does not trust certificate.der of {folder}"):
        hwsim.OpcuaPlant(server.url, security=folder, user=("operator", USERS["operator"]))


def test_a_client_without_keys_is_refused(server):
    with pytest.raises(
        PermissionError, match=f"security must be a folder of certificates: {server.url} encrypts"
    ):
        hwsim.OpcuaPlant(server.url, security="none")


def test_a_session_that_names_another_s_certificate_is_refused(
    server, keys, strangers, tmp_path, monkeypatch
):
    """The channel's certificate counts, not the one that a session names."""
    from asyncua.client.ua_session import UaSession

    folder = copied(strangers, tmp_path / "keys")
    shutil.copy(keys / "certificate.der", folder / "trusted" / "machine.der")
    create = UaSession.create_session

    async def lying(self, parameters):
        parameters.ClientCertificate = (keys / "certificate.der").read_bytes()
        return await create(self, parameters)

    monkeypatch.setattr(UaSession, "create_session", lying)
    with pytest.raises((PermissionError, ConnectionError)):
        hwsim.OpcuaPlant(server.url, security=folder, user=("operator", USERS["operator"]))


NOW = datetime.now(UTC)


@pytest.mark.parametrize(
    ("when", "said"),
    [
        (
            {"begins": NOW - timedelta(days=9), "valid": timedelta(days=8)},
            "certificate.der is not valid after ",
        ),
        ({"begins": NOW + timedelta(days=1)}, "certificate.der is not valid before "),
    ],
)
def test_a_certificate_out_of_date_names_its_file(keys, tmp_path, when, said):
    folder = copied(keys, tmp_path / "keys")
    write_certificate(folder, **when)
    with pytest.raises(ValueError, match=said) as error:
        hwsim.serve(Axis(), ANY, security=folder, users=USERS)
    assert str(error.value).startswith(str(folder))


def test_a_trusted_certificate_out_of_date_is_refused_with_its_file(keys, tmp_path):
    folder = copied(keys, tmp_path / "keys")
    old = write_certificate(
        copied(keys, tmp_path / "peer"), begins=NOW - timedelta(days=9), valid=timedelta(days=8)
    )
    (folder / "trusted" / "old.der").write_bytes(old)
    found = _keys.read_keys(folder)
    assert found.refusal(old).startswith(f"{folder / 'trusted' / 'old.der'} is not valid after ")
    assert found.refusal((folder / "certificate.der").read_bytes()) == ""
    assert found.refusal(None) == found.refusal(b"x") == f"its certificate is not in {folder / 'trusted'}"


def test_files_that_are_no_keys(keys, tmp_path):
    for name, text, said in (
        ("certificate.der", b"no certificate", "certificate.der must be a certificate in DER or PEM"),
        ("private_key.pem", b"no key", "private_key.pem must be a private key in PEM without a password"),
    ):
        folder = copied(keys, tmp_path / name)
        (folder / name).write_bytes(text)
        with pytest.raises(ValueError, match=said):
            _keys.read_keys(folder)
    folder = copied(keys, tmp_path / "other")
    key = rsa.generate_private_key(65537, 2048).private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    (folder / "private_key.pem").write_bytes(key)
    with pytest.raises(
        ValueError, match=r"private_key.pem must be the key of .*certificate.der; it is another one"
    ):
        _keys.read_keys(folder)
    with pytest.raises(ValueError, match=r"certificate.der is missing; `hwsim keys .*` makes a pair of keys"):
        _keys.read_keys(tmp_path / "nowhere")


def test_no_password_of_a_url_stands_in_a_message():
    with pytest.raises(ValueError) as error:
        hwsim.serve(Axis(), "opc.tcp://user:battery@127.0.0.1", security="none")
    assert str(error.value) == "url must be such as opc.tcp://127.0.0.1:4840; got 'opc.tcp://...@127.0.0.1'"


@pytest.mark.parametrize(
    ("users", "said"),
    [
        (None, 'users must be passwords by name: {"operator": ...}; got None'),
        (
            {"observer": "battery"},
            "users must be passwords by name: {\"operator\": ...}; got names ['observer']",
        ),
        ({"operator": "x", "root": "y"}, "a name in users must be one of observer, operator; got 'root'"),
        ({"operator": ""}, "users['operator'] must be a password, a text that is not empty"),
    ],
)
def test_wrong_users(keys, users, said):
    with pytest.raises(ValueError) as error:
        hwsim.serve(Axis(), ANY, security=keys, users=users)
    assert str(error.value).startswith(said)


def test_passwords_are_kept_as_hashes_with_a_salt_of_their_own():
    users = _keys.Users({"operator": "same", "observer": "same"})
    (one, first), (two, second) = users._hashed.values()
    assert one != two and first != second and b"same" not in first + second
    assert users.get_user(None, "operator", "same").name == "operator"
    for name, password in (("operator", "Same"), ("observer", None), (None, "same"), ("nobody", "same")):
        assert users.get_user(None, name, password) is None


def test_keys_of_the_command_line(tmp_path, capsys):
    folder = tmp_path / "keys"
    assert cli.main(["keys", str(folder)]) == 0
    assert capsys.readouterr().out.startswith(f"{folder / 'certificate.der'}")
    assert (folder / "private_key.pem").stat().st_mode & 0o777 == 0o600
    assert _keys.read_keys(folder).own.key.key_size == 2048
    assert cli.main(["keys", str(folder)]) == 2
    assert "is there already; keys are never overwritten" in capsys.readouterr().err


def test_all_addresses_are_listened_at_only_when_written_out(keys):
    for url in ("opc.tcp://:4840", "opc.tcp://0.0.0.0:4840"):
        with pytest.raises(ValueError, match='listen must be "all" to listen at all addresses; got url'):
            hwsim.serve(Axis(), url, security=keys, users=USERS)
    with hwsim.serve(Axis(), ANY, security=keys, users=USERS, listen="all") as own:
        port = own.url.rpartition(":")[2]
        plant = hwsim.OpcuaPlant(
            f"opc.tcp://127.0.0.1:{port}", security=keys, user=("observer", USERS["observer"])
        )
        assert np.isfinite(plant.look()["place"])
        plant.close()
