"""A hint where rounded corners make a trapezoid slow."""

import pytest

from hwsim.command._finishing.report import corner_lines
from sdpgrind import finishing

SHARP = finishing.hilbert(finishing.surface.flat_surface(6.4), 2, mapping="parametric")


def lines(path, method):
    return list(corner_lines(finishing.plan(finishing.FinishingProblem(path, feed_rate=25.0), method=method)))


def test_min_time_is_for_rounded_corners():
    """At 10 um a trapezoid goes as slowly as in the tightest corner; sharp ones need rest whatever the law."""
    (hint,) = lines(SHARP.blended(0.01), "trapezoid")
    assert hint.endswith('a greater deviation or method = "min_time" may be faster')


@pytest.mark.parametrize(
    ("path", "method"),
    [(SHARP, "trapezoid"), (SHARP.blended(0.01), "min_time"), (SHARP.blended(0.4), "trapezoid")],
)
def test_no_hint_where_there_is_no_gain(path, method):
    assert lines(path, method) == []
