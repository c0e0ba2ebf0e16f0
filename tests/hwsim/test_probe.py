"""The probe: scans to the bits of the loop, its noise floor, runout on the length rolled, dust, following, a
part that moves.
"""

import copy
import math

import numpy as np
import pytest

import hwsim
from hwsim._log.log import same
from sdpgrind import units

RING = hwsim.Ring(61.94, 3.6, 0.5, lobes={3: (0.000206, 0.2), 43: (0.000235, 1.0)})
PLAIN = hwsim.Ring(61.94, 3.6, 0.5)
TURN = 2 * math.pi
UM = 1e-3


class Watch:
    """Takes what is read; stops after some turns; may command another speed at a sample."""

    tier = "probe"

    def __init__(self, turns=1.0, period=None, speeds=None):
        self.turns, self.period, self.speeds = turns, period, speeds or {}

    def reset(self):
        self.first, self.number = None, -1

    def step(self, *, angle, **others):
        self.first = angle if self.first is None else self.first
        self.number += 1
        if angle - self.first >= TURN * self.turns - 1e-9:
            return {"stop": 1.0}
        return {"spindle_speed": self.speeds[self.number]} if self.number in self.speeds else {}


def only(**errors):
    """A probe that is faultless but for some errors."""
    return hwsim.ProbeErrors(
        **{"probe_quantum": 0.0, "slide_quantum": 0.0, "counts": 0, "noise_sd": 0.0, "runout": 0.0} | errors
    )


def drawn(rng):
    return RING.replace(offset=rng.uniform(0.01, 3.0), offset_angle=rng.uniform(-3.0, 3.0))


KINDS = {
    "timed": {},
    "timed at odd speed": {"spindle_speed": 1.2345, "sample_time": 0.004, "start_angle": -4.0},
    "triggered": {"samples_per_turn": 360},
    "triggered, odd": {"samples_per_turn": 1001, "spindle_speed": 3.3, "start_angle": 6.001},
    "triggered, no counts": {"samples_per_turn": 360, "errors": None, "start_angle": 1.0},
    "no errors": {"errors": None},
    "all errors": {
        "errors": hwsim.ProbeErrors(noise_sd=1e-3, skew=1e-3, slip=0.01, dust=0.05, runout_phase=1.0)
    },
    "bridged": {"ring": hwsim.Ring(61.94, 3.6, 0.5, lobes={43: (0.65, 0.3)})},
    "a point": {"tip_radius": 0.0},
    "drawn": {"truth": drawn},
    "moved": {"moved": (1.5, 0.05, -0.02), "samples_per_turn": 360},
    "lost": {"stroke": 1.0, "follow_time": 0.3},
}


@pytest.mark.parametrize("options", KINDS.values(), ids=KINDS)
def test_a_scan_is_the_loop_bit_for_bit(options):
    probe = hwsim.Probe(**{"ring": RING} | options)
    scan = probe.scan(turns=2.5, rng=7)
    log = hwsim.run(probe, Watch(turns=2.5), rng=7)
    table = log["probe"]
    for name in ("angle", "reading", "slide", "probe", "time"):
        column = table[name].values[: scan.angle.size]
        assert np.array_equal(getattr(scan, name), column, equal_nan=True), name
    assert 0 <= table.sizes["row"] - scan.angle.size <= 1
    assert log.outcome.true_radius.values == scan.ring.radius
    assert (log.outcome.lost.values > 0) == np.isnan(scan.reading).any() == ("stroke" in options)


def test_a_scan_has_the_samples_of_whole_turns():
    timed, triggered = (
        hwsim.Probe(RING).scan(turns=3.0),
        hwsim.Probe(RING, samples_per_turn=360).scan(turns=3.0),
    )
    assert (timed.angle.size, triggered.angle.size) == (900, 1080)
    assert hwsim.Probe(RING).scan(turns=1e-6).angle.size == 1
    assert timed.time.tolist() == [k / 100 for k in range(900)]
    assert not timed.reading.flags.writeable
    assert timed == hwsim.Probe(RING).scan(turns=3.0) and timed != hwsim.Probe(RING).scan(turns=3.0, rng=1)


