"""A bead that cannot be ground away in time: what is left of it, and what would do."""

import re
import warnings

import pytest

from sdpgrind import sdp, weldbead

P1 = weldbead.preset("P1")


def told(problem):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        weldbead.plan(problem, tolerance=None, nodes=21)
    return [str(each.message) for each in found if "cannot be finished" in str(each.message)]


def depth_in(problem, time_left):
    """Greatest total of mean cuts, mm: every sequence of passes."""
    depths = [0.0]
    for duration in problem.durations:
        if duration <= time_left:
            feed, force = problem.feed_rate(duration), problem.force_interval(duration)[1]
            cut = float(problem.depths.moments(problem.model, force, feed)[0])
            depths.append(cut + depth_in(problem, time_left - duration))
    return max(depths)


def test_what_is_left_and_what_would_do():
    problem = P1.replace(horizon=20.0, durations=(6, 8, 10))
    (text,) = told(problem)
    left, time, force = map(float, re.findall(r"([\d.]+) (?:mm will|s or|N would)", text))
    assert text.startswith("a bead of 2 mm cannot be finished in 20 s")
    assert left == pytest.approx(2.0 - depth_in(problem, 20.0), abs=5e-3)
    assert depth_in(problem, time - 2.0) < 2.0 <= depth_in(problem, time)
    assert depth_in(problem.replace(force_max=0.999 * force), 20.0) < 2.0
    assert depth_in(problem.replace(force_max=1.001 * force), 20.0) > 2.0
    assert told(problem.replace(horizon=time)) == [] == told(problem.replace(force_max=1.001 * force))


def test_it_is_said_once_by_every_way_of_planning():
    small = P1.replace(horizon=6.0, durations=(6,))
    for options in ({}, {"tolerance": 1e-2}, {"tolerance": 1e-2, "feed": "continuous"}, {"time_limit": 60.0}):
        with pytest.warns(UserWarning, match="cannot be finished in 6 s: 1.66 mm") as found:
            weldbead.plan(small, **options)
        assert sum("cannot be finished" in str(each.message) for each in found) == 1
        assert found[0].filename == __file__


def test_late_passes_and_presets_are_no_such_case():
    for name in ("P1", "P2", "P3", "P4", "P5", "C0"):
        assert told(weldbead.preset(name)) == []
    assert told(P1.replace(horizon=6.0, lateness_charge=sdp.Linear(0.1))) == []
