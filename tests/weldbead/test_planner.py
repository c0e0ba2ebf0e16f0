"""The planner against loops written anew, identities that hold for every plan, and all kinds of problems."""

import itertools
from functools import lru_cache

import numpy as np
import pytest
from bead_plans import cut_moments, rayleigh_over_under
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import sdp, weldbead

P1 = weldbead.preset("P1")
SMALL = P1.replace(durations=(6, 10, 20), horizon=30.0)
FINISH = weldbead.FinishCharge(0.4, reference_rate=12.5)
TIMES = np.arange(0, 31, 2)


@lru_cache(maxsize=8)
def solved(problem, nodes=41):
    """Several tests compare with the same few plans."""
    return weldbead.plan(problem, tolerance=None, nodes=nodes)


def values(policy):
    height, time = policy.states()
    return policy.value(height[:, None], time)


def weights(x, node, mean, sd):
    """Probability weights on the nodes, P(overground) and E (D - x)+, for one height and all cuts."""
    h = node[1]
    under = lambda y: np.where(y > 0, rayleigh_over_under(mean, sd, np.maximum(y, 1e-300))[1], 0.0)  # noqa: E731
    z = node[:, None]
    inner = (under(x - z + h) - 2 * under(x - z) + under(x - z - h)) / h
    q = np.minimum(sd / np.sqrt(2 - np.pi / 2), mean / np.sqrt(np.pi / 2))
    out = np.exp(-0.5 * (np.maximum(x - mean + q * np.sqrt(np.pi / 2), 0) / q) ** 2)
    inner[0] = 1 - out - (under(x) - under(x - h)) / h
    return inner, out, rayleigh_over_under(mean, sd, x)[0]


def by_loops(problem, node, levels, finish):
    """J[last pass, stage, node] by the recursion of the specification; the last entry of `last pass` is none
    yet.

    At the node 0 it is the limit from above: that is what falls between the first two nodes.
    """
    durations = problem.durations
    stop = 2 * node
    count = round(problem.horizon / 2)
    charge = np.append([finish(50 / (t - 2)) for t in durations], 0.0)
    table = np.empty((len(durations) + 1, count + 1, node.size))
    for stage in range(count + 1):
        best = np.full(node.size, np.inf)
        for a, duration in enumerate(durations):
            before = stage - round(duration / 2)
            if before < 0:
                continue
            mean, sd = cut_moments(levels[a], duration)
            for k in range(node.size):
                inner, out, over = weights(node[k], node, mean, sd)
                cost = problem.pass_charge + table[a, before] @ inner + 10 * over + charge[a] * out
                best[k] = min(best[k], cost.min())
        table[:, stage] = np.minimum(stop + charge[:, None], best)
    return table


@pytest.mark.parametrize(
    ("finish", "pass_charge", "min_cut"), [(None, 0.03, 0.1), (FINISH, 0.0, 0.02), (FINISH, 0.02, 0.1)]
)
def test_against_plain_loops(finish, pass_charge, min_cut):
    problem = SMALL.replace(finish_charge=finish, pass_charge=pass_charge, min_cut=min_cut)
    node = np.linspace(0, 2, 21)
    policy = weldbead.SequencePolicy(
        problem, sdp.plan(weldbead.sequence.sdp_problem(problem, 21, levels=25, search=False))
    )
    levels = []
    for duration in problem.durations:
        low = (100 + 125 * min_cut * 50 / (duration - 2)) / 12.75
        kink = 100 / 12.75 / (1 - 0.15 * 1.9130584)  # mean = 1.913 sd
        levels.append(np.unique([*np.linspace(low, 50.0, 25), *([kink] if kink > low else [])]))
    table = by_loops(problem, node, levels, finish or (lambda feed: 0.0))
    height, time = node[:, None], TIMES
    np.testing.assert_allclose(policy.value(height, time), table[-1].T, atol=1e-9)
    if finish is not None:
        for a, duration in enumerate(problem.durations):
            found = policy.value(height, time, last_duration=duration)
            np.testing.assert_allclose(found[1:], table[a].T[1:], atol=1e-9)
            # no further pass from 0
            np.testing.assert_allclose(found[0], finish(problem.feed_rate(duration)), atol=1e-12)
            np.testing.assert_allclose(policy.table.table.value[:, a + 1, 0], table[a, :, 0], atol=1e-9)


