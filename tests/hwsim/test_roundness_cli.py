"""``hwsim roundness``: a file to a decision and a sheet; its exit status, and what it refuses."""

import html
import os
import re
import sys

import numpy as np
import pytest
from hwsim_inside import in_terms

from centering.roundness import Profile
from hwsim.cli import main
from sdpgrind import units

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
    news = r"hwsim: this takes about 5 s[^\n]* \(on an idle core\)\n|(sdpgrind: compiling| *\d+ % ).*\n"
    return status, said.out, re.sub(news, "", said.err)


COLUMNS = ("--angle", "phi:deg", "--deviation", "dev", "--radius", "30")


@pytest.mark.parametrize(
    ("limit", "status", "found"),
    [("2.5um", 0, "accepted"), ("0.0015mm", 1, "rejected"), ("2.02 um", 1, "not decided")],
)
def test_its_status_is_the_decision(ring, capsys, limit, status, found):
    code, out, err = told(capsys, ring, *COLUMNS, "--limit", limit)
    assert code == status and out.splitlines()[-1].endswith(f"µm: {found}") and not err


@pytest.mark.usefixtures("sketch")
@pytest.mark.parametrize("buffering", [1, -1])
def test_a_reader_that_has_gone_changes_nothing(ring, tmp_path, monkeypatch, buffering):
    """As in ``hwsim roundness ... | head -0``: the sheet is written, the status is that of the decision."""
    read, write = os.pipe()
    os.close(read)
    page = tmp_path / "ring.html"
    with os.fdopen(write, "w", buffering) as output, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", output)
        status = main(["roundness", str(ring), *COLUMNS, "--limit", "1.5um", "--report", str(page)])
    assert status == 1 and page.exists() and main(["verify", str(page)]) == 0


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
    ("given", "upr"), [("3-30", (3, 30)), ("2-15", "2-15"), ("15-", (15, None)), ("62.5", 62.5), ("1-50", 50)]
)
def test_any_band_of_the_library_is_taken(ring, capsys, given, upr):
    profile = Profile.read(ring, angle=("phi", "deg"), deviation="dev", radius=30.0)
    code, out, _ = told(capsys, ring, *COLUMNS, "--upr", given)
    assert code == 0 and f"{profile.filter(upr=upr).roundness()!r}" in out


