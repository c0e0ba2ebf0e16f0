"""`identify`: what data it takes, the three methods, and the bias that it warns of."""

import warnings

import numpy as np
import pytest
from scipy import signal

import hwsim
from centering import identify, preset
from centering.circle import circle_reading, corrected_radius, limacon_radius, limacon_reading
from sdpgrind.identify import Status

RADIUS, OFFSET, PHI = 61.9, 26.4, 0.7
TURN = np.radians(np.arange(360.0))
READ = circle_reading(TURN, RADIUS, OFFSET, PHI, 3.75)


class Table(dict):
    """A table of a log: columns by name."""


def log(parts):
    """Something that is asked for its table "probe", as a log is; one reading of each part is missing."""
    rows = [
        (k, *row)
        for k, part in enumerate(parts)
        for row in zip(np.arange(360) / 100, TURN, part, strict=True)
    ]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    columns[3][5::360] = np.nan
    table = Table(zip(("part", "time", "angle", "reading"), columns, strict=True))
    return type("Log", (), {"__getitem__": lambda self, name: {"probe": table}[name]})()


def of_readings(angle, reading, **rules):
    """Log of a file with angles and readings."""
    table = {"t [s]": np.arange(angle.size) / 100, "a [rad]": angle, "r [mm]": reading}
    return hwsim.Log.read(table, time="t", angle="a", reading="r", **rules)


def scan(circles, noise):
    """A turn of each circle (radius, offset; mm) in one log, as from a file of which nobody named the parts."""
    angle = np.concatenate([TURN + 2 * np.pi * k for k in range(len(circles))])
    turns = [circle_reading(TURN, radius, offset, PHI) for radius, offset in circles]
    return of_readings(angle, np.concatenate(turns) + noise)


@pytest.mark.parametrize(
    ("other", "told"),
    [((40.0, 0.3), "the centre differs by 0.250 mm"), ((40.1, 0.05), "the radius differs by 0.100 mm")],
)
def test_turns_of_two_parts_in_one_log_are_told(other, told):
    for circles in ([(40.0, 0.05), other], [(40.0, 0.05), other, (40.0, 0.05)]):
        noise = np.random.default_rng(1).normal(0.0, 2e-4, 360 * len(circles))
        both = scan(circles, noise)
        with pytest.warns(UserWarning, match=f"^{told} .* of another part.*Log.read takes its column"):
            identify(both, "circle")
        sentences = preset("printed").doubts(both).sentences
        assert sum(sentence.startswith(told) for sentence in sentences) == 1


