"""What is refused of axes that carry the work; each in one sentence with its name."""

import numpy as np
import pytest
from mounted_cells import HELD, PLACE, RAIL, TABLE, ring
from robot_twins import UR10

from sdpgrind import finishing


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"axis": (0, 0, 0)}, r"axis must be a direction, with a length above 0; got \(0, 0, 0\)"),
        ({"axis": (0, 1)}, "axis must be three numbers, x, y, z"),
        ({"axis": (0, np.nan, 1)}, "axis.* must be finite"),
        ({"origin": (0.8, 0.0, 0.1)}, r"origin must be in mm, .* metres\? units.m\(...\); got \(0.8"),
        ({"position_min": 1.0, "position_max": 1.0}, "position_max of the Turntable must be > position_min"),
        ({"position_max": 360.0}, r"position_max of the Turntable must be within two turns; units.deg\(90\)"),
        ({"speed_max": 0.0}, r"speed_max must be > 0 \(rad/s\); got 0.0"),
        ({"speed_max": -1.0}, "speed_max must be > 0"),
        ({"speed_max": 120.0}, r"speed_max must be in rad/s, some 2; units.rpm\(...\) for rev/min; got 120"),
        ({"acceleration_max": 0.0}, "acceleration_max must be > 0"),
        ({"jerk_max": 0.0}, "jerk_max must be > 0"),
        ({"angles": 0}, "angles must be"),
        ({"angles": 1000}, "angles must be"),
        ({"angles": ()}, "angles must be one to 720 numbers"),
        ({"angles": (0.1, 0.1)}, "angles must be numbers that differ"),
        ({"angles": (0.0, 7.0)}, r"angles\[1\] must be in \[-6.28"),
    ],
)
def test_turntables(changes, said):
    with pytest.raises(ValueError, match=said):
        TABLE.replace(**changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"direction": (0.0, 0.0, 0.0)}, "direction must be a direction, with a length above 0"),
        (
            {"travel": (500.0, -500.0)},
            r"travel must be its least position, then a greater one \(mm\); got \(500",
        ),
        ({"travel": (0.0, 0.0)}, "travel must be its least position, then a greater one"),
        ({"travel": 500.0}, "travel must be its least and greatest position"),
        ({"travel": (-0.5, 0.5)}, r"travel must be in mm, some 1000 long; metres\? units.m\(...\)"),
        ({"speed_max": 0.4}, r"speed_max must be in mm/s, some 300; units.m_per_s\(...\) for m/s; got 0.4"),
        ({"speed_max": 0.0}, r"speed_max must be > 0 \(mm/s\)"),
        ({"positions": (0.0, 500.0)}, r"positions\[1\] must be in \[-400"),
    ],
)
def test_tables(changes, said):
    with pytest.raises(ValueError, match=said):
        RAIL.replace(**changes)


@pytest.mark.parametrize("value", [True, 24.0, "24", None])
def test_types_of_candidates(value):
    with pytest.raises(TypeError, match=r"angles must be a number of them, or a tuple \(rad\)"):
        TABLE.replace(angles=value)


def test_robots_and_names():
    with pytest.raises(ValueError, match="axes must be one or more: a Turntable or a LinearTable; got none"):
        finishing.arm.mounted(UR10)
    with pytest.raises(ValueError, match="names of the joints must be without repeats; got 'q1' twice"):
        finishing.arm.mounted(UR10, q1=TABLE)
    cell = finishing.arm.mounted(UR10, rail=RAIL)
    with pytest.raises(ValueError, match="names of the joints must be without repeats; got 'rail' twice"):
        finishing.arm.mounted(cell, rail=RAIL)
    with pytest.raises(ValueError, match="name of an axis must not be that of another freedom; got 'spin'"):
        finishing.arm.mounted(UR10, spin=TABLE)
    with pytest.raises(TypeError, match=r"axes\[0\] must be a Turntable or a LinearTable; got a SerialRobot"):
        finishing.arm.mounted(UR10, turntable=UR10)
    with pytest.raises(TypeError, match=r"robot must be a robot: .*; got 'ur10'"):
        finishing.arm.mounted("ur10", rail=RAIL)
    with pytest.raises(ValueError, match=r"jerk_max must be given .* or for none; it is None for rail"):
        finishing.arm.mounted(UR10, rail=RAIL.replace(jerk_max=None))
    with pytest.raises(ValueError, match="robot must have no axes yet"):
        finishing.arm.MountedRobot(cell, axes=(TABLE,), axis_names=("turntable",))
    with pytest.raises(ValueError, match="candidates of the axes must be at most 720 together; got 1200"):
        finishing.arm.mounted(UR10, rail=RAIL.replace(positions=50), turntable=TABLE)
    with pytest.raises(ValueError, match="axis_names must be one for each of the 1 axes; got 2"):
        finishing.arm.MountedRobot(UR10, axes=(TABLE,), axis_names=("a", "b"))
    with pytest.raises(ValueError, match=r"joints must be of shape \(..., 7\) \(rad, mm\); got \(6,\)"):
        cell.forward(np.zeros(6))


def test_placements():
    problem = ring().replace(placement=None)
    with pytest.raises(
        ValueError, match=r"placement must be given where axes carry the work: x, y, z \(mm\)"
    ):
        finishing.plan(problem)


def test_sequences():
    problem = ring()
    with pytest.raises(ValueError, match="robot must be one whose work rests: positions of turntable are"):
        finishing.sequence(problem.path, robot=problem.robot, placement=PLACE)


def test_no_way():
    far = ring().replace(placement=(PLACE[0] + 5000.0, *PLACE[1:]))
    told = (
        r"candidates of the axes must leave the robot a way: try another placement \(no position of turntable"
        r" takes poses\[0\]: of 192 candidates 0 reach it.*\); more candidates of the axes, or other limits"
    )
    with pytest.raises(ValueError, match=told):
        finishing.plan(far)
    both = far.replace(
        robot=finishing.arm.mounted(HELD, rail=RAIL.replace(positions=3), turntable=TABLE.replace(angles=3)),
        contact_angle=np.pi / 2,
        spin=3,
    )
    with pytest.raises(
        ValueError, match="no turn of the tool and position of rail and position of turntable takes"
    ):
        finishing.plan(both)
