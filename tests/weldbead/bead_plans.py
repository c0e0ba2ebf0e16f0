"""Plans that several tests read, each solved once, and cut laws written anew from their definition."""

from functools import cache

import numpy as np
from scipy.special import erf, erfc

from sdpgrind import sdp, weldbead

NAMES = ("P1", "P2", "P3", "P4", "P5")
FINE = 1601
RAYLEIGH_MEAN = np.sqrt(np.pi / 2)
RAYLEIGH_SD = np.sqrt(2 - np.pi / 2)


def solved(problem, nodes, **options):
    """Plan of one grid, without an error of its own, which takes a second grid."""
    return weldbead.SequencePolicy(
        problem, sdp.plan(weldbead.sequence.sdp_problem(problem, nodes, **options))
    )


@cache
def fine(name):
    """A canonical problem on the grid of 0.00125 mm."""
    return solved(weldbead.preset(name), FINE)


@cache
def plain(name):
    """A canonical problem on the grid of 0.005 mm."""
    return weldbead.plan(weldbead.preset(name), tolerance=None, nodes=401)


@cache
def dense(name):
    """A canonical problem on the grid of 0.005 mm, with levels so dense that the search errs by less than
    1e-6 $.
    """
    return solved(weldbead.preset(name), 401, levels=801)


@cache
def tall():
    """P3 on beads of up to 6 mm."""
    return solved(weldbead.preset("P3").replace(height_max=6.0), 1201)


def table(policy, times):
    """Value, stop, duration and force on the nodes of `policy`, each [height, time]."""
    height = policy.states()[0]
    action = policy.action(height=height[:, None], time_left=np.asarray(times, dtype=float))
    value = policy.value(height=height[:, None], time_left=np.asarray(times, dtype=float))
    return height, value, action


def cut_moments(force, duration, relative_sd=0.15, process=None, length=50.0, reset=2.0):
    """Mean and sd (mm) of a cut, "C1" random, from Brown (4.5) and (4.9a)."""
    k1, k2, mu, radius, omega, width = process or (10.0, 100.0, 0.3, 85.0, 500.0, 12.5)
    feed = length / (duration - reset)
    power = 1e-3 * mu * radius * force * omega
    whole = k1 * width * feed
    return np.maximum(power - k2, 0.0) / whole, relative_sd * power / whole


def rayleigh_over_under(mean, sd, x):
    """E (D - x)+ and E (x - D)+ of the translated or scaled Rayleigh law, x >= 0."""
    q = np.minimum(sd / RAYLEIGH_SD, mean / RAYLEIGH_MEAN)
    start = mean - q * RAYLEIGH_MEAN
    u = np.maximum(x - start, 0.0) / q
    over = q * RAYLEIGH_MEAN * erfc(u / np.sqrt(2)) + np.maximum(start - x, 0.0)
    under = np.where(x > start, q * (u - RAYLEIGH_MEAN * erf(u / np.sqrt(2))), 0.0)
    return over, under
