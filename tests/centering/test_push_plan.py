import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from push_inside import TooFastError, landing, ring_state

import sdpgrind
from centering import Push, plan_push, preset, simulate_push
from centering.push import Part, plan_touch
from sdpgrind import units

PRINTED = preset("printed")
SLOW = units.rpm(20.0)
V_R = 83.333
LIMITS = PRINTED.limits.replace(approach_speed=V_R, push_speed_max=V_R)
SOURCE = PRINTED.replace(part=Part(18.9, 61.94), limits=LIMITS)  # "as written"
ROWS = [
    (1.0, 10.0, 38.749828, 8.7047237, 0.3229152, 4.303),
    (10.0, V_R, 36.407758, 15.6911104, 0.3033980, 6.618),
]


def _at(problem=SOURCE, offset=1.0, rpm=20.0, push_speed=10.0, **further):
    return plan_push(
        problem,
        offset=offset,
        follow_gap=7.928,
        spindle_speed=units.rpm(rpm),
        push_speed=push_speed,
        **further,
    )


@pytest.mark.parametrize(("offset", "speed", "angle", "stroke", "time", "slip"), ROWS)
def test_leads_of_the_specification(offset, speed, angle, stroke, time, slip):
    push = _at(offset=offset, push_speed=speed, direction="end")
    assert math.isclose(push.lead_angle, units.deg(angle), abs_tol=units.deg(1e-6))
    assert math.isclose(push.stroke, stroke, abs_tol=1e-6) and math.isclose(push.time, time, abs_tol=1e-6)
    printed = _at(offset=offset, push_speed=speed, direction="end", timing="printed")
    assert math.isclose(printed.lead_angle - push.lead_angle, units.deg(slip), abs_tol=units.deg(1e-3))
    assert math.isclose(printed.lead_angle, units.rpm(20.0) * printed.time, rel_tol=1e-12)


def test_lead_is_the_limit_of_the_source_s_iteration():
    """(5.6), (5.16) and (5.17) in turn, with the corrected times."""
    d, r, w, a, angle = 1.0, 61.94, units.rpm(20.0), 2560.0, 0.0
    for _ in range(60):
        lead = d * (1 - math.cos(angle)) + r - math.sqrt(r * r - (d * math.sin(angle)) ** 2)
        angle = w * ((7.928 - lead - 0.5) / V_R + V_R / a + 0.05 + 1.5 / 10.0 + 10.0 / a)
    assert math.isclose(_at(direction="end").lead_angle, angle, abs_tol=1e-11)


def test_lead_follows_where_iteration_does_not_converge():
    """The rim outruns the approach: the map has a slope beyond -1, the bracketed root is found all the same."""
    slow = SOURCE.replace(limits=LIMITS.replace(approach_speed=10.0))
    push = _at(slow, offset=4.0, rpm=30.0, push_speed=80.0, direction="end")
    slope = units.rpm(30.0) * 4.0 * math.sin(push.lead_angle) / 10.0
    assert slope > 1.0
    assert math.isclose(push.lead_angle, units.rpm(30.0) * push.time, rel_tol=1e-12)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.01, 10.0),
    st.floats(1.0, 60.0),
    st.floats(2.0, 80.0),
    st.sampled_from(["end", "contact", "quasi-static"]),
)
def test_a_plan_meets_the_rim_at_its_place(offset, rpm, speed, direction):
    try:
        push = _at(offset=offset, rpm=rpm, push_speed=speed, direction=direction)
    except ValueError as refusal:
        assert "the rim arrives before the push" in str(refusal)
        return
    r, w = 61.94, units.rpm(rpm)
    profile, touch = push.profile, push.touch
    assert math.isclose(profile.stroke, push.stroke, rel_tol=1e-9) and math.isclose(
        push.stroke, push.rough + push.fine
    )
    assert math.isclose(profile.total_time, push.time, rel_tol=1e-9)
    time = np.linspace(0.0, push.time - touch.time, 200)
    angle = w * time - push.lead_angle
    rim = offset * np.cos(angle) + np.sqrt(r**2 - (offset * np.sin(angle)) ** 2)
    tip = rim[0] + 7.928 - (profile.position(time) - profile.start)
    assert np.all(tip[:-1] > rim[:-1]) and math.isclose(tip[-1], rim[-1], abs_tol=1e-8)
    assert math.isclose(angle[-1], -touch.angle, abs_tol=1e-8)
    assert math.isclose(rim[0] + 7.928 - push.stroke, r, abs_tol=1e-9)  # the tip ends a radius from the axis
    assert math.isclose(touch.push_profile.stroke, touch.travel, rel_tol=1e-9, abs_tol=1e-8)


