"""Smaller tables: the C against the kernel in bits, bytes, and the value lost against a sweep of the test's own."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from codegen_inside import LibrarySteps, Varied, rows_of, small_of
from scipy.special import erf, erfc

import sdpgrind
from sdpgrind import finishing, sdp, weldbead

pytestmark = pytest.mark.usefixtures("few_blocks")
gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
PASS = ("duration", "feed_rate", "normal_force")
STEPS = 3000
STRICT = [
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Wshadow",
    "-Wconversion",
    "-pedantic",
    "-Werror",
]


@pytest.fixture(scope="module")
def policy():
    """P1 on the grid of the bar: 31 x 401 nodes."""
    return weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=401)


@pytest.fixture(scope="module")
def small(policy, tmp_path_factory):
    return sdpgrind.export(policy, tmp_path_factory.mktemp("out") / "small", lost_max=1e-4, outputs=PASS)


def object_bytes(made):
    """Bytes of code and constants, as gcc makes them."""
    name = made.manifest["name"]
    built = made.path / "thing.o"
    subprocess.run(["gcc", *STRICT, "-c", made.path / f"{name}.c", "-o", built], check=True)
    told = subprocess.run(["size", built], capture_output=True, text=True, check=True).stdout.split()
    built.unlink()
    assert told[7:9] == ["0", "0"]  # data, bss
    return int(told[6])


def cost_of_pass(after, nodes, x, law):
    """Expected penalty ($) of a pass from the heights x (mm), `after` at the nodes (mm) after it: Rayleigh cuts, 10 $/mm below the base.

    With the distribution function 1 - S of the cut and its end s, E f(D) = f(s) + integral of f' S, for f of
    straight pieces. For a law whose mean is above 1.914 sd, s > 0.
    """
    q = law.sd / np.sqrt(2.0 - np.pi / 2.0)
    s, root = law.mean - q * np.sqrt(np.pi / 2.0), q * np.sqrt(np.pi / 2.0)
    reach = np.maximum(x[:, None] - nodes - s[:, None], 0.0) / (q[:, None] * np.sqrt(2.0))
    inside = root[:, None] * -np.diff(erf(reach), axis=1)
    below = root * erfc(np.maximum(x - s, 0.0) / (q * np.sqrt(2.0)))
    first = np.where(x >= s, np.interp(x - s, nodes, after), after[0] + 10.0 * (s - x))
    return first - inside @ (np.diff(after) / np.diff(nodes)) + 10.0 * below


def swept(policy, control):
    """Costs [row, node] of the plan's moves at these forces (N): stop at 2 $/mm, or grind on."""
    table, problem = policy.table.table, policy.problem
    x, out = np.linspace(0.0, problem.height_max, policy.nodes), []
    for row, best in enumerate(table.best[:, 0]):
        cost = 2.0 * x
        for move in set(best[best >= 0].tolist()):
            node, stages = np.flatnonzero(best == move), policy.table.layout.moves[move].duration
            law = problem.cut(stages * problem.stage, control[row, 0, node])
            cost[node] = cost_of_pass(out[row - stages], x, x[node], law)
        out.append(cost)
    return np.array(out)


def test_the_value_lost_by_another_evaluation(policy, small):
    lost = small.manifest["lost"]
    control = small_of(policy.table, small.manifest["precision"]).control
    cost, plan = swept(policy, control), policy.table.table.value[:, 0]
    assert lost["all_stages"] == pytest.approx(np.max(cost - plan), abs=1e-12)
    assert lost["first_stage"] == pytest.approx(np.max(cost[-1] - plan[-1]), abs=1e-12)
    assert 0.0 < lost["first_stage"] <= lost["all_stages"] <= lost["bound"] < 1e-4
    assert lost["error"] == policy.error and small.manifest["precision"] == "int16"


@gcc
def test_bytes_and_bits(small):
    """64 kB with code, from about 306 kB."""
    assert object_bytes(small) <= 64_000
    found = small.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.status == "equal" and found.differing == 0, found.first
    assert small.promise == "same bits on every IEEE 754 target: no libm function is used"
    assert [one["name"] for one in small.manifest["outputs"]] == list(PASS)


