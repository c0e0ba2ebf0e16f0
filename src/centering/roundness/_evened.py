"""Readings at nearly even part angles, moved onto an even turn: an eccentric ring then has its FFT, too.

Of n readings at angles t_j + d_j beside an even turn t_j exactly one wave form of up to n/2 upr goes through
all. Its values g at t_j follow from the readings r = A g, where A is Taylor's series: A = 1 + d D + d^2 D^2/2
+ ... with the derivative D, which multiplies a harmonic by i k. In root mean square D grows nothing by more
than n/2, so that with s = max |d| in steps of 2 pi/n

    ||A - 1|| <= q = exp(pi s) - 1,

and sweeps g <- g + r - A g converge for s < ln 2/pi = 0.22, whatever the readings: an error of g is at most
that of A g over 1 - q. A series ended after m terms errs by less than (pi s)^(m + 1)/(m + 1)! exp(pi s).

White noise of the readings becomes that of g. Where the steps change slowly g is the readings on a stretched
turn: its density of readings is 1 - d', which changes the variance of a low-passed value by a factor 1 + d'.
A ring off its axis by e has |d'| <= e/R and the sd of the even formula is right to e/(2 R).
"""

from math import exp, factorial, pi
from typing import NamedTuple

import numpy as np

from centering.roundness._harmonic_fit import even_harmonics, even_values
from centering.roundness._sampling import even_turn, is_even
from sdpgrind.base.checks import Complex, Floats

_NEAR = 0.2  # chosen: steps, below the ln 2/pi that the sweeps need; at 3600 points and 30 mm some 10 um
_STRETCH = 0.01  # chosen: change of a step over the step; the sd of the even formula is right to half of it
_EXACT = 1e-6  # chosen: error over the readings, root mean squares; of 1 um it is 1 pm


class Evened(NamedTuple):
    """Deviations on an even turn from 0 on (mm), their circle (radius, x, y; mm), angles beside that turn."""

    values: Floats
    circle: Floats
    shift: Floats | None  # part angles of the readings less those of the turn, rad; None: they are even

    @property
    def told(self) -> str:
        """What was done, for the steps of a profile."""
        if self.shift is None:
            return "by FFT"
        farthest = np.abs(_apart(self.shift)[1]).max()
        return f"by FFT of readings moved by up to {farthest:.2g} steps onto an even turn"

    def at_readings(self, values: Floats) -> Floats:
        """Values of an even turn (mm), at the places of the readings."""
        if self.shift is None:
            return values
        start, apart = _apart(self.shift)
        return _series(apart).moved(_turned(values, start))


def evened(part_angle: Floats, deviation: Floats, circle: Floats) -> Evened | None:
    """Deviations of one turn on an even turn about their own circle; None where the angles are not near."""
    if is_even(part_angle):
        return Evened(deviation, circle, None)
    shift = part_angle - even_turn(part_angle.size)
    start, apart = _apart(shift)
    change = np.diff(apart, append=apart[0])
    if np.abs(apart).max() > _NEAR or np.abs(change).max() > _STRETCH:
        return None
    values = _turned(_settled(deviation, apart), -start)
    return Evened(*about_itself(values, circle), shift)


def about_itself(deviation: Floats, circle: Floats) -> tuple[Floats, Floats]:
    """Form on an even turn without 0 and 1 upr (mm), and the circle that these move (mm).

    The form about the moved circle differs by the square of the move over the radius.
    """
    coef = even_harmonics(deviation)
    moved = np.array([coef[0].real, 2 * coef[1].real, -2 * coef[1].imag])
    coef[:2] = 0.0
    return even_values(coef, deviation.size), circle + moved


def _apart(shift: Floats) -> tuple[float, Floats]:
    """Turn of the even grid that brings it nearest to all readings, rad, and what is left, in steps."""
    start = float(shift.max() + shift.min()) / 2
    return start, (shift - start) * shift.size / (2 * pi)


def _turned(values: Floats, angle: float) -> Floats:
    """Values of an even turn at places farther on by an angle (rad)."""
    coef = even_harmonics(values)
    return even_values(coef * np.exp(1j * angle * np.arange(coef.size)), values.size)


class _Series(NamedTuple):
    """Taylor's series from an even turn to places beside it (steps), with powers of the derivative."""

    apart: Floats
    powers: Complex

    def moved(self, values: Floats) -> Floats:
        """Values at the places, by Horner's scheme."""
        derivatives = np.fft.irfft(np.fft.rfft(values) * self.powers, values.size)
        found = np.zeros_like(values)
        for order in range(len(derivatives), 0, -1):
            found = (found + derivatives[order - 1]) * (self.apart / order)
        return np.asarray(values + found)


def _series(apart: Floats) -> _Series:
    """The series, with as many terms as keep what is left out below the accuracy."""
    reach, terms = pi * float(np.abs(apart).max()), 1
    while exp(reach) * reach ** (terms + 1) / factorial(terms + 1) > _EXACT:
        terms += 1
    slope = 2j * pi / apart.size * np.arange(apart.size // 2 + 1)  # of a step
    return _Series(apart, np.asarray(slope ** np.arange(1, terms + 1)[:, None], dtype=complex))


def _settled(readings: Floats, apart: Floats) -> Floats:
    """Values on the even turn whose wave form goes through the readings, by sweeps."""
    series, share = _series(apart), 2 - exp(pi * float(np.abs(apart).max()))  # 1 - q
    goal = share * _EXACT * float(np.linalg.norm(readings))
    found, left = readings, readings - series.moved(readings)
    while np.linalg.norm(left) > goal:
        found = found + left
        left = readings - series.moved(found)
    return np.asarray(found + left)