@pytest.mark.parametrize("direction", ["end", "quasi-static"])
def test_push_that_lasts_longer_than_the_rim_is_away_is_refused(direction):
    """The tip is in reach of the rim for a turn: the rim meets it on the round before."""
    with pytest.raises(
        ValueError, match=r"push_speed must be higher .* the rim arrives before the push \(mm/s\); got 1.0"
    ):
        plan_touch(PRINTED, offset=2.0, spindle_speed=units.rpm(60.0), push_speed=1.0, direction=direction)


def test_alignment_is_where_it_was_asked():
    assert _at(direction="contact").touch.angle == 0.0
    end = _at(direction="end")
    assert math.isclose(end.touch.angle, units.rpm(20.0) * end.touch.time, abs_tol=1e-9)
    quasi = _at(direction="quasi-static").touch
    # half a turn of the push
    assert math.isclose(quasi.angle, units.rpm(20.0) * quasi.time / 2, rel_tol=0.05)


def test_beyond_half_a_turn_the_part_waits():
    slow = SOURCE.replace(limits=LIMITS.replace(safety=0.5))
    near = _at(slow, offset=0.5, rpm=60.0, push_speed=2.0, direction="end")
    assert near.lead_angle > math.pi and near.turns == 1
    assert math.isclose(near.lead_angle, units.rpm(60.0) * near.time, rel_tol=1e-12)
    assert _at(direction="end").turns == 0


def test_rim_that_arrives_first_is_refused():
    with pytest.raises(ValueError, match="the rim arrives before the push; slow the spindle or open the gap"):
        _at(offset=10.0, rpm=80.0, direction="quasi-static")
    with pytest.raises(ValueError, match="rough must be >= 0"):
        plan_push(SOURCE, offset=1.0, follow_gap=0.3, spindle_speed=2.0, push_speed=10.0)


def test_stroke_offset_lengthens_the_push():
    plain, longer = _at(direction="contact"), _at(direction="contact", stroke_offset=0.2)
    assert math.isclose(longer.fine - plain.fine, 0.2, rel_tol=1e-12)


@pytest.mark.parametrize("direction", ["quasi-static", "exact"])
def test_gentle_push_begins_at_first_touch(direction):
    push = _at(offset=5.0, push_speed=40.0, shape="gentle", direction=direction)
    first = push.push_profile.segments[push.push_profile.duration > 1e-6][0]
    assert math.isclose(first[1], 1.0) and first[2] == 0.0
    time = np.linspace(0.0, push.profile.total_time, 20001)
    assert math.isclose((push.profile.position(time) - push.profile.start).max(), push.stroke, abs_tol=1e-4)


def test_correction_may_take_the_whole_run_up():
    """As for a ring that slides on by most of its offset."""
    far = SOURCE.replace(limits=LIMITS.replace(stroke_offset_max=5.0))
    push = _at(far, offset=4.26, rpm=5.56, push_speed=60.5, direction="end", stroke_offset=-3.8)
    assert push.fine == pytest.approx(0.96) and push.touch.run_up_time == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("direction", ["exact", "quasi-static"])
def test_gentle_push_asks_no_more_than_the_slide_can_do(direction):
    """Its way back as well."""
    weak = PRINTED.replace(limits=PRINTED.limits.replace(acceleration_max=800.0))
    push = plan_push(
        weak, offset=1.0, spindle_speed=SLOW, push_speed=10.0, direction=direction, shape="gentle"
    )
    assert np.abs(push.profile.acceleration).max() == pytest.approx(800.0, rel=1e-12)


def test_gentle_push_is_gentle():
    gentle = _at(PRINTED, offset=5.0, push_speed=40.0, shape="gentle").simulate()
    hard = _at(PRINTED, offset=5.0, push_speed=40.0).simulate()
    assert gentle.peak_force < hard.peak_force / 3
    assert abs(gentle.final_position - gentle.profile.position(np.linspace(0, 1, 2001)).max()) < 0.02


def test_simulation_is_that_of_the_model():
    push = _at(PRINTED, push_speed=10.0)
    assert push.simulate(PRINTED.model.replace(mass=0.8)).peak_force < push.simulate().peak_force
    still = _at(PRINTED, push_speed=10.0, rpm=0.01, direction="contact")
    again = simulate_push(PRINTED.model, still.push_profile)
    assert math.isclose(still.simulate().final_position, again.final_position, rel_tol=1e-4)
    assert math.isclose(still.simulate().peak_force, again.peak_force, rel_tol=1e-4)


