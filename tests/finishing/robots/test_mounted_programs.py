"""Programs in RAPID and KRL for robots with axes that carry the work; read back by other means than theirs."""

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mounted_cells import HELD, PLACE, RAIL, TABLE, moved, planned, ring
from robot_twins import about
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sdpgrind import finishing
from sdpgrind.finishing._program.options import check_axes
from sdpgrind.finishing._program.read_program import read_text

pytestmark = pytest.mark.filterwarnings("ignore:.* is not the language of the")

NUMBER = r"-?\d+\.\d+"


def on_both():
    """A ring on a turntable that stands on a rail: two axes, one unit."""
    robot = finishing.arm.mounted(HELD, rail=RAIL.replace(travel=(-40.0, 40.0), positions=3), turntable=TABLE)
    return planned(robot=robot, method="trapezoid")


MOTIONS = {"turntable": planned, "both": on_both}


def told(text, target):
    """Poses (k, 4, 4) of the straight moves in the frame of the unit, mm, and external axes as told."""
    numbers = [
        [float(each) for each in re.findall(NUMBER, line.split("v1000")[0])]
        for line in text.splitlines()
        if re.match(r"\s*(MoveL|LIN) ", line)
    ]
    rows, poses = np.array(numbers), np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3, 3] = rows[:, :3]
    if target == "rapid":
        poses[:, :3, :3] = Rotation.from_quat(np.roll(rows[:, 3:7], -1, axis=1)).as_matrix()
        return frame_of(text, "rapid") @ poses, rows[:, 7:]
    poses[:, :3, :3] = Rotation.from_euler("ZYX", rows[:, 3:6], degrees=True).as_matrix()
    return frame_of(text, "krl") @ poses, rows[:, 6:]


def frame_of(text, target):
    """The work in the frame of the unit, mm."""
    line = next(line for line in text.splitlines() if "wobjdata w_" in line or "$BASE=EK" in line)
    values, out = [float(each) for each in re.findall(NUMBER, line)], np.eye(4)
    out[:3, 3] = values[:3]
    turn = (
        Rotation.from_quat([*values[4:], values[3]])
        if target == "rapid"
        else Rotation.from_euler("ZYX", values[3:], degrees=True)
    )
    out[:3, :3] = turn.as_matrix()
    return out


@pytest.mark.parametrize("target", ["rapid", "krl"])
@pytest.mark.parametrize("name", MOTIONS)
def test_a_configured_controller_brings_the_tool_where_the_motion_does(name, target):
    """The unit as the head says, moved by the external axes, then the work on it: the tool in the base."""
    motion = MOTIONS[name]()
    program, robot = motion.program(target, name="ring1"), motion.problem.robot
    poses, axes = told(program.text, target)
    assert axes.shape == (len(poses), len(robot.axes))
    scale = [np.pi / 180 if unit == "rad" else 1.0 for unit in robot.units[6:]]
    rest = robot.axes[-1].frame
    tips = np.empty((len(poses), 3))
    for k, (pose, values) in enumerate(zip(poses, axes * scale, strict=True)):
        there = np.eye(4)
        for axis, value in zip(robot.axes, values, strict=True):
            there = there @ moved(axis, value)
        tips[k] = (there @ rest @ pose)[:3, 3]
    dense = motion.at(np.linspace(0.0, motion.duration, 20_001)).joints
    frames = HELD.forward(dense[:, :6])
    wanted = frames[:, :3, 3] + motion.problem.lever_arm * frames[:, :3, 2]
    # the last point is 20 mm off the work; 20 001 places of some 300 mm are 8 um from the next at most
    assert cKDTree(wanted).query(tips[:-1])[0].max() < 0.02 + 0.01
    assert np.ptp(axes[:, -1]) > 50.0  # deg: the turntable turns


