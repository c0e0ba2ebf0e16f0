"""What the finishing cell refuses: values, things, commands, motions of other jobs."""

import numpy as np
import pytest
from finishing_fakes import AXIS, Steady, cell, controller, line, motion, problem, truth

import hwsim
from sdpgrind import finishing

CELL = hwsim.FinishingCell(problem())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gap": -0.1}, r"gap must be >= 0 \(mm\); got -0.1"),
        ({"max_time": 0.0}, r"max_time must be > 0 \(s\); got 0.0"),
        ({"target_force": -1.0}, r"target_force must be > 0 \(N\); got -1.0"),
        (
            {"axis": AXIS.replace(lever_arm=80.0)},
            r"axis.lever_arm must be that of the problem, 95 \(mm\); got 80.0",
        ),
    ],
)
def test_values_out_of_range(options, message):
    with pytest.raises(ValueError, match=message):
        CELL.replace(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"problem": 3.0},
            r'problem must be a FinishingProblem \(see finishing.preset\("nominal"\)\); got 3.0',
        ),
        ({"axis": "big"}, r"axis must be a TorqueAxis or None; got 'big'"),
        ({"scatter": 0.1}, r"scatter must be a CellScatter or None; got 0.1"),
        ({"truth": 0.1}, r"truth must be a CellTruth, a function of rng, or None; got 0.1"),
    ],
)
def test_things_of_another_kind(options, message):
    with pytest.raises(TypeError, match=message):
        CELL.replace(**options)


def test_a_truth_that_draws_something_else():
    with pytest.raises(
        TypeError, match=r"truth\(rng\) must be a CellTruth \(see hwsim.CellTruth\); got None"
    ) as caught:
        hwsim.run(CELL.replace(truth=lambda rng: None), controller(problem()))
    assert caught.value.__notes__ == ["in part 0"]


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"friction_ratio": -0.1}, ValueError, r"friction_ratio must be >= 0; got -0.1"),
        ({"load_torque": np.nan}, ValueError, r"load_torque must be finite \(N m\); got nan"),
        ({"tool_mass": -1.0}, ValueError, r"tool_mass must be >= 0 \(kg\); got -1.0"),
        ({"mass_radius": -1.0}, ValueError, r"mass_radius must be >= 0 \(mm\); got -1.0"),
        ({"roughness_error": np.inf}, ValueError, r"roughness_error must be finite; got inf"),
        ({"height": 0.1}, TypeError, r"height must be a HeightField \(see hwsim.HeightField\); got 0.1"),
        ({"table": 0.1}, TypeError, r"table must be a TableLoop or None; got 0.1"),
        ({"axis": None}, TypeError, r"axis must be a TorqueAxis; got None"),
    ],
)
def test_impossible_truths(changes, kind, message):
    with pytest.raises(kind, match=message):
        truth(problem()).replace(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"torque_constant": -0.1}, r"torque_constant must be in \[0, 1\]; got -0.1"),
        ({"height_sd": -0.1}, r"height_sd must be >= 0 \(mm\); got -0.1"),
        ({"shortest_wavelength": 0.0}, r"shortest_wavelength must be > 0 \(mm\); got 0.0"),
        ({"load_torque": -1.0}, r"load_torque must be >= 0 \(N m\); got -1.0"),
    ],
)
def test_impossible_scatter(changes, message):
    with pytest.raises(ValueError, match=message):
        hwsim.CellScatter(**changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: hwsim.HeightField([[1.0, 0.0, 0.0]], [0.0, 1.0], [0.1]),
            r"of shapes \(n, 3\), \(n,\) and \(n,\); got \(1, 3\)",
        ),
        (
            lambda: hwsim.HeightField([[np.nan, 0.0, 0.0]], [0.0], [0.1]),
            r"waves\[0\] must be finite \(rad/mm\); got nan",
        ),
        (lambda: hwsim.HeightField.wave(0.1, 0.0), r"wavelength must be > 0 \(mm\); got 0.0"),
        (
            lambda: hwsim.HeightField.wave(0.1, 1.0, (0, 0, 0)),
            r"direction must be three coordinates, not all zero; got \(0, ",
        ),
    ],
)
def test_impossible_fields(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"current": np.inf}, r"current must be finite \(A\); got inf"),
        ({"feed_override": 1.5}, r"feed_override must be in \[0, 1\]; got 1.5"),
        ({"feed_override": 0.5}, r"feed_override must be 0 before a motion is given; got 0.5"),
        (
            {"motion": np.zeros((3, 7))},
            r"motion must be an array \(m, 8\) of times and 7 joints, m >= 2; got .* \(3, 7\)",
        ),
        ({"motion": np.full((2, 8), np.nan)}, r"motion\[0\] must be finite \(s, rad, mm\); got nan"),
        ({"motion": np.zeros((2, 8))}, r"times of motion must begin at 0 and rise \(s\)"),
    ],
)
def test_commands_that_cannot_be_done(command, message):
    with pytest.raises(ValueError, match=message):
        CELL.start(np.random.default_rng(0)).step(command, 1)


