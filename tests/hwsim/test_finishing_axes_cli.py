"""Axes that carry the work in a job of ``hwsim finishing``: tables [robot.turntable] and [robot.rail]."""

import numpy as np
import pytest
from cli_fakes import without_news

import sdpgrind
from hwsim.cli import main
from hwsim.command._finishing.toml import read
from sdpgrind import finishing, units

pytestmark = pytest.mark.usefixtures("sketched")
RAIL = """
[robot.rail]
direction = [0, 1, 0]
travel = ["-0.5 m", "0.5 m"]
speed_max = "400 mm/s"
acceleration_max = 2000
jerk_max = 20000
positions = [0, 100]
"""
TABLE = """
[robot.turntable]
name = "STN_1"
origin = ["90 cm", 0, 80]
speed_max = "20 rpm"
acceleration_max = 4
jerk_max = 40
angles = 4
"""
JOB = """
method = "trapezoid"
[surface]
shape = "nominal"
[path]
pattern = "hilbert"
order = 1
[robot]
preset = "irb2400"
tool_length = "150 mm"
{axes}
[tool]
placement = [900, -25, 100]
"""


def written(tmp_path, axes):
    job = tmp_path / "job.toml"
    job.write_text(JOB.format(axes=axes))
    return job


def test_fields_are_those_of_the_classes_and_the_first_table_stands_in_the_base(tmp_path):
    rail = finishing.arm.LinearTable(
        (0, 1, 0), (-500, 500), speed_max=400, acceleration_max=2000, jerk_max=2e4, positions=(0.0, 100.0)
    )
    fields = {"speed_max": units.rpm(20), "acceleration_max": 4, "jerk_max": 40, "angles": 4}
    table = finishing.arm.Turntable((900, 0, 80), **fields)
    held = finishing.robot("irb2400").replace(tool=finishing.tool(length=150.0, axis="x"))
    found = read(written(tmp_path, RAIL + TABLE)).problem.robot
    assert found == finishing.arm.mounted(held, rail=rail, STN_1=table)
    other = read(written(tmp_path, TABLE + RAIL)).problem.robot
    assert other == finishing.arm.mounted(held, STN_1=table, rail=rail)
    more = TABLE + 'axis = [0, 1, 0]\nposition_min = "-90 deg"\nposition_max = 1\n'
    (axis,) = read(written(tmp_path, more)).problem.robot.axes
    assert axis == table.replace(axis=(0, 1, 0), position_min=-np.pi / 2, position_max=1.0)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (TABLE.replace('"20 rpm"', "120"), "[robot.turntable] speed_max must be in rad/s, some 2"),
        (TABLE.replace('"20 rpm"', '"20 mm/s"'), "robot.turntable.speed_max must have a unit like rad/s"),
        (TABLE.replace("[", "[", 1).replace('["90 cm", 0, 80]', "[0.9, 0, 0.08]"), "[robot.turntable] origin must be in mm"),
        (TABLE.replace('origin = ["90 cm", 0, 80]\n', ""), "robot.turntable.origin is missing"),
        (TABLE + 'axis = "z"', "robot.turntable.axis must be a list of numbers; got 'z'"),
        (TABLE.replace("angles = 4", "positions = 4"), "robot.turntable.positions is not a key"),
        (TABLE.replace("jerk_max = 40\n", ""), "[robot] jerk_max must be given for the robot and all axes"),
        (TABLE.replace('"STN_1"', '"q1"'), "[robot] names of the joints must be without repeats; got 'q1'"),
        (TABLE.replace('"STN_1"', '"my table"'), "robot.turntable.name must be a name, as of a joint; got 'my table'"),
        (TABLE.replace('"STN_1"', '"rail"') + RAIL, "names in [robot] must differ; got rail, rail"),
        (RAIL.replace('["-0.5 m", "0.5 m"]', '["0.5 m", "-0.5 m"]'), "[robot.rail] travel must be its least position"),
        (RAIL.replace("travel", "travels"), "robot.rail.travel is missing; is it meant by robot.rail.travels?"),
        (RAIL.replace("[robot.rail]", "[robot.rial]"), "robot.rial is not a key; is robot.rail meant?"),
    ],
)  # fmt: skip
def test_what_is_refused(axes, said, tmp_path):
    with pytest.raises(ValueError) as error:
        read(written(tmp_path, axes))
    assert said in str(error.value)


def test_a_program_for_the_axes_of_a_job(capsys, tmp_path):
    job, folder = written(tmp_path, RAIL + TABLE), tmp_path / "out"
    assert main(["finishing", str(job), "--program", "rapid", "--out", str(folder)]) == 0
    told = capsys.readouterr().out
    motion = sdpgrind.load(folder / "motion.nc")
    found = finishing.read_program(folder / "finishing.mod")
    assert found.unit == "STN_1" and found.axes.shape[1] == 2 and found.check(motion).deviation <= 0.02
    assert f"read back: {found.check(motion).deviation:.4f} mm" in told
    assert main(["finishing", str(job), "--program", "urscript", "--out", str(folder)]) == 2
    error = without_news(capsys.readouterr().err)
    assert "no external axes; got rail, STN_1; take csv or ros" in error and "planning" not in error


def test_a_placement_on_the_axes_is_searched_in_a_box(capsys, tmp_path):
    """And not without; what it is worth is told for the axes at their best."""
    job = written(tmp_path, TABLE.replace("angles = 4", "angles = [-0.2, 0, 0.2]"))
    text = job.read_text()
    job.write_text(text.replace("placement = [900, -25, 100]", 'placement = "search"'))
    with pytest.raises(ValueError, match=r"\[tool\] box must be given where axes carry the work"):
        read(job)
    box = "placement_box = [[900, -25, 100], [900, -25, 100]]"
    job.write_text(text.replace("placement = [900, -25, 100]", f'placement = "search"\n{box}'))
    assert main(["finishing", str(job), "--program", "csv", "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    problem = sdpgrind.load(tmp_path / "out" / "motion.nc").problem
    assert problem.placement[:3] == (900.0, -25.0, 100.0) and "placed at (900, -25, 100) mm" in told
    assert (
        "least margin over the path" in told and "-" not in told.split("least margin over the path ")[1][:3]
    )
