"""Where a push is expected to leave the ring, against draws of everything that scatters."""

import numpy as np
import pytest
from push_inside import at

from centering import plan_push, preset
from centering.push import Arrival
from sdpgrind import units
from sdpgrind.base.compiling.compiled import opened

PRINTED = preset("printed")


def drawn(push, count, rng):
    """Places on the table, x through the centre before the push: each ring laid, pushed and turned back by
    itself.
    """
    problem, w, d, touch = push.problem, push.spindle_speed, push.offset, push.touch
    scatter, ends = problem.scatter, []
    spread = np.hypot(scatter.friction_part_sd, scatter.friction_push_sd)
    rows = touch.push_profile.segments
    early = 0.02 / rows[0, 1]
    across = d * np.sin(touch.angle)
    tip = d * np.cos(touch.angle) + np.sqrt(89.5**2 - across**2) + 0.02
    for _ in range(count):
        law = problem.model.parameters
        law[3:5] *= 1 + spread * rng.standard_normal()
        start = d + scatter.measuring_sd * (rng.standard_normal() + 1j * rng.standard_normal())
        place = start * np.exp(-1j * (touch.angle + w * early))
        state = np.zeros(at.STATES)
        state[at.X], state[at.Y], state[at.V_X], state[at.V_Y] = (
            place.real,
            place.imag,
            -w * place.imag,
            w * place.real,
        )
        state[at.TIP], state[at.RESTS], state[at.TOUCH] = (
            tip + scatter.stop_sd * rng.standard_normal(),
            1.0,
            -1.0,
        )
        whole = np.vstack(([(early, rows[0, 1], 0.0)], rows, [(0.08, 0.0, 0.0)]))
        opened(at._push_on_table)(law, 89.5, w, whole, 4e-5, state)
        end = complex(state[at.X], state[at.Y]) * np.exp(1j * (touch.angle + w * early - w * state[at.CLOCK]))
        ends.append(start + (end - start) * np.exp(1j * scatter.direction_sd * rng.standard_normal()))
    return np.array([(end.real, end.imag) for end in ends])


@pytest.mark.parametrize(
    ("mass", "rpm", "offset", "speed", "shape"),
    [
        (18.9, 20.0, 1.0, 10.0, "trapezoid"),
        (0.8, 60.0, 5.0, 40.0, "trapezoid"),
        (18.9, 20.0, 3.0, 40.0, "gentle"),
    ],
)
def test_it_is_where_draws_arrive(mass, rpm, offset, speed, shape):
    push = plan_push(
        PRINTED.replace(mass=mass),
        offset=offset,
        follow_gap=20.0,
        spindle_speed=units.rpm(rpm),
        push_speed=speed,
        shape=shape,
    )
    there, ends = push.arrival(), drawn(push, 400, np.random.default_rng(0))
    assert there.offset < 2e-3  # an exact push
    mean = ends.mean(axis=0) - [there.x, there.y]
    # bent: friction moves the mean
    assert np.all(np.abs(mean) < 4.0 * ends.std(axis=0) / 20.0 + [0.2 * there.sd[0] + 2e-3, 0.0])
    assert there.sd == pytest.approx(ends.std(axis=0), rel=0.25 if shape == "gentle" else 0.15)


def test_nothing_scatters_where_nothing_does():
    still = dict.fromkeys(
        ("friction_part_sd", "friction_push_sd", "direction_sd", "stop_sd", "measuring_sd"), 0.0
    )
    problem = PRINTED.replace(scatter=PRINTED.scatter.replace(**still))
    push = plan_push(problem, offset=1.0, spindle_speed=2.0, push_speed=10.0)
    assert np.all(push.arrival().covariance == 0.0)
    slippery = push.arrival(problem.model.replace(mu_static=0.16, mu_kinetic=0.12))
    assert slippery.x < -0.002  # it slides further than planned


def test_equality_is_by_value():
    one, other = (Arrival(1.0, 0.0, np.eye(2)) for _ in range(2))
    assert one == other and hash(one) == hash(other) and one != one.replace(x=2.0)
    with pytest.raises(ValueError, match="read-only"):
        one.covariance[0, 0] = 1.0


@pytest.mark.parametrize(
    ("x", "y", "along", "across"),
    [(0.0, 0.0, 3.6, 26.0), (1.5, -2.0, 2.0, 2.0), (8.0, 3.0, 1.0, 9.0), (0.0, 0.0, 0.0, 5.0)],
)
def test_probability_within_is_the_share_of_draws(x, y, along, across):
    turned = np.array([[0.8, -0.6], [0.6, 0.8]])
    there = Arrival(1e-3 * x, 1e-3 * y, 1e-6 * turned @ np.diag([along**2, across**2]) @ turned.T)
    draws = np.random.default_rng(0).normal(size=(400_000, 2)) * (along, across) @ turned.T + (x, y)
    share = np.mean(np.hypot(*draws.T) <= 2.5)
    assert there.probability_within(2.5e-3) == pytest.approx(
        share, abs=4.5 * np.sqrt(max(share * (1 - share), 1e-5) / 400_000)
    )


def test_probability_within_far_away_and_repr():
    there = Arrival(0.5, 0.0, [[1e-6, 0.0], [0.0, 4e-6]])
    assert there.probability_within(0.0025) == 0.0
    assert repr(there) == "Arrival(500 µm from the axis, give or take 1 µm along and 2 µm across)"
    with pytest.raises(ValueError, match=r"tolerance must be > 0 \(mm\); got 0\.0"):
        there.probability_within(0.0)
