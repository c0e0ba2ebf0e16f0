"""Turns that do not repeat, as where angles come in another unit, are told with every result."""

import numpy as np
import pytest

import centering
from centering.roundness import Profile

ANGLE = np.arange(0.0, 360.0, 0.5)  # degrees
RING = 12.0 * np.cos(np.radians(ANGLE) - 0.8) + 2.0 * np.cos(4 * np.radians(ANGLE))  # um


def scanned(angle, noise=0.1):
    readings = RING + noise * np.random.default_rng(2).normal(size=RING.size)
    table = {"angle": angle, "deviation": readings}
    return Profile.read(table, angle=("angle", "deg"), deviation=("deviation", "um"), radius=30.0)


@pytest.mark.parametrize(
    ("angle", "told"),
    [
        (ANGLE / 0.9, "the centre differs by 17.1 µm from turn to turn, by more than 5 standard deviations"),
        (2.0 * ANGLE, "the readings do not repeat from turn to turn (correlation -0.9"),
    ],
    ids=["gon", "number of the row"],
)
def test_angles_in_another_unit(angle, told):
    ring = scanned(angle)
    for result in (ring, ring.filter(upr=50)):
        assert any(each.startswith(told) for each in result.roundness().remarks)
    assert told in ring.report(limits={"RONt": 0.005}) and "is the angle in another unit" in ring.unlike_turns
    assert told in str(centering.preset("printed").doubts(ring))


@pytest.mark.parametrize("noise", [0.05, 2.0, 20.0])
@pytest.mark.parametrize("turns", [1, 1.4, 3])
def test_turns_of_one_ring_repeat(turns, noise):
    """Noise below and far above the form, of neighbours that resemble each other, too."""
    rng = np.random.default_rng(5)
    angle = np.arange(0.0, 2 * np.pi * turns, np.pi / 180)
    form = 30.0 + 0.012 * np.cos(angle - 0.8) + 0.002 * np.cos(4 * angle)
    for _ in range(5):
        each = 1e-3 * noise * rng.normal(size=angle.size)
        alike = np.convolve(each, np.ones(4) / 2, "same")
        assert Profile(angle, form + each).unlike_turns == Profile(angle, form + alike).unlike_turns == ""
