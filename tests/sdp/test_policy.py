"""Policies: what look-ups give and refuse, files, Monte-Carlo, and the exact distribution of the final
penalty.
"""

import dataclasses
import pickle

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm
from sdp_inside import Menu

import sdpgrind
from sdpgrind import sdp

CHARGE = sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0))


def cut(s, c):
    return sdp.Rayleigh(c.mean, 0.15 * c.mean)


def bead(search=False, levels=33, nodes=41, count=6, late=None, **more):
    moves = [
        sdp.Move(
            "fast",
            {"mean": sdp.Levels(0.0, 0.6, levels, search=search)},
            sdp.Shift("height", cut),
            charge=0.005,
        ),
        sdp.Move(
            "slow",
            {"mean": sdp.Levels(0.0, 1.2, levels, search=search)},
            sdp.Shift("height", cut),
            duration=2,
        ),
    ]
    axis = sdp.Axis("height", 0.0, 2.0, nodes, "mm", below="stop")
    return sdp.Problem([axis], moves, [sdp.Stop("stop", CHARGE)], sdp.Stages(count, 2.0, late=late), **more)


def bend(nodes=81):
    shift = sdp.Shift("error", lambda s, c: sdp.Normal(c.by, 0.1 * c.by))
    return sdp.Problem(
        [sdp.Axis("error", -3, 3, nodes, "mm", below="stop", above="stop")],
        [sdp.Move("bend", {"by": sdp.Levels(0, 5, 26, search=False)}, shift, charge=0.01)],
        [sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))],
        sdp.Stages(3, 1.0, "hits_left", ""),
    )


@pytest.fixture(scope="module")
def policy():
    return sdp.plan(bead())


# -- shapes and types --------------------


def test_a_number_gives_numbers_and_arrays_give_arrays(policy):
    one = policy.value(height=1.0, time_left=8.0)
    assert type(one) is float
    action = policy.action(height=1.0, time_left=8.0)
    assert type(action.stop) is bool and type(action.name) is str
    assert type(action.mean) is float and type(action.gap) is float and action.duration in (2.0, 4.0)
    assert type(policy.gradient(height=1.0, time_left=8.0)["height"]) is float
    height, time = np.linspace(0, 2, 7)[:, None], np.arange(0.0, 13.0, 4.0)
    many, actions = policy.value(height=height, time_left=time), policy.action(height=height, time_left=time)
    assert (
        many.shape
        == actions.stop.shape
        == actions.name.shape
        == actions.mean.shape
        == actions.gap.shape
        == (7, 4)
    )
    assert actions.stop.dtype == bool and np.isnan(actions.mean[actions.stop]).all()
    assert policy.gradient(height=height, time_left=time)["height"].shape == (7, 4)
    for i in range(7):
        for k in range(4):
            state = {"height": float(height[i, 0]), "time_left": float(time[k])}
            assert policy.value(**state) == many[i, k]
            assert policy.action(**state).name == actions.name[i, k]
    assert policy.value(height=np.empty(0), time_left=2.0).shape == (0,)


def test_nodes_are_as_in_the_table_and_between_them_linear(policy):
    x = policy.grid.coordinates[0]
    np.testing.assert_allclose(policy.value(height=x, time_left=8.0), policy.table.value[4, 0], rtol=1e-13)
    middle = policy.value(height=(x[:-1] + x[1:]) / 2, time_left=8.0)
    straight = (policy.table.value[4, 0, 1:] + policy.table.value[4, 0, :-1]) / 2
    plain = policy.kinks.at[4, 0] < 0
    np.testing.assert_allclose(middle[plain], straight[plain], rtol=1e-13)
    # the least of several costs has its kinks above the chord
    assert np.all(middle[~plain] >= straight[~plain] - 1e-15)
    assert 0 < np.sum(~plain) < 10


