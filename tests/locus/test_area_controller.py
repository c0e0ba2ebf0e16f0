"""Several hidden states by several measurements: against the best points themselves, and a model that is
wrong.
"""

import functools

import numpy as np
import pytest

import hwsim
from sdpgrind import locus

HIDDEN = {"dullness": 1.3, "dressing_state": 0.85}


@functools.cache
def area():
    return locus.plan(locus.preset("grinding-roughness"))


def measured(problem, controls, hidden):
    """What the process reads at controls, by its own functions."""
    s, c = (type("Values", (), values)() for values in (hidden, controls))
    return {one.name: float(one.response(s, c)) for one in problem.varying}


def walked(controller, hidden, steps, problem=None):
    """Slacks, scaled, after each step, and the last controls."""
    problem = problem or area().problem
    command = controller.command
    for _ in range(steps):
        command = controller.step(**measured(problem, command, hidden))
    return command


@pytest.mark.parametrize("theta", [0.3, 0.7, 1.0])
def test_it_comes_to_the_best_point(theta):
    """Errors fall by the share theta: 1 in a few steps, as Newton's method."""
    controller = locus.AreaController(area(), theta=theta)
    command = walked(
        controller, HIDDEN, 8 if theta == 1.0 else int(np.ceil(np.log(1e-9) / np.log(1 - theta))) + 8
    )
    best = area().at(**HIDDEN).controls
    np.testing.assert_allclose(list(command.values()), list(best.values()), rtol=1e-6)
    np.testing.assert_allclose(list(controller.report().values()), list(HIDDEN.values()), rtol=1e-6)


def test_near_the_best_point_errors_fall_by_theta():
    """The loop is I - theta I: no constraint disturbs another."""
    near = {name: 1.002 * value for name, value in HIDDEN.items()}
    controller = locus.AreaController(area(), theta=0.4, start=near)
    system, true = area().system, np.array(list(HIDDEN.values()))
    before = system.scaled(np.array(list(near.values())), system.n) - system.scaled(true, system.n)
    walked(controller, HIDDEN, 1)
    after = controller.state - system.scaled(true, system.n)
    np.testing.assert_allclose(after, 0.6 * before, atol=0.02 * np.max(np.abs(before)))


def test_a_wrong_model_keeps_the_true_limits():
    """Chips take 3 % more energy than the model knows: readings come to the limits, the believed states not
    to the true.
    """
    wheel = area().problem.model.grinding
    power = wheel.power.replace(specific_energy=1.03 * wheel.power.specific_energy)
    plant = area().problem.replace(grinding=wheel.replace(power=power))
    controller = locus.AreaController(area(), theta=0.7)
    command = walked(controller, HIDDEN, 40, plant)
    found, limit = measured(plant, command, HIDDEN), area().at(**controller.report()).limit
    for name, value in found.items():
        assert value == pytest.approx(limit[name], rel=1e-6)
    assert controller.report()["dullness"] > 1.02 * HIDDEN["dullness"]


def test_a_margin_is_kept():
    controller = locus.AreaController(area(), theta=0.7, margin={"grinding_power": 20.0})
    command = walked(controller, HIDDEN, 40)
    limit = area().at(**controller.report()).limit
    found = measured(area().problem, command, HIDDEN)
    assert limit["grinding_power"] - found["grinding_power"] == pytest.approx(20.0, abs=1e-3)
    assert limit["roughness"] == pytest.approx(found["roughness"], rel=1e-6)


def test_states_are_clamped_and_nothing_winds_up():
    controller = locus.AreaController(area(), theta=1.0)
    for _ in range(30):
        controller.step(grinding_power=1e5, roughness=0.0008)
    assert np.all((controller.state >= 0) & (controller.state <= 1))
    command = walked(controller, HIDDEN, 12)
    np.testing.assert_allclose(list(command.values()), list(area().at(**HIDDEN).controls.values()), rtol=1e-6)


def test_readings_that_are_missing_count_for_nothing():
    controller = locus.AreaController(area())
    before = controller.command
    assert controller.step(grinding_power=np.nan, roughness=np.nan) == before
    controller.step(grinding_power=np.inf, roughness=0.0006)
    assert controller.command != before
    controller.reset()
    assert controller.command == before


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: locus.AreaController(None), TypeError, "curve must be an Area"),
        (lambda: locus.AreaController(area(), theta=0.0), ValueError, r"theta must be in \(0, 1\]; got 0"),
        (
            lambda: locus.AreaController(area(), start={"dullness": 1.0}),
            ValueError,
            "start must have dullness, dressing_state",
        ),
        (
            lambda: locus.AreaController(area(), start={**HIDDEN, "dullness": 9.0}),
            ValueError,
            r"start\['dullness'\] must be in",
        ),
        (
            lambda: locus.AreaController(area(), margin={"power": 1.0}),
            ValueError,
            "margin must be one of grinding_power, roughness",
        ),
        (
            lambda: locus.AreaController(area()).step(roughness=0.001),
            ValueError,
            "measurement must have grinding_power",
        ),
        (
            lambda: locus.AreaController(area()).step(roughness="1", grinding_power=1.0),
            TypeError,
            "roughness must be a number",
        ),
    ],
)
def test_refusals(make, kind, message):
    with pytest.raises(kind, match=message):
        make()


def test_it_is_a_controller():
    controller = locus.AreaController(area(), period=0.5)
    assert isinstance(controller, hwsim.protocols.Controller)
    assert controller.commands == {"infeed_rate": "mm/s", "work_rotation": "rad/s", "dressing_lead": "mm"}