def test_its_help_says_what_a_band_is(capsys):
    with pytest.raises(SystemExit):
        main(["roundness", "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "cut-off in undulations per revolution" in said and "15-150 keeps waves of 15 to 150 a turn" in said
    )
    assert "2-15=0.5um: those of 2 to 15" in said


def test_before_and_harmonics_are_those_of_python(ring, capsys, tmp_path):
    """3 upr of 1 um on a noise of 0.1 um: known to +- 1.96 x 0.1 sqrt(2/720) = 0.0103 um."""
    form = 3 * np.cos(np.radians(3 * ANGLE)) + np.cos(np.radians(2 * ANGLE + 40))
    form += 0.1 * np.random.default_rng(1).normal(size=ANGLE.size)
    earlier, page = tmp_path / "before.csv", tmp_path / "ring.html"
    rows = [f"{angle:.1f};{each:.4f}" for angle, each in zip(ANGLE, form, strict=True)]
    earlier.write_text("\n".join(["phi;dev (um)", *rows]))
    limits = ("--harmonic-limit", "2-15=1.5um", "--harmonic-limit", "42=0.05 um")
    given = (*COLUMNS, "--before", earlier, "--rotation", "0deg", *limits, "--report", page)
    code, out, err = told(capsys, ring, *given)
    now, then = (
        Profile.read(file, angle=("phi", "deg"), deviation="dev", radius=30.0) for file in (ring, earlier)
    )
    change = now.compare(then, rotation=0.0)
    held = now.harmonics(42, limits={(2, 15): units.um(1.5), 42: units.um(0.05)})
    assert code == 0 and not err and f"change  {change!r}\n" in out
    assert [line for line in out.splitlines() if "upr:" in line] == [
        f"limit   {each}" for each in held.decisions
    ]
    assert held.decisions[0].half == pytest.approx(units.um(0.0103), rel=0.1)
    sheet = page.read_text("utf-8")
    assert change._told() in html.unescape(sheet) and "Before and after" in sheet
    assert f"{held.decisions[1]} (before the filter)" in sheet and main(["verify", str(page)]) == 0
    code, out, _ = told(capsys, ring, *COLUMNS, "--harmonic-limit", "3=0.9um", "--limit", "4um")
    assert code == 1 and "4 µm: accepted" in out and out.endswith("limit 0.9 µm: rejected\n")
    code, out, _ = told(capsys, ring, *COLUMNS, "--harmonic-limit", "3=1um")
    assert code == 1 and out.endswith("limit 1 µm: not decided\n")


def test_noise_and_centred_deviations(ring, capsys):
    given = ("--angle", "phi:deg", "--deviation", "dev", "--centred", "--noise-sd", "0.05um")
    code, out, _ = told(capsys, ring, *given)
    profile = Profile.read(ring, angle=("phi", "deg"), deviation="dev", centred=True)
    circle = profile.with_noise_sd(5e-5).filter(upr=50).roundness()
    assert code == 0 and f"{circle!r}" in out and "radius not known" in out
    assert "step    standard deviation of a reading given as 0.05 µm; the readings show 0.1" in out
    found = profile.filter(upr=50).roundness()
    ratio = (
        5e-5 / profile.noise_sd
    )  # two estimators of 0.1 um, by the median and by residuals, differ by some percent
    np.testing.assert_allclose(circle.noise_sd, ratio * found.noise_sd, rtol=0.1)
    code, out, err = told(capsys, ring, *given, "--tip-radius", "1mm")
    assert code == 2 and "--tip-radius must be 0 where the radius is not known (mm); got 1.0" in err


@pytest.mark.parametrize("given", [("--circle", "MCC"), ("--circle", "MIC"), ("--filter", "robust")])
def test_without_an_interval_no_decision_can_be_signed(ring, capsys, given):
    code, out, err = told(capsys, ring, *COLUMNS, "--limit", "3um", *given)
    assert code == 1 and not err and "RONt 2." in out
    last = out.splitlines()[-1]
    assert "as measured; limit 3 µm: not decided, no interval of RONt is proved" in last
    assert given[1] in last


def test_turns_of_two_rings_are_told(capsys, tmp_path):
    """Centres 18 and 20 um off, on opposite sides: the mean form is neither's, and nothing is decided."""
    noise, rows = 0.02 * np.random.default_rng(3).normal(size=(2, ANGLE.size)), ["phi;dev (um)"]
    for shift, lobes, each in ((18.0, 3, noise[0]), (-20.0, 2, noise[1])):
        form = shift * np.cos(np.radians(ANGLE)) + 2 * np.cos(np.radians(lobes * ANGLE)) + each
        rows += [f"{angle:.1f};{one:.3f}" for angle, one in zip(ANGLE, form, strict=True)]
    both = tmp_path / "both.csv"
    both.write_text("\n".join(rows))
    code, out, err = told(capsys, both, *COLUMNS, "--limit", "10um")
    told_of = "95 % guaranteed); limit 10 µm: not decided, most of the measured value is noise\n"
    assert code == 1 and not err and out.endswith(told_of)
    assert out.splitlines()[1].startswith(
        "note    the centre differs by 38.0 µm from turn to turn, by more than 5"
    )
    assert "of another part? --section NAME=WORD takes one" in out


def test_dust_is_noticed_unasked(ring, capsys, tmp_path):
    dusty = tmp_path / "dusty.csv"
    rows = ring.read_text().splitlines()
    rows[300] = rows[300].partition(";")[0] + ";40.0"
    dusty.write_text("\n".join(rows))
    _, out, _ = told(capsys, dusty, *COLUMNS)
    assert "note    1 reading looks like an asperity; --remove-asperities takes it out\n" in out
    _, out, _ = told(capsys, dusty, *COLUMNS, "--remove-asperities")
    assert "asperity;" not in out and "step    1 reading of 1 asperity more than 6 sd" in out


def test_a_value_above_its_own_interval_is_explained(ring, capsys):
    _, out, _ = told(capsys, ring, *COLUMNS, "--upr", "100")
    circle = (
        Profile.read(ring, angle=("phi", "deg"), deviation="dev", radius=30.0).filter(upr=100).roundness()
    )
    assert circle.ron_t > circle.interval().high and f"note    {circle.remarks[0]}\n" in out


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--deviation", "dev"), "--radius must be the nominal radius of deviations (mm); it is not given"),
        (
            ("--deviation", "foo", "--radius", "30"),
            "ring.csv: --deviation must be one of its columns; got 'foo'",
        ),
        (("--reading", "dev"), "these are deviations: say --deviation dev:um, --radius ...\n"),
        (("--reading", "dev", "--radius", "3"), "--radius must be left out where readings are radii (mm)"),
        ((), "--angle must be named, and either --reading or --deviation, as --angle angle:deg, --deviation"),
    ],
)
def test_messages_name_options(ring, capsys, given, said):
    code, out, err = told(capsys, ring, "--angle", "phi:deg", *given)
    assert code == 2 and said in err and not out


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (
            "reading must have at least 64 samples; got 60",
            "the readings must have at least 64 samples; got 60",
        ),
        (
            "a.csv: angle must be in rad: angle=('phi', 'deg')",
            "a.csv: --angle must be in rad: --angle ('phi', 'deg')",
        ),
        ('several: section=("nr", 3) reads one', "several: --section nr=3 reads one"),
        ('several: section=("section", 3) reads one', "several: --section section=3 reads one"),
        (
            'parts, say section=("section", ...) or Sections.read; they',
            "parts, say --section section=WORD for one of them, or read all in Python, Sections.read; they",
        ),
        (
            "deviation must be one of its columns, 'radius must', \"upr=5\"; the part's upr=5 and user's",
            "--deviation must be one of its columns, 'radius must', \"upr=5\"; the part's --upr 5 and user's",
        ),
        ("radius must be known, or centred=True", "--radius must be known, or --centred"),
        ("the radius of the circle, angle and height", "the radius of the circle, angle and height"),
    ],
)
def test_terms(message, said):
    assert in_terms(message) == said