@pytest.mark.parametrize("target", ["rapid", "krl"])
@pytest.mark.parametrize("name", MOTIONS)
def test_the_work_sees_the_plan_and_its_axes_keep_step(name, target, tmp_path):
    program = MOTIONS[name]().program(target, name="ring1", deviation=0.05)
    found = program.check()
    assert found.axis_deviation <= found.deviation <= 0.05 and found.angle_deviation < 0.05 / 95.0
    assert found.axis_deviation > 0.0
    file = tmp_path / f"ring1{program.ending}"
    program.save(file)
    path = finishing.read_program(file)
    assert path.check(program.motion) == found
    assert path.unit == {"rapid": "turntable", "krl": "2"}[target]
    assert path.axes.shape[1] == len(program.motion.problem.robot.axes) == path.begun.size
    assert target == "rapid" or max(map(len, program.text.splitlines())) <= 140


def test_the_axes_cost_points_where_a_chord_of_the_contact_alone_would_do():
    """A ring off the axis of the turntable: its lever is longer, and so is what a chord leaves of its turn."""
    near = planned()
    far = planned(placement=(PLACE[0], PLACE[1], PLACE[2] + 30.0))
    assert far.program("krl").check().axis_deviation <= 0.02
    assert far.program("krl").text.count("LIN ") > near.program("krl").text.count("LIN ")


def test_work_near_the_axis_has_a_longer_lever_on_the_lift_alone():
    """A ring of 10 mm; 20 mm off the work the axis is at its place, and what it leaves on the work is less."""
    thin = planned(radius=10.0, method="trapezoid")
    found = thin.program("rapid").check()
    assert 0.005 < found.axis_deviation <= found.deviation <= 0.02


@cache
def ring1(target):
    """Program of the ring; reading an altered text makes a new one."""
    return planned().program(target, name="ring1")


@pytest.mark.parametrize(
    ("target", "old", "new"),
    [
        ("rapid", "[FALSE,FALSE,", "[FALSE,TRUE,"),
        ("rapid", '"turntable"', '""'),
        ("rapid", "    ActUnit turntable;\r\n", ""),
        ("rapid", "ActUnit turntable", "ActUnit table"),
        ("rapid", "[[0,0,0],[1,0,0,0]],[[0.0000,0.0000,-6.0", "[[0,0,0],[1,0,0,0]],[[0.0000,0.0000,-6.3"),
        ("rapid", "[[0,0,0],[1,0,0,0]],[[0.0", "[[0,0,1],[1,0,0,0]],[[0.0"),
        ("krl", "EK(MACHINE_DEF[2].ROOT", "EK(MACHINE_DEF[3].ROOT"),
        ("krl", "MECH_TYPE,{X 0.0", "MECH_TYPE,{X 0.3"),
        ("krl", "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,{", "$BASE={"),
    ],
)
def test_another_unit_or_frame_is_found(target, old, new):
    program = ring1(target)
    text = program.text.replace(old, new, 1).replace(
        "C 90.000000})", "C 90.000000}" if "BASE={" in new else "C 90.000000})"
    )
    assert text != program.text and faulty(program, text)


def faulty(program, text):
    changed = dataclasses.replace(program, text=text)
    try:
        return changed._fault(changed.check()) != ""
    except ValueError:
        return True


@pytest.mark.parametrize("target", ["rapid", "krl"])
@given(data=st.data())
@settings(max_examples=10, deadline=None)
def test_an_axis_that_is_off_is_found(target, data):
    """By an angle that moves the contact by three times the deviation, anywhere; elsewhere all is as it was."""
    program = ring1(target)
    form = {"rapid": rf",\[({NUMBER}),9E9", "krl": rf",E1 ({NUMBER})\}}"}[target]
    every = list(re.finditer(form, program.text))
    found = data.draw(st.sampled_from(every[2:]))
    off = np.degrees(0.06 / 20.0) * data.draw(st.sampled_from([-1.0, 1.0]))
    begin, end = found.span(1)
    text = program.text[:begin] + f"{float(found[1]) + off:.6f}" + program.text[end:]
    path = read_text(text)
    assert path.check(program.motion).axis_deviation > 0.02
    assert faulty(program, text)


