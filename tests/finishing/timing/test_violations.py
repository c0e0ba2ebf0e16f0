"""The check between points: against dense sampling, and with limits that are known to be exceeded."""

import numpy as np
import pytest
from finishing_inside import closest, double_s_law
from timing_paths import ARM, SMOOTH, TABLE, dense, ellipse, line, wavy

from sdpgrind.finishing.timing import JointLimits, JointPath, TimeLaw, Trapezoid, time_laws, worst_violation


@pytest.mark.parametrize("seed", range(4))
def test_ratios_are_those_of_dense_sampling(seed):
    run = wavy(seed)
    law = double_s_law(0.0, Trapezoid(30.0, 60.0, 800.0), 2e4)
    ratios = closest(run, law, SMOOTH, 50.0, 20)[:, 0]
    # an equal grid misses a peak by up to the square of its step; the check is never below it by more
    assert np.allclose(ratios, dense(run, law, SMOOTH, 50.0), rtol=2e-3)
    assert np.all(ratios >= np.array(dense(run, law, SMOOTH, 50.0)) * (1 - 1e-5))


def test_the_place_between_points_is_found():
    """Table on an ellipse at constant feed: X is fastest half way, where the tangent points along it, between
    any samples.
    """
    run = ellipse(samples=400)
    law = TimeLaw([0.0, run.span / 50.0], [0.0], [50.0], [0.0], [0.0])
    worst = worst_violation(
        [run],
        [law],
        limits=TABLE.replace(speed_max=(40.0, 200.0), acceleration_max=(1e6, 1e6)),
        feed_rate=100.0,
        refine=1,
    )
    assert (worst.quantity, worst.joint, worst.run) == ("speed", "X", 0)
    assert worst.ratio == pytest.approx(50.0 / 40.0, rel=1e-6)
    assert worst.length == pytest.approx(run.span / 2, rel=1e-2)
    assert not worst.held


@pytest.mark.parametrize(
    ("quantity", "limits", "feed_rate", "ratio"),
    [
        ("speed", {"speed_max": (20.0,)}, 100.0, 1.25),
        ("acceleration", {"acceleration_max": (400.0,)}, 100.0, 1.25),
        ("jerk", {"jerk_max": (1.6e4,)}, 100.0, 1.25),
        ("feed", {}, 20.0, 1.25),
    ],
)
def test_each_quantity_is_named(quantity, limits, feed_rate, ratio):
    law = double_s_law(0.0, Trapezoid(10.0, 25.0, 500.0), 2e4)
    free = JointLimits(("X",), speed_max=(1e3,), acceleration_max=(1e6,), jerk_max=(1e9,)).replace(**limits)
    worst = worst_violation([line(10.0)], [law], limits=free, feed_rate=feed_rate)
    assert worst.quantity == quantity
    assert worst.ratio == pytest.approx(ratio, rel=1e-9)
    assert worst.joint == ("" if quantity == "feed" else "X")


def test_the_run_is_named_and_told():
    fast = TimeLaw([0.0, 1.0], [0.0], [0.0], [20.0], [0.0])
    slow = TimeLaw([0.0, 2.0], [0.0], [0.0], [5.0], [0.0])
    worst = worst_violation([line(10.0)] * 3, [slow, fast, slow], limits=LIMITS, feed_rate=100.0)
    assert (worst.run, worst.joint) == (1, "X")
    assert str(worst) == "speed of X at 200 % of its limit in run 1 at 10 mm, 1 s"


LIMITS = JointLimits(("X",), speed_max=(10.0,), acceleration_max=(1e3,))


@pytest.mark.parametrize("limits", [ARM, SMOOTH])
def test_every_method_holds_every_limit(limits):
    runs = [JointPath(run.length[:25], run.joints[:25]) for run in (wavy(11), wavy(12))]
    for method in ("trapezoid", "min_time"):
        laws = time_laws(runs, limits, feed_rate=200.0, method=method)
        assert worst_violation(runs, laws, limits=limits, feed_rate=200.0).ratio <= 1 + 1e-6


def test_the_greatest_share_is_looked_for_between_the_places():
    """The slope is 1 at 3.3 mm only; the nearest of four places shows 1.3 % less."""
    length = np.linspace(0.0, 10.0, 6)
    run = JointPath(length, (length - (length - 3.3) ** 3 / 150.0)[:, None])
    limits = JointLimits(["X"], speed_max=[10.0], acceleration_max=[1e6])
    law = TimeLaw([0.0, 1.0], [0.0], [10.0], [0.0], [0.0])
    found = worst_violation([run], [law], limits=limits, feed_rate=1e3, refine=2)
    assert found.ratio == pytest.approx(1.0, abs=1e-3) and found.length == pytest.approx(3.3, abs=0.15)
