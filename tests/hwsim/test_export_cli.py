"""``hwsim export``: a saved policy as C99 or an FMU, smaller tables, what it refuses and what it points to."""

import json
import re
import zipfile
from types import SimpleNamespace

import pytest

import sdpgrind
from hwsim.cli import main
from sdpgrind import sdp
from sdpgrind.codegen._files import vectors


def removed(state, control):
    return sdp.LogNormal(0.0004 * control.strokes, 0.2 * 0.0004 * control.strokes)


@pytest.fixture(scope="module", autouse=True)
def briefly():
    """Exports with 2 of the 64 digests of the self-test's long run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vectors, "BLOCKS", 2)
        yield


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    stock = sdp.Axis("stock", 0.0, 0.040, 21, "mm", below="stop")
    hone = sdp.Move(
        "hone",
        {"strokes": sdp.Levels(1, 120, 13)},
        sdp.Shift("stock", removed),
        charge=lambda state, control: 0.3 + 0.02 * control.strokes,
    )
    done = sdp.Stop("done", sdp.Charge(under=sdp.Linear(200.0), over=sdp.Linear(900.0)))
    policy = sdp.plan(sdp.Problem([stock], [hone], [done], sdp.Forever()), tolerance=1.0)
    path = tmp_path_factory.mktemp("plans") / "hone.nc"
    policy.save(path)
    return path


@pytest.fixture(scope="module")
def wanted(saved, tmp_path_factory):
    """Folder of the library's own export."""
    path = tmp_path_factory.mktemp("export") / "honing"
    sdpgrind.export(sdpgrind.load(saved), path)
    return path


def refused(capsys, *arguments):
    assert main(["export", *map(str, arguments)]) != 0
    return capsys.readouterr().err


def test_a_saved_policy(saved, wanted, tmp_path, capsys):
    """It says first what it does, before anything is loaded."""
    assert main(["export", str(saved), str(tmp_path / "honing")]) == 0
    out, error = capsys.readouterr()
    assert "honing.h, honing.c" in out and "tables in" not in out
    assert re.match(rf"hwsim: {saved} as C99: this takes about \d+ s.*measured", error)
    for path in wanted.iterdir():
        assert (tmp_path / "honing" / path.name).read_bytes() == path.read_bytes()


def test_says_first_what_it_does(saved, tmp_path, capsys):
    """With smaller tables, too; nothing where there is no plan."""
    first, why = refused(capsys, saved, tmp_path / "small", "--lost-max", "1").splitlines()
    assert f"{saved} as C99, with the value that smaller tables lose: this takes about" in first
    assert "needs the problem" in why  # a policy of the user's own has functions
    assert "as C99" not in refused(capsys, tmp_path / "none.nc", tmp_path / "x")


def test_tells_what_smaller_tables_lose(saved, tmp_path, capsys, monkeypatch):
    lost = {"all_stages": 1.78e-8, "error": 2e-3, "unit": "$"}
    manifest = {"name": "a", "precision": "int16", "lost": lost}
    monkeypatch.setattr(
        sdpgrind, "export", lambda *a, **k: SimpleNamespace(manifest=manifest, size=9, promise="same bits")
    )
    assert main(["export", str(saved), str(tmp_path / "a"), "--lost-max", "1"]) == 0
    told = "tables in int16, which lose at most 1.78e-08 $; the plan's own error is 0.002 $"
    assert capsys.readouterr().out.splitlines()[-2:] == [told, "same bits"]


def test_outputs(saved, tmp_path):
    wanted = ["--outputs", "strokes, value", "--name", "small"]
    assert main(["export", str(saved), str(tmp_path / "my bead"), *wanted]) == 0
    told = json.loads((tmp_path / "my bead" / "manifest.json").read_text())
    assert told["name"] == "small"
    assert [one["name"] for one in told["outputs"]][-1] == "value"


def test_an_fmu(saved, tmp_path):
    path = tmp_path / "honing.fmu"
    assert main(["export", str(saved), str(path), "--target", "fmi2"]) == 0 and zipfile.is_zipfile(path)


def test_lost_max_goes_on_to_the_library(saved, tmp_path, capsys):
    told = refused(capsys, saved, tmp_path / "x", "--lost-max", "-1")
    assert "lost_max must be" in told and "got -1" in told


def test_errors_point_to_the_option(saved, wanted, tmp_path, capsys):
    assert "or an FMU by --target fmi2" in refused(capsys, saved, tmp_path / "x.fmu")
    assert "end in .fmu with --target fmi2" in refused(capsys, saved, tmp_path / "x", "--target", "fmi2")
    told = refused(capsys, saved, tmp_path / "my bead")
    assert "--name must be given" in told and "'my bead'" in told
    assert list(tmp_path.iterdir()) == []
    told = refused(capsys, saved, wanted, "--name", "other")
    assert "--overwrite must be given where path holds another export; got" in told and "True" not in told


def test_help(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "write a saved plan as C99 or as an FMU" in " ".join(capsys.readouterr().out.split())