def test_a_scan_is_told_in_one_line():
    lost = hwsim.Probe(RING, stroke=1.0, follow_time=0.3).scan(turns=2.0)
    missing = np.isnan(lost.reading).sum()
    assert missing > 0
    assert repr(lost).startswith(
        f"ProbeScan(600 readings ({missing} without the surface) on 1.997 turns in 5.99 s: radius "
    )
    assert f"offset {RING.offset:g} mm)" in repr(lost) and "\n" not in repr(lost)
    assert "without" not in repr(hwsim.Probe(RING).scan(turns=2.0))


@pytest.mark.parametrize("options", [{}, {"samples_per_turn": 360}], ids=["timed", "triggered"])
def test_check_copies_and_repeats(options):
    probe = hwsim.Probe(RING, truth=drawn, **options)
    controller = Watch(turns=0.2)
    assert hwsim.check(probe, controller)
    machine = probe.start(np.random.default_rng(3))
    machine.step({}, 5)
    twin = copy.deepcopy(machine)
    assert [machine.step({}, 7) for _ in range(5)] == [twin.step({}, 7) for _ in range(5)]
    assert same(hwsim.run(probe, controller, parts=2, rng=2), hwsim.run(probe, controller, parts=2, rng=2))


def test_workers_change_nothing(processes):
    probe, controller = hwsim.Probe(RING, truth=drawn), Watch(turns=0.2)
    log = hwsim.run(probe, controller, parts=4, rng=2)
    assert len(set(log.outcome.true_offset.values)) == 4
    assert same(hwsim.run(probe, controller, parts=4, rng=2, executor=processes), log)


def test_controllers_are_compared_on_the_same_rings():
    log = hwsim.compare(hwsim.Probe(RING, truth=drawn), {"short": Watch(0.1), "long": Watch(0.3)}, parts=3)
    assert np.array_equal(log.outcome.true_offset[0], log.outcome.true_offset[1])
    assert np.all(log.outcome.samples[0] < log.outcome.samples[1])


@pytest.mark.parametrize(
    "options", [{}, {"samples_per_turn": 360}, {"start_angle": 2.0, "spindle_speed": 5.0}]
)
def test_without_errors_it_reads_the_ring(options):
    scan = hwsim.Probe(RING, errors=None, **options).scan(turns=2.0)
    assert np.abs(scan.reading - RING.reading(scan.angle, 3.75)).max() < 1e-11
    assert np.abs(np.diff(scan.angle) - np.diff(scan.angle).mean()).max() < 1e-12


def test_angles_are_those_of_the_spindle():
    scan = hwsim.Probe(RING, errors=None, start_angle=0.3).scan()
    assert np.abs(scan.angle - 0.3 - units.rpm(20.0) * scan.time).max() < 1e-14
    triggered = hwsim.Probe(RING, samples_per_turn=360, start_angle=0.3).scan()
    counts = triggered.angle * 4000 / TURN
    assert np.abs(counts - np.round(counts)).max() < 1e-9
    assert np.abs(triggered.angle - np.arange(360) * TURN / 360 - 0.3).max() <= TURN / 4000
    assert np.all(
        (late := triggered.time - (triggered.angle - triggered.angle[0]) / units.rpm(20.0)) < 1.0001e-6
    )
    assert np.all(late > -1e-12)  # latched at the edge, there at the next tick


def test_the_reading_does_not_depend_on_where_the_slide_is():
    """Section 1: slide and probe both count outward, so that a part that stands still reads the same wherever
    the slide is.
    """
    followed = hwsim.Probe(RING, errors=None, follow_time=0.01).scan()
    late, still = (
        hwsim.Probe(RING, errors=None, follow_time=0.3).scan(),
        hwsim.Probe(RING, errors=None, follow_time=math.inf).scan(),
    )
    for scan in (late, still):
        assert np.abs(scan.reading - followed.reading).max() < 1e-13
    assert np.ptp(still.slide) == 0.0
    assert 0.0 < np.ptp(followed.probe) < 0.3 < np.ptp(late.probe) < np.ptp(still.probe)
    for scan in (followed, late, still):
        assert np.array_equal(scan.slide + scan.probe, scan.reading)