def test_between_nodes_the_lesser_of_two_costs_is_nearer_than_the_chord():
    coarse, fine = sdp.plan(bead(levels=129, nodes=41)), sdp.plan(bead(levels=129, nodes=41 * 8 - 7))
    x = np.linspace(0.1, 2.0, 901)
    for time in (4.0, 8.0, 12.0):
        truth = fine.value(height=x, time_left=time)
        chord = np.interp(x, coarse.grid.coordinates[0], coarse.table.value[round(time / 2), 0])
        assert (
            np.max(np.abs(coarse.value(height=x, time_left=time) - truth))
            <= np.max(np.abs(chord - truth)) + 1e-12
        )


def test_beyond_a_stopping_edge_the_charge_is_exact(policy):
    assert policy.value(height=-0.3, time_left=8.0) == pytest.approx(3.0, abs=1e-14)
    assert policy.action(height=-0.3, time_left=8.0).stop
    assert policy.gradient(height=-0.3, time_left=8.0)["height"] == pytest.approx(-10.0)


def test_gradient_is_that_of_the_table_to_second_order():
    problem = sdp.Problem(
        [sdp.Axis("x", 0.0, 1.0, 101)], [sdp.Move("no", {}, sdp.Stay(), charge=9.0)],
        [sdp.Stop("s", lambda s: np.sin(3 * s.x))], sdp.Stages(1, 1.0),
    )  # fmt: skip
    x = np.linspace(0.02, 0.98, 23)
    got = sdp.plan(problem).gradient(x=x, time_left=1)["x"]
    np.testing.assert_allclose(got, 3 * np.cos(3 * x), atol=27 * 0.01**2 / 2)


@pytest.mark.parametrize(
    ("state", "error", "message"),
    [
        ({"height": 2.1, "time_left": 4.0}, ValueError, r"height must be <= 2.*mm.*2\.1"),
        ({"height": np.nan, "time_left": 4.0}, ValueError, "height must be finite"),
        (
            {"height": 1.0, "time_left": 12.5},
            ValueError,
            r"time_left must be <= 12, the horizon of the policy.*s.*12\.5",
        ),
        ({"height": 1.0, "time_left": -0.1}, ValueError, "time_left must be >= 0, where the policy ends"),
        ({"height": 1.0, "time_left": np.inf}, ValueError, "time_left must be <= 12"),
        ({"height": 1.0}, TypeError, "a state is given by height, time_left; got height"),
        ({"height": 1.0, "time_left": 2.0, "heat": 3.0}, TypeError, "a state is given by height, time_left"),
        ({"height": 1.0, "time_left": 2.0, "mode": 1}, ValueError, "mode must be"),
        ({"height": 1.0, "time_left": 2.0, "mode": "x"}, ValueError, "mode must be one of"),
        (
            {"height": 1.0, "time_left": 2.0, "mode": 0.5},
            ValueError,
            r"mode must be a whole number in \[0, 0\]; got 0.5",
        ),
    ],
)
def test_states_outside_the_table_are_refused_by_name(policy, state, error, message):
    with pytest.raises(error, match=message):
        policy.value(**state)
    with pytest.raises(error, match=message):
        policy.action(**state)


def test_late_states_off_the_lattice_are_refused():
    policy = sdp.plan(bead(late=sdp.Linear(0.1)))
    assert policy.value(height=1.0, time_left=-4.0) == pytest.approx(
        policy.value(height=1.0, time_left=-2.0) + 0.2
    )
    # Where the late side is the same at all times, any late time can be asked for; a finite table has its own
    # lattice.
    window = sdp.plan(bead(late=sdp.Quadratic(0.01)))
    with pytest.raises(ValueError, match="time_left must be a multiple of 2 where it is < 0"):
        window.value(height=1.0, time_left=-3.0)


