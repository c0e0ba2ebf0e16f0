"""Density of the friction scale: what is believed before a push, its lower end, forgetting."""

import numpy as np
import pytest
from push_inside import FRICTION_SCALES, FrictionScaleBelief, lower_end, moments, prior, widened

from centering import preset

PROBLEM = preset("printed")
WIDE = PROBLEM.replace(friction_range=(0.6, 1.4))


def drawn(problem, size=400_000):
    """Friction of parts: told with its scatter, a tenth of them by a factor of the range."""
    rng = np.random.default_rng(5)
    factor = np.where(rng.random(size) < 0.1, np.exp(rng.uniform(*np.log(problem.friction_range), size)), 1.0)
    return factor * (1.0 + problem.scatter.friction_part_sd * rng.standard_normal(size))


@pytest.mark.parametrize("problem", [PROBLEM, WIDE])
def test_what_is_believed_at_first_against_drawn_parts(problem):
    weights, parts = prior(problem, 1.0, 0.0), drawn(problem)
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    mean, sd = moments(weights)
    assert mean == pytest.approx(parts.mean(), abs=2e-3)  # a part of a thousand has any friction: 5e-4
    middle = 0.5 * np.diff(np.quantile(parts, (0.1587, 0.8413)))[0]
    assert sd == pytest.approx(middle, rel=0.03)  # 0.5 % from the nodes, as much from those
    for edge in (0.75, 0.9, 1.1, 1.3):
        inside = weights[edge > FRICTION_SCALES].sum()
        assert inside == pytest.approx(np.mean(parts < edge), abs=0.06)  # half a node at its greatest density


def test_with_evidence_the_range_is_no_longer_asked():
    weights = prior(WIDE, 1.1, 4.0)
    mean, sd = moments(weights)
    assert mean == pytest.approx(1.1, abs=2e-3)
    assert weights[FRICTION_SCALES < 0.9].sum() < 1e-3
    assert sd == pytest.approx(FrictionScaleBelief.of(WIDE.scatter).sd(4.0), rel=0.1)  # the nodes add 3 %


def test_parts_without_scatter_lie_where_they_are_told():
    still = WIDE.replace(friction_part_sd=0.0)
    assert prior(still, 1.0, 0.0)[np.argmin(np.abs(FRICTION_SCALES - 1.0))] > 0.9
    assert prior(still, 1.0, 0.0)[FRICTION_SCALES < 0.9].sum() > 0.03  # the range is believed all the same
    assert moments(prior(still, 1.0, 0.0))[1] < 0.02  # a node


def test_the_lower_end_against_drawn_pushes():
    weights = np.exp(-0.5 * ((FRICTION_SCALES - 1.1) / 0.06) ** 2) * np.gradient(FRICTION_SCALES)
    rng = np.random.default_rng(1)
    pushes = (1.1 + 0.06 * rng.standard_normal(10**6)) * (1.0 + 0.04 * rng.standard_normal(10**6))
    low = lower_end(weights / weights.sum(), 0.04)
    assert np.mean(pushes < low) == pytest.approx(1e-3, rel=0.25)  # drawn: 3 %; the nodes widen it


def test_forgetting_keeps_the_mean_and_gives_up_evidence():
    weights = np.exp(-0.5 * ((FRICTION_SCALES - 1.0) / 0.05) ** 2)
    mean, sd = moments(widened(weights / weights.sum(), 0.25))
    assert mean == pytest.approx(1.0, abs=1e-3)  # the nodes lie wider above 1
    assert sd == pytest.approx(2.0 * 0.05, rel=0.02)
    assert widened(weights / weights.sum(), 1.0) == pytest.approx(weights / weights.sum())