def test_the_slide_follows_with_its_time_constant():
    """A first-order lag of T behind a rim of frequency w leaves w T/(1 + w^2 T^2)^(1/2) of the offset to the
    probe.
    """
    speed, lag = units.rpm(20.0), 0.2
    scan = hwsim.Probe(
        hwsim.Ring(61.94, 1.0), errors=None, follow_time=lag, sample_time=0.001, tip_radius=0.0
    ).scan(turns=3.0)
    settled = scan.probe[6000:]
    assert np.ptp(settled) / 2 == pytest.approx(speed * lag / math.hypot(1.0, speed * lag), rel=3e-3)


def test_a_probe_beyond_its_stroke_reads_nothing():
    scan = hwsim.Probe(PLAIN, errors=None, follow_time=math.inf, stroke=6.0).scan()
    whole = hwsim.Probe(PLAIN, errors=None, follow_time=math.inf).scan()
    lost = np.abs(whole.probe) > 3.0
    assert np.array_equal(np.isnan(scan.reading), lost) and 0 < lost.sum() < 200
    assert np.array_equal(scan.reading[~lost], whole.reading[~lost])


def test_another_speed_takes_effect_at_once():
    log = hwsim.run(hwsim.Probe(RING, errors=None), Watch(speeds={10: 4.0, 30: 1.0}))
    step = np.diff(log["probe"].angle.values)
    assert step[:10] == pytest.approx(0.01 * units.rpm(20.0), abs=1e-14)
    assert step[10:30] == pytest.approx(0.04, abs=1e-14) and step[30:] == pytest.approx(0.01, abs=1e-14)
    triggered = hwsim.run(hwsim.Probe(RING, errors=None, samples_per_turn=360), Watch(speeds={10: 4.0}))[
        "probe"
    ]
    assert np.diff(triggered.angle) == pytest.approx(TURN / 360, abs=1e-12)
    assert np.diff(triggered.time)[15:] == pytest.approx(TURN / 360 / 4.0, abs=2e-6)


def test_a_table_triggered_by_its_angle_under_a_controller_with_a_clock():
    """Between triggers the last sample stands; nothing is read twice as new."""
    log = hwsim.run(hwsim.Probe(RING, samples_per_turn=360), Watch(turns=0.5, period=0.001))
    angle = log["probe"].angle.values
    scan = hwsim.Probe(RING, samples_per_turn=360).scan(turns=0.6)
    assert np.array_equal(np.unique(angle), scan.angle[: np.unique(angle).size])
    assert log.outcome.samples.values == np.unique(angle).size
    assert np.diff(log["probe"].time) == pytest.approx(0.001)


def test_a_part_that_is_moved():
    scan = hwsim.Probe(PLAIN, errors=None, moved=(1.0, 0.3, -0.2)).scan()
    after = scan.time >= 1.0
    x, y = PLAIN.center_x + 0.3, PLAIN.center_y - 0.2
    there = hwsim.Ring(61.94, math.hypot(x, y), math.atan2(y, x))
    for ring, when in ((PLAIN, ~after), (there, after)):
        assert np.abs(scan.reading[when] - ring.reading(scan.angle[when], 3.75)).max() < 1e-11
    out = hwsim.run(hwsim.Probe(PLAIN, moved=(1.0, 0.3, -0.2)), Watch()).outcome
    assert (out.true_center_x.values[0], out.true_center_y.values[0]) == pytest.approx((x, y), abs=1e-12)


@pytest.mark.parametrize("tip_radius", [0.0, 1.0])
def test_a_part_that_is_moved_until_the_axis_is_near_its_rim(tip_radius):
    """From the side the tip may touch two lobes; where the part lay before, it could not."""
    centred = hwsim.Ring(61.94, lobes={40: (0.2, 0.0)})
    there = centred.replace(offset=0.999 * 61.74)
    probe = hwsim.Probe(
        centred, errors=None, tip_radius=tip_radius, stroke=1e3, moved=(0.1, there.offset, 0.0)
    )
    scan = probe.scan()
    after = scan.time >= 0.1
    for ring, when in ((centred, ~after), (there, after)):
        assert np.abs(scan.reading[when] - ring.reading(scan.angle[when], tip_radius)).max() < 1e-11


def off(probe, turns=1.0):
    """What it reads less what there is at the angle that it shows."""
    scan = probe.scan(turns=turns)
    return scan.reading - scan.ring.reading(scan.angle, probe.tip_radius)


