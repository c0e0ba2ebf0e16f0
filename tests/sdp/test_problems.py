"""The shipped problems: the scripts of the documentation run, and every number they show is found in a second
way.
"""

import runpy
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from scipy import integrate, optimize, sparse, stats
from scipy.sparse import csgraph
from scipy.sparse.linalg import spsolve

from sdpgrind import sdp, weldbead

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


@pytest.fixture(scope="module")
def example():
    """Run a script once, without a window."""
    done = {}

    def run(name):
        if name not in done:
            import matplotlib.pyplot as plt

            with mpl.rc_context({"backend": "agg"}):
                done[name] = runpy.run_path(str(EXAMPLES / f"solver_{name}.py"))
                assert plt.get_fignums(), "the page wants a picture"
                plt.close("all")
        return done[name]

    return run


def all_routes(trails, here, entrances):
    """Times of every route from here to an entrance."""
    if here in entrances:
        return [0]
    return [t + rest for a, b, t in trails if a == here for rest in all_routes(trails, b, entrances)]


def test_ski_trails_of_the_source(example):
    policy = example("ski_trails")["policy"]
    # Brown (1988), Appendix A: what the text says of its lost map.
    assert [policy.value(mode=p) for p in "ABDI"] == [2.0, 1.0, 6.0, 8.0]
    assert example("ski_trails")["wrong_turn"] == 10.0
    trails = example("ski_trails")["trails"]
    heads = {p: trails[int(policy.action(mode=p).trail)][1] for p in "DEI"}
    assert heads == {"D": "A", "E": "C", "I": "D"}


def test_ski_trails_against_all_routes_and_against_dijkstra(example):
    trails, places, entrances = (example("ski_trails")[k] for k in ("trails", "places", "entrances"))
    policy = example("ski_trails")["policy"]
    graph = np.zeros((len(places) + 1, len(places) + 1))
    for a, b, t in trails:
        graph[places.index(b), places.index(a)] = t
    for entrance in entrances:
        graph[-1, places.index(entrance)] = 1e-9  # zero would be no edge
    shortest = csgraph.dijkstra(sparse.csr_array(graph), indices=len(places))
    for k, place in enumerate(places):
        assert policy.value(mode=place) == min(all_routes(trails, place, entrances))
        assert policy.value(mode=k) == pytest.approx(shortest[k], abs=1e-8)


def expected_charge(aim, sd):
    """E of 1 $/mm under and 4 $/mm over for a normal error: the newsboy's formula."""
    z = aim / sd
    return (
        aim * stats.norm.cdf(z)
        + sd * stats.norm.pdf(z)
        + 4 * (sd * stats.norm.pdf(z) - aim * stats.norm.sf(z))
    )


def best_hit(error, expected, levels=8001):
    """Least over 8000 bends in either direction: within curvature/2 * (0.25 um)^2, some 1e-6 $, of the
    minimum.
    """
    b = np.linspace(0, 4, levels)[1:]
    return min(np.min(expected(error - b, 0.1 * b)) + 0.02, np.min(expected(error + b, 0.15 * b)) + 0.05)


def stopped(error):
    return max(error, 0.0) + 4 * max(-error, 0.0)


def test_one_hit_of_roll_bending_is_the_newsboy(example):
    policy = example("roll_bending")["policy"]
    dense = sdp.plan(example("roll_bending")["problem"](nodes=301, hits=1, levels=1601))
    for error in (-2.4, -0.4, 0.3, 1.0, 2.0, 2.8):
        # On the grid the charge is linear between nodes, and one of them is the target: exact but for the
        # search.
        expected = min(stopped(error), best_hit(error, expected_charge))
        off = abs(policy.value(error=error, hits_left=1) - expected)
        assert off <= policy.table.search_error and off < 2e-4
        assert dense.value(error=error, hits_left=1) == pytest.approx(expected, abs=1.5e-6)


def test_two_hits_of_roll_bending_by_quadrature(example):
    fine = np.linspace(-3.5, 3.5, 701)  # the nodes of the plan below
    once = np.array([min(stopped(x), best_hit(x, expected_charge, 2001)) for x in fine])
    points = np.linspace(-7, 7, 701)
    weights = stats.norm.pdf(points) * 0.02

    def expected(aim, sd):
        return np.interp(aim[:, None] + sd[:, None] * points, fine, once) @ weights

    policy = sdp.plan(example("roll_bending")["problem"](nodes=601, hits=2, levels=801))
    for error in (1.0, 2.0):
        # The same cells; trapezes of sd/50 across kinks, bends in steps of 2 um: some 1e-5.
        assert policy.value(error=error, hits_left=2) == pytest.approx(
            best_hit(error, expected, 2001), abs=5e-5
        )


