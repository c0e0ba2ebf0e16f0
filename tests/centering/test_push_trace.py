"""Traces of pushes: samples, files, pictures; batches; refusals; the free slide against the speed."""

import matplotlib
import numpy as np
import pytest
from push_inside import COLUMN_NAMES, FORCE, TRAVEL, WORK, pushed

from centering import TipProfile, preset, simulate_push
from centering.push import PushTrace, free_slide_table, simulate_pushes

matplotlib.use("Agg")
MODEL = preset("printed").model
THROWN = TipProfile.move(5.0, 40.0, 2560.0, start=-0.5)


def test_a_trace_says_what_a_batch_says():
    profiles = [THROWN, TipProfile.constant_speed(10.0, 0.4), TipProfile.move(0.01, 10.0, 1000.0)]
    out = simulate_pushes(MODEL, profiles)
    for row, profile in zip(out, profiles, strict=True):
        trace = simulate_push(MODEL, profile)
        np.testing.assert_array_equal(trace.summary, row)
        assert trace.part_position[-1] == trace.final_position
        assert len(trace.event_mode) == row[COLUMN_NAMES.index("events")]
    assert np.isnan(out[2, COLUMN_NAMES.index("breakaway_time")])
    assert out[2, 0] == 0.0
    many = simulate_pushes([MODEL, MODEL.replace(mass=5.0)], THROWN)
    np.testing.assert_array_equal(many[0], out[0])
    np.testing.assert_array_equal(many[1], simulate_pushes(MODEL.replace(mass=5.0).parameters, THROWN)[0])


def test_what_is_not_asked_of_a_push_is_not_told_and_changes_nothing():
    profiles = [THROWN, TipProfile.constant_speed(10.0, 0.4)]
    whole, forces, travels = (pushed(MODEL, profiles, asked) for asked in (WORK, FORCE, TRAVEL))
    peak, balance = (COLUMN_NAMES.index(name) for name in ("peak_force", "energy_error"))
    assert np.all(np.isnan(forces[:, balance])) and np.all(np.isinf(travels[:, peak]))
    np.testing.assert_array_equal(np.delete(forces, balance, 1), np.delete(whole, balance, 1))
    both = [peak, balance]
    np.testing.assert_array_equal(np.delete(travels, both, 1), np.delete(whole, both, 1))


def test_samples_follow_the_equation_of_motion():
    trace = simulate_push(MODEL, THROWN)
    np.testing.assert_allclose(
        trace.tip_position, THROWN.position(np.minimum(trace.time, THROWN.total_time)), atol=1e-12
    )
    time = np.linspace(0.03, 0.12, 5)
    step = 1e-7
    for t in time:
        data = trace.at([t - step, t, t + step])
        x, u, force = (data[name].values for name in ("part_position", "part_velocity", "contact_force"))
        assert (x[2] - x[0]) / (2 * step) == pytest.approx(u[1], rel=1e-6)
        gained = (u[2] - u[0]) / (2 * step)
        inertia = MODEL.inertia * gained + MODEL.coulomb_force + MODEL.viscous_coefficient * u[1]
        assert inertia == pytest.approx(force[1], rel=1e-5, abs=1e-4)


def test_the_part_is_still_where_the_push_ends_only_if_the_tip_stops():
    assert simulate_push(MODEL, TipProfile.constant_speed(40.0, 0.1)).final_velocity > 1.0
    trace = simulate_push(MODEL, THROWN)
    assert trace.final_velocity == 0.0
    assert trace.duration > THROWN.total_time
    assert trace.final_position == pytest.approx(trace.phases[-1, 2] - trace.phases[-1, 5])


def test_a_trace_is_kept_in_a_file(tmp_path):
    trace = simulate_push(MODEL, THROWN)
    trace.save(tmp_path / "push.nc")
    again = PushTrace.from_file(tmp_path / "push.nc")
    assert again == trace
    assert again.profile == THROWN
    assert again != simulate_push(MODEL, TipProfile.constant_speed(10.0, 0.1))
    assert hash(again) == hash(trace)
    data = trace.dataset
    assert {
        name: data[name].attrs["units"] for name in ("time", "tip_position", "part_velocity", "contact_force")
    } == {
        "time": "s",
        "tip_position": "mm",
        "part_velocity": "mm/s",
        "contact_force": "N",
    }


