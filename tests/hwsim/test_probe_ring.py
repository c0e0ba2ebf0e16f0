"""The ring under a round tip: exact contact by two ways, what a roller passes on, where it bridges, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

import hwsim
from centering.circle import circle_reading
from centering.kernels import probe, shape_of

ANGLES = np.linspace(-7.0, 20.0, 97)
ROLLER = 3.75
UM = 1e-3


def turned(ring, angle, about):
    """Place of the surface at polar angles about the part's centre, along and beside the probe line at a
    spindle angle.
    """
    surface = ring.surface(about)
    along = ring.offset * math.cos(ring.offset_angle - angle) + surface * np.cos(about - angle)
    beside = ring.offset * math.sin(ring.offset_angle - angle) + surface * np.sin(about - angle)
    return along, beside


def pushed_on(ring, angle, tip_radius, places=20001, rounds=3):
    """The obvious way: every point of the surface holds the tip's centre off by so much; the largest counts.
    Refined.
    """
    low, high = angle - 1.55, angle + 1.55
    for _ in range(rounds):
        about = np.linspace(low, high, places)
        along, beside = turned(ring, angle, about)
        square = tip_radius**2 - beside**2
        off = np.where(square >= 0, along + np.sqrt(np.maximum(square, 0.0)), -np.inf)
        best = int(np.argmax(off))
        low, high = about[max(best - 2, 0)], about[min(best + 2, places - 1)]
    return float(off[best]) - tip_radius


@pytest.mark.parametrize("ratio", [0.0, 0.05, 0.5, 0.95, 0.99])
@pytest.mark.parametrize("tip_radius", [0.0, ROLLER, 40.0])
def test_without_lobes_it_is_the_exact_curve(ratio, tip_radius):
    ring = hwsim.Ring(61.94, 61.94 * ratio, -2.0)
    exact = circle_reading(ANGLES, 61.94, 61.94 * ratio, -2.0, tip_radius)
    assert np.abs(ring.reading(ANGLES, tip_radius) - exact).max() < 1e-11


def test_a_point_reads_the_surface_on_the_line():
    ring = hwsim.Ring(61.94, 10.0, 1.0, lobes={2: (0.5, 0.3), 7: (0.2, 1.0)})
    reading, about = ring.reading(ANGLES), ring.part_angle(ANGLES)
    for angle, read, at in zip(ANGLES, reading, about, strict=True):
        beyond = brentq(
            lambda b, angle=angle: float(turned(ring, angle, b)[1]), angle - 1.5, angle + 1.5, xtol=1e-15
        )
        assert at == pytest.approx(beyond, abs=1e-13)
        assert read == pytest.approx(float(turned(ring, angle, beyond)[0]), abs=1e-12)


BRIDGED = {
    "smooth": ({3: (0.0002, 0.0), 43: (0.000235, 1.0)}, ROLLER, False),
    "rough": ({3: (0.5, 1.0), 17: (0.3, 2.0)}, ROLLER, False),
    "bridged": ({43: (0.65, 1.0)}, ROLLER, True),
    "a large tip": ({3: (2.0, 1.0), 11: (1.7, 2.0)}, 30.0, True),
    "fine waves": ({150: (0.06, 0.4)}, ROLLER, True),
}


@pytest.mark.parametrize(("lobes", "tip_radius", "bridges"), BRIDGED.values(), ids=BRIDGED)
@pytest.mark.parametrize("offset", [0.0, 3.6, 40.0])
def test_the_tip_lies_where_the_surface_holds_it_off_furthest(lobes, tip_radius, bridges, offset):
    ring = hwsim.Ring(61.94, offset, 0.5, lobes=lobes)
    angles = ANGLES[::8]
    reading = ring.reading(angles, tip_radius)
    assert np.abs(reading - [pushed_on(ring, angle, tip_radius) for angle in angles]).max() < 1e-10
    if not offset:
        assert bool(shape_of(ring, tip_radius)[probe.SCAN]) == bridges


@pytest.mark.parametrize("amplitude", [0.3, 0.58])
def test_searching_for_two_contacts_finds_the_one_that_there_is(monkeypatch, amplitude):
    """Below 0.59 mm of 43 upr a roller of 3.75 mm touches once (erratum 23); both ways must then agree."""
    ring = hwsim.Ring(61.94, 3.6, 0.5, lobes={43: (amplitude, 0.3)})
    assert shape_of(ring, ROLLER)[probe.SCAN] == (amplitude > 0.55)
    found = {}
    for near in (-1.0, 1.0):
        monkeypatch.setattr("centering._plant.ring._NEAR", near)
        found[near] = ring.reading(ANGLES, ROLLER), ring.part_angle(ANGLES, ROLLER)
    for once, searched in zip(found[-1.0], found[1.0], strict=True):
        assert np.abs(once - searched).max() < 1e-12


def bridging_amplitude(upr, radius, tip_radius):
    """(1/rho + 1/R) R^2/(n^2 - 1), to first order."""
    return (1 / tip_radius + 1 / radius) * radius**2 / (upr**2 - 1)


def test_where_a_roller_begins_to_bridge():
    """Erratum 23 has 0.59 mm from curvature to first order; the parallel curve itself turns back at 0.586 mm."""
    assert bridging_amplitude(43, 61.94, ROLLER) == pytest.approx(0.587, abs=5e-4)

    def least(amplitude):
        ring = hwsim.Ring(61.94, lobes={43: (amplitude, 0.0)})
        about = np.linspace(0.0, 2 * math.pi / 43, 20001)
        surface = ring.surface(about)
        first, second = np.gradient(surface, about), -(43**2) * (surface - 61.94)
        square = surface**2 + first**2
        return (np.sqrt(square) + ROLLER * (1 - (second * surface - first**2) / square)).min()

    threshold = brentq(least, 0.5, 0.7)
    assert threshold == pytest.approx(bridging_amplitude(43, 61.94, ROLLER), rel=0.02)
    for amplitude, jumps in ((0.97 * threshold, False), (1.03 * threshold, True)):
        fine = np.linspace(0.0, 2 * math.pi / 43, 4001)
        step = np.diff(hwsim.Ring(61.94, lobes={43: (amplitude, 0.0)}).part_angle(fine, ROLLER))
        assert (step.max() > 0.01) == jumps


def amplitude_seen(ring, upr, tip_radius, number=4096):
    beta = ring.part_angle(angles := np.arange(number) * (2 * math.pi / number), tip_radius)
    assert np.all(np.diff(beta) > 0)
    return 2 * abs(np.exp(-1j * upr * angles) @ ring.reading(angles, tip_radius)) / number


def test_a_roller_passes_on_43_lobes_of_a_quarter_of_a_micrometre():
    """Erratum 23: transmission 1.000000, so that bridging does not explain what the source lost."""
    ring = hwsim.Ring(61.94, lobes={43: (0.235 * UM, 0.7)})
    assert amplitude_seen(ring, 43, ROLLER) / (0.235 * UM) == pytest.approx(1.0, abs=5e-7)
    bridged = hwsim.Ring(61.94, lobes={43: (0.65, 0.7)})
    assert amplitude_seen(bridged, 43, ROLLER) / 0.65 < 0.9


@given(
    st.floats(0.0, 0.9),
    st.floats(-3.0, 3.0),
    st.floats(0.0, 20.0),
    st.integers(2, 20),
    st.floats(0.0, 0.3),
    st.floats(-3.0, 3.0),
)
def test_turning_part_and_table_together_changes_nothing(ratio, turn, tip_radius, upr, steep, phase):
    amplitude = steep * 50.0 / upr**2
    ring = hwsim.Ring(50.0, 50.0 * ratio * 0.8, 0.4, lobes={upr: (amplitude, phase)})
    angle = turn - ring.offset_angle
    turned_on = ring.replace(offset_angle=turn, lobes={upr: (amplitude, phase + upr * angle)})
    one, other = ring.reading(ANGLES, tip_radius), turned_on.reading(ANGLES + angle, tip_radius)
    assert np.abs(one - other).max() < 1e-9 * (1 + abs(turn))


def test_the_contact_goes_on_over_turns():
    ring = hwsim.Ring(61.94, 30.0, 0.5, lobes={5: (0.1, 0.0)})
    once, later = ring.part_angle(ANGLES, ROLLER), ring.part_angle(ANGLES + 6 * math.pi, ROLLER)
    assert np.abs(later - once - 6 * math.pi).max() < 1e-12
    assert np.all(np.diff(once) > 0)


def test_roundness_is_peak_to_valley():
    ring = hwsim.Ring(61.94, lobes={2: (0.001, 0.3), 3: (0.002, 1.0)})
    fine = np.linspace(0.0, 2 * math.pi, 1_000_001)
    assert ring.roundness == pytest.approx(
        np.ptp(0.001 * np.cos(2 * fine - 0.3) + 0.002 * np.cos(3 * fine - 1.0)), rel=1e-4
    )
    assert hwsim.Ring(61.94).roundness == 0.0


REFUSED = {
    "no radius": ({"radius": 0.0}, "radius must be > 0"),
    "beyond": (
        {"radius": 10.0, "offset": 10.0},
        "offset must be < radius less amplitudes of lobes, 10: .* got 10.0",
    ),
    "beyond with lobes": (
        {"radius": 10.0, "offset": 9.5, "lobes": {2: (0.5, 0.0)}},
        "less amplitudes of lobes, 9.5",
    ),
    "negative": ({"radius": 10.0, "offset": -1.0}, "offset must be >= 0"),
    "degrees": (
        {"radius": 10.0, "offset_angle": 30.0},
        "offset_angle must be within a turn; units.deg.90. for degrees [(]rad[)]; got 30.0",
    ),
    "1 upr": ({"radius": 10.0, "lobes": {1: (0.1, 0.0)}}, "upr of lobes must be >= 2; got 1"),
    "upr not whole": ({"radius": 10.0, "lobes": {2.5: (0.1, 0.0)}}, "upr of lobes must be a whole number"),
    "amplitude alone": ({"radius": 10.0, "lobes": {2: 0.1}}, "must be a pair"),
    "negative amplitude": ({"radius": 10.0, "lobes": {2: (-0.1, 0.0)}}, "amplitude of lobes.2. must be >= 0"),
    "infinite phase": ({"radius": 10.0, "lobes": {2: (0.1, math.inf)}}, "phase of lobes.2. must be finite"),
    "steep": (
        {"radius": 10.0, "lobes": {43: (0.235, 0.0)}},
        "lobes must be of upr times amplitude <= 5 together .* got 10.1",
    ),
    "no mapping": ({"radius": 10.0, "lobes": [(2, 0.1)]}, "lobes must be a mapping"),
}


@pytest.mark.parametrize(("values", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(values, message):
    with pytest.raises((ValueError, TypeError), match=message):
        hwsim.Ring(**values)


def test_readings_refused():
    ring = hwsim.Ring(61.94)
    with pytest.raises(ValueError, match=r"tip_radius must be >= 0 \(mm\); got -1.0"):
        ring.reading([0.0], tip_radius=-1.0)
    with pytest.raises(ValueError, match=r"angle\[1\] must be finite"):
        ring.part_angle([0.0, math.nan])


def test_a_ring_is_a_value():
    lobes = {3: (0.001, 0.0)}
    ring = hwsim.Ring(61.94, 3.6, lobes=lobes)
    lobes[5] = (0.1, 0.0)
    assert ring == hwsim.Ring(61.94, 3.6, lobes={3: (0.001, 0)}) and hash(ring) == hash(
        hwsim.Ring(61.94, 3.6)
    )
    assert (ring.center_x, ring.center_y) == (3.6, 0.0)