def test_roll_bending_by_monte_carlo(example):
    policy, outcome = example("roll_bending")["policy"], example("roll_bending")["outcome"]
    runs = policy.simulate(error=2.0, hits_left=4, runs=40_000, rng=1, snap=True)
    assert abs(runs.mean - outcome.mean) < 3.5 * runs.standard_error
    # The table holds the vertex of a cubic between levels, the distribution what the bend there really costs.
    off = abs(outcome.mean - policy.value(error=2.0, hits_left=4))
    assert off <= policy.table.search_error and off < 5e-5
    dense = sdp.plan(example("roll_bending")["problem"](nodes=301, hits=4, levels=1601))
    state = {"error": 2.0, "hits_left": 4}
    assert dense.distribution(**state).mean == pytest.approx(dense.value(**state), abs=1e-6)
    assert runs.moves.mean() == pytest.approx(outcome.moves, abs=3.5 * runs.moves.std() / 200)


def discretised(nodes, successors, weights):
    """Transition matrix by linear interpolation, row by row."""
    matrix = np.zeros((nodes.size, nodes.size))
    for row, after in enumerate(successors):
        for x, w in zip(after, weights, strict=True):
            k = min(np.searchsorted(nodes, x, side="right") - 1, nodes.size - 2)
            part = (x - nodes[k]) / (nodes[k + 1] - nodes[k])
            matrix[row, k] += w * (1 - part)
            matrix[row, k + 1] += w * part
    return matrix


def test_refining_against_a_linear_programme(example):
    policy, blend, demote = (example("refining")[k] for k in ("policy", "blend", "demote"))
    p = np.linspace(0, 1, 201)
    left, weights = np.array([0.25, 0.4, 0.95]), np.array([0.5, 0.35, 0.15])
    step = discretised(p, 1 - (1 - p[:, None]) * left, weights)

    class S:
        purity = p

    stop = np.minimum(np.where(p >= 0.7, blend(S), np.inf), demote(S))
    # The largest J with J <= stop and J <= charge + P J.
    found = optimize.linprog(
        -np.ones(p.size), A_ub=np.eye(p.size) - step, b_ub=np.full(p.size, example("refining")["RECYCLE"]),
        bounds=[(None, s) for s in stop],
    )  # fmt: skip
    np.testing.assert_allclose(policy.table.value[0, 0], found.x, atol=1e-8)


def test_refining_uses_all_its_actions_in_order(example):
    names = list(dict.fromkeys(example("refining")["policy"].action(purity=np.linspace(0, 1, 401)).name))
    assert names == ["demote", "recycle", "blend"]


def no_wear(s, c):
    return (s.dullness + 0.0 * c.force,)


def test_without_wear_every_dullness_is_a_bead_of_its_own(example):
    cut, whole = (
        example("wheel_dullness")["cut"],
        example("wheel_dullness")["problem"](no_wear, height=41, dullness=3),
    )
    forces = {"force": sdp.Levels(0.0, 50.0, 33, search=False)}
    whole = replace(whole, moves=[replace(whole.moves[0], controls=forces), whole.moves[1]])
    both = sdp.plan(whole)
    for k, dullness in enumerate((0.0, 0.5, 1.0)):
        sharp = sdp.Shift("height", lambda s, c, d=dullness: cut(type("S", (), {"dullness": d}), c))
        grind = sdp.Move("grind", forces, sharp, duration=2)
        alone = sdp.plan(sdp.Problem(whole.axes[:1], [grind], whole.stops, whole.stages))
        value = both.table.value[:, 0].reshape(13, 41, 3)[:, :, k]
        if dullness == 0.0:  # nothing to gain from dressing
            np.testing.assert_allclose(value, alone.table.value[:, 0], atol=1e-12)
        else:
            assert np.all(value <= alone.table.value[:, 0] + 1e-12)
            assert np.any(value < alone.table.value[:, 0] - 1e-3)


