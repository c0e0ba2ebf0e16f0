"""What the check of a program finds, and what is refused."""

import dataclasses
import json
import re
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_twin import match as slow_match
from program_motions import IRB2400, UR10, planned

from sdpgrind import finishing
from sdpgrind.finishing._program.matching_kernels import match
from sdpgrind.finishing._program.read_program import read_text

pytestmark = pytest.mark.filterwarnings("ignore:.* is not the language of the")

LINES = ["urscript", "rapid", "krl"]
MOVES = {"urscript": "movel", "rapid": "MoveL", "krl": "LIN ", "csv": "1."}


def refused(program, text):
    """Whether a changed text is refused by its check, or by the reader."""
    changed = dataclasses.replace(program, text=text)
    try:
        return changed._fault(changed.check()) != ""
    except ValueError:
        return True


def move_lines(text, target):
    """Numbers of lines with a move, and the lines."""
    lines = text.split("\n")
    return [k for k, line in enumerate(lines) if line.strip().startswith(MOVES[target])], lines


@pytest.mark.parametrize("target", LINES)
def test_exchanged_axes_are_found(target):
    program = planned("small").program(target)
    number = r"(-?\d+\.\d+)"
    first = {
        "urscript": rf"p\[{number}, {number},",
        "rapid": rf"\[\[{number},{number},",
        "krl": rf"\{{X {number},Y {number},",
    }
    at, lines = move_lines(program.text, target)
    pairs = {k: re.search(first[target], lines[k]) for k in at}
    apart = 0.001 if target == "urscript" else 1.0  # 1 mm; on the diagonal nothing changes
    told = [k for k, found in pairs.items() if abs(float(found[1]) - float(found[2])) > apart]
    for k in (told[0], told[len(told) // 2], told[-1]):
        found = pairs[k]
        turned = lines.copy()
        swapped = found[0].replace(found[1], "?", 1).replace(found[2], found[1], 1).replace("?", found[2], 1)
        turned[k] = lines[k].replace(found[0], swapped)
        assert turned[k] != lines[k] and refused(program, "\n".join(turned))


@pytest.mark.parametrize("target", LINES)
@given(data=st.data())
@settings(max_examples=12, deadline=None)
def test_a_changed_digit_of_a_place_is_found(target, data):
    """A point moved off the path by 0.06 mm must be found: a blend makes less than half of it good."""
    program = planned("small").program(target)
    at, lines = move_lines(program.text, target)
    k = data.draw(st.sampled_from(at[:-1]))
    places = [found.span(1) for found in re.finditer(r"(-?\d+\.\d+)", lines[k])][:3]
    begin, end = data.draw(st.sampled_from(places))
    decimals = 4 if target == "urscript" else 1
    last = lines[k].index(".", begin, end) + decimals
    digits = [j for j in range(begin, last + 1) if lines[k][j].isdigit()]
    j = data.draw(st.sampled_from(digits))
    digit = data.draw(st.sampled_from([each for each in "0123456789" if each != lines[k][j]]))
    lines[k] = lines[k][:j] + digit + lines[k][j + 1 :]
    text = "\n".join(lines)
    # along the path a point may be elsewhere, so that brute force tells how far it is off
    path = read_text(text)
    place = path.points[at.index(k)] @ path.work[:3, :3].T + path.work[:3, 3]
    if np.linalg.norm(_tips(program.motion) - place, axis=1).min() > 0.06:
        assert refused(program, text)


@cache
def _tips(motion):
    """Contacts along a motion, 5 um apart, in the base."""
    poses = motion.problem.robot.forward(motion.at(np.linspace(0, motion.duration, 16_001)).joints)
    return poses[:, :3, 3] + motion.problem.lever_arm * poses[:, :3, 2]


@pytest.mark.parametrize("target", LINES)
def test_changed_angles_frames_feeds_and_blends_are_found(target):
    program = planned("small").program(target)
    at, lines = move_lines(program.text, target)
    middle = at[len(at) // 2]
    changes = {
        "urscript": [("set_tcp(p[0.0000000", "set_tcp(p[0.0001000"), ("work = p[0.65", "work = p[0.56"), (", v=0.0", ", v=0.1")],
        "rapid": [("[[0.0000,0.0000,245", "[[0.1000,0.0000,245"), ("[[650.", "[[560."), ("\\V:=", "\\V:=9")],
        "krl": [("$TOOL={X 0.0", "$TOOL={X 0.1"), ("$BASE={X 650", "$BASE={X 560"), ("$VEL.CP=0.0", "$VEL.CP=0.1")],
    }[target]  # fmt: skip
    for old, new in changes:
        assert old in program.text and refused(program, program.text.replace(old, new, 1))
    number = {"urscript": 3, "rapid": 3, "krl": 3}[target]
    found = list(re.finditer(r"-?\d+\.\d+", lines[middle]))[number]
    nearer = f"{float(found[0]) + (0.3 if target == 'krl' else 0.005):.6f}"
    turned = lines.copy()
    turned[middle] = lines[middle][: found.start()] + nearer + lines[middle][found.end() :]
    assert refused(program, "\n".join(turned))
    longer = re.sub(r"(r=|,\[FALSE,|CDIS=)(\d)", r"\g<1>9\2", program.text, count=0)
    assert refused(program, longer)  # blends overlap


@pytest.mark.parametrize("target", LINES)
def test_a_lost_a_doubled_and_an_exchanged_move_are_found(target):
    program = planned("corners").program(target)
    at, lines = move_lines(program.text, target)
    for k in (at[3], at[len(at) // 2], at[-1]):
        assert refused(program, "\n".join(lines[:k] + lines[k + 1 :]))
    k = at[len(at) // 2]
    swapped = lines.copy()
    after = at[len(at) // 2 + 1]
    swapped[k], swapped[after] = lines[after], lines[k]
    assert refused(program, "\n".join(swapped))
    assert refused(program, "\n".join(lines[: at[-1]]))


def test_a_wrong_configuration_is_found():
    program = planned("small").program("rapid")
    data = re.search(r"\],\[(-?\d),(-?\d),(-?\d),(\d)\],\[9E9", program.text)
    for k in range(1, 5):
        words = [data[j] if j != k else str(int(data[j]) + 1) for j in range(1, 5)]
        with pytest.raises(ValueError, match="configuration of the motion's joints; move 1 names"):
            read_text(program.text.replace(data[0], f"],[{','.join(words)}],[9E9", 1)).check(program.motion)
    bits = planned("small").program("krl")
    for old, new in ((",S 0", ",S 1"), (",S 2", ",S 3"), (",T ", ",T 1")):
        if old in bits.text:
            assert refused(bits, bits.text.replace(old, new, 1))


def test_a_frame_that_is_set_again_between_moves_is_refused():
    """All moves would count in the last one."""
    lines = planned("small").program("krl").text.split("\r\n")
    base = next(line for line in lines if line.startswith("$BASE"))
    third = [k for k, line in enumerate(lines) if line.startswith("LIN")][2]
    again = "\r\n".join([*lines[:third], base, *lines[third:]])
    with pytest.raises(
        ValueError, match=rf"must set \$BASE before its straight moves.*line {third + 1} sets it"
    ):
        read_text(again)


@pytest.mark.parametrize("timing", [False, True])
def test_a_table_or_stream_that_loses_a_row_or_a_digit_is_refused(timing):
    motion = planned("small")
    program = motion.program("urscript", timing=True) if timing else motion.program("csv")
    lines = program.text.split("\n")
    middle = len(lines) // 2
    if timing:
        assert refused(program, "\n".join(lines[:middle] + lines[middle + 1 :]))  # all later rows are early
    found = list(re.finditer(r"\d+\.\d+", lines[middle]))[1]
    lines[middle] = (
        lines[middle][: found.end() - 4]
        + str((int(lines[middle][found.end() - 4]) + 5) % 10)
        + (lines[middle][found.end() - 3 :])
    )
    assert refused(program, "\n".join(lines))
    assert refused(program, "\n".join(program.text.split("\n")[:middle]))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda told: told.pop("units"), "text must have about, trajectory, units, and nothing else; got about, tra"),
        (lambda told: told.update(units=["deg"] * 6), "units of the text must be rad or m, one for each of 6"),
        (lambda told: told["units"].pop(), "units of the text must be rad or m, one for each of 6 joints"),
        (lambda told: told.update(trajectory=None), "trajectory of the text must have header, joint_names, points"),
        (lambda told: told["trajectory"].update(points=[]), "a list of two points or more"),
        (lambda told: told["trajectory"].update(points=None), "a list of two points or more"),
        (lambda told: told["trajectory"].update(joint_names=7), "joint_names of the text must be names"),
        (lambda told: told["trajectory"].update(joint_names=["q1"] * 6), "must be names, each once"),
        (lambda told: told["trajectory"]["header"]["stamp"].update(sec=9), "header of the text must be"),
        (lambda told: told["trajectory"]["points"][3].pop("velocities"), "point 3 of the text must have positions, "),
        (lambda told: told["trajectory"]["points"][3].update(accelerations=[0.0] * 6), "point 3 .* nothing else"),
        (lambda told: told["trajectory"]["points"][3]["positions"].pop(), "6 finite positions a point; point 3"),
        (lambda told: told["trajectory"]["points"][3]["positions"].__setitem__(0, float("nan")), "point 3 has"),
        (lambda told: told["trajectory"]["points"][3]["positions"].__setitem__(0, 10**400), "point 3 has"),
        (lambda told: told["trajectory"]["points"][3]["velocities"].__setitem__(0, "1"), "velocities.*point 3 has"),
        (lambda told: told["trajectory"]["points"][4]["time_from_start"].update(sec=-1), "point 4 .* whole sec"),
        (lambda told: told["trajectory"]["points"][4]["time_from_start"].update(nanosec=10**9), "point 4 .* whole"),
        (lambda told: told["trajectory"]["points"][4]["time_from_start"].update(sec=0.5), "point 4 .* whole sec"),
        (lambda told: told["trajectory"]["points"][4]["time_from_start"].update(sec=0, nanosec=0), r"rise \(s\).*4"),
        (lambda told: told["trajectory"]["points"][4].update(time_from_start=1), "point 4 of the text must have nan"),
    ],
)  # fmt: skip
def test_a_trajectory_of_ros_that_says_too_little_is_refused(change, told):
    text = json.loads(planned("small").program("ros").text)
    change(text)
    with pytest.raises(ValueError, match=told) as caught:
        read_text(json.dumps(text))
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_a_trajectory_of_ros_that_moves_otherwise_is_refused():
    program = planned("small").program("ros")
    text = json.loads(program.text)
    points = text["trajectory"]["points"]
    points[len(points) // 2]["velocities"][1] += 1.0
    assert refused(program, json.dumps(text))
    for damaged in (program.text[:-20], "{" + '"a":[' * 100_000):
        with pytest.raises(ValueError, match="text must be JSON"):
            read_text(damaged)


def test_a_trajectory_of_ros_is_as_fast_as_the_motion(tmp_path):
    """Speeds that are 30 % higher at one point move the contact by less than the deviation, 30 % faster there."""
    motion = planned("small")
    program = motion.program("ros", deviation=0.02)
    told = json.loads(program.text)
    k = int(np.argmax(motion.at(motion.profile[:, 0]).feed_rate))
    point = told["trajectory"]["points"][k]
    point["velocities"] = [1.3 * each for each in point["velocities"]]
    changed = dataclasses.replace(program, text=json.dumps(told))
    found = changed.check()
    assert found.deviation < 0.02 and found.feed_excess == pytest.approx(0.3 * 25.0, rel=1e-4)
    with pytest.raises(
        ValueError, match=r"text must not be faster than the plan \(mm/s\); read back, it is by 7.5"
    ):
        changed.save(tmp_path / "run.json")


def test_a_trajectory_of_ros_keeps_the_speeds_of_the_joints(tmp_path):
    """The last axis is that of the tool: it may turn as it likes without any feed."""
    motion = planned("small")
    program = motion.program("ros", deviation=0.02)
    assert program.check().joint_speed_excess < -0.5
    told = json.loads(program.text)
    k = len(told["trajectory"]["points"]) // 2
    told["trajectory"]["points"][k]["velocities"][5] = 1.1 * motion.problem.robot.speed_max[5]
    changed = dataclasses.replace(program, text=json.dumps(told))
    found = changed.check()
    assert found.joint_speed_excess == pytest.approx(0.1, abs=1e-9)
    assert found.feed_excess < 1e-6 * motion.problem.feed_rate
    with pytest.raises(ValueError, match=r"must keep the speed limits of the joints; read back.* by 10 %"):
        dataclasses.replace(changed, deviation=1.0).save(tmp_path / "run.json")
    assert not list(tmp_path.iterdir())


def test_a_trajectory_of_ros_of_a_motion_over_a_limit_is_no_faster_than_that():
    motion = planned("small")
    robot = motion.problem.robot
    slow = robot.replace(speed_max=tuple(0.5 * np.abs(motion.profile_speed).max(axis=0)))
    over = finishing.Motion(
        motion.problem.replace(robot=slow),
        motion.method,
        motion.posture,
        motion.worst_violation,
        motion._data,
    )
    assert read_text(motion.program("ros").text).check(over).joint_speed_excess < 1e-6


def test_a_trajectory_of_ros_has_the_joints_of_the_robot_and_ends_at_rest():
    """One name for another moves another joint; a table with its columns swapped is the same mistake."""
    motion = planned("small")
    text = motion.program("ros").text
    told = json.loads(text)
    told["trajectory"]["joint_names"][:2] = ["q2", "q1"]
    with pytest.raises(ValueError, match=r"must have the joints q1, q2, q3.*got q2, q1, q3"):
        read_text(json.dumps(told)).check(motion)
    table = motion.program("csv").text.replace("q1_rad,q2_rad", "q2_rad,q1_rad")
    with pytest.raises(ValueError, match=r"must have the joints q1, q2, q3.*got q2, q1, q3"):
        read_text(table).check(motion)
    for cut in (slice(1, None), slice(None, -1)):
        told = json.loads(text)
        told["trajectory"]["points"] = told["trajectory"]["points"][cut]
        with pytest.raises(ValueError, match="must begin and end at rest"):
            read_text(json.dumps(told)).check(motion)
        for point in (told["trajectory"]["points"][0], told["trajectory"]["points"][-1]):
            point["velocities"] = [0.0] * 6
        short = read_text(json.dumps(told)).check(motion)
        assert short.deviation > 1e-4  # the end is held, not led on


def test_a_program_whose_check_fails_is_not_written(tmp_path):
    program = planned("small").program("urscript")
    wrong = dataclasses.replace(program, deviation=0.5 * program.check().deviation)
    with pytest.raises(ValueError, match="nothing is written"):
        wrong.save(tmp_path / "face.script")
    fast = dataclasses.replace(program, text=program.text.replace("v=0.02", "v=0.03"))
    with pytest.raises(ValueError, match=r"faster than the plan \(mm/s\).*nothing is written"):
        fast.save(tmp_path / "face.script")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("target", "options", "told"),
    [
        ("gcode", {}, "target must be one of urscript, rapid, krl, csv, ros"),
        ("krl", {"deviation": 0.0}, "deviation must be > 0"),
        ("krl", {"deviation": 20e-6}, "deviation must be in mm, some 0.02"),
        ("krl", {"name": "a" * 25}, "at most 24 in krl"),
        ("rapid", {"name": "a" * 31}, "at most 30 in rapid"),
        ("urscript", {"name": "1face"}, "name must be a letter"),
        ("urscript", {"name": "end"}, "name must be a letter"),
        ("urscript", {"name": "gänge"}, "name must be a letter"),
        ("rapid", {"timing": True}, "timing must be False for rapid"),
        ("rapid", {"date": "1\n2"}, "date must be a line of ASCII"),
    ],
)  # fmt: skip
def test_wrong_arguments(target, options, told):
    with pytest.raises(ValueError, match=told):
        planned("small").program(target, **options)


def test_a_krl_file_has_the_name_of_its_program(tmp_path):
    with pytest.raises(ValueError, match=r"named face1.src, as the program in it; got 'other.src'"):
        planned("small").program("krl", name="face1").save(tmp_path / "other.src")


def test_a_flange_that_no_controller_has():
    motion = planned("small")
    links = motion.problem.robot.links.copy()
    links[-1] = links[-1] @ np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    robot = motion.problem.robot.replace(links=links, tool=finishing.tool(length=150.0) @ np.linalg.inv(
        np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    ))  # fmt: skip
    with pytest.warns(UserWarning, match="across the axis of the last joint"):
        problem = motion.problem.replace(robot=robot, placement=(650.0, -25.0, 100.0))
        changed = finishing.plan(problem)
    with pytest.raises(
        ValueError, match="robot must be one with a flange whose z or x is along the last axis"
    ):
        changed.program("rapid")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hello", "URScript .* RAPID .* KRL"),
        ("def a():\n  sleep(1)\nend\na()", "line 2 is"),
        ("def a():\n  movej([0, 0, 0, 0, 0, 0], a=1, v=1)", "to its end"),
        ("MODULE a\n  MoveC x;\nENDMODULE", "line 2 is"),
        ("DEF a()\nCIRC {X 1}\nEND", "line 2 is"),
        ("DEF a()\n$BASE={X 1,Y 2}\nEND", "line 2 is"),
        ("time_s,q1\n0,1\n1,2", "in _rad or _mm"),
        ("time_s,q1_rad\n0,1\n0,2", "times rise"),
        ("time_s,q1_rad\n0,1\n1,x", "line 3 is"),
    ],
)
def test_texts_that_are_no_programs(text, told):
    with pytest.raises(ValueError, match=told):
        read_text(text)


def test_a_file_that_is_not_ascii(tmp_path):
    (tmp_path / "a.src").write_text("DEF ä()", encoding="utf-8")
    with pytest.raises(ValueError, match="ASCII"):
        finishing.read_program(tmp_path / "a.src")


def test_places_are_matched_as_by_the_twin():
    rng = np.random.default_rng(1)
    nodes = np.cumsum(rng.normal(size=(40, 3)) + np.array([1.5, 0, 0]), axis=0)
    nodes[7] = nodes[6]  # a segment without length
    places = np.concatenate([nodes[:-1] + u * np.diff(nodes, axis=0) for u in (0.0, 0.3, 0.7)])
    places = places[np.argsort(np.arange(len(places)) % 39, kind="stable")] + rng.normal(0, 0.02, (117, 3))
    segment, share, away = np.empty(117, dtype=np.int64), np.empty(117), np.empty(117)
    match(nodes, places, segment, share, away)
    assert np.allclose(np.stack([segment, share, away], axis=1), slow_match(nodes, places), atol=1e-12)


@pytest.mark.parametrize(
    ("target", "name"), [("urscript", "movel"), ("krl", "LIN"), ("rapid", "Stop"), ("krl", "ptp")]
)
def test_words_of_the_languages_are_no_names(target, name):
    with pytest.raises(ValueError, match="no word of it; got"):
        planned("small").program(target, name=name)


def test_a_language_of_another_maker_is_told():
    """A warning names the language of a robot whose maker is known, whatever its tool, limits and names."""
    motion = planned("small")
    with pytest.warns(
        UserWarning, match="krl is not the language of the UR10 of .*, whose controller takes urscript"
    ):
        motion.program("krl")
    with pytest.warns(
        UserWarning, match="urscript is not the language of the IRB 2400 of ABB, .* takes rapid"
    ):
        _other(motion, IRB2400.replace(speed_max=(1.0,) * 6, names=tuple("abcdef"))).program("urscript")


@pytest.mark.filterwarnings("error")
def test_no_warning_where_the_language_fits_or_the_maker_is_not_known():
    motion = planned("small")
    for target in ("urscript", "csv", "ros"):
        motion.program(target)
    links = UR10.links.copy()
    links[2, 0, 3] -= 1e-3  # mm: a calibration
    for target in ("rapid", "krl"):
        _other(motion, UR10.replace(links=links)).program(target)


def _other(motion, robot):
    """The motion's path with another robot."""
    place = (900.0, -25.0, 0.0) if robot.names[0] == "a" else motion.problem.placement
    return finishing.plan(motion.problem.replace(robot=robot, placement=place))