@pytest.mark.parametrize(
    ("late", "error", "message"),
    [
        (lambda z: -z, ValueError, r"stages.late must be >= 0 \(\$\); got -0.004"),
        (lambda z: z * (z < 2), ValueError, "stages.late must be non-decreasing"),
        (lambda z: z + 1, ValueError, "stages.late must be 0 at the target"),
        (3.0, TypeError, "stages.late must be a one-sided charge, a function or None; got 3.0"),
    ],
)
def test_what_is_no_late_charge_is_refused(late, error, message):
    with pytest.raises(error, match=message):
        sdp.Stages(3, 1.0, late=late, late_window=4.0)


def test_an_action_says_what_it_has(policy):
    with pytest.raises(AttributeError, match="controls mean; it has no 'force'"):
        _ = policy.action(height=1.0, time_left=8.0).force


# -- files --------------------


def problems():
    """Small problems of many kinds, as numbers that hypothesis can choose."""
    return st.fixed_dictionaries({
        "nodes": st.integers(3, 12), "levels": st.integers(2, 9), "count": st.integers(1, 5), "modes": st.booleans(),
        "late": st.sampled_from([None, sdp.Linear(0.3), sdp.Linear(0.1, tolerance=1.0), sdp.Quadratic(0.2, tolerance=0.5)]),
        "search": st.booleans(),
    })  # fmt: skip


def made(nodes, levels, count, modes, late, search):
    problem = bead(search, levels, nodes, count, late)
    if not modes:
        return problem
    moves = [dataclasses.replace(m, into=m.name) for m in problem.moves]
    stop = sdp.Stop("stop", CHARGE, extra=lambda s: 0.1 * np.asarray(s.mode))
    return dataclasses.replace(problem, moves=moves, stops=[stop], modes=("none", "fast", "slow"))


@given(problems())
@settings(max_examples=15, deadline=None)
def test_save_and_load_keep_every_bit(tmp_path_factory, which):
    policy = sdp.plan(made(**which))
    path = tmp_path_factory.mktemp("policy") / "p.nc"
    policy.save(path)
    again = sdpgrind.load(path)
    for name in ("value", "best", "control", "entry", "gap"):
        a, b = getattr(policy.table, name), getattr(again.table, name)
        assert a.dtype == b.dtype and a.tobytes() == b.tobytes()
    state = {"height": np.linspace(-0.2, 2, 23), "time_left": 2.0 * which["count"]}
    assert np.array_equal(policy.value(**state), again.value(**state))
    assert again.error == policy.error and again.layout == policy.layout
    if which["late"] is not None:
        assert again.value(height=1.0, time_left=-2.0) == policy.value(height=1.0, time_left=-2.0)


def test_a_loaded_policy_of_functions_answers_and_says_what_it_lacks(policy, tmp_path):
    policy.save(tmp_path / "p.nc")
    again = sdpgrind.load(tmp_path / "p.nc")
    with mpl.rc_context({"backend": "agg"}):
        import matplotlib.pyplot as plt

        assert again.plot() is not None
        plt.close("all")
    x = policy.grid.coordinates[0]
    a, b = policy.action(height=x, time_left=12.0), again.action(height=x, time_left=12.0)
    assert np.array_equal(a.name, b.name) and np.array_equal(a.mean, b.mean, equal_nan=True)
    for verb in (again.simulate, again.distribution, lambda **s: again.alternatives(0.1, **s)):
        with pytest.raises(ValueError, match="needs the problem, whose functions no file can hold"):
            verb(height=1.0, time_left=4.0)
    runs = again.simulate(height=1.0, time_left=4.0, runs=100, rng=0, problem=bead())
    assert np.array_equal(runs.penalty, policy.simulate(height=1.0, time_left=4.0, runs=100, rng=0).penalty)


def test_a_file_that_is_not_ours_is_refused(tmp_path):
    (tmp_path / "x.nc").write_text("hello")
    with pytest.raises(ValueError, match="path must be a plan, log or record saved by this library"):
        sdpgrind.load(tmp_path / "x.nc")
    with pytest.raises(FileNotFoundError, match="path must be an existing file"):
        sdpgrind.load(tmp_path / "none.nc")


