"""A ring with lobes, learned over pushes: where it is and how sure that is, against rings whose place is
given.
"""

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from push_inside import LAST, SIZE, PartView, RingFilter, _write_row, places

import hwsim
from centering import CycleSettings, preset
from hwsim import Ring
from sdpgrind.base.compiling.compiled import opened

write_row = opened(_write_row)

RADIUS, TIP, NOISE = 60.0, 3.75, 3e-4  # mm
HEIGHT = NOISE * (SIZE / 60) ** 0.5  # mm: sd of the surface at a place, by a turn of 60 readings
STEP = 0.105  # rad: 100 turns a minute, 100 readings a second


def show(take, ring, begin, arc, rng, step=STEP):
    """Show a ring over an arc."""
    angle = begin + step * np.arange(round(arc / step))
    for a, r in zip(angle, ring.reading(angle, TIP) + NOISE * rng.standard_normal(angle.size), strict=True):
        take(a, r)


def view():
    """A view that expects the lobes of 6 µm sooner than by default: a turn is enough."""
    return PartView(RADIUS, CycleSettings(tip_radius=TIP, angle_sd=0.0, form_sd=3e-4), NOISE)


@pytest.mark.parametrize("upr", range(2, LAST + 1))
def test_a_whole_turn_tells_lobes_from_the_offset(upr):
    part, ring = view(), Ring(RADIUS, 2.0, 1.0, lobes={upr: (0.006, 0.4)})
    show(part.take, ring, 0.3, 2 * pi, np.random.default_rng(upr))
    part.look()
    # a circle alone: no less than the lobes
    assert hypot(part.x - ring.center_x, part.y - ring.center_y) < part.band < 1e-3
    assert part.rim - part.offset == pytest.approx(float(ring.surface(ring.offset_angle)), abs=4 * HEIGHT)


def test_a_slow_turn_tells_as_much():
    """A turn of 1257 readings at 0.5 rad/s; a quarter of one leaves the centre of an oval unknown by 3 µm."""
    part, ring = view(), Ring(RADIUS, 0.002, 1.0, lobes={2: (0.003, 0.4)})
    show(part.take, ring, 0.3, 2.2 * pi, np.random.default_rng(0), step=0.005)
    part.look()
    assert hypot(part.x - ring.center_x, part.y - ring.center_y) < part.band < 3e-4


@pytest.mark.parametrize("upr", [2, 3, 5])
def test_lobes_stay_known_over_a_push(upr):
    """After it a quarter turn does, which without them is off by several of their amplitudes."""
    rng, lobes = np.random.default_rng(upr), {upr: (0.006, 0.4)}
    part, after = view(), Ring(RADIUS, 0.05, 2.0, lobes=lobes)
    show(part.take, Ring(RADIUS, 2.0, 1.0, lobes=lobes), 0.0, 2 * pi, rng)
    part.look()
    part.moved()
    show(part.take, after, 7.5, 0.5 * pi, rng)
    part.look()
    assert hypot(part.x - after.center_x, part.y - after.center_y) < part.band < 2e-3


def test_a_push_takes_away_the_lobes_expected_beforehand_as_they_were_counted():
    """What is kept over a push is what readings told: none of it is negative, and of what they cannot tell
    there is nothing.

    Half a turn shows lobes of 6 µm, so that others are expected larger than when the equations were written;
    then none do."""
    ring = RingFilter(RADIUS, 0.05, 3e-4, NOISE, 0.0, TIP)
    show(
        lambda a, r: ring.take(a, r, True),
        Ring(RADIUS, 0.5, 1.0, lobes={2: (0.006, 0.4)}),
        0.0,
        pi,
        np.random.default_rng(1),
    )
    ring.look((0.5, 0.0))
    told = ring._matrix - ring._known - np.diag([0.0] * 3 + [1.0 / 3e-4**2] * (SIZE - 3))
    ring.moved()
    least = np.linalg.eigvalsh(ring._known)[0]
    assert ring._form > 1.2 * 3e-4 and least > -1e-9 * np.trace(told)
    row = np.zeros((SIZE, 2))
    row[:2] = np.eye(2)  # that the centre is unknown takes two of the directions, and leaves the others
    kept = told - told @ row @ np.linalg.inv(row.T @ told @ row) @ row.T @ told
    np.testing.assert_allclose(ring._known[2:, 2:], kept[2:, 2:] + np.diag([1 / 0.05**2] + [0.0] * (SIZE - 3)),
                               atol=1e-9 * np.trace(told))  # fmt: skip


