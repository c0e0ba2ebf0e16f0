"""Pages of sections, cylinders and separations: values, limits, steps, filter, files with their digests."""

import hashlib

import html5lib
import numpy as np
import pytest
from measured_rings import turn

from centering.roundness import Profile, Sections, multistep
from sdpgrind import units
from sdpgrind.base.sheets import seal

ANGLE = turn(1, 360)
TURNS = np.radians([0.0, 10.0, 30.0, 80.0, 140.0])


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A shaft of 20 mm with three lobes of 1 um and two of 0.3 um that turn over the height; noise 0.05 um."""
    path, rng = tmp_path_factory.mktemp("pages") / "shaft.csv", np.random.default_rng(0)
    rows = [
        f"{z:g};{angle:.2f};{np.cos(np.radians(3 * angle)) + 0.3 * np.cos(np.radians(2 * angle - 3 * z)) + 0.05 * e:.4f}"
        for z in (0.0, 10.0, 20.0)
        for angle, e in zip(np.degrees(ANGLE), rng.normal(size=360), strict=True)
    ]
    path.write_text("\n".join(["z (mm);phi (deg);dev (um)", *rows]))
    return path


@pytest.fixture(scope="module")
def shaft(table):
    return Sections.read(table, height="z", angle="phi", deviation="dev", radius=20.0)


@pytest.fixture(scope="module")
def separation(tmp_path_factory):
    """Part of 3 upr and 0.4 um, spindle of 2 upr and 0.1 um, noise of 0.01 um; each setup in a file."""
    folder, read, rng = tmp_path_factory.mktemp("setups"), [], np.random.default_rng(1)
    for k, step in enumerate(TURNS):
        form = 0.4 * np.cos(3 * (ANGLE - step)) + 0.1 * np.cos(2 * ANGLE - 1.9) + 0.01 * rng.normal(size=360)
        rows = [f"{angle:.2f};{each:.5f}" for angle, each in zip(np.degrees(ANGLE), form, strict=True)]
        (folder / f"setup_{k}.csv").write_text("\n".join(["phi (deg);dev (um)", *rows]))
        read.append(Profile.read(folder / f"setup_{k}.csv", angle="phi", deviation="dev", radius=30.0))
    return folder, multistep(read, TURNS)


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def row(told, name):
    return next(line for line in told.splitlines() if line.startswith(name)).split()


def test_page_of_sections(shaft, table):
    limits = {
        "CYLt": units.um(3),
        "CYLt (MZC)": units.um(2),
        "total run-out": units.um(3),
        "straightness": 1e-6,
    }
    told = shaft.report(limits=limits)
    values = (shaft.cylinder().cyl_t, shaft.cylinder("MZC").cyl_t, shaft.total_runout(), shaft.straightness())
    for (name, limit), value in zip(limits.items(), values, strict=True):
        side = "within" if value <= limit else "above"
        assert f"{name} {1e3 * value:.4g} µm, limit {1e3 * limit:.4g} µm: not decided, {side} the" in told
    assert (
        told.count("above the limit as measured, no interval") == 2
        and "No interval is measured for cylinders" in told
    )
    for kind in ("LSC", "MZC", "MCC", "MIC"):
        assert float(row(told, kind)[1]) == pytest.approx(1e3 * shaft.cylinder(kind).cyl_t, abs=6e-4)
    ends = shaft.profiles[1].roundness().interval()
    assert [float(each) for each in row(told, "10 ")[4:6]] == pytest.approx(
        [1e3 * ends.low, 1e3 * ends.high], abs=1e-3
    )
    own = shaft.cylinder()
    runouts = [shaft.profiles[1].radial_runout(each, heights=10.0) for each in (None, own)]
    assert [float(each) for each in row(told, "10 ")[6:]] == pytest.approx(1e3 * np.array(runouts), abs=1e-3)
    for name, measure in (("total run-out", shaft.total_runout), ("coaxiality", shaft.coaxiality)):
        for axis, datum in ((", to the spindle's axis", None), (", to the part's own (LSC cylinder)", own)):
            line = next(each for each in told.splitlines() if each.startswith(f"{name}{axis}"))
            assert float(line.split()[-1]) == pytest.approx(1e3 * measure(datum), rel=1e-3)
    assert digest(table) in told.replace("\n", "") and told.count("shaft.csv") == 1 and "filter: none" in told


def test_steps_and_filter_of_sections_are_told(shaft):
    dusty = [Profile(each.angle, each.reading + 0.02 * (np.arange(360) == 77)) for each in shaft.profiles]
    told = Sections(dusty, shaft.heights).report()
    assert told.count("1 reading looks like an asperity; profile.remove_asperities() takes it out") == 3
    clean = [each.remove_asperities().filter(upr=15) for each in dusty]
    told = Sections(clean, shaft.heights).report()
    assert (
        "filter: Gaussian low-pass, 15 upr" in told and "height 10 mm, step: 1 reading of 1 asperity" in told
    )
    assert "looks like" not in told and "not read from a file" in told
    assert (
        "(no interval is measured;"
        in Sections([each.filter("robust", upr=15) for each in dusty], shaft.heights).report()
    )


def test_page_of_a_scan_has_no_sections(shaft):
    angle = np.linspace(0.0, 20 * np.pi, 1800)
    told = Sections.from_points(angle, angle, 25.0 + 1e-3 * np.cos(3 * angle)).report()
    assert "total run-out" in told and "straightness" not in told and "Roundness of each section" not in told


@pytest.mark.parametrize("kind", ["LSC", "MZC", "MCC", "MIC"])
def test_page_of_a_cylinder(kind, shaft):
    found = shaft.cylinder(kind)
    told = found.report(limits={"CYLt": units.um(10), "CYLq": 1e-6})
    assert (
        f"CYLt ({kind}) {1e3 * found.cyl_t:.4g} µm, limit 10 µm: not decided, within the limit as measured, no interval"
        in told
    )
    assert f"CYLq ({kind}) {1e3 * found.cyl_q:.4g} µm, limit 0.001 µm: not decided, above the limit" in told
    assert found.certificate in told and row(told, "CYLp")[1] == f"{1e3 * found.cyl_p:.4g}"
    assert {"MCC": found.cyl_p, "MIC": found.cyl_v}.get(kind, 0) == 0 and f"CYLt ({kind})" in found.report()


def test_page_of_a_separation(separation):
    folder, found = separation
    limits = {"RONt": units.um(1), "spindle": units.um(0.15), (2, 15): units.um(0.5), "RONq": units.um(1)}
    told = found.report(limits=limits)
    ends = found.part.roundness().interval()
    assert f"as measured, {ends.middle} without the lift of noise ({ends.ends}, 95 % {ends.method});" in told
    assert "; limit 1 µm: accepted" in told and "RONq 0." in told
    assert f"spindle {1e3 * found.spindle.range:.4g} µm, limit 0.15 µm: not decided, above the" in told
    assert "2 to 15 upr: largest amplitude at 3 upr 0." in told and "limit 0.5 µm: accepted" in told
    part, spindle = (float(row(told, "3 ")[k]) for k in (1, 2))
    assert part == pytest.approx(0.4, abs=0.005) and spindle < 0.005
    assert [line.split()[1] for line in told.splitlines() if line.endswith(" usual")] == [
        "0",
        "10",
        "30",
        "80",
        "140",
    ]
    for k in range(TURNS.size):
        assert digest(folder / f"setup_{k}.csv") in told.replace("\n", "")
    assert "step: spindle taken off by 5 steps" in told and "filter: none" in told


def test_pages_are_valid_and_sealed(shaft, separation, tmp_path):
    for k, (thing, pictures) in enumerate(((shaft, 1), (shaft.cylinder("MZC"), 1), (separation[1], 1))):
        path = thing.report(tmp_path / f"{k}.html")
        text = (tmp_path / f"{k}.html").read_text("utf-8")
        html5lib.HTMLParser(strict=True).parse(text)
        assert path == str(tmp_path / f"{k}.html") and not seal.changes(text) and "signature" in text
        assert text.count("<svg") == pictures and ": left out, " not in text


def test_limits_that_are_refused(shaft, separation):
    with pytest.raises(ValueError, match=r"limits must be one of CYLt .*got 'CYLx'"):
        shaft.report(limits={"CYLx": 1e-3})
    with pytest.raises(ValueError, match=r"limits\['coaxiality'\] must be in mm, some 0.003; units.um"):
        shaft.report(limits={"coaxiality": 3.0})
    with pytest.raises(ValueError, match="limits must be one of RONt"):
        separation[1].report(limits={"CYLt": 1e-3})
    with pytest.raises(ValueError, match="limits must be one of CYLt"):
        shaft.cylinder().report(limits={"RONt": 1e-3})
