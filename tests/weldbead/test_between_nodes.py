"""What look-ups say between two nodes, and whether the estimated error covers it, off the canonical problems."""

import numpy as np
import pytest

from sdpgrind import weldbead

P1 = weldbead.preset("P1")


def like_p1(idle_power, relative_sd, durations, horizon, *, attribution="C1", law="rayleigh", **changes):
    """P1 with another process, up to 1 mm."""
    changes |= {"scatter": weldbead.Scatter(attribution, relative_sd, law=law), "durations": durations, "horizon": horizon}
    return P1.replace(model=P1.model.replace(idle_power=idle_power), height_max=1.0, **changes)


def values(policy, height):
    """Expected penalty [row of the table, mode, height], all stages of the table."""
    table = policy.table
    rows, modes, _ = table.table.value.shape
    row, mode, k = (x.ravel() for x in np.indices((rows, modes, height.size)))
    return table.interpolated(row, mode, table.grid.index(0, height)[None, k]).reshape(rows, modes, height.size)


# Kinks where the force leaves the scaled for the translated law ------------------------------------------------------


@pytest.mark.parametrize(("idle_power", "relative_sd"), [(43.5, 0.099), (11.7, 0.099), (31.8, 0.074)])
def test_a_change_of_the_law_inside_a_cell_is_no_chord(idle_power, relative_sd):
    problem = like_p1(idle_power, relative_sd, (12, 20), 12.0)
    coarse, fine = (weldbead.plan(problem, tolerance=None, nodes=n) for n in (401, 3201))
    break_ = problem.force_breaks(12)[0]
    best, force = coarse.table.table.best[6, 0], coarse.table.table.control[6, 0]
    across = np.flatnonzero((best[:-1] >= 0) & (force[:-1] < break_) & (force[1:] > break_))
    assert across.size
    cell = int(across[0])
    height = (cell + np.arange(1, 8) / 8) / 400
    true, found = (values(p, height)[6, 0] for p in (fine, coarse))
    ends = values(coarse, np.array([cell, cell + 1]) / 400)[6, 0]
    chord = ends[0] + (height * 400 - cell) * np.diff(ends)
    assert np.max(true - chord) > 1e-4  # a line between the nodes lies too low: the least of two costs has a concave kink
    assert np.max(np.abs(found - true)) < 0.4 * np.max(true - chord)