def test_dullness_by_monte_carlo_and_by_its_distribution(example):
    policy = example("wheel_dullness")["policy"]
    start = {"height": 1.3, "dullness": 0.45, "time_left": 24.0}
    runs = policy.simulate(runs=20_000, rng=3, snap=True, **start)
    outcome = policy.distribution(**start)
    assert abs(runs.mean - policy.value(**start)) < 3.5 * runs.standard_error
    assert outcome.total == pytest.approx(1, abs=1e-12)
    assert outcome.mean == pytest.approx(policy.value(**start), abs=policy.table.search_error)


def test_canonical_centering_problem(example):
    policy = example("centering")["policy"]
    assert policy.value(offset=2.0) == pytest.approx(5.68501, abs=1e-5)
    assert policy.value(offset=0.2) == pytest.approx(3.95824, abs=1e-5)


def test_centering_by_value_iteration_and_by_a_linear_solve(example):
    policy = example("centering")["policy"]
    z = np.geomspace(0.0025, 3.0, 121)
    eta, theta = np.array([-0.12, -0.04, 0.04, 0.12]), np.array([-0.03, 0.0, 0.03])
    weight = np.outer(np.full(4, 0.25), [0.25, 0.5, 0.25]).ravel()
    steps = []
    for aim in np.linspace(0.7, 1.1, 21):
        travel = aim * z[:, None, None] * (1 + eta[:, None])
        after = np.sqrt(
            z[:, None, None] ** 2 + travel**2 - 2 * z[:, None, None] * travel * np.cos(theta)
        ).reshape(121, 12)
        inside = after > 0.0025
        matrix = discretised(np.log(z), np.log(np.maximum(after, 0.0025)), weight)
        # at and below the tolerance nothing is left to do: not the value of the first node
        for row in range(121):
            matrix[row, 0] -= weight[~inside[row]].sum()
        steps.append(matrix)
    value = np.zeros(121)
    for _ in range(400):
        costs = np.array([2 + m @ value for m in steps])
        value = costs.min(axis=0)
    np.testing.assert_allclose(policy.table.value[0, 0], value, atol=1e-8)
    best = np.array(steps)[costs.argmin(axis=0), np.arange(121)]
    np.testing.assert_allclose(
        spsolve(sparse.csc_array(np.eye(121) - best), np.full(121, 2.0)), value, atol=1e-8
    )


def test_centering_by_monte_carlo(example):
    policy = example("centering")["policy"]
    runs = policy.simulate(offset=2.0, runs=40_000, rng=5)
    # The published 5.683 +- 0.018 s is that of the continuous offset; the table's own process is within its
    # errors.
    assert runs.mean == pytest.approx(5.683, abs=3.5 * np.hypot(0.018, runs.standard_error))
    snapped = policy.simulate(offset=2.0, runs=40_000, rng=6, snap=True)
    assert abs(snapped.mean - policy.value(offset=2.0)) < 3.5 * snapped.standard_error


def test_forty_lines_of_numpy_agree_with_the_library(example):
    difference = example("from_nothing")["difference"]
    # 199 levels without search cost up to 1e-4 $; and never less than the least.
    assert difference.min() > -1e-12 and difference.max() < 2e-4
    assert example("from_nothing")["exact"].value(1.0, 24.0) == pytest.approx(0.070643, abs=1e-4)


def test_p1_one_pass_by_quadrature_of_the_density():
    # The last pass at 6 s: expected charge of stopping afterwards, minimised over the force by scipy.
    problem = weldbead.preset("P1")
    policy = weldbead.plan(problem, tolerance=None, nodes=401)
    low, high = problem.force_interval(6.0)

    def cost(force, x):
        law = problem.cut(6.0, force)
        q = float(law.sd) / np.sqrt(2 - np.pi / 2)
        start = float(law.mean) - q * np.sqrt(np.pi / 2)

        def charge(d):
            return (
                (2 * max(x - d, 0) + 10 * max(d - x, 0))
                * (d - start)
                / q**2
                * np.exp(-((d - start) ** 2) / (2 * q * q))
            )

        return sum(integrate.quad(charge, a, b, epsabs=1e-11)[0] for a, b in ((start, x), (x, start + 9 * q)))

    for x in (0.1, 0.25):
        found = optimize.minimize_scalar(
            lambda f, x=x: cost(f, x), bounds=(low + 4, high), options={"xatol": 1e-7}
        )
        assert policy.value(x, 6.0) == pytest.approx(found.fun, abs=1e-6)