@pytest.mark.parametrize(("offset", "rms"), [(3.6, 1.15 * UM), (20.0, 6.4 * UM)])
def test_steps_of_the_spindle(offset, rms):
    """d 3.2e-4 rms: a step of 2 pi/4000 over 12^(1/2) turns the rim by that, and 2^(1/2) is the mean over the
    turn.
    """
    probe = hwsim.Probe(hwsim.Ring(61.94, offset), errors=only(counts=4000), sample_time=0.00137)
    error = off(probe, turns=5.0)
    assert np.sqrt((error**2).mean()) == pytest.approx(offset * TURN / 4000 / math.sqrt(24), rel=0.02)
    assert np.sqrt((error**2).mean()) == pytest.approx(rms, rel=0.02)
    assert np.abs(off(probe.replace(samples_per_turn=360))).max() < 1e-11  # at the edges there is none


def test_steps_of_probe_and_slide():
    """Uniform within a step each: 50 nm/12^(1/2) = 14.4 nm, 20 nm/12^(1/2) = 5.8 nm."""
    for errors, sd in (({"probe_quantum": 5e-5}, 1.443e-5), ({"slide_quantum": 2e-5}, 0.577e-5), ({}, 0.0)):
        error = off(hwsim.Probe(PLAIN, errors=only(**errors)), turns=10.0)
        assert error.std() == pytest.approx(sd, rel=0.05, abs=1e-13)
        assert np.abs(error).max() <= sd * math.sqrt(3) * 1.001 + 1e-12
    scan = hwsim.Probe(RING).scan()
    for shown, step in ((scan.probe, 5e-5), (scan.slide, 2e-5), (scan.angle, TURN / 4000)):
        assert np.abs(shown / step - np.round(shown / step)).max() < 1e-8


@pytest.mark.parametrize("options", [{}, {"samples_per_turn": 360}], ids=["timed", "triggered"])
def test_skew_turns_the_part(options):
    """1 ms at 20 rpm: 2.1 mrad, 7.5 um across at 3.6 mm."""
    scan = hwsim.Probe(PLAIN, errors=only(skew=0.001), **options).scan()
    skewed = PLAIN.replace(offset_angle=PLAIN.offset_angle + units.rpm(20.0) * 0.001)
    assert np.abs(scan.reading - skewed.reading(scan.angle, 3.75)).max() < 1e-11
    across = 3.6 * (skewed.offset_angle - PLAIN.offset_angle)
    assert skewed.offset_angle - PLAIN.offset_angle == pytest.approx(2.1e-3, abs=0.01e-3)
    assert across == pytest.approx(7.5 * UM, abs=0.05 * UM)


@pytest.mark.parametrize("slip", [0.0, 0.01])
def test_runout_follows_the_length_rolled(slip):
    """phase = (R/rho) beta with beta about the part's centre: modulated by (d/rho) sin psi when the part is
    off-centre.
    """
    errors = only(runout=1.5 * UM, runout_phase=0.7, slip=slip)
    probe = hwsim.Probe(PLAIN, errors=errors)
    scan = probe.scan(turns=3.0)
    psi = scan.angle - 0.5
    center = PLAIN.reading(scan.angle, 3.75) + 3.75
    beta = 0.5 + np.unwrap(np.arctan2(center * np.sin(psi), center * np.cos(psi) - 3.6))
    tone = 1.5 * UM * np.cos((1 - slip) * 61.94 / 3.75 * (beta - beta[0] + PLAIN.part_angle(0.0, 3.75)) - 0.7)
    assert np.abs(scan.reading - PLAIN.reading(scan.angle, 3.75) - tone).max() < 1e-11
    modulation = 61.94 / 3.75 * (beta - beta.mean() - (scan.angle - scan.angle.mean()))
    assert np.ptp(modulation) / 2 == pytest.approx(3.6 / 3.75, rel=0.06)


