import dataclasses
import json
import math
import re

import numpy as np
import pytest
from push_inside import GRAVITY

from centering import CenteringLimits, CenteringProblem, PushScatter, preset, presets
from centering.push import Part, PushModel
from sdpgrind.base import stored
from sdpgrind.identify import Estimate, Status

PRINTED = preset("printed")
FIELDS = {"contact_stiffness": 1200.0, "contact_damping": 1.0, "mu_static": 0.2, "mu_kinetic": 0.15}


def _model(**changes):
    return PushModel(Part(18.9, 89.5), **{**FIELDS, **changes})


def test_forces_are_in_newton_though_lengths_are_in_mm():
    model = PRINTED.model
    assert math.isclose(model.breakaway_force, 0.2 * 18.9 * 9.807, rel_tol=1e-14)  # kg m/s^2
    assert math.isclose(model.coulomb_force, 0.15 * 18.9 * 9.807, rel_tol=1e-14)
    assert GRAVITY == 9807.0


@pytest.mark.parametrize(("mass", "quantum"), [(18.9, 15.4e-3), (0.8, 0.65e-3)])
def test_quantum_is_that_of_the_specification(mass, quantum):
    assert math.isclose(PRINTED.replace(mass=mass).model.stick_slip_quantum, quantum, rel_tol=1e-2)


def test_quantum_is_the_swing_of_an_undamped_jump():
    model = PRINTED.model
    m, k, f_k = model.inertia, model.contact_stiffness, model.coulomb_force
    x, v, closed, dt = 0.0, 0.0, model.breakaway_force / k, 1e-6
    while True:
        v += dt * (k * (closed - x) - f_k) / m
        if v <= 0:
            break
        x += dt * v
    assert math.isclose(x, model.stick_slip_quantum, rel_tol=1e-3)


def test_parameters_are_what_kernels_take():
    model = preset("identified").model
    wanted = [0.0189, 729.0, 0.527, 0.238 * 0.0189 * 9807, 0.0992 * 0.0189 * 9807, 0.286]
    np.testing.assert_allclose(model.parameters, wanted, rtol=1e-14)


def test_replace_reaches_the_part_through_the_problem():
    changed = PRINTED.replace(part=Part(mass=5.0, radius=60.0), tolerance=0.01)
    assert changed.model.part == Part(5.0, 60.0) and changed.tolerance == 0.01
    assert PRINTED.replace(mass=5.0, mu_kinetic=0.1).model.part == Part(5.0, 89.5)
    with pytest.raises(ValueError, match="is mu_kinetic meant"):
        PRINTED.replace(mu_kinetc=0.1)


def test_replace_reaches_limits_and_scatter():
    changed = PRINTED.replace(slide_speed_max=90.0, stop_sd=0.001, mass=5.0)
    assert changed.limits == PRINTED.limits.replace(
        slide_speed_max=90.0
    ) and changed.model == PRINTED.model.replace(mass=5.0)
    assert changed.scatter == PRINTED.scatter.replace(stop_sd=0.001)
    both = (
        r"approach_speed and push_speed_max must be <= slide_speed_max = 60; lower both \(mm/s\); got 83\.3"
    )
    with pytest.raises(ValueError, match=both):
        PRINTED.replace(slide_speed_max=60.0)


def test_note_of_the_quantum_has_the_numbers():
    assert "7.72 µm" in PRINTED.quantum_note and "2.5 µm" in PRINTED.quantum_note
    assert PRINTED.replace(mass=0.8).quantum_note == ""


def test_problem_survives_a_file():
    text = stored.encode(
        PRINTED.replace(limits=CenteringLimits(settle_time=0.0), scatter=PushScatter(stop_sd=0.0))
    )
    json.loads(text)
    assert stored.decode(text) == PRINTED.replace(
        limits=CenteringLimits(settle_time=0.0), scatter=PushScatter(stop_sd=0.0)
    )


def test_presets_are_told():
    assert [info.name for info in presets()] == ["printed", "identified"]
    assert all(preset(info.name).model.part == Part(18.9, 89.5) for info in presets())
    with pytest.raises(ValueError, match="name must be one of printed, identified; got 'best'"):
        preset("best")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mu_kinetic": 0.0}, r"mu_kinetic must be > 0; got 0.0"),
        ({"mu_static": 0.1}, r"mu_static must be >= mu_kinetic = 0.15; got 0.1"),
        ({"contact_stiffness": -1.0}, r"contact_stiffness must be > 0 \(N/mm\); got -1.0"),
        ({"contact_damping": -1.0}, r"contact_damping must be >= 0 \(N s/mm\); got -1.0"),
        ({"viscous_coefficient": -0.1}, r"viscous_coefficient must be >= 0 \(N s/mm\); got -0.1"),
        ({"restitution": 1.2}, r"restitution must be in \[0, 1\]; got 1.2"),
        ({"contact_stiffness": math.nan}, "contact_stiffness must be finite"),
    ],
)
def test_bad_models_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        _model(**changes)


def test_bad_parts_are_refused():
    with pytest.raises(ValueError, match=r"mass must be > 0 \(kg\); got 0.0"):
        Part(0.0, 10.0)
    with pytest.raises(ValueError, match=r"radius must be > 0 \(mm\); got -1.0"):
        Part(1.0, -1.0)
    with pytest.raises(TypeError, match="part must be a Part; got 18"):
        PushModel(18.9, **FIELDS)


