"""Height of the true surface over the planned one: plane waves, evaluated in closed form at the contact."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, described

WAVES = 16  # waves of a random field; chosen: fewer are not normal, more make a tick expensive
_LONGEST = 10.0  # longest over shortest wavelength; chosen: waviness and form


@described()
class HeightField(Described, ByValue):
    """Height of the true surface over the planned one, along its normal: a sum of plane waves in space.

    Height at x: sum of ``amplitude * cos(wave . x + phase)``.

    Parameters
    ----------
    waves : array_like, (n, 3)
        Wave vectors in the frame of the surface, rad/mm.
    phases : array_like, (n,)
        Phases, rad.
    amplitudes : array_like, (n,)
        Amplitudes, mm.

    Raises
    ------
    ValueError
        When sizes differ, or a value is not finite.

    Examples
    --------
    >>> import hwsim
    >>> field = hwsim.HeightField.wave(0.1, 12.5)  # mm
    >>> field
    HeightField(1 wave, standard deviation 0.0707 mm)
    >>> field.at([[0.0, 0.0, 0.0], [6.25, 3.0, 1.0]]).round(12)
    array([ 0.1, -0.1])
    """

    waves: Any = array("rad/mm")
    phases: Any = array("rad")
    amplitudes: Any = array("mm")

    def _check(self) -> None:
        number = self.phases.size
        if (
            self.waves.shape != (number, 3)
            or self.phases.shape != (number,)
            or self.amplitudes.shape != (number,)
        ):
            shapes = ", ".join(str(each.shape) for each in (self.waves, self.phases, self.amplitudes))
            raise ValueError(
                f"waves, phases and amplitudes must be of shapes (n, 3), (n,) and (n,); got {shapes}"
            )

    def __repr__(self) -> str:
        number, spread = self.phases.size, float(np.sqrt(np.sum(self.amplitudes**2) / 2))
        return f"HeightField({number} wave{'' if number == 1 else 's'}, standard deviation {spread:.3g} mm)"

    @classmethod
    def flat(cls) -> Self:
        """Return the field of a surface as planned: no waves, 0 mm."""
        return cls(np.empty((0, 3)), np.empty(0), np.empty(0))

    @classmethod
    def wave(
        cls,
        amplitude: float,
        wavelength: float,
        direction: Sequence[float] = (1.0, 0.0, 0.0),
        phase: float = 0.0,
    ) -> Self:
        """Return a single wave.

        Parameters
        ----------
        amplitude, wavelength : float
            Amplitude and wavelength, mm.
        direction : sequence of three floats
            Direction of the wave; its length does not count.
        phase : float
            Phase at the origin, rad.
        """
        along = checks.finite_array("direction", direction)
        if along.shape != (3,) or not np.any(along):
            raise ValueError(
                f"direction must be three coordinates, not all zero; got {checks.shown(direction)}"
            )
        number = 2 * np.pi / checks.positive("wavelength", wavelength, "mm")
        return cls(number * along[np.newaxis] / np.linalg.norm(along), [phase], [amplitude])

    @classmethod
    def drawn(cls, sd: float, shortest: float, rng: np.random.Generator) -> Self:
        """Draw a field of random directions, with wavelengths log-uniform from the shortest to ten times it.

        Parameters
        ----------
        sd : float
            Standard deviation of the height, mm.
        shortest : float
            Shortest wavelength, mm.
        rng : numpy.random.Generator
            Random source.
        """
        number = 2 * np.pi / (shortest * _LONGEST ** rng.random(WAVES))
        along = rng.standard_normal((WAVES, 3))
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        phases = 2 * np.pi * rng.random(WAVES)
        return cls(number[:, np.newaxis] * along, phases, np.full(WAVES, sd * np.sqrt(2 / WAVES)))

    def at(self, points: npt.ArrayLike) -> Floats:
        """Return the height, mm.

        Parameters
        ----------
        points : array_like, (..., 3)
            Points in the frame of the surface, mm.
        """
        return np.asarray(np.cos(np.asarray(points) @ self.waves.T + self.phases) @ self.amplitudes)