def test_the_roller_of_the_source_turns_as_it_says():
    """(6.20): f = rpm R/225 Hz; at 20 rpm and 61.94 mm 5.506 Hz, and 2.8 Hz (Fig. 6.16) at 10.17 rpm."""
    ring = hwsim.Ring(61.94)
    for rpm, frequency in ((20.0, 20 * 61.94 / 225), (10.17, 2.8)):
        probe = hwsim.Probe(ring, errors=only(runout=1.5 * UM), spindle_speed=units.rpm(rpm))
        scan = probe.scan(turns=20.0)
        line = np.exp(-2j * math.pi * frequency * scan.time)
        assert 2 * abs(line @ (scan.reading - 61.94)) / scan.time.size == pytest.approx(1.5 * UM, rel=0.02)


def test_each_part_has_its_own_phase_of_the_roller_unless_told():
    log = hwsim.run(hwsim.Probe(hwsim.Ring(61.94), errors=only(runout=1.5 * UM)), Watch(0.1), parts=4)
    first = log["probe"].reading.values[np.diff(log["probe"].part.values, prepend=-1) > 0]
    assert np.ptp(first) > 0.5 * UM
    assert off(hwsim.Probe(hwsim.Ring(61.94), errors=only(runout=1.5 * UM, runout_phase=0.0)))[
        0
    ] == pytest.approx(1.5 * UM)


def test_noise_has_its_standard_deviation_and_its_part():
    error = off(hwsim.Probe(RING, errors=only(noise_sd=0.3 * UM)), turns=20.0)
    assert error.std() == pytest.approx(0.3 * UM, rel=0.03)
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.05


def test_dust_only_adds():
    """1 sample in 100, by half to one and a half times its mean height; the other draws stay as they were."""
    clean, dusty = (
        hwsim.Probe(RING, errors=only(noise_sd=0.1 * UM, dust=p, dust_size=0.01)) for p in (0.0, 0.01)
    )
    added = off(dusty, turns=40.0) - off(clean, turns=40.0)
    hit = np.abs(added) > 1e-12
    assert np.all(added[hit] > 0.005 - 1e-12) and np.all(added[hit] < 0.015 + 1e-12)
    assert hit.mean() == pytest.approx(0.01, abs=4 * math.sqrt(0.01 / 12000))
    assert added[hit].mean() == pytest.approx(0.01, abs=4 * 0.01 / math.sqrt(12 * hit.sum()))


def test_a_part_that_nobody_stops_is_broken_off():
    log = hwsim.run(hwsim.Probe(RING, turns_max=2.0), Watch(turns=1e9))
    out = log.outcome
    assert out.timed_out.values == 1.0 and out.turns.values == pytest.approx(2.0, abs=0.01)
    assert hwsim.run(hwsim.Probe(RING), Watch()).outcome.timed_out.values == 0.0


def test_outcome_has_names_and_units():
    out = hwsim.run(hwsim.Probe(RING), Watch(0.5)).outcome
    assert {name: out[name].units for name in out.data_vars} == {
        name: unit or "1" for name, unit in hwsim.Probe(RING).outcomes.items()
    }
    assert (out.time.values[0], out.turns.values[0]) == pytest.approx((1.5, 0.5), abs=1e-3)
    assert out.samples.values[0] == 151 and out.lost.values[0] == 0
    assert out.true_roundness.values[0] == RING.roundness and out.true_offset.values[0] == pytest.approx(3.6)


def test_replace_reaches_the_errors():
    probe = hwsim.Probe(RING).replace(noise_sd=0.5 * UM, tip_radius=0.0)
    assert probe.errors == hwsim.ProbeErrors(noise_sd=0.5 * UM) and probe.tip_radius == 0.0


