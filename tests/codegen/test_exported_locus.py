"""Controllers on a locus as C: bits of their kernels, the loop, tapes written out, what is refused."""

import re
import shutil
import subprocess
import warnings
from dataclasses import replace
from functools import cache

import casadi
import numpy as np
import pytest
from codegen_inside import Inversion, LibrarySteps, LocusTable, straight_lines, tape, tape_kernels

import hwsim
import sdpgrind
from sdpgrind import locus
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
STEPS = 2000  # enough for some parts of each kind; benchmarks take a million
NONE = "same bits on every IEEE 754 target: no libm function is used"
KOREN = {"gain": 3.3e-6, "kp": 5.3e-6, "at": "command", "hold": 3.0, "start": 1e-3, "floor": 8e-4}
CASES = {
    "scheduled": ("grinding", "infeed_rate", {}),
    "printed": ("grinding", "infeed_rate", KOREN),
    "lagging": ("grinding", "infeed_rate", {"lag": 1.25, "hold": "none", "margin": 0.3}),
    "turning": ("turning", "cutting_speed", {}),
    "motor": ("motor", "acceleration", {}),
    "hidden": ("koren-example", "x", {}),
    "fixed": ("koren-example", "v", {"gain": 0.3, "kp": 0.1, "kd": 0.1, "x": (0.76, 1.72), "period": None}),
}


def controller(name):
    preset, along, options = CASES[name]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="kd = 0.1 may step beyond the limit")
        return locus.LocusController(locus.plan(locus.preset(preset)), along=along, **options)


@pytest.fixture(scope="module")
def exported(few_blocks, tmp_path_factory):
    """The export of a case, made once."""
    return cache(lambda name: sdpgrind.export(controller(name), tmp_path_factory.mktemp("out") / "walk"))


@pytest.fixture(scope="module")
def inverted(few_blocks, tmp_path_factory):
    """The inversion of a preset and its export, made once."""

    def made(preset):
        inversion = locus.plan(locus.preset(preset)).inversion()
        return inversion, sdpgrind.export(inversion, tmp_path_factory.mktemp("out") / "x")

    return cache(made)


@pytest.mark.parametrize("name", CASES)
def test_the_same_bits(exported, name):
    made = exported(name)
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.status == "equal" and found.differing == 0, found.first
    assert made.promise == NONE and made.manifest["stack"] >= found.stack["-O2"] > 0
    functions = {one["kernel"]: one for one in made.manifest["functions"]}
    assert functions["limit_at"]["written_out"] and "run" not in functions


@pytest.mark.parametrize("name", ["scheduled", "printed", "lagging"])
def test_parts_in_the_loop(exported, name):
    walking, made = controller(name), exported(name)
    grinder = hwsim.AdaptiveGrinder(walking.curve.problem)
    log, wanted = (hwsim.run(grinder, one, parts=2, rng=0) for one in (made.controller(), walking))
    assert log.outcome.identical(wanted.outcome)
    assert log["controller"].identical(wanted["controller"])


@pytest.mark.parametrize("name", ["scheduled", "fixed"])
def test_commands_and_reports_are_those_of_the_controller(exported, name):
    walking, c = controller(name), exported(name).controller()
    assert (c.period, c.reads, c.commands, c.reports, c.job) == (
        walking.period, walking.reads, walking.commands, walking.reports, walking.job,
    )  # fmt: skip
    response, along = walking.stretch.response, walking.stretch.along
    rng, limit = np.random.default_rng(4), float(walking.stretch.limit.max())
    for _ in range(100):
        row = {
            response: rng.uniform(0.9, 1.1) * limit,
            along: walking.command[along] * rng.uniform(0.9, 1.02),
        }
        for key in row:
            row[key] = np.nan if rng.random() < 0.2 else row[key]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            wanted = walking.step(**row)
        assert c.step(**row) == wanted
        assert c.report() == pytest.approx(walking.report(), rel=0.0, abs=0.0, nan_ok=True)


def test_an_exceeded_limit_is_a_status(exported):
    """The library warns; no reading, and one that waits, has a status of its own."""
    walking, c = controller("scheduled"), exported("scheduled").controller()
    found = []
    with pytest.warns(UserWarning, match="the limit has been exceeded in 20 readings in a row"):
        for _ in range(40):
            wanted = walking.step(grinding_power=1e4)
            assert c.step(grinding_power=1e4) == wanted
            found.append(c.status)
    assert found.count(2) == 1 and set(found) == {1, 2}
    c.reset()
    c.step(grinding_power=200.0, infeed_rate=0.0)
    assert c.status == 0
    with pytest.raises(ValueError, match=r"status -1\); got grinding_power=inf"):
        c.step(grinding_power=np.inf)


