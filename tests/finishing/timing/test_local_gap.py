"""The local gap of a law: no less than what laws with two to six times the nodes save, whatever made the law."""

import math
from functools import cache

import numpy as np
import pytest
from finishing_inside import LimitedRun, fastest_law, jerk_limited
from timing_paths import SMOOTH, line, part, wavy

from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing.timing import JointLimits, time_laws

JERKY = SMOOTH.replace(jerk_max=(80.0,) * 5 + (2e4,) * 2)
RUNS = {
    "short": (part(wavy(1), 8.0, 9.6), SMOOTH, 25.0),
    "smooth": (wavy(1), SMOOTH, 25.0),
    "jerky": (wavy(20, 60.0, 121), JERKY, 100.0),
    "stiff": (wavy(129714, 11.148), SMOOTH.replace(jerk_max=(4000.0,) * 5 + (1e6,) * 2), 115.871),
    "fast": (wavy(5), SMOOTH, 200.0),
}


def law_of(run, limits, feed, **options):
    return time_laws([run], limits, feed_rate=feed, method="min_time", **options)[0]


@cache
def with_gap(name):
    return law_of(*RUNS[name], gap=True)


def finer(monkeypatch, given, times):
    """Law by interior points with so many times the nodes."""
    with monkeypatch.context() as changed:
        changed.setattr(jerk_limited, "FINE", jerk_limited.FINE / times)
        for name in ("LEAST", "MOST"):
            changed.setattr(jerk_limited, name, times * getattr(jerk_limited, name))
        turn = 2 * float(np.max(given.limits.table[1] / given.limits.table[2]))
        law = jerk_limited._by_nodes(given, fastest_law(given, gain=jerk_limited.COARSE), turn)
        return jerk_limited.within(given, law)


@pytest.mark.parametrize("name", RUNS)
def test_it_is_no_less_than_what_finer_laws_save(name, monkeypatch):
    """And no more than 1 % of the time; on the stiff one changes fall by less than a half at each halving."""
    run, limits, feed = RUNS[name]
    law = with_gap(name)
    times = {"short": 4, "stiff": 6}.get(name, 2)
    best = finer(monkeypatch, LimitedRun(run, limits, feed), times).duration
    assert law.duration - best <= law.gap * law.duration <= 0.01 * law.duration
    assert f"local gap={law.gap:.3g}"[:14] in repr(law)


@pytest.mark.parametrize("name", ["short", "smooth"])
def test_a_law_is_the_same_without_its_gap(name):
    """By one program and by nodes."""
    law = law_of(*RUNS[name])
    assert law.gap == math.inf and law == with_gap(name).replace(gap=math.inf)


def test_a_law_that_is_slowed_has_a_gap_that_says_so():
    """A tenth slower: a tenth of the time more to save; the fastest one may take as long as before."""
    law = with_gap("short")
    slow = law.slower(1.1)
    assert slow.duration * (1 - slow.gap) == pytest.approx(law.duration * (1 - law.gap))
    assert slow.gap > 0.09 and decode(encode(slow)) == slow


def test_where_it_is_known_and_where_not():
    limits = JointLimits(["X"], speed_max=[25.0], acceleration_max=[500.0], jerk_max=[2e4])
    assert law_of(line(2.0), limits, 20.0, gap=True).gap == 0.0  # seven pieces are the fastest law
    law = law_of(line(2.0), limits, 20.0)
    assert law.gap == math.inf == law.slower(2.0).gap and decode(encode(law)) == law
    for method, given in (("trapezoid", limits), ("min_time", limits.replace(jerk_max=None))):
        with pytest.raises(
            ValueError, match="gap must be False but for method='min_time' with limits of jerk"
        ):
            time_laws([line(2.0)], given, feed_rate=20.0, method=method, gap=True)
    with pytest.raises(TypeError, match="gap must be"):
        law_of(line(2.0), limits, 20.0, gap=1)
    with pytest.raises(ValueError, match="gap must be >= 0, or inf where it is not known"):
        law.replace(gap=math.nan)