@gcc
def test_actions_are_those_of_the_plan(policy, small):
    """At nodes the same move, and a force within half a step of 16 bits."""
    controller, at = small.controller(), np.random.default_rng(0)
    heights, times = policy.states()
    for height, time in zip(at.choice(heights, 200), at.choice(times, 200), strict=True):
        wanted, got = policy.action(height, time), controller.step(height=height, time_left=time)
        assert got["stop"] == wanted.stop
        if not wanted.stop:
            assert got["duration"] == wanted.duration
            assert got["normal_force"] == pytest.approx(wanted.normal_force, abs=50.0 / 65534)


@gcc
def test_value_and_gap_in_floats(policy, tmp_path):
    made = sdpgrind.export(policy, tmp_path / "told", precision="float32", outputs=(*PASS, "gap", "value"))
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    out = np.zeros(5)
    for height, time in ((1.0, 30.0), (0.31, 12.0), (1.7333, 47.1)):
        made.recipe.take(np.zeros(1), (height, time), out)
        wanted = policy.value(height, time), policy.action(height, time).gap
        assert (out[4], out[3]) == pytest.approx(wanted, rel=1e-6, abs=1e-7)
    assert np.isnan([made.recipe.take(np.zeros(1), (-0.1, 9.0), out), out[4]]).tolist() == [
        False,
        True,
    ]


LOG = sdp.Axis("x", 0.1, 2.0, 21, "mm", "log", below="hold", above="hold")


def go(s, c, e):
    return s.x * (1.0 - 0.5 * c.by), s.y + e.n


def two_axes():
    """Two axes, one logarithmic; two modes; a listed and a continuous control."""
    axes = [LOG, sdp.Axis("y", 0.0, 1.0, 11, "", below="hold", above="hold")]
    moves = [
        sdp.Move("go", {"by": sdp.Levels(0.0, 1.0, 21), "kind": [1.0, 2.0]},
                 sdp.Sampled(go, {"n": sdp.Normal(0.0, 0.1)}), charge=lambda s, c: 0.1 * c.by * c.kind),
        sdp.Move("flip", {}, sdp.Stay(), charge=0.05, into="b"),
    ]  # fmt: skip
    stop = sdp.Stop("end", lambda s: s.x**2 + 0.1 * s.y + 0.2 * (s.mode == 0))
    return sdp.plan(sdp.Problem(axes, moves, [stop], sdp.Stages(3, 0.5, "left", "s"), modes=("a", "b")))


@gcc
def test_a_policy_of_the_solver(tmp_path):
    """As it is, its actions are the library's; rounded, the C has the bits of the kernel."""
    plan = two_axes()
    made = sdpgrind.export(plan, tmp_path / "plan")
    assert made.check(STEPS, ["gcc"], levels=["-O2"], targets=()).differing == 0
    assert made.manifest["libm"] == ["log"] and made.manifest["status"] == ["end", "go", "flip"]
    varied = Varied(made.recipe, *rows_of(made.recipe, np.random.default_rng(0), 100))
    taken = LibrarySteps(made.recipe).take(*varied.take(1000)).codes
    assert np.mean(taken >= 0) > 0.5  # a mode between two is refused: the self-test varies none
    controller, rng = made.controller(), np.random.default_rng(0)
    for _ in range(100):
        state = {"x": rng.uniform(0.05, 2.2), "y": rng.uniform(-0.1, 1.1), "left": rng.uniform(0.0, 1.5)}
        mode = int(rng.integers(2))
        wanted, got = plan.action(**state, mode=mode), controller.step(**state, mode=float(mode))
        assert made.manifest["status"][controller.status] == wanted.name
        assert np.array_equal(
            [got["by"], got["kind"], got["gap"]], [wanted.by, wanted.kind, wanted.gap], equal_nan=True
        )
    rounded = sdpgrind.export(plan, tmp_path / "rounded", precision="int16", outputs=("by", "kind"))
    assert rounded.check(STEPS, ["gcc"], levels=["-O2"], targets=()).differing == 0
    assert rounded.manifest["sizes"]["tables"] < 0.3 * made.manifest["sizes"]["tables"]