@pytest.mark.parametrize("shape", ["trapezoid", "gentle"])
@pytest.mark.parametrize(
    ("mass", "rpm", "offset", "speed"),
    [(18.9, 20.0, 1.0, 10.0), (18.9, 100.0, 5.0, 40.0), (0.8, 60.0, 0.2, 5.0)],
)
def test_exact_push_stops_at_the_axis(mass, rpm, offset, speed, shape):
    """To the 1e-8 of the offset of its search and the errors of its own steps; unaimed it stops mm off."""
    problem, w = PRINTED.replace(mass=mass), units.rpm(rpm)
    touch = plan_touch(problem, offset=offset, spindle_speed=w, push_speed=speed, shape=shape)
    rows, model = touch.push_profile.segments, problem.model
    state = ring_state(offset, -touch.angle, model.part.radius, w)
    assert abs(landing(model, w, rows, state, 1e-11)) < 1e-7 * offset
    assert math.isclose(
        touch.push_profile.position(np.linspace(0, touch.time + 0.01, 4001)).max(), touch.travel, rel_tol=1e-4
    )


def _left(problem, w, offset, speed):
    """Final position of the ring across and along its first direction, mm."""
    touch = plan_touch(problem, offset=offset, spindle_speed=w, push_speed=speed)
    rows = touch.push_profile.segments
    state = ring_state(offset, -touch.angle, 89.5, w)
    return landing(problem.model, w, rows, state, 1e-11) * np.exp(1j * touch.angle), touch


def test_ring_that_is_thrown_is_pushed_less_far():
    """18.9 kg at 40 mm/s go 0.83 mm beyond an axis that is 1 mm away; a stroke of 0.37 mm throws them to it."""
    end, touch = _left(PRINTED, SLOW, 1.0, 40.0)
    assert abs(end) < 1e-7 and 0.3 < touch.travel < 0.45


def test_ring_that_sticks_is_aimed_at_the_axis():
    with pytest.warns(UserWarning, match="leaves the ring 0.01 mm from the axis .*: it sticks"):
        # the contact closes by more before the ring breaks away
        stuck, touch = _left(PRINTED, SLOW, 0.01, 5.0)
    assert math.isclose(abs(stuck), 0.01, rel_tol=1e-9) and math.isclose(touch.travel, 0.01, rel_tol=1e-3)
    assert math.isclose(touch.miss, 0.01, rel_tol=1e-9)


def test_what_is_left_is_told_although_it_is_within_the_tolerance():
    with pytest.warns(UserWarning, match="leaves the ring 0.002 mm"):
        touch = plan_touch(PRINTED, offset=0.002, spindle_speed=SLOW, push_speed=5.0)
    assert math.isclose(touch.miss, 0.002, rel_tol=1e-9)


def test_push_says_what_it_misses():
    """To the 1e-8 of the offset that the search asks for, in each of two numbers; of other directions nothing
    is known.
    """
    exact, other = (_at(PRINTED, direction=direction) for direction in ("exact", "contact"))
    assert 0.0 <= exact.miss < 1.5e-8 and math.isnan(other.miss)
    assert exact.arrival().offset < 1e-4 < other.arrival().offset


FAST_RIMS = [
    (90.7, 7.3, 16.0, "gentle"),
    (74.5, 8.6, 22.0, "gentle"),
    (100.0, 10.0, 40.0, "gentle"),
    (100.0, 2.0, 3.0, "trapezoid"),
    (62.0, 6.3, 5.0, "trapezoid"),
]


@pytest.mark.parametrize(("rpm", "offset", "speed", "shape"), FAST_RIMS)
def test_push_against_a_rim_that_is_faster_reaches_the_axis(rpm, offset, speed, shape):
    """The tip meets the rim nearly a radian before alignment; errors double along the way, from 1e-8 of the offset."""
    touch = plan_touch(PRINTED, offset=offset, spindle_speed=units.rpm(rpm), push_speed=speed, shape=shape)
    state = ring_state(offset, -touch.angle, 89.5, units.rpm(rpm))
    assert (
        abs(landing(PRINTED.model, units.rpm(rpm), touch.push_profile.segments, state, 1e-11)) < 1e-6 * offset
    )


def test_push_that_cannot_reach_the_axis_is_refused():
    """The rim is faster than the tip: planned all the same, it would leave 5 mm."""
    place = {"offset": 5.2754, "spindle_speed": units.rpm(93.23), "push_speed": 30.8, "shape": "gentle"}
    with pytest.raises(ValueError, match=r"must be lower for an offset of .*30.8 mm/s, which .* push faster"):
        plan_push(PRINTED.replace(mass=59.19, radius=61.0), **place)


def test_exact_push_for_which_the_rim_comes_first_is_refused():
    place = {"offset": 4.8622, "spindle_speed": units.rpm(97.07), "push_speed": 5.2587}
    with pytest.raises(TooFastError, match="the rim arrives before"):
        plan_push(PRINTED.replace(mass=5.0, radius=85.0), **place)


