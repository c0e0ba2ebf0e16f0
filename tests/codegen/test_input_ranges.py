"""Ranges of inputs: stated in header, manifest and FMU, checked by the C as by the library's side."""

import shutil

import numpy as np
import pytest
from codegen_inside import LibrarySteps, bounds_of, recipe_of
from fmu_things import THINGS, described, low_pass

import centering
import sdpgrind
from sdpgrind import sdp, weldbead
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal, TablesAsked

pytestmark = pytest.mark.usefixtures("few_blocks")
gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")


@compiled(error_model="numpy")
def squared(state, x, y, out):
    state[0] += 1.0
    out[0] = x * x + (y if y == y else 0.0)
    return 0


def stated(given, outputs):
    """An output that is NaN or infinite with a status from 0 on says so in its meaning."""
    for name, column in zip(given.outputs, outputs.T, strict=True):
        told = given.outputs[name].meaning
        assert "NaN" in told or not np.isnan(column).any(), name
        assert "infinite" in told or not np.isinf(column).any(), name


WIDE = {"x": "mm", "y": Signal("N", missing=True)}


def recipe(told="", **more):
    inputs = {
        "x": Signal("mm", told, -2.5, 1e3),
        "y": Signal("N", low=0.0, high=np.inf, missing=True),
        **more,
    }
    return Recipe("squared", squared, inputs, {"z": Signal("mm^2", "square of the way")})


def test_what_is_usable():
    rows = [
        (-2.5, 0.0),
        (1e3, np.inf),
        (1.0, np.nan),
        (np.nan, 1.0),
        (-np.inf, 1.0),
        (1.0, -5e-324),
        (1000.1, 1.0),
    ]
    assert recipe().usable(np.array(rows)).tolist() == [True] * 3 + [False] * 4
    assert recipe(**WIDE).usable(np.array([(1e9, -1e9), (1.1e9, 0.0)])).tolist() == [True, False]


@gcc
def test_c_takes_what_is_usable(tmp_path):
    made = sdpgrind.export(recipe(), tmp_path / "x")
    library, rows = made.controller()._library, bounds_of(recipe(), np.array([[0.5, 2.0], [1.0, np.nan]]))
    assert {-2.5, np.nextafter(-2.5, -3.0), 1e3, np.nextafter(1e3, 2e3)} <= set(rows[:, 0])
    state, out = np.zeros(1), np.zeros(1)
    for row, usable in zip(rows, recipe().usable(rows), strict=True):
        before, out[0] = state[0], 7.0
        status = library.step(state, row, out)
        assert (status, state[0] - before) == ((0, 1.0) if usable else (-1, 0.0))
        assert usable or out[0] == 7.0
    assert made.check(2000, ["gcc"], levels=["-O2"], targets=()).differing == 0


@pytest.mark.parametrize("name", THINGS)
def test_numbers_in_range_give_numbers(name):
    """Inputs at their bounds, for a while, give no NaN and no infinity; beyond them nothing changes."""
    given = recipe_of(THINGS[name](), TablesAsked())
    ends = np.array(np.meshgrid(*given.limits)).reshape(len(given.inputs), -1).T
    rows = np.concatenate([np.repeat(ends, 40, axis=0), given.chains(np.random.default_rng(1), 400)[0]])
    steps = LibrarySteps(given)
    found = steps.take(rows, np.zeros(len(rows), dtype=bool))
    stated(given, found.outputs)
    kept = steps.state.copy()
    huge = np.full((2 * len(given.inputs), len(given.inputs)), 0.0)
    for k in range(len(given.inputs)):
        huge[2 * k : 2 * k + 2, k] = -1e308, np.inf
    assert (steps.take(huge, np.zeros(len(huge), dtype=bool)).codes == -1).all()
    assert np.array_equal(steps.state, kept, equal_nan=True)


@pytest.mark.parametrize("thing", ["ring", "policy"])
def test_outputs_that_are_none_are_stated(thing):
    """The band while readings are few; a control at a stop, which is status 0 of a policy, and its gap."""
    made = centering.GeometryEstimator(noise_sd=0.002) if thing == "ring" else own_policy()
    given = recipe_of(made, TablesAsked())
    steps = LibrarySteps(given)
    rows = given.chains(np.random.default_rng(0), 200)[0]
    found = steps.take(rows, np.zeros(len(rows), dtype=bool))
    taken = found.outputs[found.codes >= 0]
    assert not np.isfinite(taken).all()
    stated(given, taken)


