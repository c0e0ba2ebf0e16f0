"""Harmonics of a part and of a spindle from readings of the part in several setups, by least squares.

In setup k the part is turned by a_k, and the probe stands on its usual side (sense 1) or on the other (-1).
Harmonic n of its profile is then P exp(-i n a_k) + sense_k S, with P of the part and S of the spindle. With
the common sum g = sum sense_k exp(-i n a_k) over M setups, the normal matrix is [[M, conj g], [g, M]]; the
singular values are the roots of M + |g| and M - |g|.
"""

import dataclasses
from math import sqrt

import numpy as np

from sdpgrind.base.checks import Bools, Complex, Floats

LOST = 0.3  # chosen: singular value below which noise grows more than three times
_RECTANGULAR = sqrt(3)  # derived: half width over standard deviation of a rectangular law
_PASSED = 1e-3  # chosen: transmission of a filter below which a harmonic does not show the noise


@dataclasses.dataclass(frozen=True, eq=False)
class Setups:
    """Turns of the part, rad, and senses of the probe, 1 or -1, (M,)."""

    turns: Floats
    senses: Floats

    def waves(self, upr: Floats) -> Complex:
        """Factor of each harmonic of the part in each setup, (M, n)."""
        return np.asarray(np.exp(-1j * np.outer(self.turns, upr)))

    def common(self, upr: Floats) -> Complex:
        """Sum over the setups by which part and spindle look alike, (n,)."""
        return np.asarray(self.senses @ self.waves(upr))

    def singular(self, upr: Floats) -> Floats:
        """Smallest singular value of each harmonic, (n,)."""
        return np.asarray(np.sqrt(np.maximum(self.turns.size - np.abs(self.common(upr)), 0.0)))

    def growth(self, upr: Floats) -> Floats:
        """Standard deviation of a separated harmonic over that of a read one, (n,); 0 if lost."""
        count, common = self.turns.size, np.abs(self.common(upr))
        lost = self.singular(upr) < LOST
        return np.where(lost, 0.0, np.sqrt(count / np.where(lost, 1.0, count**2 - common**2)))


@dataclasses.dataclass(frozen=True, eq=False)
class Split:
    """Complex amplitudes (mm) of part and spindle, joint amplitude of the lost ones, what is left, (M, n)."""

    part: Complex
    spindle: Complex
    joint: Floats
    lost: Bools
    left: Complex

    def noise(self, passed: Floats) -> Floats:
        """Standard deviation of each harmonic of one profile, mm, for noise of which `passed` is left."""
        setups = len(self.left)
        known = ~self.lost & (passed > _PASSED * passed.max())
        freedom = (setups - 2) * int(known.sum())
        power = float(np.sum(np.abs(self.left[:, known] / passed[known]) ** 2)) / 2
        return np.asarray(passed * (sqrt(power / freedom) if freedom else np.inf))

    def sd(self, setups: Setups, upr: Floats, noise: Floats) -> Floats:
        """Standard deviation of the amplitudes, mm: by noise; of a lost one, by its joint amplitude.

        What is lost may be the part's or the spindle's, anything from nothing to all of it.
        """
        shared = np.hypot(self.joint / _RECTANGULAR, noise / sqrt(setups.turns.size))
        return np.where(self.lost, shared, noise * np.where(self.lost, 1.0, setups.growth(upr)))


def split(read: Complex, setups: Setups, upr: Floats) -> Split:
    """Part and spindle from the harmonics of all profiles, (M, n) complex amplitudes; the lost ones are 0."""
    waves, common = setups.waves(upr), setups.common(upr)
    count, lost = setups.turns.size, setups.singular(upr) < LOST
    of_part, of_spindle = (waves.conj() * read).sum(axis=0), setups.senses @ read
    inverse = setups.growth(upr) ** 2 / count
    part = (count * of_part - common.conj() * of_spindle) * inverse
    spindle = (count * of_spindle - common * of_part) * inverse
    joint = np.where(lost, of_spindle / count, 0.0)
    left = read - waves * part - np.outer(setups.senses, spindle + joint)
    return Split(part, spindle, np.abs(joint), lost, left)