@pytest.mark.parametrize(
    ("rpm", "offset", "speed", "why"),
    [
        (72.733, 0.47124, 2.46157, "the rim is as fast as the tip"),
        (68.656, 0.0551366, 7.36737, "it is thrown beyond"),
    ],
)
def test_push_that_leaves_some_of_the_offset_says_how_much(rpm, offset, speed, why):
    with pytest.warns(UserWarning, match=why) as told:
        push = plan_push(preset("identified"), offset=offset, spindle_speed=units.rpm(rpm), push_speed=speed)
    left = float(re.search(r"leaves the ring (\S+) mm", str(told[0].message))[1])
    assert 0.01 * offset < left < 0.1 * offset
    assert math.isclose(push.arrival().offset, left, rel_tol=0.02)


def test_push_is_drawn():
    push = _at(PRINTED)
    (axis,) = push.plot().axes
    assert (
        axis.get_ylabel() == "place on the push line [mm]"
        and axis.get_xlabel() == "time since the trigger [ms]"
    )
    lines = {line.get_label(): line.get_xydata() for line in axis.lines}
    (place,) = lines["first touch"]
    tip = lines["tip"]
    assert np.interp(place[0], *tip.T) == pytest.approx(place[1], abs=1e-3)
    # the gap that is followed with
    assert tip[0, 1] - lines["rim, until it is touched"][0, 1] == pytest.approx(7.928, abs=1e-6)
    told = {text.get_text() for text in axis.figure.legends[0].get_texts()}
    assert told >= {*lines, "approach", "pause", "run-up", "push"}
    assert axis.get_title().startswith("1 mm off the axis at 20 rpm: begin 33.63° before")
    assert "lead 33.63 deg" in repr(push)


def test_push_is_drawn_where_it_is_asked():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure, axis = pyplot.subplots()
    assert _at(PRINTED).plot(axis) is figure and axis.lines
    pyplot.close(figure)


def test_equal_plans_are_equal():
    assert _at() == _at() and hash(_at()) == hash(_at()) and _at() != _at(offset=1.5)
    assert _at().touch == _at().touch and _at().touch != _at(offset=1.5).touch


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"offset": 0.0}, r"offset must be > 0 \(mm\); got 0.0"),
        ({"offset": 62.0}, r"offset must be < radius = 61.94, or the probe finds no part \(mm\); got 62.0"),
        ({"rpm": -1.0}, r"spindle_speed must be > 0 \(rad/s\); got -0.1"),
        ({"push_speed": math.nan}, r"push_speed must be finite \(mm/s\); got nan"),
        (
            {"push_speed": 100.0},
            r"push_speed must be <= push_speed_max = 83.333 \(mm/s\); units.mm_per_min\(...\) for mm/min; got 100.0",
        ),
        ({"direction": "left"}, "direction must be one of exact, quasi-static, contact, end; got 'left'"),
        ({"timing": "legacy"}, "timing must be one of exact, printed; got 'legacy'"),
        ({"shape": "round"}, "shape must be one of trapezoid, gentle; got 'round'"),
        ({"stroke_offset": 0.7}, r"stroke_offset must be in \[-0.5, 0.5\] \(mm\); got 0.7"),
    ],
)
def test_bad_pushes_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        _at(**arguments)


def test_ring_pushed_from_its_side_is_refused():
    with pytest.raises(TooFastError, match=r"push_speed must be higher .* the rim arrives before the push"):
        plan_touch(PRINTED, offset=10.0, spindle_speed=20.0, push_speed=1.0)


@pytest.mark.parametrize(
    "further", [{}, {"direction": "end", "timing": "printed"}, {"shape": "gentle", "stroke_offset": 0.1}]
)
def test_a_push_is_kept_in_a_file(tmp_path, further):
    """By value: simulation and arrival are as before; the data for a slide have their units."""
    push = _at(**further)
    push.save(tmp_path / "push.nc")
    again = sdpgrind.load(tmp_path / "push.nc")
    assert type(again) is Push and again == push and hash(again) == hash(push)
    assert again != _at(offset=1.01, **further)
    assert again.simulate() == push.simulate()
    data = push.dataset
    assert np.array_equal(
        np.column_stack([data[name] for name in ("duration", "velocity", "acceleration")]),
        push.profile.segments,
    )
    told = {
        name: data[name].attrs["units"]
        for name in ("duration", "velocity", "acceleration", "start", "lead_angle", "time")
    }
    assert told == dict(zip(told, ("s", "mm/s", "mm/s^2", "mm", "rad", "s"), strict=True))