def test_a_joint_beyond_its_end():
    profile = motion(problem()).profile.copy()
    profile[7, 6] = 250.0
    with pytest.raises(
        ValueError, match=rf"X in motion at {profile[7, 0]:g} s must be in \[-200, 200\] \(mm\); got 250.0"
    ):
        CELL.start(np.random.default_rng(0)).step({"motion": profile}, 1)


def test_a_motion_that_leaves_the_path():
    profile = motion(problem()).profile.copy()
    profile[9:, 6] += 5.0
    with pytest.raises(
        ValueError, match=r"motion must follow the path of the problem; at .* s its tip is .* mm away"
    ):
        CELL.start(np.random.default_rng(0)).step({"motion": profile}, 1)


def test_a_motion_is_given_once():
    machine = CELL.start(np.random.default_rng(0))
    machine.step({"motion": motion(problem()).profile}, 1)
    with pytest.raises(ValueError, match="motion must be given once in a part, before it is played"):
        machine.step({"motion": motion(problem()).profile}, 1)


@pytest.mark.parametrize(
    "other", [problem(order=1), problem(feed_rate=12.5), problem(contact_angle=0.3), line()]
)
def test_a_motion_of_another_problem_is_refused(other):
    report = hwsim.check(CELL, controller(other))
    assert not report and "controller is made for another part or machine: its " in str(report)
    with pytest.raises(ValueError, match="made for another part or machine"):
        hwsim.run(CELL, controller(other))


def test_a_controller_that_holds_another_force_is_refused():
    plant, found = CELL.replace(target_force=1.1), controller(problem(), normal_force=1.2)
    (said,) = hwsim.check(plant, found).faults
    assert (
        said
        == "controller is made for another part or machine: its target_force is 1.2 N, that of the plant 1.1 N"
    )
    # which was told nothing
    assert hwsim.check(plant.replace(target_force=1.2), found) and hwsim.check(CELL, found)


def test_its_own_motion_is_not():
    of = problem()
    assert hwsim.check(cell(of), controller(of.replace(friction_ratio=0.3)))  # what is estimated may differ


def test_the_true_torque_is_known_to_nobody():
    with pytest.raises(ValueError, match=r"observer must be 'pid' or 'state' on a machine"):
        hwsim.run(CELL, controller(problem(), observer="ideal"))


def test_plans_and_problems_are_told_what_they_want():
    (said,) = hwsim.check(CELL, motion(problem())).faults
    assert said.endswith("finishing.TorqueController(axis, motion, normal_force=1.11) follows it")
    assert "as hwsim.FinishingCell(problem) is one" in hwsim.check(problem(), Steady(0.0, 0.0)).faults[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"pattern": ("hilbert5", "hilbert3", "zigzag")},
            "pattern must be one of hilbert4, hilbert5, zigzag; got 'hilbert3'",
        ),
        ({"replicates": 0}, "replicates must be >= 1; got 0"),
        ({"confirm": 0}, "confirm must be >= 1; got 0"),
        ({"pitch": 0.0}, r"pitch must be > 0 \(mm\); got 0.0"),
        ({"normal_force": (1.0, 2.0)}, "normal_force"),
        ({"tool_diameter": (4.0, -3.0, 5.0)}, "tool_diameter"),
    ],
)
def test_studies_that_cannot_be_made(options, message):
    with pytest.raises(ValueError, match=message):
        hwsim.finishing_study(CELL, **options)


def test_a_study_needs_a_cell():
    with pytest.raises(TypeError, match=r"cell must be a FinishingCell; got"):
        hwsim.finishing_study(finishing.preset("specimen"))