@gcc
def test_branches_that_no_number_takes_are_left_out(tmp_path):
    """In doubles no line keeps more digits, and infinity is itself; in 16 bits one stands for it where it occurs."""
    plan = honed(sdp.Linear(200.0))
    table = small_of(plan, "double", ("gap",))
    assert not table.table.widens and not table.told.endless
    text = (sdpgrind.export(plan, tmp_path / "plan").path / "plan.c").read_text()
    assert "place < 0" not in text and "stored ==" not in text
    infinite = small_of(two_axes(), "int16", ("gap",)).told
    assert infinite.endless == bool(np.isinf(two_axes().table.gap).any())


def honed(under):
    """Honing to size with a charge of too little stock, $ of mm."""
    moves = [
        sdp.Move("hone", {"strokes": sdp.Levels(1.0, 9.0, 5)}, sdp.Shift("stock", removed),
                 charge=lambda s, c: 0.3 + 0.02 * c.strokes),
        sdp.Move("lap", {"strokes": [2.0, 4.0]}, sdp.Shift("stock", removed), charge=0.4),
    ]  # fmt: skip
    stop = sdp.Stop("done", sdp.Charge(under=under, over=sdp.Linear(900.0)))
    stock = sdp.Axis("stock", 0.0, 0.04, 21, "mm", below="stop")
    return sdp.plan(sdp.Problem([stock], moves, [stop], sdp.Forever()))


def removed(s, c):
    return sdp.LogNormal(0.004 * c.strokes, 0.0008 * c.strokes)


def test_states_and_controls_are_told(tmp_path):
    """No unit is claimed for controls, which have none; what each is comes from the problem."""
    plan = honed(sdp.Linear(200.0))
    made = sdpgrind.export(plan, tmp_path / "hone")
    header = (made.path / "hone.h").read_text()
    assert "double strokes; /* unit of the plan */" in header
    told = {one["name"]: one["meaning"] for one in [*made.manifest["inputs"], *made.manifest["outputs"]]}
    assert told["stock"] == "stock; below 0 the process ends, above 0.04 refused (-1)"
    assert told["strokes"] == (
        "control of hone: 1 to 9; lap: 2, 4; NaN where the action has no such control, as a stop"
    )
    mode, left = (two_axes().__export__().inputs[name].meaning for name in ("mode", "left"))
    assert (mode, left) == ("number of the mode: 0 a, 1 b", "countdown to the deadline")


def bent(modes=("one", "other"), late=None, **sides):
    """Height above a target within the axis, two modes, late stages; the stop is charged by `sides`."""
    axis = sdp.Axis("height", -0.5, 2.0, 26, "mm", below="stop", above="hold")
    moves = [
        sdp.Move("grind", {"mean": sdp.Levels(0.05, 0.6, 9)}, sdp.Shift("height", lambda s, c: sdp.Rayleigh(c.mean, 0.3 * c.mean)),
                 charge=lambda s, c: 0.02 + 0.1 * (s.mode == 1)),
        sdp.Move("wait", {}, sdp.Stay(), charge=0.05, into=modes[0]),
    ]  # fmt: skip
    stages = sdp.Stages(4, 2.0, "left", "s", late=late)
    return sdp.plan(sdp.Problem([axis], moves, [sdp.Stop("stop", sdp.Charge(**sides))], stages, modes=modes))


BENT = {
    "quadratic": lambda: bent(under=sdp.Quadratic(1.0), over=sdp.Quadratic(9.0)),
    "tolerance": lambda: bent(under=sdp.Linear(1.0, tolerance=0.13), over=sdp.Constant(0.6, tolerance=0.07)),
    "late": lambda: bent(late=sdp.Linear(0.3), under=sdp.Quadratic(1.0), over=sdp.Linear(2.0)),
    "no deadline": lambda: honed(sdp.Quadratic(1e5)),
}