def test_equal_coefficients_are_warned_of():
    with pytest.warns(
        UserWarning, match="mu_static equals mu_kinetic = 0.15: the part will not stick and slip"
    ):
        _model(mu_static=0.15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: CenteringLimits(approach_speed=130.0),
            r"approach_speed must be <= slide_speed_max = 120; lower it \(mm/s\); got 130.0",
        ),
        (lambda: CenteringLimits(acceleration_max=0.0), r"acceleration_max must be > 0 \(mm/s\^2\); got 0.0"),
        (lambda: CenteringLimits(settle_time=-1.0), r"settle_time must be >= 0 \(s\); got -1.0"),
        (
            lambda: PushScatter(friction_part_sd=1.5),
            r"friction_part_sd must be in \[0, 1\) \(relative\); got 1.5",
        ),
        (lambda: PushScatter(stop_sd=-1.0), r"stop_sd must be >= 0 \(mm\); got -1.0"),
        (
            lambda: PRINTED.replace(offset_max=90.0),
            r"offset_max must be < the radius of the part = 89.5 \(mm\); got 90.0",
        ),
        (
            lambda: PRINTED.replace(offset_max=0.001),
            r"tolerance must be < a tenth of offset_max, 0.0001; units.um\(...\) for",
        ),
        (lambda: PRINTED.replace(pushes_max=0), "pushes_max must be >= 1; got 0"),
    ],
)
def test_bad_problems_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"spindle_speed_max": 60.0},
            "spindle_speed_max must be < 30; units.rpm(...) for rev/min (rad/s); got 60.0",
        ),
        ({"acceleration_max": 1.5}, "acceleration_max must be > 20; 1000 times m/s^2 (mm/s^2); got 1.5"),
        ({"slide_speed_max": 5000.0}, "slide_speed_max must be < 2000; mm/min over 60 (mm/s); got 5000.0"),
        ({"settle_time": 50.0}, "settle_time must be < 5; ms/1000 (s); got 50.0"),
        ({"sample_time": 10.0}, "sample_time must be < 1; ms/1000 (s); got 10.0"),
        ({"safety": 500.0}, "safety must be < 100; units.um(...) for micrometres (mm); got 500.0"),
        ({"follow_gap": 7928.0}, "follow_gap must be < 200; units.um(...) for micrometres (mm); got 7928.0"),
        (
            {"stroke_offset_max": 500.0},
            "stroke_offset_max must be < 50; units.um(...) for micrometres (mm); got 500.0",
        ),
        ({"mu_static": 16.0}, "mu_static must be < 2; percent/100; got 16.0"),
        ({"mu_static": 20.0, "mu_kinetic": 15.0}, "mu_static must be < 2; percent/100; got 20.0"),
        ({"mu_kinetic": 15.0}, "mu_kinetic must be < 2; percent/100; got 15.0"),
        (
            {"contact_stiffness": 1.2e6},
            "contact_stiffness must be < 200000; N/m over 1000 (N/mm); got 1200000.0",
        ),
        ({"mass": 5000.0}, "mass must be < 500; grams/1000 (kg); got 5000.0"),
        ({"direction_sd": 1.5}, "direction_sd must be < 0.3; units.deg(...) for degrees (rad); got 1.5"),
        ({"stop_sd": 0.5}, "stop_sd must be < 0.1; units.um(...) for micrometres (mm); got 0.5"),
        ({"measuring_sd": 0.3}, "measuring_sd must be < 0.1; units.um(...) for micrometres (mm); got 0.3"),
        (
            {"tolerance": 4.0},
            "tolerance must be < a tenth of offset_max, 1; units.um(...) for micrometres (mm); got 4.0",
        ),
    ],
)
def test_values_that_smell_of_another_unit_are_refused_with_the_way_to_write_them(changes, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        PRINTED.replace(**changes)


def test_updated_takes_the_friction_and_how_sure_it_is():
    estimate = Estimate(("mu_static", "mu_kinetic"), [0.22, 0.14], np.diag([1e-4, 0.007**2]))
    updated = PRINTED.updated(estimate)
    assert (updated.model.mu_static, updated.model.mu_kinetic) == (0.22, 0.14)
    assert math.isclose(updated.scatter.friction_part_sd, 0.05)
    assert updated.scatter.friction_push_sd == PRINTED.scatter.friction_push_sd


def test_updated_keeps_the_spread_where_none_is_known():
    alone = PRINTED.updated(Estimate(("contact_stiffness",), [900.0], [[1.0]]))
    assert alone.model.contact_stiffness == 900.0 and alone.scatter == PRINTED.scatter
    vague = PRINTED.updated(Estimate(("mu_kinetic",), [0.1], [[math.inf]]))
    assert vague.scatter == PRINTED.scatter


@pytest.mark.parametrize("status", [Status.NOT_IDENTIFIED, Status.IMPOSSIBLE])
def test_updated_refuses_what_failed(status):
    with pytest.raises(ValueError, match="estimate must have succeeded"):
        PRINTED.updated(Estimate(("mu_kinetic",), [0.1], [[1e-4]], status))


def test_updated_refuses_what_it_does_not_know():
    with pytest.raises(ValueError, match=r"estimate\.names must be one of mu_static, mu_kinetic"):
        PRINTED.updated(Estimate(("mass",), [1.0], [[1e-4]]))
    with pytest.raises(TypeError, match="an Estimate, as FrictionEstimator gives it"):
        PRINTED.updated(0.15)


def test_everything_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        PRINTED.tolerance = 1.0
    assert isinstance(PRINTED, CenteringProblem)
