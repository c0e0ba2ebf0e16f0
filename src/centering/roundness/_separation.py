"""A part's form and a spindle's error, separated: the result of a reversal or of several steps."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from centering.roundness._harmonic_fit import even_values
from centering.roundness._harmonics import Harmonics
from centering.roundness._origin import Made, Origin, sd_of_harmonics
from centering.roundness._profile import Profile
from centering.roundness._sampling import even_turn
from centering.roundness._setups import Setups, Split
from centering.roundness._spindle_error import SpindleError, told_lost
from sdpgrind.base import pictures, stored
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Complex, Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.units import UM


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Separation(ByValue, Plan):
    """Form of a part and error of the spindle, the result of `reverse` or `multistep`; immutable.

    Parameters
    ----------
    part : Profile
        The part, centred, at the angle of the first setup less its turn: one even turn, with the harmonics'
        standard deviations by noise and by what is lost.
    spindle : SpindleError
        Error of the spindle over its angle, mm.
    turns : array, shape (m,)
        Turn of the part in each setup, rad.
    senses : array, shape (m,)
        1 where the probe was on its usual side, -1 on the other; unit 1.
    noise_sd : array, shape (n,)
        Standard deviation of the amplitude of each harmonic of one profile by noise, mm.
    joint : array, shape (n,)
        Amplitude of part and spindle together where a harmonic is lost, mm; else 0.
    disagreement : str
        Sentence on the harmonic that the setups agree on least; on RONt of the part no decision is taken
        then. Default: empty, they agree.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile, multistep, step_angles
    >>> angle, steps = np.linspace(0.0, 2 * np.pi, 720, endpoint=False), step_angles(7)
    >>> spindle = 1e-4 * np.cos(2 * angle - 1.9)
    >>> read = [30.0 + 4e-4 * np.cos(2 * (angle - step) - 0.2) + spindle for step in steps]
    >>> found = multistep([Profile(angle, each) for each in read], steps)
    >>> round(found.part.roundness().ron_t, 6), round(found.spindle.range, 6)  # mm
    (0.0008, 0.0002)
    >>> found.lost[:2].tolist()
    [36, 72]
    """

    kind = "centering.separation"
    _title = "Part and spindle, separated"
    part: Profile
    spindle: SpindleError
    turns: Floats
    senses: Floats
    noise_sd: Floats
    joint: Floats
    disagreement: str = ""

    @property
    def upr(self) -> Floats:
        """Harmonics, (n,), undulations per turn, from 2 on, unit 1."""
        return self.spindle.harmonics.upr

    @property
    def lost(self) -> npt.NDArray[np.int64]:
        """Harmonics that the setups do not tell apart, left out of part and spindle, upr (unit 1)."""
        return self.spindle.lost

    @property
    def singular(self) -> Floats:
        """Smallest singular value of each harmonic, (n,), unit 1; below 0.3 it is lost."""
        return self._setups.singular(self.upr)

    @property
    def covariance(self) -> Complex:
        """Covariance of the complex amplitudes of part and spindle for each harmonic, (n, 2, 2), mm^2.

        Half of the mean of d conj(d)': its diagonal holds the variances of both amplitudes along their
        phases. A lost harmonic is shared out anyhow, between nothing and its joint amplitude.
        """
        share = self._setups.common(self.upr) / self.turns.size
        found = np.ones((self.upr.size, 2, 2), dtype=complex)
        found[:, 0, 1], found[:, 1, 0] = -share.conj(), -share
        return np.asarray(found * (self.spindle.harmonics.sd**2)[:, np.newaxis, np.newaxis])

    @cached_property
    def _setups(self) -> Setups:
        return Setups(self.turns, self.senses)

    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        limits: Mapping[str | int | tuple[int, int], float] | None = None,
    ) -> str:
        """Write one HTML page: limits, roundness of the part, harmonics of both, setups, files.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits of "RONt", "RONp", "RONv", "RONq" of the part about the least squares circle, mm, of
            "spindle", its error from valley to peak, mm, and of harmonics of the part by upr, as of
            `Profile.harmonics`.

        Returns
        -------
        str
            The path of the file, or the text of the page.

        Raises
        ------
        ValueError
            For a limit of another name, not > 0, or above 0.5 mm.
        ImportError
            With a path, without the extra ``report``.

        Examples
        --------
        >>> import numpy as np
        >>> from centering.roundness import Profile, reverse
        >>> angle = np.linspace(0.0, 2 * np.pi, 360, endpoint=False)
        >>> part, spindle = 3e-4 * np.cos(3 * angle), 1e-4 * np.cos(2 * angle)
        >>> found = reverse(Profile(angle, 30.0 + part + spindle), Profile(angle, 30.0 + part - spindle))
        >>> print(found.report(limits={"spindle": 0.0001}).splitlines()[5])
        spindle 0.2 µm, limit 0.1 µm: not decided, above the limit as measured, no interval
        """
        return str(called("centering.roundness._separation_sheet:report", self, path, limits))

    def plot(self) -> Any:
        """Draw part and spindle magnified (µm), and the singular values over upr; return the figure."""
        return pictures.drawn("centering.roundness._separation_picture:plot", self)

    @property
    def dataset(self) -> xr.Dataset:
        """Part and spindle as labelled arrays: angles in rad, lengths in mm, harmonics in upr."""
        spindle = self.spindle.deviation(self.part.angle)
        of_part = self.part.dataset
        more = {
            "spindle_error": ("sample", spindle, _label("mm", "error of the spindle at its angle")),
            "turn": ("setup", self.turns, _label("rad", "turn of the part")),
            "sense": ("setup", self.senses, _label("1", "side of the probe")),
            "singular": ("harmonic", self.singular, _label("1", "smallest singular value")),
            "noise_sd": ("harmonic", self.noise_sd, _label("mm", "sd of an amplitude by noise")),
            "joint": ("harmonic", self.joint, _label("mm", "joint amplitude of a lost harmonic")),
        }
        whole = of_part.assign(more).assign_coords(upr=("harmonic", self.upr, _label("upr", "undulations")))
        return whole.assign_attrs(spindle=stored.encode(self.spindle), disagreement=self.disagreement)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "Separation":
        kept = {
            field: lasting(dataset[name].values)
            for field, name in (("turns", "turn"), ("senses", "sense"), ("noise_sd",) * 2, ("joint",) * 2)
        }
        told = str(dataset.attrs.get("disagreement", ""))  # files of before hold none
        spindle = stored.decode(dataset.attrs["spindle"])
        return cls(Profile.restored(dataset), spindle, **kept, disagreement=told)

    def _headline(self) -> str:
        return f"{self.disagreement}. {self._told()}" if self.disagreement else self._told()

    def _told(self) -> str:
        together = f" of up to {UM * float(self.joint.max()):.2g} µm" if self.lost.size else ""
        return (
            f"{self.turns.size} setups: part {UM * float(np.ptp(self.part.deviation)):.4g} µm, spindle"
            f" {UM * self.spindle.range:.4g} µm from peak to valley; {told_lost(self.lost)}{together}"
        )


def separation_of(
    profiles: Sequence[Profile],
    setups: Setups,
    upr: Floats,
    found: Split,
    noise: Floats,
    how: str,
    disagreement: str = "",
) -> Separation:
    """The separation of harmonics that were found; `how` begins the sentence on the step."""
    sd, lost = found.sd(setups, upr, noise), upr[found.lost].astype(int)
    shape = Harmonics(upr, np.abs(found.spindle), -np.angle(found.spindle), sd, profiles[0].nyquist)
    told = f"spindle taken off by {how}, {told_lost(lost)}"
    part = _part(profiles, found.part, sd, lost, told)
    return Separation(
        part=Profile._made(replace(part, origin=replace(part.origin, disagreement=disagreement))),
        spindle=SpindleError(shape, lost),
        turns=lasting(setups.turns),
        senses=lasting(setups.senses),
        noise_sd=lasting(noise),
        joint=lasting(found.joint),
        disagreement=disagreement,
    )


def _part(
    profiles: Sequence[Profile], amplitude: Complex, sd: Floats, lost: npt.NDArray[np.int64], told: str
) -> Made:
    """The part on an even turn about the axis, of the mean radius."""
    first = profiles[0]
    radius = float(np.mean([each.circle.radius for each in profiles]))
    deviation = even_values(np.concatenate([np.zeros(2), amplitude / 2]), first.angle.size)
    origin = Origin(
        steps=(*first.steps, told),
        filter=first._origin.filter,
        low=first._origin.low,
        sd=(0.0, 0.0, *sd.tolist()),
        noise_sd=sd_of_harmonics(sd),
        nyquist=first.nyquist,
        radius_known=all(each._origin.radius_known for each in profiles),
        high=first._origin.high,
        separated=(0.0, 0.0, *sd.tolist()),
        lost=tuple(lost.tolist()),
        source=_source(profiles),
    )
    circle = first.circle.replace(value=np.array([radius, 0.0, 0.0]))
    angle = even_turn(first.angle.size)
    return Made(angle, radius + deviation, first.tip_radius, circle, origin, None, first.internal)


def _source(profiles: Sequence[Profile]) -> str:
    """JSON of the source with the files of all setups; empty where one was not read from a file."""
    sources = [each.source for each in profiles if each.source is not None]
    if len(sources) < len(profiles):
        return ""
    files = dict.fromkeys(note for source in sources for note in source.files)
    return dataclasses.replace(sources[0], files=tuple(files)).to_json()


def _label(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}