@pytest.mark.parametrize("name", BENT)
def test_a_stop_whose_charge_is_bent_within_cells(tmp_path, name):
    """The C decides as `Policy.action` does: exact charge of the stop beside the lowest line of a move."""
    policy = BENT[name]()
    assert policy.bent.any()
    told = (*policy._controls, "gap", "value")
    made = sdpgrind.export(policy, tmp_path / "thing", outputs=told)
    found = made.check(3000, ["gcc"], levels=["-O0", "-O2"], targets=())
    assert found.differing == 0, found.first
    c, rng, layout, statuses = made.controller(), np.random.default_rng(0), policy.layout, set()
    names = [*layout.stops, *(one.name for one in layout.moves)]
    row, mode, cell = np.nonzero(policy.bent)
    for k in rng.choice(row.size, 60):
        state = {layout.axes[0].name: float(policy.grid.coordinate(0, cell[k] + rng.uniform()))}
        if not layout.endless:
            state[layout.stage_name] = max(float(policy.countdown.time(row[k])), 0.0)
        modes = {} if layout.endless else {"mode": int(mode[k])}
        answer, wanted = c.step(**modes, **state), policy.action(**modes, **state)
        assert (names[c.status], answer["gap"]) == (wanted.name, wanted.gap)
        assert answer["value"] == policy.value(**modes, **state)
        statuses.add(c.status)
    assert 0 in statuses and len(statuses) > 1  # it stops, and it moves


class Cubic(sdp.Quadratic):
    """Another charge than the class it is made from."""

    def __call__(self, z):
        return 7.0 * np.asarray(z) ** 3


def test_what_of_a_bent_charge_is_refused(tmp_path):
    """The condition that fails, and it alone."""
    for under, told in ((lambda x: x**2, "function"), (Cubic(1.0), "Cubic")):
        policy = bent(under=under, over=sdp.Linear(2.0))
        with pytest.raises(ValueError, match=rf"charged by sdp.Constant.*got 'under {told}'"):
            sdpgrind.export(policy, tmp_path / "thing")


def test_a_suggested_loss_is_kept(policy, tmp_path):
    """The loss that a refusal names is one that the export then accepts; unrounded actions lose the search's."""
    with pytest.raises(ValueError, match="search between levels") as refused:
        sdpgrind.export(policy, tmp_path / "bead", lost_max=1e-9)
    suggested = float(re.search(r">= (\S+),", str(refused.value)).group(1))
    made = sdpgrind.export(policy, tmp_path / "bead", lost_max=suggested)
    assert made.manifest["lost"]["all_stages"] <= suggested < 1.01 * made.manifest["lost"]["all_stages"]


def test_an_export_tells_how_far_it_is(policy, tmp_path):
    told = []
    sdpgrind.export(policy, tmp_path / "bead", lost_max=1e-4, progress=lambda *news: told.append(news))
    shares, texts = zip(*told, strict=True)
    assert list(shares) == sorted(shares) and shares[-1] >= 0.9
    assert texts.count("value lost by tables in int16") == len(policy.table.table.value)
    assert {"kernels as C", "vectors of the self-test"} <= set(texts)


def test_a_loaded_policy_says_which_call_takes_the_problem(policy, tmp_path):
    policy.table.save(tmp_path / "table.nc")
    with pytest.raises(ValueError, match=r"plan it again \(`Policy.simulate` also takes problem=\)"):
        sdpgrind.export(sdpgrind.load(tmp_path / "table.nc"), tmp_path / "out", lost_max=1e-3)


def test_what_is_refused(policy, tmp_path):
    torque = finishing.TorqueController(finishing.TorqueAxis(), normal_force=1.111, kind="constant")
    cases = [
        (torque, {"precision": "int16"},
         "precision must be 'double' for a TorqueController: only the tables of a policy are rounded; got 'int16'"),
        (torque, {"lost_max": 1.0}, "lost_max must be None for a"),
        (policy, {"lost_max": 1e-9}, "lost_max must be >= .*, what tables in .* lose .double loses .*: the plan's own error of its search"),
        (policy, {"lost_max": -1.0}, "lost_max must be >= 0 "),
        (policy, {"precision": "int8"}, "precision must be one of double, float32, int16; got 'int8'"),
        (policy, {"outputs": ("gap",)}, "outputs must be duration, feed_rate, normal_force, and of gap, value those"),
        (policy, {"outputs": "gap"}, "outputs must be a sequence of names; got 'gap'"),
    ]  # fmt: skip
    for thing, asked, text in cases:
        with pytest.raises(ValueError, match=text):
            sdpgrind.export(thing, tmp_path / "thing", **asked)
    assert not list(tmp_path.iterdir())