@pytest.mark.parametrize("name", ["scheduled", "hidden"])
def test_vectors_reach_every_outcome(name):
    recipe = controller(name).__export__()
    found: set[int] = set()
    steps = LibrarySteps(recipe)
    for rows in recipe.chains(np.random.default_rng(0), 512):
        resets = np.arange(len(rows)) == 0
        found |= set(steps.take(rows, resets).codes.tolist())
    # where the hidden state is walked along nothing is measured, and no reading waits
    assert found == ({0, 1, 2} if name == "scheduled" else {1, 2})


def test_a_used_controller_is_exported_fresh():
    used, fresh = controller("scheduled"), controller("scheduled")
    for _ in range(5):
        used.step(grinding_power=150.0)
    before = used.state.copy()
    assert used.__export__().fingerprint == fresh.__export__().fingerprint
    assert np.array_equal(used.state, before)


# -- what is refused ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            {"method": "inversion"},
            "method must be 'feedback' for an export: the inversion is solved in Python",
        ),
        ({"start": "learned"}, "start must be a coordinate for an export, which keeps none after a reset"),
    ],
)
def test_what_has_no_kernel_or_no_start(tmp_path, options, told):
    walking = locus.LocusController(locus.plan(locus.preset("grinding")), along="infeed_rate", **options)
    with pytest.raises(ValueError, match=f"^{told}"):
        sdpgrind.export(walking, tmp_path / "walk")
    assert not (tmp_path / "walk").exists()


def test_a_stretch_whose_limit_is_python(tmp_path):
    curve = locus.plan(locus.preset("grinding")).stretch("infeed_rate")
    plain = replace(curve, values=lambda controls, hidden: curve.values(controls, hidden))
    with pytest.raises(ValueError, match="the limit of this one is a function in Python; got 'Stretch'"):
        sdpgrind.export(locus.LocusController(plain), tmp_path / "walk")
    assert sdpgrind.export(locus.LocusController(curve), tmp_path / "walk").promise == NONE


# -- inversion ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["grinding", "turning", "koren-example", "motor"])
def test_an_inversion_has_the_same_bits(inverted, preset):
    _, made = inverted(preset)
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.status == "equal" and found.differing == 0, found.first
    assert made.manifest["stack"] >= found.stack["-O2"] > 0
    (run,) = [one for one in made.manifest["functions"] if one["kernel"] == "run"]
    assert run["written_out"]


def test_an_inversion_answers_as_the_library(inverted):
    inversion, made = inverted("grinding")
    c = made.controller()
    assert c.reads == {"grinding_power": "W", "infeed_rate": "mm/s", "work_rotation": "rad/s"}
    assert c.commands == {"wear_flat_area": "1", "infeed_rate_at": "mm/s", "work_rotation_at": "rad/s"}
    statuses = set()
    for power in np.geomspace(50.0, 5e3, 40).tolist():
        got = c.step(grinding_power=power, infeed_rate=0.01, work_rotation=30.0)
        wanted, clamped = inversion.at(power, 0.01, 30.0)
        assert list(got.values()) == wanted.tolist() and (c.status > 0) == clamped
        statuses.add(c.status)
    assert statuses == {0, 1, 2}
    with pytest.raises(ValueError, match="status -1"):
        c.step(grinding_power=np.nan, infeed_rate=0.01, work_rotation=30.0)


def test_an_inversion_of_one_s_own(tmp_path):
    """Without names, and where the model has no response."""
    response = tape(casadi.Function("f", [Y, X], [X * casadi.log(Y), casadi.log(Y)]))
    key = np.array([1.0, 2.0, 4.0])
    table = LocusTable(key, np.column_stack([key**2]), np.column_stack([2 * key]))
    made = sdpgrind.export(Inversion(response, table, low=1.0, high=4.0), tmp_path / "x")
    c = made.controller()
    assert list(c.reads) == ["measured", "control_0"] and list(c.commands) == ["state", "column_0"]
    assert c.step(measured=3.0 * np.log(2.5), control_0=2.5) == pytest.approx({"state": 3.0, "column_0": 9.0})
    with pytest.raises(ValueError, match="status -1"):
        c.step(measured=1.0, control_0=-1.0)
    wide = tape(casadi.Function("f", [casadi.SX.sym("a", 4), X], [X, casadi.SX(1.0)]))
    with pytest.raises(TypeError, match="an Inversion of 4 controls is not exported; of 1 to 3 it is"):
        sdpgrind.export(Inversion(wide, table, low=1.0, high=4.0), tmp_path / "y")


