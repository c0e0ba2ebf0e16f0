"""``hwsim export``: a saved policy as C99 or an FMU, smaller tables, what it refuses and what it points to."""

import json
import zipfile

import pytest

import sdpgrind
from hwsim.cli import main
from sdpgrind import sdp


def removed(state, control):
    return sdp.LogNormal(0.0004 * control.strokes, 0.2 * 0.0004 * control.strokes)


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


def refused(capsys, *arguments):
    assert main(["export", *map(str, arguments)]) != 0
    return capsys.readouterr().err


def test_a_saved_policy(saved, tmp_path, capsys):
    assert main(["export", str(saved), str(tmp_path / "honing")]) == 0
    assert "honing.h, honing.c" in capsys.readouterr().out
    sdpgrind.export(sdpgrind.load(saved), tmp_path / "wanted", name="honing")
    for path in (tmp_path / "wanted").iterdir():
        assert (tmp_path / "honing" / path.name).read_bytes() == path.read_bytes()


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


def test_errors_point_to_the_option(saved, tmp_path, capsys):
    assert "or an FMU by --target fmi2" in refused(capsys, saved, tmp_path / "x.fmu")
    assert "end in .fmu with --target fmi2" in refused(capsys, saved, tmp_path / "x", "--target", "fmi2")
    told = refused(capsys, saved, tmp_path / "my bead")
    assert "--name must be given" in told and "'my bead'" in told
    assert list(tmp_path.iterdir()) == []
    assert main(["export", str(saved), str(tmp_path / "bead")]) == 0
    told = refused(capsys, saved, tmp_path / "bead", "--name", "other")
    assert "--overwrite must be given where path holds another export; got" in told and "True" not in told


def test_help(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "write a saved plan as C99 or as an FMU" in " ".join(capsys.readouterr().out.split())
