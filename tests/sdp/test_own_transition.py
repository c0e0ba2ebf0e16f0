"""A user's own transition: two methods, and everything works."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import sparse

from sdpgrind import sdp


@dataclass(frozen=True)
class Half:
    """Goes to ``share * x``, surely: written against the protocol, with the matrix of linear interpolation."""

    def rows(self, menu, points, mode, stage, choice, level):
        after = menu.controls(choice, level).share * points[0]
        node, part = menu.grid.corners([menu.grid.index(0, after)])
        at = np.broadcast_to(np.arange(after.size), node.shape)
        matrix = sparse.csr_array(
            (part.ravel(), (at.ravel(), node.ravel())), shape=(after.size, menu.grid.size)
        )
        charge = np.broadcast_to(
            menu.penalty(menu.state(points, mode, stage), menu.controls(choice, level)), after.shape
        )
        return sdp.Rows(
            matrix,
            np.zeros(after.size, int) if mode is None else mode,
            charge.astype(float),
            np.zeros(after.size),
        )

    def sample(self, menu, points, mode, stage, choice, level, rng):
        return (menu.controls(choice, level).share * points[0],), 0.0


def problem(to, modes=("",)):
    move = sdp.Move(
        "go", {"share": sdp.Levels(0.25, 0.75, 33)}, to, charge=lambda s, c: 0.3 / c.share + 0.1 * s.x
    )
    return sdp.Problem(
        [sdp.Axis("x", 0.0, 8.0, 81)], [move], [sdp.Stop("stop", lambda s: s.x)], sdp.Stages(5, 1.0), modes
    )


@pytest.mark.parametrize("modes", [("",), ("a", "b")])
def test_own_transition_equals_the_same_sampled_step(modes):
    own = sdp.plan(problem(Half(), modes))
    sampled = sdp.plan(problem(sdp.Sampled(lambda s, c, e: (c.share * s.x,)), modes))
    np.testing.assert_allclose(own.table.value, sampled.table.value, rtol=1e-13)
    assert own.value(x=8.0, time_left=5) < own.value(x=8.0, time_left=1) < 8.0


def test_own_transition_is_simulated_spread_and_checked():
    policy = sdp.plan(problem(Half()))
    start = {"x": 8.0, "time_left": 5}
    runs = policy.simulate(runs=2000, snap=True, rng=0, **start)
    assert abs(runs.mean - policy.value(**start)) < 3.5 * runs.standard_error + policy.table.search_error * 5
    assert policy.distribution(**start).total == pytest.approx(1, abs=1e-12)
    assert sdp.check(replace(problem(Half()))).ok