def own_policy():
    move = sdp.Move(
        "cut",
        {"depth": [0.2, 0.5]},
        sdp.Shift("stock", lambda s, c: sdp.LogNormal(c.depth, 0.1 * c.depth)),
        charge=0.1,
    )
    stop = sdp.Stop("done", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    stock = sdp.Axis("stock", 0.0, 2.0, 41, "mm", below="stop")
    return sdp.plan(sdp.Problem([stock], [move], [stop], sdp.Stages(3, 1.0)))


def late_bead(charge):
    return weldbead.plan(weldbead.preset("P1").replace(lateness_charge=charge), tolerance=None, nodes=41)


@pytest.mark.parametrize(
    ("charge", "low"), [(None, 0.0), (sdp.Linear(0.1), -1e9), (sdp.Quadratic(0.01), -1e9)]
)
def test_late_times_that_are_stated_have_an_answer(charge, low):
    """From the stated low end on each time has one, or, where the meaning says so, each whole stage."""
    plan = late_bead(charge)
    given = recipe_of(plan, TablesAsked())
    lowest = plan.table.countdown.lowest * 2.0
    assert given.limits[1] == (low, 60.0)
    whole, told = lowest < 0.0, given.inputs["time_left"].meaning
    assert ("< 0: late" in told) == (low < 0.0)
    assert ("whole stages of 2 s" in told) == whole
    times = np.arange(max(low, -50.0), 60.0, 2.0 if whole else 0.25)
    codes = [given.take(np.zeros(1), (1.0, time), np.empty(4)) for time in times]
    assert min(codes) >= 0
    if charge is None:
        with pytest.raises(ValueError, match="time_left"):
            plan.action(1.0, -1.0)
    edge = np.array([[1.0, low], [1.0, np.nextafter(low, -2e9)]])
    assert given.usable(edge).tolist() == [True, False]


@gcc
def test_header_and_manifest_state_them(tmp_path):
    told = "way to the right, > 0 away from the " + "very " * 30 + "old wall"
    made = sdpgrind.export(recipe(told), tmp_path / "x")
    text = (made.path / "x.h").read_text()
    assert "    double x; /* mm, -2.5 to 1000 */" in text and "/* square of the way */" in text
    assert "    double y; /* N, 0 to inf, NaN: no reading */" in text
    assert (
        "     * way to the right, > 0 away from the very" in text and max(map(len, text.splitlines())) < 112
    )
    x, y = made.manifest["inputs"]
    assert x == {
        "name": "x",
        "unit": "mm",
        "meaning": told,
        "range": [-2.5, 1000.0],
        "may_be_missing": False,
    }
    assert y["range"] == [0.0, "inf"] and y["may_be_missing"]
    assert recipe().fingerprint != recipe(**WIDE).fingerprint


def test_an_output_that_is_named_as_an_input_is_always_a_number(tmp_path):
    made = sdpgrind.export(low_pass(outputs={"pull": "N", "rest": ""}), tmp_path / "x")
    text = (made.path / "x.h").read_text()
    assert (
        "    double pull; /* N, -1e+09 to 1e+09, NaN: no reading */" in text
        and "    double pull; /* N */" in text
    )


def test_tables_bear_their_names(tmp_path):
    made = sdpgrind.export(THINGS["table"](), tmp_path / "x")
    text = (made.path / "x.c").read_text()
    assert "/* head, keys, values and slopes node by node, guide of whole numbers by their bits (" in text


def test_an_fmu_states_them():
    found = {one.name: one for one in described("torque")[0].modelVariables}
    assert (found["motor_angle"].min, found["motor_angle"].max) == ("-1000000.0", "1000000.0")
    assert found["current"].description.startswith("current to command, > 0 presses the tool onto the part")


@pytest.mark.parametrize(("low", "high"), [(1.0, 0.0), (np.nan, 0.0)])
def test_ranges_that_are_none(low, high):
    with pytest.raises(
        ValueError, match=rf"inputs\['x'\] must be of low <= high \(mm\); got \({low}, {high}\)"
    ):
        recipe(x=Signal("mm", low=low, high=high))


def test_a_library_law_of_other_numbers():
    for law in ((np.array([1.0, 2.5]),), (np.array([1.0, 2.0]), 0.0)):
        with pytest.raises(ValueError, match="library_law must be of the numbers of law; got"):
            Recipe("x", squared, WIDE, {"z": ""}, law=(np.array([1, 2], dtype=np.int16),), library_law=law)


def test_what_is_no_signal():
    with pytest.raises(TypeError, match=r"inputs\['x'\] must be a Signal or a unit; got \('mm', 0.0, 1.0\)"):
        recipe(x=("mm", 0.0, 1.0))
