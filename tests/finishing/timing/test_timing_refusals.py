"""What is refused, and in which words."""

import sys

import numpy as np
import pytest
from timing_paths import LINE, SMOOTH, line, wavy

from sdpgrind.finishing.timing import (
    JointLimits,
    JointPath,
    TableLoop,
    TimeLaw,
    Trapezoid,
    time_laws,
    worst_violation,
)

LAW = time_laws([line(1.0)], LINE, feed_rate=10.0)[0]

REFUSED = {
    "length rises": (
        lambda: JointPath([0.0, 1.0, 1.0, 2.0], np.zeros((4, 1))),
        r"length must be rising: points 1 and 2 coincide or go back \(mm\); got \(1\.0, 1\.0\)",
    ),
    "length falls": (
        lambda: JointPath([0.0, 2.0, 1.0], np.zeros((3, 1))),
        r"length must be rising: points 1 and 2 coincide or go back \(mm\); got \(2\.0, 1\.0\)",
    ),
    "one sample": (
        lambda: JointPath([0.0], [[0.0]]),
        r"length must be of shape \(m,\) with m >= 2 \(mm\); got \(1,\)",
    ),
    "samples": (
        lambda: JointPath([0.0, 1.0], [[0.0]]),
        r"joints must be of shape \(2, n\), as many as lengths .*got \(1, 1\)",
    ),
    "no number": (
        lambda: JointPath([0.0, np.nan], [[0.0], [1.0]]),
        r"length\[1\] must be finite \(mm\); got nan",
    ),
    "joint no number": (
        lambda: JointPath([0.0, 1.0], [[0.0], [np.inf]]),
        r"joints\[1\] must be finite \(rad or mm\); got inf",
    ),
    "off the run": (lambda: line(1.0).at(1.5), r"length must be in \[0, 1\] \(mm\); got 1\.5"),
    "derivative": (lambda: line(1.0).at(0.5, derivative=4), r"derivative must be one of 0, 1, 2, 3; got 4"),
    "before the law": (lambda: LAW.at(-0.1), r"time must be in \[0, 0\.12\] \(s\); got -0\.1"),
    "after the law": (lambda: LAW.at(1.0), r"time must be in \[0, 0\.12\] \(s\); got 1\.0"),
    "feed": (
        lambda: time_laws([line(1.0)], LINE, feed_rate=0.0),
        r"feed_rate must be > 0 \(mm/s\); got 0\.0",
    ),
    "acceleration": (
        lambda: time_laws([line(1.0)], LINE, feed_rate=1.0, acceleration=-1.0),
        r"acceleration must be > 0 \(mm/s\^2\); got -1\.0",
    ),
    "method": (
        lambda: time_laws([line(1.0)], LINE, feed_rate=1.0, method="spline"),
        r"method must be one of trapezoid, toppra, min_time; got 'spline'",
    ),
    "joints": (
        lambda: time_laws([wavy(0)], LINE, feed_rate=1.0),
        r"runs\[0\] must be of the 1 joints X; got 7",
    ),
    "jerk by toppra": (
        lambda: time_laws([wavy(0)], SMOOTH, feed_rate=1.0, method="toppra"),
        r"limits\.jerk_max must be None for method='toppra', whose acceleration jumps",
    ),
    "trapezoid length": (lambda: Trapezoid(-1.0, 1.0, 1.0), r"length must be >= 0 \(mm\); got -1\.0"),
    "trapezoid speed": (lambda: Trapezoid(1.0, 0.0, 1.0), r"speed_max must be > 0 \(mm/s\); got 0\.0"),
    "trapezoid acceleration": (
        lambda: Trapezoid(1.0, 1.0, -2.0),
        r"acceleration must be > 0 \(mm/s\^2\); got -2\.0",
    ),
    "a copy of a trapezoid": (
        lambda: Trapezoid(1.0, 1.0, 2.0).replace(length=-5.0),
        r"length must be >= 0 \(mm\); got -5\.0",
    ),
    "pieces of a law": (
        lambda: TimeLaw([0.0, 1.0], [0.0, 1.0], [1.0], [0.0], [0.0]),
        r"length must be of shape \(1,\), a piece between each two knots \(mm\); got \(2,\)",
    ),
    "knots of a law": (
        lambda: TimeLaw([0.0], [], [], [], []),
        r"knots must be of shape \(k \+ 1,\) with k >= 1 \(s\); got \(1,\)",
    ),
    "begin of a law": (
        lambda: TimeLaw([1.0, 2.0], [0.0], [1.0], [0.0], [0.0]),
        r"knots\[0\] must be 0 \(s\); got 1\.0",
    ),
    "back in time": (
        lambda: TimeLaw([0.0, 2.0, 1.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]),
        r"knots must be rising: knots 1 and 2 go back \(s\); got \(2\.0, 1\.0\)",
    ),
    "a jump of length": (
        lambda: TimeLaw([0.0, 1.0, 2.0], [0.0, 5.0], [0.0, 1.0], [1.0, -1.0], [0.0, 0.0]),
        r"length\[1\] must be where piece 0 ends, at 0\.5 \(mm\); got 5\.0",
    ),
    "a jump of feed": (
        lambda: TimeLaw([0.0, 1.0, 2.0], [0.0, 0.5], [0.0, 3.0], [1.0, -1.0], [0.0, 0.0]),
        r"feed\[1\] must be where piece 0 ends, at 1 \(mm/s\); got 3\.0",
    ),
    "no number in a law": (
        lambda: TimeLaw([0.0, 1.0], [0.0], [np.nan], [0.0], [0.0]),
        r"feed\[0\] must be finite \(mm/s\); got nan",
    ),
    "a law faster than asked": (lambda: LAW.slower(0.5), r"factor must be >= 1; got 0\.5"),
    "limit": (
        lambda: LINE.replace(speed_max=(0.0,)),
        r"speed_max\[0\] must be > 0 \(rad/s or mm/s\); got 0\.0",
    ),
    "limits": (
        lambda: LINE.replace(jerk_max=(1.0, 2.0)),
        r"jerk_max must be one number for each of the 1 joints \(rad/s\^3 or mm/s\^3\); got \(1\.0, 2\.0\)",
    ),
    "names": (
        lambda: JointLimits(("X", "X"), speed_max=(1.0, 1.0), acceleration_max=(1.0, 1.0)),
        r"names must be without repeats; got 'X' twice",
    ),
    "laws": (
        lambda: worst_violation([line(1.0)], [], limits=LINE, feed_rate=1.0),
        r"laws must be one for each of the 1 runs \(at least one\); got 0",
    ),
    "refine": (
        lambda: worst_violation([line(1.0)], [LAW], limits=LINE, feed_rate=1.0, refine=0),
        r"refine must be >= 1; got 0",
    ),
    "unstable": (
        lambda: TableLoop(ki=3000.0),
        r"\(damping \+ torque_constant\*kd\)\*kp must be > inertia\*ki, else the loop is unstable; "
        r"its poles are -117\+0j, 6\.017\+79\.83j, ",
    ),
    "inertia": (lambda: TableLoop(inertia=0.0), r"inertia must be > 0 \(kg m\^2\); got 0\.0"),
    "integral gain": (lambda: TableLoop(ki=0.0), r"ki must be > 0 \(A/\(rad s\)\); got 0\.0"),
    "damping": (lambda: TableLoop(damping=-0.1), r"damping must be >= 0 \(N m s\); got -0\.1"),
    "period": (lambda: TableLoop().sampled(0.0), r"period must be > 0 \(s\); got 0\.0"),
    "frequency": (
        lambda: TableLoop().response([1.0, np.inf]),
        r"frequency\[1\] must be finite \(rad/s\); got inf",
    ),
    "command": (
        lambda: TableLoop().follow(np.zeros((2, 2)), 1e-3),
        r"command must be of shape \(m,\) with m >= 1 \(mm\); got \(2, 2\)",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_words(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=words):
        make()


def test_missing_toppra_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "toppra", None)
    with pytest.raises(ImportError, match=r"toppra is not installed: pip install 'sdpgrind\[toppra\]'"):
        time_laws([line(1.0)], LINE, feed_rate=1.0, method="toppra")


def test_no_law_by_toppra_is_told(monkeypatch):
    class Failing:
        def __init__(self, rules, path, gridpoints):
            pass

        def compute_parameterization(self, begin, end):
            return None, None, None

    monkeypatch.setattr("toppra.algorithm.TOPPRA", Failing)
    with pytest.raises(
        ValueError,
        match=r"run 0: toppra found no law between 0 and 1 mm; take method='min_time' or 'trapezoid'",
    ):
        time_laws([line(1.0)], LINE, feed_rate=1.0, method="toppra")
