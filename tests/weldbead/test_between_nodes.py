"""Look-ups between two nodes, and their estimated error, off the canonical problems."""

from functools import cache

import numpy as np
import pytest
from bead_plans import fine, solved

from sdpgrind import sdp, weldbead

P1, P5 = weldbead.preset("P1"), weldbead.preset("P5")


def like_p1(idle_power, relative_sd, durations, horizon, *, attribution="C1", law="rayleigh", **changes):
    """P1 with another process, up to 1 mm."""
    changes |= {
        "scatter": weldbead.Scatter(attribution, relative_sd, law=law),
        "durations": durations,
        "horizon": horizon,
    }
    return P1.replace(model=P1.model.replace(idle_power=idle_power), height_max=1.0, **changes)


def values(policy, height):
    """Expected penalty [row of the table, mode, height], all stages of the table."""
    table = policy.table
    rows, modes, _ = table.table.value.shape
    row, mode, k = (x.ravel() for x in np.indices((rows, modes, height.size)))
    return table.interpolated(row, mode, table.grid.index(0, height)[None, k]).reshape(
        rows, modes, height.size
    )


FINISH = {"finish_charge": weldbead.FinishCharge(0.35, reference_rate=12.5)}
LATE = {"lateness_charge": sdp.Linear(0.25)}
SQUARES = {"height_charge": sdp.Charge(under=sdp.Linear(2.0), over=sdp.Quadratic(20.0))}
BOWL = {"height_charge": sdp.Charge(under=sdp.Quadratic(4.0), over=sdp.Linear(8.1))}
MANY = {  # idle power (W), relative sd, durations (s), horizon (s); and the tolerance ($)
    "few watts": (like_p1(5.0, 0.1, (6,), 30.0), 2e-3),
    "break": (like_p1(43.5, 0.099, (12, 20), 20.0), 2e-4),
    "break in the first cells": (like_p1(11.7, 0.099, (12, 20), 12.0), 2e-3),
    "many durations": (like_p1(31.8, 0.074, range(6, 21, 2), 20.0), 2e-3),
    "nothing at first": (like_p1(62.9, 0.098, (6, 8), 30.0, **SQUARES), 5e-4),
    "finish": (like_p1(2.6, 0.242, (6, 8), 20.0, law="lognormal", **FINISH, **SQUARES), 5e-4),
    "finish, late": (
        like_p1(2.9, 0.266, (6, 8), 20.0, attribution="K1", law="normal", **FINISH, **LATE),
        5e-4,
    ),
    "finish, K2": (like_p1(40.0, 0.15, (8, 14), 20.0, attribution="K2", **FINISH), 2e-3),
    "late": (like_p1(125.4, 0.118, (6, 12, 20), 20.0, attribution="K2", **LATE), 5e-4),
    "K1": (like_p1(69.9, 0.07, (8, 14), 12.0, attribution="K1"), 2e-3),
    "lognormal": (like_p1(14.2, 0.118, (6,), 30.0, law="lognormal", **LATE, **BOWL), 2e-4),
    "passes of nothing": (like_p1(100.0, 0.2, (6,), 40.0, law="lognormal"), 1e-3),
    "narrow": (like_p1(120.0, 0.05, (6, 8), 20.0), 5e-4),
    "wide": (like_p1(71.6, 0.3, (6, 12, 20), 20.0), 5e-4),
}


@pytest.mark.parametrize("name", MANY)
def test_the_estimated_error_covers_the_error_everywhere(name):
    """At nodes and between them, in every stage and mode, against a grid at least four times as fine."""
    problem, tolerance = MANY[name]
    policy = weldbead.plan(problem, tolerance=tolerance)
    cells = policy.table.grid.size - 1
    reference = sdp.plan(weldbead.sequence.sdp_problem(problem, 4 * max(cells, 400) + 1, levels=801))
    true = np.max(np.abs(values(policy, reference.grid.points[0]) - reference.table.value))
    assert true <= policy.error <= tolerance


@pytest.mark.parametrize("name", ["few watts", "break", "finish, late", "lognormal", "many durations"])
def test_the_error_of_the_search_is_covered_by_its_estimate(name):
    problem = MANY[name][0]
    policy, dense = (sdp.plan(weldbead.sequence.sdp_problem(problem, 101, levels=n)) for n in (401, 6401))
    assert dense.table.search_error < 0.05 * policy.table.search_error
    assert np.max(np.abs(policy.table.value - dense.table.value)) <= policy.table.search_error


# Kinks where the force leaves the scaled for the translated law