def differs(policy, fine):
    """Largest difference of two plans in all stages, at the nodes of the finer and so between those of the
    other.
    """
    shape = fine.table.value.shape
    row, mode, *node = (x.ravel() for x in np.indices((*shape[:2], *fine.grid.shape)))
    index = [k * (n - 1) / (m - 1) for k, n, m in zip(node, policy.grid.shape, fine.grid.shape, strict=True)]
    return float(np.max(np.abs(policy.interpolated(row, mode, np.array(index)) - fine.table.value.ravel())))


def to_tolerance(problem, tolerance, times, **finer):
    """A plan to a tolerance, and its distance from one on a grid `times` as fine."""
    policy = sdp.plan(problem, tolerance=tolerance)
    nodes = [(n - 1) * times + 1 for n in policy.grid.shape]
    axes = [dataclasses.replace(axis, nodes=n) for axis, n in zip(problem.axes, nodes, strict=True)]
    return policy, differs(policy, sdp.plan(dataclasses.replace(problem, axes=axes, **finer)))


@pytest.mark.parametrize("tolerance", [2e-2, 2e-3])
@pytest.mark.parametrize("late", [None, sdp.Linear(0.3)])
def test_refining_to_a_tolerance_reports_an_error_that_holds(tolerance, late):
    # At the first cells the sd is below them.
    moves = bead(search=True, levels=513).moves
    policy, true = to_tolerance(bead(search=True, nodes=21, late=late), tolerance, 4, moves=moves)
    assert true <= policy.error <= tolerance


def test_the_error_covers_the_kinks_of_both_axes():
    """On two axes a look-up cuts kinks between the nodes."""
    shift = sdp.Shift(
        "height",
        lambda s, c: sdp.Rayleigh(c.mean * (1 - 0.3 * s.wear), 0.15 * c.mean),
        lambda s, c: (s.wear + 0.1,),
    )
    axes = [sdp.Axis("height", 0.0, 1.0, 11, "mm", below="stop"), sdp.Axis("wear", 0.0, 1.0, 6, above="hold")]
    moves = [sdp.Move("grind", {"mean": sdp.Levels(0.05, 0.6, 33)}, shift, charge=0.05)]
    problem = sdp.Problem(axes, moves, [sdp.Stop("stop", CHARGE)], sdp.Stages(2, 1.0))
    policy, true = to_tolerance(problem, 1e-1, 4)
    assert true <= policy.error <= 1e-1


def noisy_cut(s, c, e):
    return (s.x - c.by * e.noise,)


@pytest.mark.parametrize("points", [2, 5])
def test_the_error_covers_the_quadrature_of_sampled_noise(points):
    """A kink at the target, and too few points across it."""

    def grind(points):
        step = sdp.Sampled(noisy_cut, {"noise": sdp.Normal(1.0, 0.15)}, points=points)
        return [sdp.Move("grind", {"by": np.linspace(0.05, 1.0, 8)}, step, charge=0.02)]

    axis = sdp.Axis("x", -1.0, 2.0, 31, below="hold", above="hold")
    stop = sdp.Stop("stop", lambda s: np.where(s.x > 0, 2 * s.x, -10 * s.x))
    policy, true = to_tolerance(
        sdp.Problem([axis], grind(points), [stop], sdp.Stages(2, 1.0)), 2e-2, 4, moves=grind(500)
    )
    assert true <= policy.error <= 2e-2
    few = sdp.plan(sdp.Problem(policy.grid.axes, grind(points), [stop], sdp.Stages(2, 1.0)))
    assert differs(few, policy) > 2e-2


# -- the exact distribution --------------------