def test_finish_charge_slows_the_last_pass():
    plain, charged = solved(P1), solved(P1.replace(finish_charge=FINISH, min_cut=0.02))
    state = {"height": 0.25, "time_left": 10.0}
    assert plain.action(**state).duration == 6
    assert charged.action(**state).duration == 10
    heights = np.linspace(0.05, 2, 40)
    assert np.all(charged.value(heights, 60.0) >= plain.value(heights, 60.0) - 1e-9)
    # at most the fastest finish
    assert np.all(charged.value(heights, 60.0) <= plain.value(heights, 60.0) + 0.4 + 1e-9)
    # A slow last pass to refinish: worth it as long as it saves more than it risks.
    # no pass starts from a bead that is gone
    assert charged.value(0.0, 30.0, last_duration=6.0) == pytest.approx(0.4)
    assert charged.value(0.1, 30.0, last_duration=6.0) < 0.4


def test_pass_charge_is_paid_for_each_pass():
    policy = solved(P1.replace(pass_charge=0.05))
    for height, time in ((1.0, 24.0), (2.0, 60.0), (0.3, 12.0)):
        risk = policy.risk(height, time)
        assert risk.distribution.on_the_way == pytest.approx(0.05 * risk.passes)
        assert risk.passes <= solved(P1).risk(height, time).passes + 1e-9
    # Where a charge exceeds all that can be gained, one stops.
    assert np.all(solved(P1.replace(pass_charge=4.1)).action(np.linspace(0, 2, 41), 60.0).stop)


SCATTERS = [
    *(
        weldbead.Scatter(name, 0.15, law=law)
        for name in ("C1", "K1", "K2", "mu")
        for law in ("rayleigh", "lognormal", "normal")
    ),
    weldbead.Scatter(("C1", "K2"), (0.1, 0.1)),
    weldbead.Scatter("K1", 0.2, law="empirical", sample=(0.7, 0.9, 1.0, 1.0, 1.1, 1.5), bandwidth=0.3),
]
LIMITS = {
    "none": None,
    "force": weldbead.ForceBurnLimit(16.0),
    "power": weldbead.PowerBurnLimit(150.0),
    "malkin": weldbead.MalkinBurnLimit.published(170.0),
}


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("scatter", SCATTERS, ids=lambda s: f"{s.attribution}-{s.law}")
def test_every_scatter_and_limit(scatter, limit):
    problem = SMALL.replace(
        scatter=scatter, burn_limit=LIMITS[limit], free_speed=560.0, speed_droop=0.1, idle_power=20.0
    )
    policy = solved(problem.replace(specific_energy=8.0, horizon=20.0), nodes=31)
    problem = policy.problem
    height, time = policy.states()
    value, action = values(policy), policy.action(height[:, None], time)
    going = ~action.stop
    assert np.all(np.isfinite(value)) and np.all(value >= 0)
    assert np.all(value <= 2 * height[:, None] + 1e-12)
    assert np.max(np.diff(value, axis=1)) <= 1e-8
    force, feed = action.normal_force[going], action.feed_rate[going]
    assert (
        going.any()
        and np.all(force <= 50.0)
        and np.all(force <= problem.scatter.peak_force(problem.model) + 1e-9)
    )
    if LIMITS[limit] is not None:
        margin = LIMITS[limit].margin(problem.scatter.expected(problem.model), force, feed)
        assert margin.min() > -1e-6 * 50
    low, high = np.array([problem.force_interval(t) for t in action.duration[going]]).T
    assert np.all((force >= low - 1e-9) & (force <= high + 1e-9))


def test_least_cut_is_met():
    policy = solved(P1.replace(min_cut=0.1))
    height, time = policy.states()
    action = policy.action(height[:, None], time)
    assert action.mean_cut[~action.stop].min() >= 0.1 - 1e-12
    assert np.all(values(policy) >= values(solved(P1)) - 1e-6)