def test_an_inversion_that_bisects(tmp_path):
    """Flat between a rise and a jump: Newton's method goes to an end, or to the middle, down to rounding."""
    jump = casadi.atan(1e40 * (X * X - 9.7))
    found = Y * (2.0 * casadi.atan(40.0 * (X - 1.3)) + jump + 0.3 * X)
    response = tape(casadi.Function("f", [Y, X], [found, casadi.jacobian(found, X)]))
    key = np.array([1.0, 2.0, 4.0])
    table = LocusTable(key, np.column_stack([1.0 + 0.1 * key]), np.full((3, 1), 0.1), {"x": "", "y": ""})
    inversion = Inversion(response, table, low=1.0, high=4.0, units={"f": ""})
    made = sdpgrind.export(inversion, tmp_path / "x")
    checked = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert checked.differing == 0, checked.first
    c = made.controller()
    assert c.step(f=4.0, y=1.2)["x"] == pytest.approx(np.sqrt(9.7), abs=1e-15)  # in the jump
    assert c.step(f=4.0, y=1.2)["x"] == inversion.at(4.0, 1.2)[0][0]
    assert c.step(f=-1.5, y=1.2)["x"] == inversion.at(-1.5, 1.2)[0][0] < 1.4  # beyond an end by Newton


def rounded(low=1.0, high=4.0):
    """279 (0.962 + x sqrt(y)), rounded four times: where y is small, few numbers are responses."""
    root = casadi.sqrt(Y)
    response = tape(casadi.Function("f", [Y, X], [9.3 * (30.0 * (0.962 + X * root)), 279.0 * root]))
    key = np.array([1.0, 2.0, 4.0])
    return Inversion(
        response, LocusTable(key, np.column_stack([key**2]), np.column_stack([2 * key])), low, high
    )


def branches_of(folder, place):
    """Branches that the self-test takes, and all but guards and ends of loops by a bound, by gcov."""
    command = [
        "gcc",
        "-std=c99",
        "-ffp-contract=off",
        "-O0",
        "--coverage",
        *folder.glob("*.c"),
        "-lm",
        "-o",
        "t",
    ]
    subprocess.run(command, cwd=place, check=True)
    subprocess.run(["./t"], cwd=place, check=True, capture_output=True)
    subprocess.run(["gcov", "-b", "-c", "t-x.gcda"], cwd=place, check=True, capture_output=True)
    taken, every, line = 0, 0, ""
    for text in (place / "x.c.gcov").read_text().splitlines():
        if not text.startswith("branch"):
            line = text if re.match(r" *[^ ]+: *\d+:", text) else line
        elif re.search(r" taken [1-9]", text):
            taken, every = taken + 1, every + 1
        elif "/* guard */" not in line and ": " in line and not re.search(r": +for \(", line):
            every += 1
    return taken, every


@pytest.mark.skipif(not shutil.which("gcov"), reason="gcov is not installed")
@pytest.mark.usefixtures("all_blocks")
def test_the_self_test_takes_the_branches_of_an_inversion(tmp_path):
    """Bisection too, which no usual reading needs."""
    made = sdpgrind.export(locus.plan(locus.preset("grinding")).inversion(), tmp_path / "x")
    place = tmp_path / "built"
    place.mkdir()
    taken, every = branches_of(made.path, place)
    assert every > 80 and taken >= 0.95 * every


def test_readings_that_no_state_answers(tmp_path):
    """Within a step of the response: the bracket closes about it, in the C as in the library."""
    inversion = rounded()
    recipe = inversion.__export__()
    (rows,) = recipe.vectors(np.random.default_rng(0), 512)
    small = rows[np.abs(rows[:, 1]) < 1e-20]
    responses = np.array([[9.3 * (30.0 * (0.962 + x * np.sqrt(y))) for x in (1.0, 4.0)] for _, y in small])
    within = (responses[:, 0] < small[:, 0]) & (small[:, 0] < responses[:, 1])
    assert within.sum() > 30  # few numbers lie between these ends
    c = sdpgrind.export(inversion, tmp_path / "x").controller()
    for reading, y in small[within].tolist():
        assert c.step(measured=reading, control_0=y)["state"] == inversion.at(reading, y)[0][0]