@pytest.mark.parametrize(("idle_power", "relative_sd"), [(43.5, 0.099), (11.7, 0.099), (31.8, 0.074)])
def test_a_change_of_the_law_inside_a_cell_is_no_chord(idle_power, relative_sd):
    problem = like_p1(idle_power, relative_sd, (12, 20), 12.0)
    coarse, exact = (solved(problem, n) for n in (401, 3201))
    break_ = problem.force_breaks(12)[0]
    best, force = coarse.table.table.best[6, 0], coarse.table.table.control[6, 0]
    across = np.flatnonzero((best[:-1] >= 0) & (force[:-1] < break_) & (force[1:] > break_))
    assert across.size
    cell = int(across[0])
    height = (cell + np.arange(1, 8) / 8) / 400
    true, found = (values(p, height)[6, 0] for p in (exact, coarse))
    ends = values(coarse, np.array([cell, cell + 1]) / 400)[6, 0]
    chord = ends[0] + (height * 400 - cell) * np.diff(ends)
    # a line between the nodes lies too low: the least of two costs has a concave kink
    assert np.max(true - chord) > 1e-4
    assert np.max(np.abs(found - true)) < 0.4 * np.max(true - chord)


@cache
def coarse_p1():
    return solved(P1, 101)


@pytest.mark.parametrize("time", [10.0, 16.0, 30.0])
def test_the_gap_vanishes_where_the_action_changes(time):
    """At a node the next best action lies a gap above; where two actions cost the same inside a cell there is
    none.
    """
    coarse = coarse_p1()
    height = np.linspace(0.05, 2.0, 30_001)
    found, true = (p.action(height, time).gap for p in (coarse, fine("P1")))
    assert np.all(found >= 0)
    chosen = coarse.action(height, time).duration
    changes = np.flatnonzero(np.diff(chosen))
    assert changes.size
    step = np.maximum(found[changes], found[changes + 1])
    nodes = np.interp(
        height[changes], coarse.table.grid.points[0], coarse.table.table.gap[round(time / 2), 0]
    )
    # the gaps of the nodes, read between them, are far off
    assert step.max() < 1e-4 and nodes.max() > 10 * step.max()
    for k in changes:
        assert coarse.action(float(height[k]), time).gap == pytest.approx(found[k], abs=1e-12)
    assert np.max(np.abs(found - true)) < 0.02


@pytest.mark.parametrize("nodes", [801, 333])
def test_what_stopping_is_charged_is_no_chord(nodes):
    """A charge that jumps at 0.1 mm, a node of one grid and none of the other; with too little time left one
    stops.
    """
    jump = sdp.Charge(under=sdp.Constant(1.0, tolerance=0.1), over=sdp.Linear(10.0))
    policy = weldbead.plan(P1.replace(height_charge=jump, horizon=12.0), tolerance=None, nodes=nodes)
    height = np.array([0.0985, 0.099, 0.09999, 0.1, 0.10001, 0.101])
    np.testing.assert_array_equal(policy.value(height, 4.0), height >= 0.1)
    assert [policy.value(float(x), 4.0) for x in height] == list(height >= 0.1)
    at_last = policy.action(height, 12.0)
    np.testing.assert_array_equal(at_last.stop, height < 0.1)
    assert [policy.action(float(x), 12.0).stop for x in height] == list(height < 0.1)
    assert np.all(policy.value(height, 12.0) < 1e-3)


def test_stopping_late_is_charged_exactly_between_nodes():
    policy = weldbead.plan(weldbead.preset("P5"), tolerance=None, nodes=21)
    for time in (-6.0, -400.0, 0.0):
        found = policy.value(np.array([0.013, 0.047]), time)
        late = float(P5.lateness_charge(max(-time, 0.0)))
        np.testing.assert_allclose(found, P5.height_charge(np.array([0.013, 0.047])) + late, rtol=1e-12)
        assert policy.value(0.047, time) == pytest.approx(found[1], rel=1e-12)


def test_a_pass_that_only_waits_keeps_the_kink_of_the_stage_after_it():
    """At the threshold force nothing is removed: the next stage is looked up, whose kink lies in a cell."""
    problem = P1.replace(
        scatter=weldbead.Scatter("C1", 0.15, law="lognormal"), durations=(12,), stage=12.0, horizon=48.0
    )
    coarse, exact = (solved(problem, n) for n in (401, 3201))
    heights, time = np.linspace(0.0, 0.1, 1601), np.arange(0.0, 49.0, 12.0)[:, None]
    difference = np.abs(coarse.value(heights, time) - exact.value(heights, time))
    assert difference.max() < 3e-4  # as at the nodes; 1e-3 with straight lines from node to node
