"""The predictive force controller as C: its kernels, and between them the program by the code that OSQP generates."""

import re
import shutil
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest
from codegen_inside import program_files

import sdpgrind
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, StepProgram
from sdpgrind.weldbead import force

pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
LIMITS = force.Limits(command_max=-9.85, command_min=-11.0, command_rate_max=3.0)
LAW = force.Predictive()
PERIOD = 1.0 / 60.0


def plan():
    time = np.array([0.0, 0.4, 1.0, 1.1, 2.0])
    forces, heights = [30.0, 30.0, 55.0, 20.0, 20.0], [10.0, 9.9, 9.8, 10.2, 10.0]
    place = {"center_x": 30.0 * time, "face_leaves": 1.8}
    return SimpleNamespace(time=time, normal_force=forces, fly_height=heights, **place)


def controller(limits=LIMITS):
    return force.PredictiveController(plan(), LAW, limits=limits)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return sdpgrind.export(controller(), tmp_path_factory.mktemp("out") / "press")


def closed_loop(ours, theirs, samples):
    """Commands of both on a stiff contact with play of the surface, noise, lost readings; passes one after another."""
    rng, command = np.random.default_rng(1), -10.0
    for k in range(samples):
        time = (k % 140) * PERIOD
        surface = -10.2 + 0.03 * np.sin(0.05 * k)
        reading = LAW.plant.contact_stiffness * max(0.0, command - surface) + rng.normal(0.0, 0.3)
        row = {
            "force": np.nan if rng.random() < 0.03 else reading,
            "pass_time": time,
            "center_x": np.nan if rng.random() < 0.3 else 30.0 * time + rng.normal(0.0, 0.2),
        }
        found = ours.step(**row)
        assert found == theirs.step(**row), k
        command = found["platform_command"]


def test_closed_loop(made):
    theirs = controller()
    closed_loop(made.controller(), theirs, 420)  # three passes
    assert theirs.programs[0] > 200


def test_the_same_bits(made):
    found = made.check(500, ["gcc"], levels=["-O1"], targets=())
    assert found.differing == 0, found.first
    assert made.manifest["stack"] >= max(found.stack.values()) > 0


def test_the_self_test_passes(made, tmp_path):
    sources = list(made.path.glob("*.c"))
    command = ["gcc", "-std=c99", "-O2", "-ffp-contract=off", *sources, "-lm", "-o", tmp_path / "t"]
    subprocess.run(command, check=True)
    done = subprocess.run([tmp_path / "t"], capture_output=True, text=True, check=True)
    assert "0 of 2 digests of 1000 steps differ" in done.stdout


