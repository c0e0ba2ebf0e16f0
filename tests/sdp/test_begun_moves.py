"""Moves that no stage of the table leaves time for are neither tabulated nor evaluated without a tolerance."""

import numpy as np
from sdp_inside import Bundles, Grid

from sdpgrind import sdp


def problem(durations, count):
    moves = [
        sdp.Move(
            f"{k}", {"by": sdp.Levels(0, 2, 41)},
            sdp.Shift("height", lambda s, c: sdp.Rayleigh(c.by, 0.2 * c.by)), duration=k,
        )
        for k in durations
    ]  # fmt: skip
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    axis = sdp.Axis("height", 0.0, 2.0, 101, "mm", below="stop")
    return sdp.Problem([axis], moves, [stop], sdp.Stages(count, 1.0))


def test_moves_longer_than_the_horizon_have_no_tables():
    asked = problem((1, 3, 9), 5)
    bundle = Bundles(asked, Grid.of(asked), longest=5).alone()
    rows = bundle.row_at
    assert np.any(bundle.weight[:, rows[1] : rows[2]])
    assert not np.any(bundle.weight[:, rows[2] :])


def test_moves_that_begin_too_late_are_not_evaluated():
    asked = problem((1, 3, 9), 12)
    bundles, grid = Bundles(asked, Grid.of(asked), longest=12), Grid.of(asked)
    value, level = np.linspace(0.0, 4.0, grid.size)[None], np.zeros(1)
    ((every, all_found),) = bundles.best(value, level, 3, 12)
    ((some, found),) = bundles.best(value, level, 4, 12)
    assert (every, some) == ([0, 1, 2], [0, 1])
    assert np.array_equal(found.q, all_found.q[:2])
    assert not list(bundles.best(value, level, 12, 12))


def test_a_longer_move_changes_nothing_in_a_plan():
    long, short = sdp.plan(problem((1, 3, 9), 5)), sdp.plan(problem((1, 3), 5))
    assert np.allclose(long.table.value, short.table.value, rtol=0, atol=1e-13)
    assert np.array_equal(long.table.best, short.table.best)