@pytest.mark.parametrize(
    ("given", "refused"),
    [
        (("--limit", "2.5"), "--limit must have its unit, as 2.5um or 0.0025mm; got '2.5'"),
        (("--limit", "2.5 kg"), "--limit must have a unit like mm; got '2.5 kg'"),
        (("--noise-sd", "0.05"), "--noise-sd must have its unit, as 0.05um; got '0.05'"),
        (("--noise-sd", "9um"), "--noise-sd must be at most the height of the readings, 0.00"),
        (
            ("--harmonic-limit", "2-15=0.5"),
            "--harmonic-limit must be a harmonic or a band, upr, and an ampli",
        ),
        (("--harmonic-limit", "1=0.5um"), "--harmonic-limit must be of a harmonic from 2 upr on"),
        (("--harmonic-limit", "15-2=0.5um"), "--harmonic-limit must be of a harmonic from 2 upr on"),
        (
            ("--harmonic-limit", "400=0.5um"),
            "--harmonic-limit must be <= 360, half of the points of one turn",
        ),
        (("--rotation", "0"), "--rotation must have its unit, as 0deg or 0.1rad; got '0'"),
        (("--rotation", "0deg"), "--rotation must be given with --before; got '0deg'"),
        (("--before", "none.csv"), "the file must exist; got"),
        (
            ("--upr", "many"),
            "--upr must be a cut-off, upr, or a band of them, as 50, 15-150 or 15-; got 'many'",
        ),
        (
            ("--upr", "3-30-60"),
            "--upr must be a cut-off, upr, or a band of them, as 50, 15-150 or 15-; got '3-3",
        ),
        (
            ("--upr", "1.2.3"),
            "--upr must be a cut-off, upr, or a band of them, as 50, 15-150 or 15-; got '1.2.3'",
        ),
        (("--upr", "30-3"), "--upr must be a pair (low, high) with 1 <= low < high, one of them given"),
        (
            ("--height", "30mm"),
            "--height must be given with --instrument, whose spindle may err with it; got '30mm'",
        ),
        (("--upr", "2-15", "--circle", "MZC"), "--circle must be 'LSC' after Gaussian band"),
        (("--upr", "400"), "--upr must be < 360, half of the points of one turn (upr); got 400"),
        (
            ("--radius", "0.03"),
            "--radius must be 1 ... 3000 mm; got 0.03 mm; if given in another unit: --radius 0.03m\n",
        ),
        (
            ("--tip-radius", "3750"),
            "--tip-radius must be 0.001 ... 50 mm; got 3750 mm; if given in another unit: --tip-radius 3750nm"
            " or --tip-radius 3750um\n",
        ),
        (("--centred",), "--centred must be left out with --radius, as the radius is known then; got '30'\n"),
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
    assert "they are read as turns of one" in err and "say --section nr=WORD for one of them" in err
    given = ("--deviation", "dev", "--radius", "30", "--section")
    code, out, _ = told(capsys, both, *given, "nr=2")
    assert code == 0 and "720 points" in out and out.splitlines()[1] == "section 2: 720 of 1440 rows"
    code, _, err = told(capsys, both, *given, "nr")
    assert code == 2 and "--section must be a column and one of its words, as nr=1; got 'nr'" in err
