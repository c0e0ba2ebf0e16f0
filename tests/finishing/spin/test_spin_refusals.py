"""What is refused of tools that turn about their own axis; each in one sentence with its name."""

import numpy as np
import pytest
from spin_motions import planned, problem

import hwsim
from sdpgrind import finishing


@pytest.mark.parametrize(
    ("spin", "said"),
    [
        (1, "spin must be a number of values over a turn from 2 to 720, or angles; got 1"),
        (1000, "spin must be a number of values over a turn from 2 to 720, or angles; got 1000"),
        ((0.0, 15.0), r"spin\[1\] must be within a turn; units.deg\(90\) \(rad\); got 15.0"),
        ((0.1, 0.0, 0.1), "spin must be of angles that differ"),
        (((0.1, 0.2),), r"spin must be one angle after another \(rad\); got shape \(1, 2\)"),
        ((np.nan,), "spin.* must be finite"),
    ],
)
def test_values(spin, said):
    with pytest.raises(ValueError, match=said):
        problem(spin=spin)


@pytest.mark.parametrize("spin", [True, "24", 24.0])
def test_types(spin):
    with pytest.raises(
        TypeError, match="spin must be a number of values over a turn, such as 24, or a tuple"
    ):
        problem(spin=spin)


def test_no_torque_presses():
    told = r"spin{} must be \(\): no torque of the axis presses a tool that turns about its own axis; got 24"
    leaning = problem(contact_angle=0.5)
    with pytest.raises(ValueError, match=told.format("")):
        finishing.TorqueController(finishing.TorqueAxis(), planned(), normal_force=1.0)
    with pytest.raises(ValueError, match=told.format(" of the problem")):
        hwsim.FinishingCell(leaning)
    with pytest.raises(ValueError, match=told.format("")):
        _ = planned().torque_per_force


def test_no_way():
    with pytest.raises(ValueError, match=r"spin must leave the robot a way: try another placement \(no turn"):
        finishing.plan(problem(placement=(1200.0, -25.0, 100.0)))


def test_a_turn_that_jumps():
    motion = planned()
    data = motion.dataset.copy(deep=True)
    spin = data["spin"].values.copy()
    spin[100:] += 0.5
    data["spin"] = ("row", spin, data["spin"].attrs)
    jumping = finishing.Motion.restored(data)
    with pytest.raises(
        ValueError, match=r"spin of the motion must not jump \(rad\): from .* between rows 99"
    ):
        jumping.program("urscript")