def test_the_band_of_short_arcs_counts_what_lobes_may_do():
    """Lobes drawn as they are believed, arcs of a quarter turn: errors over their sd have the variance 2 of
    two directions.

    Of 200 the mean has the standard deviation 0.14 (chi-square of 2); the sd is that of the worst direction,
    so it is less."""
    rng, squares = np.random.default_rng(0), []
    for _ in range(200):
        lobes = {
            n: (1e-3 * hypot(c, s), float(np.arctan2(s, c)))
            for n, (c, s) in enumerate(rng.normal(size=(LAST - 1, 2)), 2)
        }
        ring, place = RingFilter(RADIUS, 1e-4, 1e-3, NOISE, 0.0, TIP), Ring(RADIUS, 0.5, 1.0, lobes=lobes)
        show(lambda a, r, ring=ring: ring.take(a, r, True), place, 0.0, 0.5 * pi, rng)
        ring.look((0.0, 0.0))
        squares.append(((ring.x - place.center_x) ** 2 + (ring.y - place.center_y) ** 2) / ring.sd**2)
    assert 0.5 < np.mean(squares) < 2.5


def test_a_place_is_planned_to_be_known_as_well_as_it_is():
    """Rings 5 mm off, whose angles are rounded to 4000 counts, 2.3 µm at the rim: over 0.1 µm of noise."""
    problem = preset("printed").replace(radius=RADIUS, measuring_sd=1e-4)
    speed, count = 10.47, 80  # 100 turns a minute; readings
    planned = places(problem, speed, 8.0, 3.0, 0)[0]
    arc = 0.5 * 8.0 * (problem.limits.sample_time * np.arange(count)) ** 2
    sd = []
    for part in range(16):
        rng = np.random.default_rng(part)
        view, ring = PartView(RADIUS, CycleSettings(), 1e-4), Ring(RADIUS, 5.0, rng.uniform(-pi, pi))
        reading = ring.reading(arc, TIP) + 1e-4 * rng.standard_normal(count)
        counts = 2 * pi / 4000 * np.rint(arc * 4000 / (2 * pi))
        for angle, rim in zip(counts, reading, strict=True):
            view.take(angle, rim)
        view.look()
        sd.append(view.sd)
    assert np.interp(arc[-1], planned.arc, planned.sd) == pytest.approx(np.median(sd), rel=0.2)


def test_a_row_is_the_derivative_of_the_reading():
    row, other = np.empty(SIZE), np.empty(SIZE)
    ring, step = Ring(RADIUS, 3.0, 0.7), 1e-5
    reading = float(ring.reading(2.0, TIP)) + TIP
    left, weight = write_row(2.0, reading, ring.center_x, ring.center_y, RADIUS + TIP, 1.0 / 7.0, row)
    assert left == pytest.approx(0.0, abs=1e-12)
    moved = write_row(2.0, reading, ring.center_x + step, ring.center_y, RADIUS + TIP, 0.0, other)[0]
    assert -moved / step == pytest.approx(row[0], rel=1e-5)
    slope = (float(ring.reading(2.0 + step, TIP)) - float(ring.reading(2.0 - step, TIP))) / (2 * step)
    assert weight == pytest.approx(1.0 / (1.0 + (slope / 7.0) ** 2), rel=1e-6)


def test_dust_is_not_taken_for_form():
    part, rng = view(), np.random.default_rng(3)
    for k in range(90):
        dust = 0.02 if k % 13 == 5 else 0.0
        part.take(STEP * k, RADIUS + 0.4 * cos(STEP * k) - 0.4**2 * sin(STEP * k) ** 2 / (2 * (RADIUS + TIP)) + dust
                  + NOISE * rng.standard_normal())  # fmt: skip
    part.look()
    assert hypot(part.x - 0.4, part.y) < part.band < 1e-3


def test_rings_with_lobes_are_centred_and_said_to_be_so_truly():
    from cycle_twins import PlainStrategy

    from centering import CenteringController

    problem = preset("printed").replace(mass=0.8, radius=44.45)
    for upr, amplitude in [(2, 0.001), (2, 0.006), (3, 0.003)]:
        ring = Ring(44.45, 4.0, 1.0, lobes={upr: (amplitude, 0.3)})
        outcome = hwsim.run(
            hwsim.CenteringMachine(problem, ring=ring), CenteringController(PlainStrategy(problem)), parts=3
        ).outcome
        assert np.all(outcome.finished == 1) and outcome.pushes.max() <= 8