def test_the_self_test_sees_the_state_after_a_reset(made, tmp_path):
    """The first step of a pass sets all of the state: only a row that is refused leaves it."""
    shutil.copytree(made.path, tmp_path / "x")
    source = tmp_path / "x" / "press.c"
    changed = re.sub(r"(_reset_state\[\d+\] = \{\s*)0\.0", r"\g<1>0.5", source.read_text())
    assert changed != source.read_text()
    source.write_text(changed)
    sources = [*source.parent.glob("*.c")]
    subprocess.run(["gcc", "-std=c99", "-O1", "-w", *sources, "-lm", "-o", tmp_path / "t"], check=True)
    done = subprocess.run([tmp_path / "t"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "the state differs" in done.stdout


def test_rows_of_the_program_are_no_table_of_the_kernels(made):
    """They follow from the moves; hardly any of their numbers changes what a self-test could see."""
    assert made.manifest["sizes"]["tables"] < 11_000 < 8 * made.recipe.program.rows.size + 10_000


def test_the_program_stands_apart_with_its_licence(made):
    files = {path.name for path in made.path.iterdir()}
    assert {"press_program.c", "osqp_license.txt"} <= files and set(made.manifest["files"]) < files
    assert "Apache License" in (made.path / "osqp_license.txt").read_text()
    told = "; the quadratic program is solved by code that OSQP generates (Apache License 2.0)"
    assert made.promise == f"same bits on every IEEE 754 target: no libm function is used{told}"
    header, source = ((made.path / f"press{ending}").read_text() for ending in (".h", ".c"))
    assert "one step at a time" in header and "osqp" not in source


def test_names_and_bytes_of_the_program(tmp_path):
    """Two exports can be linked; the same program gives the same bytes; nothing is taken but memset."""
    program = controller().__export__().program
    files = program_files(program, "press")
    assert files == program_files(program, "press")
    (tmp_path / "p.c").write_bytes(files["press_program.c"])
    build = ["gcc", "-std=c99", "-O1", "-ffp-contract=off", "-c", tmp_path / "p.c", "-o", tmp_path / "p.o"]
    subprocess.run(build, check=True)
    told = subprocess.run(["nm", "-g", tmp_path / "p.o"], capture_output=True, text=True, check=True).stdout
    names = [line.split()[-2:] for line in told.splitlines()]
    assert [name for kind, name in names if kind == "U" and name not in ("memset", "memcpy", "sqrt")] == []
    assert [name for kind, name in names if kind != "U" and not name.startswith("press_")] == []


def test_programs_that_are_not_solved(tmp_path, monkeypatch):
    """Three iterations do not suffice: both go on with the law within the limits of the sample."""
    from sdpgrind.weldbead.force import _constrained

    monkeypatch.setitem(_constrained._SETTINGS, "max_iter", 3)
    theirs = controller()
    ours = sdpgrind.export(theirs, tmp_path / "press").controller()
    closed_loop(ours, theirs, 300)
    assert theirs.programs[0] == 0 and theirs.programs[1] > 30


def test_what_is_refused(tmp_path):
    with pytest.raises(ValueError, match="plan must be given at the start"):
        sdpgrind.export(force.PredictiveController(None, LAW), tmp_path / "press")
    narrow = force.Limits(command_max=-9.0, command_min=-9.0001)
    with pytest.raises(ValueError, match=r"limits must be 0.01 N apart at least.*; got 0\.00"):
        sdpgrind.export(controller(narrow), tmp_path / "press")
    with pytest.raises(ValueError, match="target must be 'c99' for a PredictiveController"):
        sdpgrind.export(controller(), tmp_path / "press.fmu", target="fmi2")


def test_iterations_bound_a_step(made):
    bound = made.manifest["loop_bounds"][-1]
    assert (bound["function"], bound["file"], bound["at_most"]) == ("press_solve", "press_program.c", 4000)


@pytest.mark.parametrize(
    ("settings", "told"),
    [({}, "with adaptive_rho False"), ({"adaptive_rho": False, "polishing": True}, "without polishing")],
)
def test_settings_by_which_c_would_do_otherwise(settings, told):
    with pytest.raises(ValueError, match=f"settings must be {told}"):
        StepProgram(np.eye(1), np.eye(1), np.zeros(1), settings)


def test_numbers_that_osqp_would_write_without_their_last_digits():
    hessian = np.array([[1.0, np.pi * 1e-6], [np.pi * 1e-6, 1.0]])
    program = StepProgram(hessian, np.ones((1, 2)), np.zeros(2), {"verbose": False, "adaptive_rho": False})
    with pytest.raises(ValueError, match="program must be of numbers above 6e-05 once it is scaled"):
        program_files(program, "small")


def test_a_program_of_two_unknowns():
    """Least of (x - 1)^2 + (y + 2)^2 with x + y >= 0: (1.5, -1.5), by hand."""
    settings = {"verbose": False, "eps_abs": 1e-10, "eps_rel": 1e-10, "adaptive_rho": False}
    program = StepProgram(2.0 * np.eye(2), np.ones((1, 2)), np.zeros(2), settings, behind=1)
    room = np.array([-2.0, 4.0, 0.0, 1e20, 0.0, 0.0, 7.0])
    assert program.width == room.size and program.sizes == (2, 1)
    program.solve(room)
    np.testing.assert_allclose(room[4:], [1.5, -1.5, 7.0], atol=1e-8)


@compiled(error_model="numpy")
def asked(state, low, high, room):
    room[0], room[1], room[2], room[3] = -2.0, low, high, 0.5
    return 1


@compiled(error_model="numpy")
def told(state, room, out):
    out[0] = room[3]
    return 0


def test_bounds_that_exclude_each_other(tmp_path):
    """The guess stays, whatever was solved before: OSQP would go on with the bounds before."""
    settings = {"verbose": False, "eps_abs": 1e-9, "eps_rel": 1e-9, "adaptive_rho": False}
    program = StepProgram(np.eye(1), np.eye(1), np.zeros(1), settings, finish=told)
    inputs = {"low": "", "high": ""}
    recipe = Recipe("small", asked, inputs, {"y": ""}, program=program)
    c = sdpgrind.export(recipe, tmp_path / "small").controller()
    for low, high, wanted in ((0.0, 1.0, 1.0), (1.0, 0.0, 0.5), (0.0, 5.0, 2.0), (1.0, 0.0, 0.5)):
        room = np.array([-2.0, low, high, 0.5])
        program.solve(room)
        assert c.step(low=low, high=high)["y"] == room[3] == pytest.approx(wanted, abs=1e-8)


def test_a_program_without_an_end_of_the_step():
    program = StepProgram(np.eye(1), np.eye(1), np.zeros(1), {"adaptive_rho": False})
    with pytest.raises(TypeError, match="finish of the program must be a Kernel"):
        Recipe("small", asked, {"low": "", "high": ""}, {"y": ""}, program=program)
