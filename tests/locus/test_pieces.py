"""Pieces as tables: number of points, names, contents."""

import numpy as np
import pytest
from hard_problems import PROBLEMS
from locus_inside import pieces as _pieces

from sdpgrind import locus


@pytest.mark.parametrize(
    ("held", "kind"),
    [((0, 0, 0), "interior"), ((0, 0, 1), "locus"), ((0, -1, 1), "bound"), ((1, 1, 0), "bound")],
)
def test_names_of_sets(held, kind):
    assert _pieces.kind_of(np.array(held), 2) == kind


def test_as_many_active_as_controls_is_a_vertex():
    assert _pieces.kind_of(np.array([0, 0, 1, 1]), 2) == "vertex"


@pytest.mark.parametrize("points", [20, 200, 1000])
def test_about_as_many_points_as_asked_for(points):
    curve = locus.plan(PROBLEMS["bounds"], points=points)
    assert sum(len(piece.table.hidden) for piece in curve.pieces) == pytest.approx(
        points, abs=2 * len(curve.pieces)
    )
    assert all(len(piece.table.hidden) >= 2 for piece in curve.pieces)


@pytest.mark.parametrize("name", ["koren", "bounds", "swap", "four-controls"])
def test_multipliers_are_slopes_of_the_least_cost(name):
    """By the envelope theorem: d cost/dx = phi_x + sum of multipliers times d(response - limit)/dx."""
    curve = locus.plan(PROBLEMS[name], points=400)
    for piece in curve.best:
        table = piece.table
        k = len(table.hidden) // 2
        x, z = table.hidden[k], table.controls[k]
        step = 1e-5 * (piece.range[1] - piece.range[0])
        costs = [curve.at(**{curve.hidden_name: x + side}).cost for side in (-step, step)]
        values = [curve.system.values(z, [x + side]) for side in (-step, step)]
        lagrangian = [cost + table.multipliers[k] @ (response - limit) for cost, response, limit in values]
        size = 1e-6 * curve.system.cost_scale
        assert (costs[1] - costs[0]) / (2 * step) == pytest.approx(
            (lagrangian[1] - lagrangian[0]) / (2 * step), rel=1e-5, abs=size
        )


def test_bound_multipliers_are_what_a_bound_costs():
    wide = locus.plan(PROBLEMS["bounds"]).at(x=1.2)
    assert wide.kind == "bound"
    piece = next(p for p in locus.plan(PROBLEMS["bounds"]).best if p.range[0] <= 1.2 <= p.range[1])
    pull = np.interp(1.2, piece.table.hidden, piece.table.bound_multipliers[:, 0])
    controls = dict(PROBLEMS["bounds"].controls)
    costs = [
        locus.plan(PROBLEMS["bounds"].replace(controls=controls | {"u": (0.2, 1.5 + d)})).at(x=1.2).cost
        for d in (-1e-4, 1e-4)
    ]
    assert (costs[0] - costs[1]) / 2e-4 == pytest.approx(pull, rel=1e-3)


def test_where_feasibility_ends_multipliers_have_no_limit():
    curve = locus.plan(PROBLEMS["end"])
    multipliers = curve.best[-1].table.multipliers[:, 0]
    assert np.all(multipliers >= 0)
    assert np.all(np.diff(multipliers[-30:]) > 0)
    assert multipliers[-1] > 1e5