@pytest.mark.parametrize("late", [None, sdp.Linear(0.1), sdp.Quadratic(0.01)])
def test_the_mean_of_the_distribution_is_the_table_at_nodes(late):
    policy = sdp.plan(bead(late=late))
    for height, time in ((1.0, 12.0), (2.0, 4.0), (0.35, 6.0), (1.5, 0.0), (1.9, -4.0 if late else 2.0)):
        found = policy.distribution(height=height, time_left=time)
        assert found.total == pytest.approx(1, abs=1e-12)
        assert found.mean == pytest.approx(policy.value(height=height, time_left=time), abs=1e-10)
        assert found.probability.min(initial=0.0) >= 0


@pytest.mark.parametrize("nodes", [121, 2401])
def test_total_probability_of_a_law_of_two_signs(nodes):
    # On fine grids differences of E (y-D)+ are noise of either sign beyond the mean; dropped negatives once
    # left 1 + 9e-10.
    problem = dataclasses.replace(bend(nodes), stages=sdp.Stages(2, 1.0, "hits_left", ""))
    policy = sdp.plan(problem)
    found = policy.distribution(error=2.0, hits_left=2)
    assert found.total == pytest.approx(1, abs=1e-12)
    assert found.mean == pytest.approx(policy.value(error=2.0, hits_left=2), abs=1e-10)
    assert found.probability_below > 1e-30 or found.probability_above < 1e-9


def test_modes_and_their_finish_charges_in_the_distribution():
    policy = sdp.plan(made(41, 33, 5, True, None, False))
    found = policy.distribution(height=1.5, time_left=10.0)
    assert found.total == pytest.approx(1, abs=1e-12)
    assert found.mean == pytest.approx(policy.value(height=1.5, time_left=10.0), abs=1e-10)


def test_a_step_forward_is_adjoint_to_a_step_back():
    rng = np.random.default_rng(0)
    for problem in (bead(), bend(), made(21, 9, 4, True, None, False)):
        policy = sdp.plan(problem)
        modes, size = len(problem.modes), policy.grid.size
        menu = Menu(problem, policy.grid, 0)
        point = (rng.uniform(0.1, 1.9, 30),)
        told = rng.integers(modes, size=30) if modes > 1 else None
        rows = menu.move.to.rows(menu, point, told, None, np.zeros(30, dtype=int), rng.uniform(0.1, 0.5, 30))
        p, value = rng.random(30), rng.normal(size=(modes, size))
        back = p @ (rows.expect(value, np.zeros(modes)) - rows.charge)
        forward = np.sum(rows.spread(p, modes) * value)
        assert back == pytest.approx(forward, abs=1e-12 * size)


@pytest.mark.parametrize(
    ("confidence", "expected"),
    [(0.0, 1.05), (0.3, 0.9 / 0.7), (0.5, (0.2 * 2 + 0.3) / 0.5), (0.8, 2.0), (0.95, 2.0), (0.999, 2.0)],
)
@pytest.mark.parametrize("extra", [0.0, 0.25])
def test_cvar_by_hand(confidence, expected, extra):
    law = sdp.Discrete([1.0, 1.5, 2.2], [0.5, 0.3, 0.2])
    move = sdp.Move("go", {"n": [0.0]}, sdp.Shift("x", lambda s, c: law), charge=-10.0)
    charge = sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(10.0))
    stop = sdp.Stop("s", charge, extra=lambda s: extra)
    axis = sdp.Axis("x", 0.0, 2.0, 21, below="stop")
    policy = sdp.plan(sdp.Problem([axis], [move], [stop], sdp.Stages(1, 1.0)))
    found = policy.distribution(x=2.0, time_left=1)
    # Charges 1, 0.5 and 10 * 0.2 $, with 5, 3 and 2 in ten. The worst 70 %: all of the 2 $, all of the 1 $.
    expected = {0.3: (0.2 * 2 + 0.5 * 1) / 0.7}.get(confidence, expected) + extra
    # The quantile is known to 1e-15 of 2 $, an expectation to some of its last bits.
    assert found.cvar(confidence) == pytest.approx(expected, abs=1e-14 / (1 - confidence))
    assert found.on_the_way == pytest.approx(-10.0) and found.moves == pytest.approx(1.0)
    assert found.probability_below == pytest.approx(0.2)
    assert found.mean == pytest.approx(policy.value(x=2.0, time_left=1)) == pytest.approx(1.05 + extra - 10)
    levels = np.array([-0.1, 0.0, 0.4, 0.6, 0.9, 1.1, 1.9, 2.1]) + extra
    odds = [1.0, 1.0, 1.0, 0.7, 0.7, 0.2, 0.2, 0.0]
    assert [found.exceeds(level) for level in levels] == pytest.approx(odds, abs=1e-14)