@pytest.mark.parametrize("degrees", [100, 270, 350, 361, 1000])
@pytest.mark.parametrize("on", [0, 360])
def test_two_parts_are_told_whatever_the_arc_of_each(degrees, on):
    """The angle begins again with each part, or goes on (a thousand degrees: by three turns)."""
    angle = np.radians(np.arange(degrees))
    parts = [circle_reading(angle, 40.0, offset, PHI) for offset in (0.05, 0.3)]
    both = np.concatenate([angle, angle + np.radians(on * -(-degrees // 360))])
    reading = np.concatenate(parts) + np.random.default_rng(3).normal(0.0, 2e-4, both.size)
    with pytest.warns(UserWarning, match=r"centre differs by .* of another part\? Log.read takes its column"):
        identify(of_readings(both, reading), "circle", turns=9)


@pytest.mark.parametrize("upr, told", [(0.41, False), (0.0, True)])
def test_an_axis_that_wanders_is_no_other_part_and_one_that_drifts_far_is_called_so(upr, told):
    """A spindle error of 0.5 µm at the frequency of a cage; 10 µm of drift in three turns."""
    angle = np.concatenate([TURN, TURN + 2 * np.pi, TURN + 4 * np.pi])
    moved = 5e-4 * np.cos(upr * angle) if upr else 1e-2 * angle / angle[-1] * np.cos(angle)
    noise = np.random.default_rng(4).normal(0.0, 2e-4, angle.size)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        identify(of_readings(angle, circle_reading(angle, 40.0, 0.05, PHI) + moved + noise), "circle")
    asked = "did part or axis move, is the angle in another unit, or is it of another part?"
    assert [asked in str(each.message) for each in caught] == [True] * told


def test_turns_without_enough_readings_are_not_held_against_others():
    """A turn without readings, its end alone, a spindle that stands still, deviations of both signs."""
    angle = np.concatenate([TURN, TURN + 2 * np.pi, TURN + 4 * np.pi])
    for there in (angle < 2 * np.pi) | (angle > 4 * np.pi), (angle < 2 * np.pi) | (angle > 18.8):
        kept = angle[there]
        assert identify(of_readings(kept, circle_reading(kept, 40.0, 0.05, PHI)), "circle").ok
    still = np.concatenate([angle[:720], np.full(60, angle[720])])
    assert identify(of_readings(still, circle_reading(still, 40.0, 0.05, PHI)), "circle").ok
    shown = of_readings(angle, 0.04 + 0.05 * np.cos(angle - PHI), plausible=False)
    assert identify(shown, "circle", method="limacon").offset == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("alike", [0.0, 0.8])
def test_turns_of_one_part_are_not_told_as_two(alike):
    """By chance once in some 300 000 scans, correlated noise included."""
    rng = np.random.default_rng(2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(20):
            noise = signal.lfilter([np.sqrt(1 - alike**2)], [1, -alike], rng.normal(0.0, 1e-3, 900))[180:]
            identify(scan([(40.0, 0.05)] * 2, noise), "circle")


def test_the_issue_line():
    rng = np.random.default_rng(0)
    angle, reading = TURN, READ + rng.normal(0, 0.01, 360)
    reading[rng.choice(360, 30, replace=False)] += 1.0
    circle = identify((angle, reading), "circle", tip_radius=3.75, loss="huber")
    assert (
        circle.ok and abs(circle.radius - RADIUS) < 5 * circle.radius_sd and 30 <= circle.down_weighted < 40
    )


@pytest.mark.parametrize(
    "data",
    [
        (TURN, READ),
        [TURN, READ],
        np.array([TURN, READ]),
        {"angle": TURN, "reading": READ, "probe": READ - 3},
        log([READ]),
    ],
    ids=["pair", "list", "array", "mapping", "log"],
)
def test_kinds_of_data(data):
    circle = identify(data, tip_radius=3.75)
    assert circle.value == pytest.approx([RADIUS, OFFSET * np.cos(PHI), OFFSET * np.sin(PHI)], abs=1e-9)
    assert circle.samples == (
        359 if hasattr(type(data), "__getitem__") and type(data).__name__ == "Log" else 360
    )


def test_a_scan():
    """As the simulated probe gives it; what was not read is left out."""
    scan = hwsim.Probe(hwsim.Ring(RADIUS, 3.6, PHI), errors=None, tip_radius=3.75).scan(turns=1.0)
    circle = identify(scan, tip_radius=3.75)
    assert circle.value == pytest.approx([RADIUS, 3.6 * np.cos(PHI), 3.6 * np.sin(PHI)], abs=1e-6)
    missing = type("Scan", (), {"angle": TURN, "reading": np.where(TURN < 0.1, np.nan, READ)})()
    assert identify(missing, tip_radius=3.75).samples == 354


def test_complex_readings_are_no_readings():
    with pytest.raises(TypeError, match=r"reading must be real numbers \(mm\); got complex ones"):
        identify((TURN, READ + 0.0j))


def test_parts_of_a_log():
    two = log([READ, READ + 1.0])
    assert identify(two, tip_radius=3.75, part=1).radius > identify(two, tip_radius=3.75, part=0).radius + 0.9
    with pytest.raises(ValueError, match=r"part must say which part \(unit 1\); data hold part 0, part 1"):
        identify(two, tip_radius=3.75)


@pytest.mark.parametrize("tip", [0.0, 3.75])
def test_methods(tip):
    reading = circle_reading(TURN, RADIUS, OFFSET, PHI, tip)
    exact, limacon, printed = (
        identify((TURN, reading), method=method, tip_radius=tip) for method in ("exact", "limacon", "printed")
    )
    assert exact.radius == pytest.approx(RADIUS, abs=1e-9)
    seen = limacon_radius(RADIUS + tip, OFFSET)
    assert limacon.radius == pytest.approx(seen - tip, abs=1e-9)
    assert printed.radius == pytest.approx(corrected_radius(seen, OFFSET, method="mears") - tip, abs=1e-9)
    for circle in (exact, limacon, printed):
        assert (circle.offset, circle.offset_angle) == (pytest.approx(OFFSET), pytest.approx(PHI))
    assert [circle.model for circle in (exact, limacon, printed)] == ["exact", "limacon", "printed"]


def test_limacon_against_lstsq_and_its_scatter():
    rng, columns = (
        np.random.default_rng(1),
        np.stack([np.ones(181), np.cos(TURN[:181]), np.sin(TURN[:181])], axis=1),
    )
    reading = limacon_reading(TURN[:181], RADIUS, 0.3, PHI) + rng.normal(0, 0.01, 181)
    found = identify((TURN[:181], reading), method="limacon")
    value, square, *_ = np.linalg.lstsq(columns, reading, rcond=None)
    assert found.value == pytest.approx(value, abs=1e-11)
    assert found.covariance == pytest.approx(square / 178 * np.linalg.inv(columns.T @ columns), rel=1e-9)
    assert found.noise_sd == pytest.approx(np.sqrt(square[0] / 178)) and found.freedom == 178
    known = identify((TURN[:181], reading), method="limacon", noise_sd=0.04)
    assert known.covariance == pytest.approx(0.04**2 * np.linalg.inv(columns.T @ columns), rel=1e-9)
    assert known.freedom == np.inf


def test_covariance_of_the_printed_radius():
    rng, found = np.random.default_rng(2), []
    for _ in range(400):
        circle = identify(
            (TURN, READ + rng.normal(0, 0.05, 360)), method="printed", tip_radius=3.75, noise_sd=0.05
        )
        found.append([*circle.value, *circle.sd])
    found = np.array(found)
    assert found[:, :3].std(axis=0) == pytest.approx(found[:, 3:].mean(axis=0), rel=0.12)


@pytest.mark.parametrize("degrees", [30, 180])
def test_warns_of_the_bias(degrees):
    """With its size: that of the error that the fit makes."""
    angle, reading = TURN[: degrees + 1], circle_reading(TURN[: degrees + 1], RADIUS, 3.0, 0.2)
    with pytest.warns(UserWarning, match="less than whole even turns") as caught:
        found = identify((angle, reading), method="limacon")
    error = found.value - [RADIUS, 3 * np.cos(0.2), 3 * np.sin(0.2)]
    told = f"of {np.hypot(*error[1:]):.3g} mm in the centre and {error[0]:.3g} mm in the radius, at an offset of 3 mm"
    assert told in str(caught[0].message)
    assert caught[0].filename == __file__


def test_does_not_warn_without_reason():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        identify((TURN, READ), method="limacon")
        identify((TURN[:90], circle_reading(TURN[:90], RADIUS, 0.5, 0.2)), method="limacon")


def test_warns_without_a_size_where_there_is_none():
    angle = TURN[:200]
    with pytest.warns(UserWarning, match="a bias of unknown size"):
        identify((angle, 0.5 + 0.7 * np.cos(angle)), method="limacon", throw=False)


def test_status_instead_of_an_error():
    flat = np.zeros(360) + 0.1
    failed = identify((TURN, flat + np.cos(TURN)), method="printed", throw=False)
    assert failed.status is Status.IMPOSSIBLE and np.all(np.isfinite(failed.value))
    close = np.arange(5) * 1e-7
    assert identify((close, READ[:5]), method="limacon", throw=False).status is Status.UNDETERMINED
    assert identify((close, READ[:5]), throw=False).status is not Status.OK


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: identify((TURN, READ), "sphere"), r"what must be one of circle, friction; got 'sphere'"),
        (
            lambda: identify((TURN, READ), method="taubin"),
            r"method must be one of exact, limacon, printed; got 'taubin'",
        ),
        (
            lambda: identify((TURN, READ), method="limacon", loss="huber"),
            r"loss must be 'linear' for method 'limacon'; got",
        ),
        (
            lambda: identify((TURN, READ), method="printed", radius_prior=(61.9, 0.1)),
            r"radius_prior must be None for method",
        ),
        (
            lambda: identify((TURN[:300], READ[:300]), method="printed"),
            r"readings even over whole turns.*got 300 .*'exact'",
        ),
        (
            lambda: identify((TURN, 0.1 + np.cos(TURN)), method="limacon"),
            r"offset must be <= pi/2 radius \(mm\).*got 1 and 0\.1",
        ),
        (
            lambda: identify((TURN, READ, READ)),
            r"data must be the pair \(angle, reading\) \(rad, mm\); got 3 entries",
        ),
        (lambda: identify((TURN, READ[1:])), r"angle and reading must be one-dimensional of one length; got"),
        (lambda: identify({"angle": TURN}), r"data must hold reading \(mm\); it holds angle"),
        (lambda: identify((np.arange(360.0), READ)), r"smells of degrees"),
        (lambda: identify((np.arange(360.0), READ), method="limacon", turns=1), r"span at most 1 turns"),
        (lambda: identify((TURN[:3], READ[:3]), method="limacon"), r"at least 4 different angles"),
        (
            lambda: identify((TURN, READ), method="limacon", tip_radius=-1.0),
            r"tip_radius must be >= 0 \(mm\); got -1\.0",
        ),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()