def test_pictures_show_tip_part_force_and_modes():
    figure = simulate_push(MODEL, THROWN).plot()
    position, lead, force = figure.axes
    assert [line.get_label() for line in position.lines] == ["tip", "part"]
    assert any("F_s" in line.get_label() for line in force.lines)
    assert "free" in " ".join(text.get_text() for text in figure.legends[0].get_texts())
    assert len(lead.patches) == len(simulate_push(MODEL, THROWN).event_mode)
    assert len(THROWN.plot().axes) == 2


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ((0.0, 1200.0, 1.0, 37.0, 28.0, 0.1), r"parameters\[:, 0\], M, must be > 0 \(N s\^2/mm\); got 0.0"),
        ((0.02, -1.0, 1.0, 37.0, 28.0, 0.1), r"parameters\[:, 1\], k, must be > 0 \(N/mm\); got -1.0"),
        ((0.02, 1200.0, -1.0, 37.0, 28.0, 0.1), r"parameters\[:, 2\], b, must be >= 0 \(N s/mm\); got -1.0"),
        ((0.02, 1200.0, 1.0, 27.0, 28.0, 0.1), r"parameters\[:, 3\], F_s, must be >= F_k \(N\)"),
        ((0.02, 1200.0, 1.0, 37.0, 0.0, 0.1), r"parameters\[:, 4\], F_k, must be > 0 \(N\); got 0.0"),
        (
            (0.02, 1200.0, 1.0, 37.0, 28.0, -0.1),
            r"parameters\[:, 5\], k_v, must be >= 0 \(N s/mm\); got -0.1",
        ),
        ((0.02, 1200.0, np.nan, 37.0, 28.0, 0.1), r"parameters\[2\] must be finite"),
        ((0.02, 1200.0), r"parameters must be of shape \(m, 6\)"),
    ],
)
def test_bad_parameters_are_refused(parameters, message):
    with pytest.raises(ValueError, match=message):
        simulate_push(np.array(parameters), THROWN)


def test_other_bad_input_is_refused():
    with pytest.raises(ValueError, match="parameters and profiles must be of one number"):
        simulate_pushes(np.tile(MODEL.parameters, (2, 1)), [THROWN] * 3)
    with pytest.raises(TypeError, match="profile must be a TipProfile"):
        simulate_push(MODEL, 3.0)
    with pytest.raises(ValueError, match=r"time must be increasing, in \[0, "):
        simulate_push(MODEL, THROWN).at([0.0, 10.0])


@pytest.mark.parametrize(("name", "mass"), [("printed", 18.9), ("printed", 5.0), ("identified", 18.9)])
def test_the_free_slide_table_is_the_simulation_and_its_inverse(name, mass):
    model = preset(name).model.replace(mass=mass)
    table = free_slide_table(model)
    assert table is free_slide_table(model)
    speed = np.linspace(1.001 * table.threshold_speed, 100.0, 37)
    slides = simulate_pushes(model, [TipProfile.constant_speed(v, 0.4) for v in speed])[:, 1]
    np.testing.assert_allclose(table.distance_at(speed), slides, atol=3e-4)
    np.testing.assert_allclose(table.distance_at(table.speed_for(slides[3:])), slides[3:], rtol=1e-9)
    below = simulate_pushes(model, TipProfile.constant_speed(0.999 * table.threshold_speed, 0.4))
    assert below[0, 1] == 0.0
    assert table.speed_for(0.0) == table.threshold_speed  # not 0
    assert np.all(np.diff(table.distance) >= 0.0)


def test_a_push_is_made_shorter_or_slower():
    table = free_slide_table(MODEL)
    slide = float(table.distance_at(40.0))
    assert table.augmented_stroke(5.0, 40.0) == 5.0 - slide
    assert table.augmented_stroke(0.5 * slide, 40.0) == 0.0
    assert table.augmented_speed(0.1, 40.0) == float(table.speed_for(0.1))
    assert table.augmented_speed(100.0, 40.0) == 40.0
    with pytest.raises(ValueError, match=r"distance must be in \[0, "):
        table.speed_for(100.0)
    with pytest.raises(ValueError, match=r"speed must be in \[0, 120\] \(mm/s\)"):
        table.distance_at(121.0)


def test_a_part_that_never_leaves_the_tip_has_no_free_slide():
    table = free_slide_table(MODEL.replace(mass=0.8))
    assert table.threshold_speed == 120.0
    assert float(table.distance_at(100.0)) == 0.0
    assert table.augmented_stroke(1.0, 80.0) == 1.0