def test_a_constant_charge_is_exceeded_below_it_alone():
    law = sdp.Normal(0.5, 0.4)
    move = sdp.Move("go", {"n": [0.0]}, sdp.Shift("x", lambda s, c: law))
    stop = sdp.Stop("s", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Constant(3.0, tolerance=0.1)))
    axis = sdp.Axis("x", 0.0, 1.0, 21, below="stop", above="hold")
    policy = sdp.plan(sdp.Problem([axis], [move], [stop], sdp.Stages(1, 1.0)))
    found = policy.distribution(x=1.0, time_left=1)
    gone = float(norm.sf(1.1, 0.5, 0.4))
    assert [found.exceeds(level) for level in (1.01, 2.9, 3.0, 3.1)] == pytest.approx([gone, gone, 0.0, 0.0])
    within = float(norm.cdf(1.1, 0.5, 0.4)) - found.probability[found.charge > 0].sum()
    assert 0.01 < within == pytest.approx(1 - found.exceeds(0.0), rel=1e-9)
    assert found.cvar(1 - gone / 2) == pytest.approx(3.0, rel=1e-13)


def test_negative_charges_have_a_mean_and_a_cvar_too():
    # Revenue: stopping at x earns 1 + x, two outcomes with equal odds.
    law = sdp.Discrete([0.5, 1.0])
    move = sdp.Move("go", {"n": [0.0]}, sdp.Shift("x", lambda s, c: law), charge=-10.0)
    axis = sdp.Axis("x", 0.0, 2.0, 21, below="hold")
    policy = sdp.plan(sdp.Problem([axis], [move], [sdp.Stop("s", lambda s: -1.0 - s.x)], sdp.Stages(1, 1.0)))
    found = policy.distribution(x=2.0, time_left=1)
    assert found.mean == pytest.approx(policy.value(x=2.0, time_left=1)) == pytest.approx(-2.25 - 10)
    assert found.cvar(0.5) == pytest.approx(-2.0, abs=1e-9)
    assert found.cvar(0.0) == pytest.approx(-2.25, abs=1e-9)


def test_a_distribution_on_nodes_of_its_own():
    """On those of the table it is the table's own; what is no row from end to end of the only axis is
    refused.
    """
    policy = sdp.plan(bead())
    state = {"height": 1.5, "time_left": 10.0}
    own, other = policy.distribution(**state), policy.distribution(nodes=policy.grid.coordinates[0], **state)
    assert other.total == pytest.approx(1.0, abs=1e-12)
    assert other.mean == pytest.approx(own.mean, rel=1e-9)  # looked up where it is read off: rounding alone
    assert other.probability_below == pytest.approx(own.probability_below, rel=1e-9)
    high = policy.layout.axes[0].high
    for nodes in ([0.0, high], [0.0, 1.0, 1.0, high], [0.0, 1.0, 1.1 * high], [[0.0, 1.0, high]]):
        with pytest.raises(ValueError, match=r"^nodes must be 3 or more that rise from 0 to "):
            policy.distribution(nodes=nodes, **state)


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_cvar_against_monte_carlo(confidence):
    problem = bead()
    problem = dataclasses.replace(
        problem, moves=[dataclasses.replace(problem.moves[0], charge=0.0), problem.moves[1]]
    )
    policy = sdp.plan(problem)
    runs = policy.simulate(height=1.7, time_left=6.0, runs=200_000, rng=2, snap=True)
    worst = np.sort(runs.penalty)[int(confidence * runs.penalty.size) :]
    found = policy.distribution(height=1.7, time_left=6.0)
    level = worst[0]
    # Spread of the Rockafellar-Uryasev estimator at its optimal level.
    se = np.std(np.maximum(runs.penalty - level, 0)) / (1 - confidence) / np.sqrt(runs.penalty.size)
    assert worst.mean() == pytest.approx(found.cvar(confidence), abs=3.5 * se + 1e-9)
    overground = np.mean(runs.final["height"] < 0)
    assert overground == pytest.approx(
        found.probability_below, abs=3.5 * np.sqrt(overground / 200_000) + 1e-9
    )


