"""The convex design: limits hold on a finer grid, and no law of another kind does better."""

import numpy as np
import pytest

from sdpgrind.control import Law, QLimits, Sampled, loop_margins, q_design, sampled

PLANT = sampled([1.0], [0.1, 1.0], 0.05).delayed(1)


@pytest.fixture(scope="module")
def found():
    return q_design(PLANT, QLimits(1.8, 1.3), taps=20)


def test_limits_hold_between_the_points_of_the_design(found):
    filter, bandwidth = found
    w = np.linspace(1e-3, np.pi / 0.05, 20_001)
    T = PLANT.response(w) * filter.response(w)
    assert np.abs(1 - T).max() <= 1.8 * 1.001
    assert np.abs(T).max() <= 1.3 * 1.001
    slope = 0.5**0.5 * w / bandwidth
    assert np.all(np.abs(1 - T)[w <= bandwidth] <= slope[w <= bandwidth] * 1.002)
    assert filter.dc_gain == pytest.approx(1.0, abs=1e-6)


def test_it_closes_a_stable_loop_with_that_bandwidth(found):
    filter, bandwidth = found
    m = loop_margins(Law.internal_model(PLANT, filter).system.then(PLANT))
    assert m.stable
    assert m.bandwidth == pytest.approx(bandwidth, rel=5e-3)


def test_no_integral_law_is_better(found):
    best = 0.0
    for gain in np.linspace(0.01, 1.0, 100):
        for lead in np.linspace(0.0, 0.95, 20):
            law = Sampled([[1.0]], [gain * (1 - lead)], [1.0], gain, 0.05)
            m = loop_margins_fast(law.then(PLANT))
            best = max(best, m)
    assert 0.3 * found[1] < best <= found[1] * 1.005


def loop_margins_fast(loop):
    """Slope-limited bandwidth where the limits hold, else 0."""
    w = np.linspace(0.02, np.pi / 0.05, 400)
    L = loop.response(w)
    S, T = np.abs(1 / (1 + L)), np.abs(L / (1 + L))
    if S.max() > 1.8 or T.max() > 1.3 or not loop.closed().stable:
        return 0.0
    reach = np.minimum.accumulate(0.5**0.5 * w / S)
    return float(w[np.argmax(w > reach)])


def test_weighted_limit_costs_bandwidth(found):
    w = np.linspace(20.0, 60.0, 80)
    limits = QLimits(1.8, 1.3, tuple(w), (1.0,) * 80, 0.3)
    filter, bandwidth = q_design(PLANT, limits, taps=20)
    assert np.abs(filter.response(w)).max() <= 0.3
    assert bandwidth < found[1]


def test_messages():
    with pytest.raises(ValueError, match=r"plant must be stable \(poles inside the unit circle\); got 1.1"):
        q_design(Sampled([[1.1]], [1.0], [1.0], 0.0, 1.0))
    with pytest.raises(ValueError, match=r"sensitivity_max must be > 1; got 0\.9"):
        QLimits(sensitivity_max=0.9)
    with pytest.raises(ValueError, match=r"weight must be as long as frequency \(1\); got 0"):
        QLimits(frequency=(1.0,))
    with pytest.raises(ValueError, match="limits leave no filter at all"):
        q_design(PLANT, QLimits(1.8, 1.3, (1e-3,), (1.0,), 0.5), taps=10)
