"""Long KRL programs are cut where the tool rests in the air, into files that one file calls."""

from pathlib import Path

import numpy as np
import pytest
from program_motions import UR10, planned

from sdpgrind import finishing
from sdpgrind.finishing._program import program as program_module

pytestmark = pytest.mark.filterwarnings("ignore:.* is not the language of the")

HOLE = [(0.35, 0.35), (0.35, 0.65), (0.65, 0.65), (0.65, 0.35), (0.35, 0.35)]


@pytest.fixture(scope="module")
def motion():
    patch = finishing.surface.Patch(finishing.surface.nominal_surface(), [HOLE])
    path = finishing.zigzag(patch, pitch=7.0, lift=finishing.Lift(height=15.0))
    assert len(path.pieces) > 1
    return finishing.plan(finishing.FinishingProblem(path, robot=UR10, placement=(650.0, -25.0, 100.0)))


@pytest.fixture
def most(motion, monkeypatch):
    """Points of a part, so that one program does not take all and each piece fits."""
    whole = motion.program("krl").text.count("LIN {")
    monkeypatch.setattr(program_module, "_POINTS", 0.8 * whole)
    return 0.8 * whole


def test_parts_are_the_whole_program(motion, monkeypatch, tmp_path):
    whole = motion.program("krl", name="face1")
    monkeypatch.setattr(program_module, "_POINTS", 0.8 * whole.text.count("LIN {"))
    cut = motion.program("krl", name="face1")
    assert not whole.parts and len(cut.parts) > 1
    cut.save(tmp_path / "face1.src")
    assert sorted(path.stem for path in tmp_path.iterdir()) == sorted(["face1", *cut.parts])
    found = finishing.read_program(tmp_path / "face1.src")
    for name in ("points", "turns", "feeds", "radii", "work", "tool"):
        np.testing.assert_array_equal(
            getattr(found, name), getattr(finishing.read_program(saved(whole, tmp_path / "w")), name)
        )
    assert found.check(motion) == whole.check() and found.check(motion).deviation <= 0.02


def saved(program, folder):
    folder.mkdir(exist_ok=True)
    program.save(folder / f"{program.name}.src")
    return folder / f"{program.name}.src"


def test_each_part_begins_and_ends_in_the_air(motion, most):
    program = motion.program("krl")
    for text in program.parts.values():
        assert text.count("LIN {") <= most
        assert (
            text.splitlines()[-2].startswith("LIN {") and " C_DIS" not in text.splitlines()[-2]
        )  # rests there
    surface = motion.problem.path.surface
    ends = list(program.parts.values())[:-1]
    for text in ends:
        x, y, z = (float(text.splitlines()[-2].split(f"{axis} ")[1].split(",")[0]) for axis in "XYZ")
        samples = surface.point(*np.meshgrid(*(np.linspace(*side, 60) for side in surface.domain)))
        assert np.linalg.norm(samples.reshape(-1, 3) - [x, y, z], axis=1).min() > 10.0  # mm, of a lift of 15


def test_a_new_version_takes_the_place_of_the_old_one(motion, most, tmp_path):
    first = motion.program("krl", name="face1", deviation=0.02)
    other = motion.program("krl", name="face1", deviation=0.05)
    first.save(tmp_path / "face1.src")
    (tmp_path / "face1_notes.src").write_text("of the user")
    other.save(tmp_path / "face1.src")
    names = {path.stem for path in tmp_path.iterdir()}
    assert names == {"face1", "face1_notes", *other.parts} and not set(first.parts) & set(other.parts)


def test_killed_before_the_last_file_the_old_program_is_whole(motion, most, tmp_path, monkeypatch):
    first = motion.program("krl", name="face1", deviation=0.02)
    first.save(tmp_path / "face1.src")
    whole_file = program_module.whole_file

    def killed(path):
        if Path(path).stem == "face1":
            raise KeyboardInterrupt
        return whole_file(path)

    monkeypatch.setattr(program_module, "whole_file", killed)
    with pytest.raises(KeyboardInterrupt):
        motion.program("krl", name="face1", deviation=0.05).save(tmp_path / "face1.src")
    assert finishing.read_program(tmp_path / "face1.src").check(motion) == first.check()


def test_what_is_refused(motion, most, tmp_path):
    with pytest.raises(ValueError, match=r"name must be at most 17 characters, with those of its \d parts"):
        motion.program("krl", name="a" * 18)
    program = motion.program("krl", name="face1")
    program.save(tmp_path / "face1.src")
    (tmp_path / f"{min(program.parts)}.src").unlink()
    with pytest.raises(FileNotFoundError, match=min(program.parts)):
        finishing.read_program(tmp_path / "face1.src")


def test_a_joint_that_passes_a_quarter_of_a_turn_between_samples():
    """Joint 6 at 90 degrees where a move ends: the plan's samples are on either side."""
    face = finishing.read_surfaces(Path(__file__).parents[2] / "data" / "step" / "nominal_hole_inch.step")[0]
    path = finishing.zigzag(face, pitch=6.0)
    motion = finishing.plan(finishing.FinishingProblem(path, robot=UR10, placement=(650.0, -25.0, 100.0)))
    assert motion.program("rapid").check().deviation <= 0.02


def test_without_a_lift_nothing_is_cut(monkeypatch):
    monkeypatch.setattr(program_module, "_POINTS", 50)
    told = r"deviation must be greater: krl takes 50 points in a program, and these are \d+ without a lift"
    with pytest.raises(ValueError, match=told):
        planned("small").program("krl")


def test_a_program_that_is_called_must_be_there(motion, most):
    program = motion.program("krl", name="face1")
    text = program.text.split("DEF face1_")[0]
    with pytest.raises(ValueError, match="text must hold the program face1_"):
        program_module.read_text(text)