# -- Monte-Carlo --------------------


CASES = {
    "bead": (bead, {"height": 1.5, "time_left": 12.0}),
    "search": (lambda: bead(search=True, levels=401), {"height": 0.4, "time_left": 2.0}),
    "late": (lambda: bead(late=sdp.Linear(0.05)), {"height": 2.0, "time_left": 2.0}),
    "later": (lambda: bead(late=sdp.Linear(0.05)), {"height": 2.0, "time_left": -6.0}),
    "window": (lambda: bead(late=sdp.Quadratic(0.01)), {"height": 2.0, "time_left": 0.0}),
    "modes": (lambda: made(41, 33, 5, True, None, False), {"height": 1.5, "time_left": 10.0}),
    "two signs": (bend, {"error": 2.0, "hits_left": 3}),
    "between nodes": (bead, {"height": 1.513, "time_left": 9.3}),
}


@pytest.mark.parametrize("name", CASES)
def test_snapped_monte_carlo_is_the_table(name):
    make, state = CASES[name]
    policy = sdp.plan(make())
    runs = policy.simulate(runs=40_000, rng=11, snap=True, **state)
    assert abs(runs.mean - policy.value(**state)) < 3.5 * runs.standard_error + policy.table.search_error
    assert runs.penalty.shape == runs.moves.shape == (40_000,) and runs.moves.max() >= 1
    found = policy.distribution(**state)
    assert found.moves == pytest.approx(runs.moves.mean(), abs=3.5 * runs.moves.std() / 200 + 1e-9)
    assert runs.dataset.sizes == {"run": 40_000}


def test_another_truth_is_another_outcome(policy):
    worse = dataclasses.replace(
        bead(), moves=[dataclasses.replace(m, to=sdp.Shift("height", wild)) for m in bead().moves]
    )
    state = {"height": 1.5, "time_left": 12.0}
    planned, real = (
        policy.simulate(runs=5000, rng=0, **state),
        policy.simulate(runs=5000, rng=0, problem=worse, **state),
    )
    assert real.mean > planned.mean + 5 * (real.standard_error + planned.standard_error)


def wild(s, c):
    return sdp.Rayleigh(c.mean, 0.4 * c.mean)


def test_modes_alone_can_be_simulated_and_spread():
    go = sdp.Move(
        "go", {"to": [0, 1]}, sdp.Stay(), into=["a", "b"], charge=lambda s, c: 1.0 + 0.5 * s.mode - 0.2 * c.to
    )
    stop = sdp.Stop("end", lambda s: 5.0 - 3.0 * s.mode)
    policy = sdp.plan(sdp.Problem([], [go], [stop], sdp.Stages(3, 1.0), ("a", "b")))
    runs = policy.simulate(runs=10, time_left=3, mode="a")
    assert np.all(runs.penalty == policy.value(time_left=3, mode="a"))
    assert policy.distribution(time_left=3, mode="a").mean + 0 == pytest.approx(
        policy.value(time_left=3, mode="a")
    )


