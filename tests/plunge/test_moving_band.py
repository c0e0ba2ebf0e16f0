"""Depth of damage against the heat below Jaeger's moving band, by quadrature."""

from functools import cache

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from plunge_inside import DECAY
from scipy.optimize import brentq, minimize_scalar
from scipy.special import kve

from sdpgrind import plunge

PROBLEM = plunge.preset("simulation")
MODEL = PROBLEM.model


NODES, WEIGHTS = leggauss(160)


def heat(x, z, half):
    """Temperature at (x, z) of a band from -half to half, lengths in 2 alpha/v, temperature in 2 q alpha/(pi
    k v).
    """
    return _upto(x + half, z) - _upto(x - half, z)


def _upto(end, z):
    """Integral of exp(-u) K0(sqrt(z^2 + u^2)) from 0, in the root of u, in which it is smooth at 0."""
    s = 0.5 * np.sqrt(abs(end)) * (NODES + 1)
    u = np.copysign(s**2, end)
    far = np.hypot(z, u)
    values = kve(0, far) * np.exp(-u - far)  # K0 scaled, so that nothing overflows
    return np.copysign(0.5 * np.sqrt(abs(end)), end) * np.sum(WEIGHTS * 2 * s * values)


@cache
def peak(z, half):
    """The greatest temperature at a depth."""
    places = np.linspace(-half - 5 * z - 3, half, 60)
    best = int(np.argmax([heat(x, z, half) for x in places]))
    low, high = places[max(best - 1, 0)], places[min(best + 1, places.size - 1)]
    return -minimize_scalar(
        lambda x: -heat(x, z, half), bounds=(low, high), method="bounded", options={"xatol": 1e-5}
    ).fun


def half_band(rate):
    """Half the length of contact at an infeed rate, in 2 alpha/v."""
    contact = np.sqrt(MODEL.equivalent_diameter * float(MODEL.depth_of_cut(rate)))
    return MODEL.work_speed * contact / (4 * MODEL.diffusivity)


@pytest.mark.parametrize(
    ("half", "depth", "slope"),
    [(10, 1, 0.925), (15, 1, 0.919), (25, 1, 0.912), (10, 4, 0.869), (15, 4, 0.898), (25, 4, 0.918)],
)
def test_decay_of_the_peak(half, depth, slope):
    """The published values; the model's constant lies between them."""
    assert np.log(peak(1e-6, half) / peak(depth, half)) / depth * np.sqrt(half) == pytest.approx(
        slope, abs=3e-3
    )
    assert 0.869 < DECAY < 0.925


def test_the_range_in_which_it_holds():
    assert 10 < half_band(MODEL.burn_rate) < half_band(PROBLEM.command_rate_max) < 30


@pytest.mark.parametrize("rate", [0.0095, 0.012, 0.02, 0.03, 0.0448])
def test_depth_of_damage(rate):
    """Depth at which the peak equals the heat of burning: within 1.5 %."""
    chips = MODEL.burning.u0 * MODEL.width * MODEL.work_speed * MODEL.depth_of_cut(rate)
    ratio = float((MODEL.grinding_power(rate) - chips) / (MODEL.burning_power(rate) - chips))
    half = half_band(rate)
    depth = brentq(lambda z: peak(z, half) * ratio - peak(1e-6, half), 1e-6, 20.0, xtol=1e-4)
    assert float(MODEL.burn_depth(rate)) == pytest.approx(
        depth * 2 * MODEL.diffusivity / MODEL.work_speed, rel=0.015
    )


def test_what_the_surface_stands():
    """B = theta k sqrt(pi)/(2 sqrt(alpha)): the peak of a long band is 2 sqrt(pi half), less conduction
    ahead.
    """
    for half, short in ((10, 0.05), (30, 0.03)):
        whole = 2 * np.sqrt(np.pi * half)
        assert (1 - short) * whole < peak(1e-6, half) < whole