@pytest.mark.parametrize(
    ("target", "form", "off"),
    [
        ("rapid", rf"(,\[)({NUMBER}),9E9", 20.0),
        ("krl", rf"(,E1 )({NUMBER})\}}", 20.0),
        ("krl", rf"(,A )({NUMBER}),", 10.0),
    ],
)
def test_work_or_tool_that_turns_off_the_work_is_found(target, form, off):
    """At the end of the last lift, there and back, where the plan has the end alone."""
    program = ring1(target)
    still = [line for line in program.text.splitlines() if re.match(r"\s*(MoveL|LIN) ", line)][-1]
    turned = re.sub(form, lambda found: found[0].replace(found[2], f"{float(found[2]) + off:.6f}"), still)
    assert turned != still
    assert faulty(program, program.text.replace(still, "\r\n".join([still, turned, still])))
    assert not faulty(program, program.text.replace(still, "\r\n".join([still, still, still])))


@pytest.mark.parametrize(
    ("target", "old", "new"),
    [
        ("rapid", r",9E9,9E9,9E9,9E9,9E9\]", ",1.0,9E9,9E9,9E9,9E9]"),
        ("krl", r"(,E1 [-\d.]+)\}", r"\1,E2 1.0}"),
    ],
)
def test_other_axes_than_those_of_the_robot(target, old, new):
    program = planned().program(target)
    one = re.sub(old, new, program.text, count=1)
    every = re.sub(old, new, program.text)
    with pytest.raises(ValueError, match="text must name the same external axes in every move; move 1 has 1"):
        read_text(one)
    with pytest.raises(ValueError, match="text must have 1 external axes, as the robot; got 2"):
        read_text(every).check(program.motion)
    path = finishing.hilbert(finishing.surface.flat_surface(20.0), 1)
    still = finishing.plan(finishing.FinishingProblem(path, robot=HELD, placement=(650.0, -25.0, 100.0)))
    with pytest.raises(ValueError, match="text must have 0 external axes, as the robot; got 1"):
        read_text(program.text).check(still)


AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: np.linalg.norm(axis) > 1e-3)


@given(
    axis=st.one_of(AXES, st.sampled_from([(0, 0, 1), (0, 0, -1), (1, 0, 0), (1e-9, 0, -1)])),
    value=st.floats(-6.0, 6.0),
)
@settings(max_examples=60, deadline=None)
def test_the_frame_of_a_unit_turns_about_or_slides_along_its_own_z(axis, value):
    """So that what the head says configures a controller: motion times frame is frame times a turn about z."""
    table = TABLE.replace(axis=axis)
    turn, slide = np.eye(4), np.eye(4)
    turn[:3, :3], slide[2, 3] = about((0, 0, 1), value), value
    np.testing.assert_allclose(table.motions(value) @ table.frame, table.frame @ turn, atol=1e-9)
    rail = RAIL.replace(direction=axis)
    np.testing.assert_allclose(rail.motions(value) @ rail.frame, rail.frame @ slide, atol=1e-12)
    assert np.linalg.det(table.frame[:3, :3]) == pytest.approx(1.0)
    assert table.frame[:3, 3].tolist() == list(TABLE.origin) and not rail.frame[:3, 3].any()


@given(
    axis=AXES,
    shift=st.tuples(*[st.floats(-150.0, 150.0)] * 3),
    deviation=st.floats(0.005, 0.2),
    rail=st.booleans(),
)
@example((0.25, 0.125, -1.0), (0.0, 0.0, 0.0), 0.02, False)  # joint 4 crosses 0 on the lift
@settings(max_examples=4, deadline=None)
def test_any_axis_keeps_any_deviation(axis, shift, deviation, rail):
    """Turned by up to 0.3 rad, or shifted by 60 mm, about or along any axis near the work."""
    origin = np.array([650.0, 0.0, 80.0]) + shift
    moving = (
        RAIL.replace(direction=axis, positions=(-60.0, 0.0, 60.0))
        if rail
        else TABLE.replace(axis=axis, origin=tuple(origin), angles=(-0.3, 0.0, 0.3))
    )
    path = finishing.hilbert(finishing.surface.flat_surface(12.0), 1)
    robot = finishing.arm.mounted(HELD, unit=moving)
    motion = finishing.plan(finishing.FinishingProblem(path, robot=robot, placement=(650.0, -25.0, 100.0)))
    for target in ("rapid", "krl"):
        found = motion.program(target, deviation=deviation).check()
        assert found.axis_deviation <= found.deviation <= deviation and found.feed_excess <= 25.0 * 1e-6