def test_alternatives_agree_with_the_table(policy):
    for height in (0.5, 1.0, 1.75):
        costs = policy.alternatives(10.0, height=height, time_left=8.0)
        ranked = list(costs.values())
        action = policy.action(height=height, time_left=8.0)
        assert ranked == sorted(ranked) and next(iter(costs)) == action.name
        assert ranked[0] == pytest.approx(policy.value(height=height, time_left=8.0), abs=1e-12)
        assert ranked[1] - ranked[0] == pytest.approx(action.gap, abs=1e-12)


def test_a_policy_pickles_when_its_problem_does():
    policy = sdp.plan(bead(nodes=11))
    again = pickle.loads(pickle.dumps(policy))
    assert np.array_equal(again.table.value, policy.table.value)
    assert (
        again.simulate(height=1.0, time_left=4.0, runs=50).mean
        == policy.simulate(height=1.0, time_left=4.0, runs=50).mean
    )


# -- invariants --------------------


@given(st.integers(5, 30), st.integers(3, 20), st.floats(0.05, 0.5))
@settings(max_examples=20, deadline=None)
def test_more_time_never_costs_more(nodes, levels, scatter):
    move = sdp.Move(
        "grind",
        {"mean": sdp.Levels(0.0, 0.7, levels, search=False)},
        sdp.Shift("height", lambda s, c: sdp.Rayleigh(c.mean, scatter * c.mean)),
    )
    axis = sdp.Axis("height", 0.0, 2.0, nodes, below="stop")
    table = sdp.plan(sdp.Problem([axis], [move], [sdp.Stop("stop", CHARGE)], sdp.Stages(4, 1.0))).table
    assert np.all(np.diff(table.value[:, 0], axis=0) <= 1e-12)
    assert np.all(table.gap >= 0)


@pytest.mark.parametrize("levels", [3, 4, 9])
@pytest.mark.parametrize("nodes", [4, 9])
def test_a_search_between_coarse_levels_settles_on_the_late_side(nodes, levels):
    # A parabola through coarse levels may undershoot: the sweeps wavered for ever, and were told to be free
    # of charge.
    policy = sdp.plan(bead(True, levels, nodes, 2, sdp.Linear(0.1, tolerance=1.0)))
    plain = sdp.plan(bead(False, 401, nodes, 2, sdp.Linear(0.1, tolerance=1.0)))
    x = np.linspace(0, 2, 9)
    late = {"height": x, "time_left": -20.0}
    np.testing.assert_allclose(policy.value(**late), plain.value(**late), atol=0.35 if levels < 9 else 0.05)


def shrink(s, c, e):
    return (s.height - c.mean * (1 + e.n),)


@pytest.mark.parametrize("to", [sdp.Shift("height", cut), sdp.Sampled(shrink, {"n": sdp.Normal(0.0, 0.15)})])
def test_a_search_without_end_settles_and_says_what_following_it_costs(to):
    def solved(levels, search):
        move = sdp.Move("g", {"mean": sdp.Levels(0.05, 1.2, levels, search=search)}, to, charge=0.02)
        axis = sdp.Axis("height", 0.0, 2.0, 41, below="stop", above="hold")
        return sdp.plan(sdp.Problem([axis], [move], [sdp.Stop("s", CHARGE)], sdp.Forever()))

    found, plain = solved(65, True), solved(2001, False)
    difference = found.table.value - plain.table.value
    # What a policy costs is never below the least, up to what 2001 levels miss; and it is near it.
    assert difference.min() > -1e-4 and difference.max() < 1e-2
    runs = found.simulate(height=1.0, runs=20_000, rng=4, snap=True)
    assert abs(runs.mean - found.value(height=1.0)) < 3.5 * runs.standard_error


def test_a_tolerance_out_of_reach_is_refused_early_with_one_that_is_not():
    problem = bead(nodes=21, levels=33)
    with pytest.raises(ValueError, match=r"tolerance must be reachable .* got 1e-30: try \d"):
        sdp.plan(problem, tolerance=1e-30)
