"""Runs whose joints are known formulas, and limits for them."""

import numpy as np

from sdpgrind.finishing.timing import JointLimits, JointPath

ARM = JointLimits(
    ("q1", "q2", "q3", "q4", "q5", "X", "Y"),
    speed_max=(1.5,) * 5 + (200.0,) * 2,
    acceleration_max=(8.0,) * 5 + (2000.0,) * 2,
)
SMOOTH = ARM.replace(jerk_max=(400.0,) * 5 + (1e5,) * 2)
TABLE = JointLimits(("X", "Y"), speed_max=(200.0, 200.0), acceleration_max=(2000.0, 2000.0))
LINE = JointLimits(("X",), speed_max=(25.0,), acceleration_max=(500.0,))


def wavy(seed, span=30.0, samples=61):
    """Seven joints as sums of sines with random amplitudes and phases."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, span, samples)
    waves = [
        rng.normal(size=7) / k * np.sin(np.pi * k * s[:, None] / span + rng.uniform(0, 6, 7))
        for k in range(1, 5)
    ]
    return JointPath(s, sum(waves) * np.array([0.1] * 5 + [10.0] * 2))


def part(run, begin, end):
    """A part of a run, as a run of its own."""
    s = np.linspace(begin, end, 17)
    return JointPath(s, run.at(s))


def line(span, begin=0.0):
    """One joint that moves as far as the contact point."""
    return JointPath([begin, begin + span], [[0.0], [span]])


def ellipse(a=40.0, b=20.0, samples=401):
    """The table on half an ellipse, by arc length."""
    fine = np.linspace(0.0, np.pi, 40 * samples)
    xy = np.column_stack([a * np.cos(fine), b * np.sin(fine)])
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    s = np.linspace(0.0, length[-1], samples)
    angle = np.interp(s, length, fine)
    return JointPath(s, np.column_stack([a * np.cos(angle), b * np.sin(angle)]))


def sine(span=60.0, samples=201):
    """The table on a sine, by its abscissa."""
    s = np.linspace(0.0, span, samples)
    return JointPath(s, np.column_stack([s, 5.0 * np.sin(2 * np.pi * s / 30.0)]))


def dense(run, law, limits, feed_rate, count=20001):
    """Greatest shares of speed, acceleration, jerk, feed at many equal times: the obvious twin of the
    compiled check.
    """
    length, feed, bend, jerk = law.at(np.linspace(0.0, law.duration, count))
    q1, q2, q3 = (run.at(length, d) for d in (1, 2, 3))
    v, a, j = feed[:, None], bend[:, None], jerk[:, None]
    speed, most, most_jerk = limits.table
    return (
        np.max(np.abs(q1 * v) / speed),
        np.max(np.abs(q1 * a + q2 * v**2) / most),
        np.max(np.abs(q1 * j + 3 * q2 * v * a + q3 * v**3) / most_jerk),
        np.max(feed) / feed_rate,
    )