def test_what_is_refused_by_name():
    motion = planned()
    with pytest.raises(ValueError, match=r"no external axes; got turntable; take csv or ros"):
        motion.program("urscript")
    with pytest.raises(ValueError, match=r"no external axes; got turntable; take csv or ros"):
        motion.program("urscript", timing=True)
    with pytest.raises(
        ValueError, match=r"name of an axis that carries the work must be a letter, .*'turntable'"
    ):
        motion.program("rapid", name="turntable")
    named = finishing.arm.MountedRobot(HELD, axes=(TABLE,), axis_names=("wait",))
    other = finishing.plan(ring(robot=named), method="trapezoid")
    with pytest.raises(ValueError, match="it is the mechanical unit; got 'wait'"):
        other.program("rapid")
    assert other.program("krl").check().deviation <= 0.02
    strange = finishing.arm.MountedRobot(HELD, axes=(TABLE,), axis_names=("Drehtisch_ä",))
    for target in ("rapid", "krl"):
        with pytest.raises(ValueError, match=f"at most 32 in {target}.*got 'Drehtisch_ä'"):
            finishing.plan(ring(robot=strange), method="trapezoid").program(target)
    three = finishing.arm.mounted(
        HELD,
        a=RAIL.replace(positions=1),
        b=RAIL.replace(direction=(1, 0, 0), positions=1),
        c=TABLE.replace(angles=24),
    )
    many = finishing.plan(ring(robot=three), method="trapezoid")
    with pytest.raises(ValueError, match="axes that carry the work must be at most 2 in krl; got 3"):
        many.program("krl")
    assert many.program("rapid").check().deviation <= 0.02


@pytest.mark.parametrize("unit", ["T_ring1", "w_ring1", "p_ring1", "ActUnit", "ROB_1"])
def test_a_unit_is_called_as_nothing_else_in_the_module(unit):
    """Tool, work object, procedure, an instruction, the robot's own unit."""
    robot = finishing.arm.MountedRobot(HELD, axes=(TABLE,), axis_names=(unit,))
    with pytest.raises(ValueError, match=f"no other word of the program: .* unit; got '{unit}'"):
        check_axes(robot, "rapid", "ring1")
    check_axes(robot, "krl", "ring1")


def test_what_the_head_says():
    text = ring1("rapid").text
    head = text.split("MODULE")[0]
    assert "mechanical unit turntable, which moves it and is coordinated" in head
    assert "turntable turns its frame by the right hand about [0.0000000, 1.0000000, 0.0000000]" in head
    assert "! [1050.0000, 0.0000, 300.0000], deg" in head
    told_frame = re.search(r"on which the work lies: \[\[(.*?)\],\[(.*?)\]\]", head)
    frame = np.eye(4)
    frame[:3, 3] = [float(each) for each in told_frame[1].split(",")]
    w, *rest = [float(each) for each in told_frame[2].split(",")]
    frame[:3, :3] = Rotation.from_quat([*rest, w]).as_matrix()
    np.testing.assert_allclose(frame, TABLE.frame, atol=1e-7)
    assert "E1" in planned().program("krl").text.split("BAS(#")[0]


def test_a_language_of_another_maker_is_told():
    motion = planned()
    for target in ("rapid", "krl"):
        with pytest.warns(
            UserWarning,
            match=f"{target} is not the language of the UR10 of Universal Robots, .*takes urscript",
        ):
            motion.program(target)
    motion.program("csv"), motion.program("ros")  # an error where there is a warning
