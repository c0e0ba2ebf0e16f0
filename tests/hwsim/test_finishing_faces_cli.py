"""``hwsim finishing`` on a face of a user's file: STEP faces, regions of scans, lifts, tools that are face-on."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from cli_fakes import only_news, without_news

import sdpgrind
from hwsim.cli import main
from hwsim.command._finishing.toml import read
from sdpgrind import finishing

pytestmark = pytest.mark.usefixtures("sketched")
FACE = """
method = "trapezoid"
[surface]
file = "{file}"
{face}
[path]
pattern = "zigzag"
pitch = "12 mm"
[path.lift]
height = "15 mm"
[robot]
preset = "ur10"
tool_length = "150 mm"
[tool]
contact_angle = "{angle} deg"
placement = [650, -25, 100]
"""
STEP = Path(__file__).parents[1] / "data" / "step"


def said(capsys, *arguments):
    assert main(["finishing", *map(str, arguments)]) == 0
    out, error = capsys.readouterr()
    assert only_news(error)
    return out


def refused(capsys, *arguments):
    assert main(["finishing", *map(str, arguments)]) == 2
    return without_news(capsys.readouterr().err).removeprefix("hwsim: ")


@pytest.mark.parametrize("angle", [30, 90])
def test_a_face_of_a_step_file_becomes_a_program(angle, capsys, tmp_path):
    """Also by a tool that is face-on, which no torque axis presses."""
    shutil.copy(STEP / "nominal_hole.step", tmp_path / "part.step")
    job = tmp_path / "job.toml"
    job.write_text(FACE.format(file="part.step", face="", angle=angle))
    folder = tmp_path / "out"
    assert "read back" in said(capsys, job, "--program", "urscript", "--out", folder)
    motion = sdpgrind.load(folder / "motion.nc")
    assert len(motion.problem.path.pieces) > 1 and motion.problem.path.lift.height == 15.0
    assert motion.problem.face_on == (angle == 90)
    if angle == 90:  # what somebody wrote into the program is not lost
        (program,) = folder.glob("*.script")
        mine = program.read_bytes() + b"# mine\n"
        program.write_bytes(mine)
        told = refused(capsys, job, "--program", "urscript", "--out", folder)
        assert "was changed by hand" in told and program.read_bytes() == mine


def test_the_tool_stands_along_the_last_axis_of_a_robot_unless_another_is_asked_for(tmp_path):
    shutil.copy(STEP / "nominal.step", tmp_path / "part.step")
    job = tmp_path / "job.toml"
    text = FACE.format(file="part.step", face="", angle=90).replace("ur10", "irb2400")
    job.write_text(text)
    along = finishing.tool(length=150.0, axis="x")
    np.testing.assert_array_equal(read(job).problem.robot.tool, along)


def test_a_tool_that_is_face_on_finishes_nothing(capsys, tmp_path):
    shutil.copy(STEP / "nominal.step", tmp_path / "part.step")
    job = tmp_path / "job.toml"
    job.write_text(FACE.format(file="part.step", face="", angle=90))
    told = "tool.contact_angle must be < 90 deg, as no torque of the axis presses a tool that is face-on"
    assert refused(capsys, job).startswith(told) and refused(capsys, job, "--study").startswith(told)


@pytest.mark.filterwarnings("ignore:krl is not the language of the UR10")
@pytest.mark.parametrize(("spin", "kept"), [("6", 6), ('["10 deg", 0.5]', (np.pi / 18, 0.5))])
def test_a_tool_that_turns_finishes_nothing(spin, kept, capsys, tmp_path):
    """Also one that leans; its motion is written as a program."""
    job = tmp_path / "job.toml"
    text = FACE.format(file="part.step", face="", angle=60).replace('pitch = "12', 'pitch = "24')
    surface = '[surface]\nshape = "nominal"'
    job.write_text(text.replace('[surface]\nfile = "part.step"', surface) + f"spin = {spin}\n")
    assert read(job).problem.spin == pytest.approx(kept)
    told = "tool.spin must be left out, as no torque of the axis presses a tool that turns about its own axis"
    assert refused(capsys, job).startswith(told) and refused(capsys, job, "--study").startswith(told)
    if kept == 6:
        assert "read back" in said(capsys, job, "--program", "krl", "--out", tmp_path / "out")


@pytest.mark.parametrize(("spin", "told"), [("1", "from 2 to 720"), ('"24"', "must be a list of numbers")])
def test_refused_turns_of_a_job(spin, told, tmp_path):
    shutil.copy(STEP / "nominal.step", tmp_path / "part.step")
    job = tmp_path / "job.toml"
    job.write_text(FACE.format(file="part.step", face="", angle=90) + f"spin = {spin}\n")
    with pytest.raises(ValueError, match=rf"tool.*spin.*{told}"):
        read(job)


def test_a_region_of_a_scan_is_the_surface(tmp_path):
    x, y = np.meshgrid(np.linspace(0, 20, 15), np.linspace(0, 20, 15))
    np.savetxt(tmp_path / "scan.xyz", np.column_stack([x.ravel(), y.ravel(), 0.2 * x.ravel()]))
    job = tmp_path / "job.toml"
    region = "[surface.region]\nbox = [[-1, -1, -1], [21, 21, 5]]"
    job.write_text(FACE.format(file="scan.xyz", face=region, angle=30).replace("12 mm", "6 mm"))
    patch = read(job).problem.path.patch
    assert patch.fit.error < 1e-3 and patch.area == pytest.approx(400 * 1.04**0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("file", "face", "told"),
    [
        (
            "two_holes.step",
            "face = 3",
            r"surface.face must be the number of one of the faces \(0: .* mm\^2\); got 3",
        ),
        ("plate_metre.step", "", r"surface.face must be the number of one of the faces \(0: .*; got None"),
        (
            "nominal.step",
            "[surface.region]\nseed = [0, 0, 0]",
            r"\[surface\] region must be None for a STEP file",
        ),
        (
            "nominl.step",
            "",
            r"job\.toml: surface\.file must be a file, as seen from .*; got \'nominl\.step\'",
        ),
    ],
)
def test_refused_faces_of_a_job(file, face, told, tmp_path):
    if (STEP / file).exists():
        shutil.copy(STEP / file, tmp_path / file)
    job = tmp_path / "job.toml"
    job.write_text(FACE.format(file=file, face=face, angle=30))
    with pytest.raises((ValueError, OSError), match=told):
        read(job)


def test_a_urdf_that_is_missing_is_named_with_its_key(tmp_path):
    job = tmp_path / "job.toml"
    text = FACE.replace('file = "{file}"', 'shape = "nominal"').format(face="", angle=30)
    ends = 'urdf = "cel.urdf"\nbase = "a"\ntip = "b"\nacceleration_max = 10.0'
    job.write_text(text.replace('preset = "ur10"', ends))
    with pytest.raises(ValueError, match=r"job\.toml: robot\.urdf must be a file, .*; got 'cel\.urdf'"):
        read(job)


def test_advice_on_a_region_is_in_words_of_the_job(tmp_path):
    """A hole of a third of the square, and a scan without a unit; then with both."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 20, 41), np.linspace(0, 20, 41)))
    kept = np.hypot(x - 10.0, y - 10.0) > 6.5
    np.savetxt(tmp_path / "scan.xyz", np.column_stack([x, y, 0.2 * x])[kept] / 25.4)
    job, words = tmp_path / "job.toml", {"file": "scan.xyz", "angle": 30}
    job.write_text(FACE.format(**words, face='unit = "in"').replace("12 mm", "6 mm"))
    told = r"\(keys of this file: \[surface\.region\] box, seed, crease, empty_max; surface\.unit\)"
    with pytest.raises(ValueError, match=told):
        read(job)
    face = 'unit = "in"\n[surface.region]\nbox = [[-1, -1, -1], [21, 21, 5]]\nempty_max = 0.4'
    job.write_text(FACE.format(**words, face=face).replace("12 mm", "6 mm"))
    assert read(job).problem.path.patch.area == pytest.approx(400 * 1.04**0.5, rel=1e-6)
