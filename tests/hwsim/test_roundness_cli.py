"""``hwsim roundness``: a file to a decision and a sheet; its exit status, and what it refuses."""

import numpy as np
import pytest

from centering.roundness import Profile
from hwsim.cli import main

ANGLE = np.arange(0.0, 360.0, 0.5)


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    form = np.cos(np.radians(3 * ANGLE)) + 0.1 * np.random.default_rng(0).normal(size=ANGLE.size)  # um
    path = tmp_path_factory.mktemp("cli") / "ring.csv"
    rows = [f"{angle:.1f};{each:.4f}" for angle, each in zip(ANGLE, form, strict=True)]
    path.write_text("\n".join(["phi;dev (um)", *rows]))
    return path


def told(capsys, *given):
    status = main(["roundness", *map(str, given)])
    said = capsys.readouterr()
    return status, said.out, said.err.replace("hwsim: about 5 s ...\n", "")


COLUMNS = ("--angle", "phi:deg", "--deviation", "dev", "--radius", "30")


@pytest.mark.parametrize(
    ("limit", "status", "found"),
    [("2.5um", 0, "accepted"), ("0.0015mm", 1, "rejected"), ("2.02 um", 1, "not decided")],
)
def test_its_status_is_the_decision(ring, capsys, limit, status, found):
    code, out, err = told(capsys, ring, *COLUMNS, "--limit", limit)
    assert code == status and out.splitlines()[-1].endswith(f"µm: {found}") and not err


def test_it_finds_what_python_finds_and_writes_the_sheet(ring, capsys, tmp_path):
    page, tester = tmp_path / "ring.html", tmp_path / "tester.toml"
    tester.write_text('spindle_error = "0.05 um"\nspindle_error_per_height = 3e-7\ngain_sd = "1 %"\n')
    given = ("--filter", "spline", "--upr", "2-15", "--instrument", tester, "--height", "100")
    code, out, err = told(capsys, ring, *COLUMNS, *given, "--limit", "4um", "--report", page)
    profile = Profile.read(ring, angle=("phi", "deg"), deviation="dev", radius=30.0)
    found = profile.filter("spline", upr="2-15").roundness()
    assert code == 0 and f"{found!r}" in out and "spindle ± 0.08 µm at most" in out
    assert out.splitlines()[0] == "file    ring.csv: 720 points" and not err
    assert "limit 4 µm: accepted" in page.read_text("utf-8") and main(["verify", str(page)]) == 0
    code, out, _ = told(capsys, ring, *COLUMNS, "--circle", "MIC", "--filter", "none")
    assert code == 0 and f"{profile.roundness('MIC')!r}" in out and "none: all undulations" in out


@pytest.mark.parametrize(
    ("given", "refused"),
    [
        (("--limit", "2.5"), "--limit must have its unit, as 2.5um or 0.0025mm; got '2.5'"),
        (("--limit", "2.5 kg"), "--limit must have a unit like mm; got '2.5 kg'"),
        (("--limit", "3um", "--circle", "MIC"), "kind must be LSC or MZC for an interval"),
        (("--upr", "many"), "upr must be one of 1-15"),
        (("--upr", "400"), "upr must be < 360, half of the points of one turn (upr); got 400"),
        (("--radius", "0.03m", "--tip-radius", "abc"), "--tip-radius must be"),
        (("--instrument", "none.toml"), "none.toml: No such file"),
    ],
)
def test_refusals(ring, capsys, given, refused):
    code, out, err = told(capsys, ring, *COLUMNS, *given)
    assert code == 2 and err.startswith(f"hwsim: {refused}") and not out and err.count("\n") == 1


def test_a_wrong_key_of_the_tester_is_named(ring, capsys, tmp_path):
    tester = tmp_path / "tester.toml"
    tester.write_text("[instrument]\nspindle_eror = 1e-5\n")
    code, _, err = told(capsys, ring, *COLUMNS, "--instrument", tester)
    assert code == 2 and "instrument.spindle_eror is not a key; is instrument.spindle_error meant?" in err


def test_the_only_column_of_angles_is_taken(ring, capsys, tmp_path):
    named = tmp_path / "named.csv"
    named.write_text(ring.read_text().replace("phi;", "phi [deg];", 1))
    code, out, _ = told(capsys, named, "--deviation", "dev", "--radius", "30", "--limit", "2.5um")
    assert code == 0 and out == told(capsys, ring, *COLUMNS, "--limit", "2.5um")[1].replace(
        "ring.csv", "named.csv"
    )
    code, _, err = told(capsys, ring, "--deviation", "dev", "--radius", "30")
    assert code == 2 and "--angle must name one column with its unit, as phi:deg; ring.csv has 'phi'" in err
    code, _, err = told(capsys, ring, *COLUMNS, "--filter", "none", "--upr", "15")
    assert code == 2 and "--upr must be left out with --filter none; got '15'" in err


@pytest.mark.filterwarnings("default")
def test_sections_in_one_file(ring, capsys, tmp_path):
    """Read as turns of one section they warn; one of them is read alone."""
    both, rows = tmp_path / "both.csv", ring.read_text().splitlines()[1:]
    both.write_text("\n".join(["phi [deg];dev (um);nr", *(f"{row};{k}" for k in (1, 2) for row in rows)]))
    code, out, err = told(capsys, both, "--deviation", "dev", "--radius", "30")
    assert code == 0 and "1440 points" in out and "'nr' is one word in each turn" in err
    assert "they are read as turns of one" in err
    given = ("--deviation", "dev", "--radius", "30", "--section")
    code, out, _ = told(capsys, both, *given, "nr=2")
    assert code == 0 and "720 points" in out
    code, _, err = told(capsys, both, *given, "nr")
    assert code == 2 and "--section must be a column and one of its words, as nr=1; got 'nr'" in err