def test_a_concave_lateness_charge_in_its_window():
    problem = SMALL.replace(lateness_charge=sdp.Constant(0.3), late_window=40.0, horizon=12.0)
    policy = solved(problem)
    # Late at last for 0.3 $: three more slow passes are worth it, and it never costs more than to stop.
    assert policy.value(2.0, 0.0) < 0.3 + 4 - 3
    assert policy.value(0.1, 0.0) == pytest.approx(0.2)
    longer = solved(problem.replace(late_window=60.0))
    assert longer.value(2.0, 0.0) <= policy.value(2.0, 0.0) + 1e-9


def test_lateness_by_a_function():
    quadratic = P1.replace(lateness_charge=sdp.Quadratic(0.01), late_window=40.0, horizon=20.0)
    given_function = quadratic.replace(lateness_charge=lambda late: 0.01 * late**2)
    np.testing.assert_allclose(values(solved(given_function)), values(solved(quadratic)), rtol=1e-12)


@settings(max_examples=12, deadline=None)
@given(factor=st.floats(0.1, 10.0))
def test_value_is_linear_in_the_charges(factor):
    over, under, late = 10.0, 2.0, 0.2
    base = SMALL.replace(lateness_charge=sdp.Linear(late), pass_charge=0.01)
    scaled = base.replace(
        height_charge=sdp.Charge(under=sdp.Linear(factor * under), over=sdp.Linear(factor * over)),
        lateness_charge=sdp.Linear(factor * late),
        pass_charge=factor * 0.01,
    )
    np.testing.assert_allclose(
        values(solved(scaled)), factor * values(solved(base)), rtol=2e-7, atol=1e-8 * factor
    )


@settings(max_examples=12, deadline=None)
@given(factor=st.floats(0.25, 4.0))
def test_unit_of_height_does_not_matter(factor):
    # Heights and cuts in another unit: K1 over the factor cuts that many times deeper; charges for a unit
    # shrink alike.
    scaled = SMALL.replace(
        specific_energy=P1.model.specific_energy / factor,
        height_max=2.0 * factor,
        height_charge=sdp.Charge(under=sdp.Linear(2.0 / factor), over=sdp.Linear(10.0 / factor)),
    )
    np.testing.assert_allclose(values(solved(scaled)), values(solved(SMALL)), rtol=1e-7, atol=1e-9)