@pytest.mark.parametrize(("low", "high"), [(0.5, 4.0), (1.0, 5.0), (1.5, 3.0)])
def test_a_range_beyond_the_table_is_clamped(tmp_path, low, high):
    """Where the table spans the range, the C has no other branch."""
    inversion = rounded(low, high)
    made = sdpgrind.export(inversion, tmp_path / "x")
    assert made.check(STEPS, ["gcc"], levels=["-O2"], targets=()).differing == 0
    assert (" x_look_up(" in (made.path / "x.c").read_text()) == (low < 1.0 or high > 4.0)
    c = made.controller()
    for state in (low, high):
        got = c.step(measured=279.0 * (0.962 + 2.0 * state), control_0=4.0)
        assert got["state"] == pytest.approx(state, rel=1e-12)
        assert got["column_0"] == pytest.approx(np.clip(state, 1.0, 4.0) ** 2, rel=1e-12)


# -- tapes -------------------------------------------------------------------------------------------------

X, Y = casadi.SX.sym("x"), casadi.SX.sym("y")
WRITTEN = {
    "plain": -X * Y + X / Y - (X - 2.5) ** 2 + 1.0 / X + casadi.sqrt(casadi.fabs(Y)) + 2.0 * X,
    "powers": casadi.fabs(X) ** 0.3 + casadi.fabs(Y) ** X + casadi.exp(Y) + casadi.log(casadi.fabs(X)),
    "angles": casadi.sin(X) + casadi.cos(Y) * casadi.tan(X) + casadi.atan(Y) + casadi.atan2(X, Y)
    + casadi.asin(X / 10.0) * casadi.acos(Y / 10.0),
    "hyperbolic": casadi.sinh(X) + casadi.cosh(Y) * casadi.tanh(X),
    "small": casadi.log1p(X * X) + casadi.expm1(Y) + casadi.hypot(X, Y),
    "choices": casadi.if_else(X < Y, X, Y) + casadi.if_else(casadi.logic_and(X <= 1, Y != 0), 3.0, X)
    + casadi.if_else(casadi.logic_or(X == 2, casadi.logic_not(Y > X)), Y, -0.0),
    "rounded": casadi.floor(X) + casadi.ceil(Y) * casadi.copysign(X, Y) + casadi.fmod(X, Y),
}  # fmt: skip


@compiled(error_model="numpy")
def tape_value(tape, x, y):
    inputs, work = np.empty(2), np.empty(tape_kernels.work_size(tape))
    out = np.empty(tape_kernels.output_size(tape))
    inputs[0], inputs[1] = x, y
    tape_kernels.run(tape, inputs, work, out)
    return out[1]


@compiled(error_model="numpy")
def tape_step(state, tape, x, y, out):
    out[0] = tape_value(tape, x, y)
    return 0


def recipe_of(expression):
    given = tape(casadi.Function("f", [X, Y], [Y, expression]))
    lines, found = straight_lines(given, ["x", "y"], [1])
    text = "\n    ".join(["def tape_value(tape, x, y):", *lines, f"return {found[0]}", ""])
    return Recipe(
        "tape", tape_step, dict.fromkeys("xy", Signal(spread=3.0)), {"f": ""}, law=(given,),
        written_out={tape_value: text}, vectors=lambda rng, n: [rng.choice([-3.0, -1.0, 0.5, 1.0, 2.0, 7.3], (n, 2))],
    )  # fmt: skip


@pytest.mark.parametrize("name", WRITTEN)
def test_a_tape_written_out_has_the_bits_of_its_interpreter(tmp_path, name):
    made = sdpgrind.export(recipe_of(WRITTEN[name]), tmp_path / "tape")
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    text = (made.path / "tape.c").read_text()
    translated = text.partition("/* Public functions")[0]  # a reset has a loop over the state
    assert "for (" not in translated and "while" not in text


def test_only_what_an_output_needs_is_written():
    given = tape(casadi.Function("f", [X, Y], [casadi.exp(Y), X + 1.0]))
    assert straight_lines(given, ["x", "y"], [1]) == (["r1 = x + 1.0"], ["r1"]) or straight_lines(
        given, ["x", "y"], [1]
    ) == (["r0 = x + 1.0"], ["r0"])
    same = tape(casadi.Function("f", [X, Y], [X, casadi.SX(-2.5), casadi.SX(-np.inf), casadi.SX(np.nan)]))
    assert straight_lines(same, ["x", "y"], range(4)) == ([], ["x", "(-2.5)", "(-np.inf)", "np.nan"])


@pytest.mark.parametrize("name", ["asinh", "acosh", "atanh", "erf", "sign"])
def test_operations_without_a_function_of_the_same_bits(name):
    with pytest.raises(ValueError, match=f"^expressions of the process must be without the operation {name}"):
        recipe_of(getattr(casadi, name)(X))