REFUSED = {
    "no ring": ({"ring": 61.94}, "ring must be a Ring"),
    "truth": ({"truth": 3.0}, "truth must be a Ring, a function of rng, or None"),
    "speed": ({"spindle_speed": 0.0}, "spindle_speed must be > 0 [(]rad/s[)]"),
    "sample time": ({"sample_time": -1.0}, "sample_time must be > 0"),
    "tip": ({"tip_radius": -1.0}, "tip_radius must be >= 0 [(]mm[)]; got -1.0"),
    "few samples": ({"samples_per_turn": 2}, "samples_per_turn must be >= 3"),
    "more than edges": (
        {"samples_per_turn": 5000},
        "samples_per_turn must be <= counts of the spindle's encoder, 4000",
    ),
    "errors": ({"errors": 0.1}, "errors must be a ProbeErrors or None"),
    "following": ({"follow_time": 0.0}, "follow_time must be > 0"),
    "moved": ({"moved": (1.0, 2.0)}, "moved must be [(]time in s, x in mm, y in mm[)] or None"),
    "moved before": ({"moved": (-1.0, 2.0, 0.0)}, r"moved\[0\] must be >= 0 [(]s[)]"),
    "stroke": ({"stroke": 0.0}, "stroke must be > 0"),
    "moved off": (
        {"moved": (1.0, 60.0, 0.0)},
        "offset that the part is moved to must be < radius less amplitudes .* got 63.1",
    ),
    "moved off later": ({"moved": (1e6, 0.0, -80.0)}, "else there is no part at the axis [(]mm[)]; got 78.3"),
    "moved, truth": (
        {"truth": hwsim.Ring(5.0), "moved": (1.0, 4.0, -3.0)},
        "moved to must be < .* 5: .* got 5.0",
    ),
    "rpm": (
        {"spindle_speed": 1200.0},
        "spindle_speed must be <= 209.4 for 3 samples in a turn; units.rpm.* got 1200.0",
    ),
    "rpm, triggered": (
        {"spindle_speed": 301.0, "samples_per_turn": 360},
        "spindle_speed must be <= 300; units.rpm",
    ),
    "too seldom": ({"sample_time": 10.0}, "spindle_speed must be <= 0.2094 for 3 samples in a turn"),
    "degrees": (
        {"start_angle": 180.0},
        "start_angle must be within a turn; units.deg.90. for degrees [(]rad[)]; got 180.0",
    ),
    "endless": ({"turns_max": 0.0}, "turns_max must be > 0"),
}
BAD_ERRORS = {
    "quantum": ({"probe_quantum": -1.0}, "probe_quantum must be >= 0"),
    "micrometres": (
        {"noise_sd": 1.0},
        "noise_sd must be <= 0.25; units.um.* for micrometres [(]mm[)]; got 1.0",
    ),
    "runout in micrometres": ({"runout": 1.5}, "runout must be <= 0.25; units.um"),
    "counts": ({"counts": -1}, "counts must be >= 0"),
    "skew": ({"skew": math.nan}, "skew must be finite [(]s[)]"),
    "dust": ({"dust": 1.5}, r"dust must be in \[0, 1\]"),
    "slip": ({"slip": 2.0}, r"slip must be in \[-1, 1\]"),
}


@pytest.mark.parametrize(("values", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(values, message):
    with pytest.raises((ValueError, TypeError), match=message):
        hwsim.Probe(**{"ring": RING} | values)


@pytest.mark.parametrize(("values", "message"), BAD_ERRORS.values(), ids=BAD_ERRORS)
def test_bad_errors_refused(values, message):
    with pytest.raises(ValueError, match=message):
        hwsim.ProbeErrors(**values)


def test_bad_truth_turns_and_commands_refused():
    with pytest.raises(TypeError, match=r"truth\(rng\) must be a Ring; got 3.0"):
        hwsim.Probe(RING, truth=lambda rng: 3.0).scan()
    with pytest.raises(ValueError, match="turns must be > 0"):
        hwsim.Probe(RING).scan(turns=0.0)
    with pytest.raises(ValueError, match=r"spindle_speed must be > 0 \(rad/s\); got -1.0"):
        hwsim.run(hwsim.Probe(RING), Watch(speeds={3: -1.0}))
    with pytest.raises(
        ValueError, match=r"spindle_speed must be <= 209.4 for 3 samples in a turn; .* got 250.0"
    ):
        hwsim.run(hwsim.Probe(RING), Watch(speeds={3: 250.0}))
    with pytest.raises(ValueError, match=r"offset that the part is moved to must be < .* got 62.9"):
        hwsim.Probe(
            hwsim.Ring(61.94), truth=lambda rng: hwsim.Ring(61.94, 2.9), moved=(1.0, 60.0, 0.0)
        ).scan()


def test_the_angle_triggers_at_speeds_that_a_clock_is_too_slow_for():
    assert hwsim.Probe(RING, samples_per_turn=360, spindle_speed=250.0).scan().angle.size == 360
    log = hwsim.run(hwsim.Probe(RING, samples_per_turn=360), Watch(speeds={3: 250.0}))
    assert log.outcome.samples.values[0] == 361