@settings(max_examples=12, deadline=None)
@given(factor=st.floats(0.25, 4.0))
def test_unit_of_time_does_not_matter(factor):
    # The same feeds over a longer bead.
    names = ("bead_length", "reset_time", "horizon", "stage")
    scaled = SMALL.replace(
        durations=[factor * t for t in SMALL.durations], **{n: factor * getattr(SMALL, n) for n in names}
    )
    np.testing.assert_allclose(values(solved(scaled)), values(solved(SMALL)), rtol=1e-7, atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(
    sd=st.floats(0.0, 0.5),
    under=st.floats(0.5, 5.0),
    ratio=st.floats(0.5, 20.0),
    rate=st.one_of(st.none(), st.floats(0.01, 1.0)),
    scatter=st.sampled_from(["C1", "K1", "mu"]),
)
def test_invariants(sd, under, ratio, rate, scatter):
    problem = SMALL.replace(
        scatter=weldbead.Scatter(scatter, sd),
        height_charge=sdp.Charge(under=sdp.Linear(under), over=sdp.Linear(ratio * under)),
        lateness_charge=None if rate is None else sdp.Linear(rate),
    )
    value = values(solved(problem))
    # actions that cost the same to 1e-7 tie, and the first of them is taken, pass after pass
    tied = 1e-6 * under
    assert np.max(np.diff(value, axis=1)) <= tied  # more time never costs
    assert np.all(value <= under * solved(problem).states()[0][:, None] + 1e-12)
    assert np.all(value >= 0)
    cheaper = problem.replace(
        height_charge=sdp.Charge(under=sdp.Linear(under), over=sdp.Linear(0.9 * ratio * under))
    )
    # dearer charges never cost less, but for the search
    assert np.all(values(solved(cheaper)) <= value + 1e-3 * under)
    more = problem.replace(durations=(6, 8, 10, 20))
    assert np.all(values(solved(more)) <= value + tied)  # nor do more feeds


FEW = P1.replace(durations=(6, 8, 10), horizon=14.0, height_max=1.0)


def every_multiple(problem, stage):
    low, high = problem.durations[0], problem.durations[-1]
    durations = [low + k * stage for k in range(round((high - low) / stage) + 1)]
    return problem.replace(stage=stage, durations=durations)


def test_finer_stages_converge_from_above():
    time = np.arange(0, 15, 2.0)
    height = np.linspace(0, 1, 41)[:, None]
    found = [solved(every_multiple(FEW, stage)).value(height, time) for stage in (2.0, 1.0, 0.5, 0.25)]
    steps = [coarse - fine for coarse, fine in itertools.pairwise(found)]
    for step in steps:
        assert step.min() > -1e-9  # every pass of the coarser stage is one of the finer
    assert steps[0].max() > steps[2].max() > 0


def test_continuous_feed():
    lattice = weldbead.plan(FEW, tolerance=2e-3)
    policy = weldbead.plan(FEW, tolerance=2e-2, feed="continuous")
    height, time = np.linspace(0, 1, 41)[:, None], np.arange(0, 15, 1.0)
    assert np.all(policy.value(height, time) <= lattice.value(height, time) + lattice.error + policy.error)
    assert policy.problem.stage <= 1.0
    # Far from the target a pass of 7 s removes 5 x 0.086 mm, where the lattice has but the one of 6 s.
    assert policy.value(1.0, 7.0) == pytest.approx(2 * (1.0 - 5 * 0.086), abs=5e-3)
    assert lattice.value(1.0, 7.0) == pytest.approx(2 * (1.0 - 4 * 0.086), abs=5e-3)
    assert policy.action(1.0, 7.0).duration == pytest.approx(7.0)
    assert policy.action(1.0, 7.0).feed_rate == pytest.approx(10.0)


def test_messages():
    with pytest.raises(ValueError, match="feed must be one of lattice, continuous; got 'free'"):
        weldbead.plan(P1, feed="free")
    with pytest.raises(ValueError, match=r"tolerance must be > 0 \(\$\); got 0.0"):
        weldbead.plan(P1, tolerance=0.0)
    with pytest.raises(ValueError, match=r"height.nodes must be >= 3; got 2"):
        weldbead.plan(P1, tolerance=None, nodes=2)
    with pytest.raises(
        ValueError, match=r"late_window must be given with a lateness_charge that is not convex \(s\)"
    ):
        P1.replace(lateness_charge=sdp.Constant(1.0))


def test_defaults():
    assert solved(P1).error > 0 and solved(P1).status == "given grid"
    assert weldbead.plan(P1, tolerance=None).table.grid.size == 401
    policy = weldbead.plan(SMALL, tolerance=5e-3)
    assert 0 < policy.error <= 5e-3 and "error" in repr(policy)


def test_what_is_no_problem_and_what_is_no_estimate():
    with pytest.raises(TypeError, match=r"problem must be a SequenceProblem .*; got 'P1'"):
        weldbead.plan("P1")
    with pytest.raises(
        TypeError, match=r"estimate must be what weldbead.identify gives, or a Scatter; got 3"
    ):
        weldbead.preset("P1").updated(3)


JUMPS = P1.replace(
    durations=(6, 10),
    height_charge=sdp.Charge(under=sdp.Constant(1.0, 0.1), over=sdp.Linear(10.0)),
    horizon=12.0,
)


def test_where_the_default_tolerance_is_out_of_reach_the_best_is_given_with_a_warning():
    """A charge that jumps does so between two nodes of any grid."""
    with pytest.warns(
        UserWarning, match=r"the expected penalty is known to .* \$, not to 1e-05 \$: a charge that jumps"
    ):
        policy = weldbead.plan(JUMPS)
    assert policy.error > 1e-5
    fine = weldbead.plan(JUMPS, tolerance=None, nodes=3201)
    at = policy.table.grid.points[0][::16]
    left = np.full(at.size, 12.0)
    assert np.max(np.abs(policy.value(at, left) - fine.value(at, left))) < policy.error


def test_a_tolerance_that_is_asked_for_is_kept_or_refused():
    with pytest.raises(
        sdp.ToleranceError, match=r"tolerance must be reachable within .* \(\$\); got 1e-05"
    ) as refused:
        weldbead.plan(JUMPS, tolerance=1e-5)
    assert refused.value.policy.error > 1e-5
