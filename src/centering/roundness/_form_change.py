"""Change of a part's form by grinding: harmonics before and after, RONt, files and steps of both."""

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from centering.roundness._harmonics import Harmonics, above_noise, noise_height
from centering.roundness._origin import MEASURED, Origin, remarks_on
from centering.roundness._roundness_interval import RoundnessInterval
from sdpgrind.base import pictures, stored
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.source import Source
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Listing, Sentences
from sdpgrind.base.units import UM

_SURE = 1e-4  # chosen: chances nearer to 0 or 1 rest on the tails of a normal law
_GROWN = 5  # chosen: harmonics that are named in the sentence on those that grew
_ROWS = 12  # chosen: largest undulations of each in the table of the page
_PARTS = ("before", "after", "interval_before", "interval_after")
_ORIGINS = ("origin_before", "origin_after")
_NUMBERS = {
    "rotation": ("rad", "turn of the part between both"),
    "correlation": ("1", "correlation of both forms"),
    "ron_t_before": ("mm", "RONt (LSC) before"),
    "ron_t_after": ("mm", "RONt (LSC) after"),
}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FormChange(ByValue, Plan):
    """Change of a part's form, the result of `Profile.compare`; immutable.

    Parameters
    ----------
    before, after : Harmonics
        Filtered undulations from 2 upr on, mm, at the part angle of the measurement before, rad.
    rotation : float
        Turn of the part on the spindle from the measurement before to that after, rad.
    correlation : float
        Correlation of both forms after that turn, unit 1.
    ron_t_before, ron_t_after : float
        RONt about the least squares circle, mm.
    interval_before, interval_after : RoundnessInterval or None
        Interval of each, mm; None where the noise is not known.
    probability : float or None
        Probability that RONt fell, each being normal on both sides of its value up to the ends of its
        interval; None without intervals.
    filter : str
        Filter of both.
    origin_before, origin_after : Origin
        Files and steps of both measurements. Default: not known.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import Profile
    >>> angle, noise = np.linspace(0.0, 2 * np.pi, 720, endpoint=False), np.random.default_rng(0)
    >>> read = [2e-3 * np.cos(2 * angle) + 1e-3 * np.cos(5 * angle), 3e-4 * np.cos(5 * (angle - 0.2))]
    >>> before, after = (Profile(30.0 + each + 1e-4 * noise.normal(size=720)) for each in read)
    >>> change = after.compare(before, rotation=0.2)
    >>> change.probability > 0.999, float(change.to_dataframe().loc[5, "ratio"].round(1))
    (True, 0.3)
    """

    kind = "centering.form_change"
    before: Harmonics
    after: Harmonics
    rotation: float
    correlation: float
    ron_t_before: float
    ron_t_after: float
    interval_before: RoundnessInterval | None
    interval_after: RoundnessInterval | None
    probability: float | None
    filter: str
    origin_before: Origin = MEASURED
    origin_after: Origin = MEASURED

    @property
    def removed(self) -> Harmonics:
        """Removed form, before minus after as vectors: amplitude, mm, phase, rad, and their sd by noise."""
        first, second = (each.amplitude * np.exp(-1j * each.phase) for each in (self.before, self.after))
        apart = first - second
        sd = np.hypot(self.before.sd, self.after.sd)
        return self.before.replace(amplitude=np.abs(apart), phase=-np.angle(apart), sd=sd)

    @property
    def ratio(self) -> Floats:
        """Amplitude after over that before, (n,), unit 1; NaN where that before is not above its noise."""
        seen = (self.before.amplitude > 0) & (self.before.amplitude > noise_height(self.before.sd))
        found = np.full(seen.size, np.nan)
        return np.asarray(np.divide(self.after.amplitude, self.before.amplitude, out=found, where=seen))

    @property
    def change(self) -> Floats:
        """Amplitude after less that before, (n,), mm; positive where a harmonic grew."""
        return np.asarray(self.after.amplitude - self.before.amplitude)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on harmonics that grew (mm), steps of the measurement before, and doubts about it."""
        steps = (f"before: step: {step}" for step in self.origin_before.steps)
        doubts = (f"before: {each}" for each in remarks_on(self.origin_before))
        return (*self._grown(), *steps, *doubts)

    def _grown(self) -> Iterator[str]:
        """Sentence on the harmonics that grew by more than noise, the most first."""
        sure = self.change > noise_height(np.hypot(self.before.sd, self.after.sd))
        order = [k for k in np.argsort(-self.change, kind="stable") if sure[k] and self.change[k] > 0]
        if order:
            named = (f"{self.before.upr[k]:g} upr by {UM * self.change[k]:.2g} µm" for k in order[:_GROWN])
            more = f", and {len(order) - _GROWN} more" if len(order) > _GROWN else ""
            yield f"grew: {', '.join(named)}{more}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of undulations: amplitudes, sd and change in mm, ratio (unit 1).

        Returns
        -------
        pandas.DataFrame
            A row for each harmonic, upr (unit 1).
        """
        columns = {
            "before": self.before.amplitude,
            "before_sd": self.before.sd,
            "after": self.after.amplitude,
            "after_sd": self.after.sd,
            "ratio": self.ratio,
            "change": self.change,
        }
        return pd.DataFrame(columns, index=pd.Index(self.before.upr, name="upr"))

    def plot(self) -> Any:
        """Draw both forms magnified (µm), and their amplitudes (µm) over upr; return the figure."""
        return pictures.drawn("centering.roundness._form_change_picture:plot", self)

    def _figures(self) -> Iterable[Block]:
        seen = {upr for each in (self.before, self.after) for upr, _ in above_noise(each, _ROWS)}
        if not seen:
            yield Sentences(["No undulation is above the noise of the readings."])
        else:
            yield self._table(seen)
        if self.remarks:
            yield Sentences(self.remarks)
        yield Listing("\n".join(self._files()))

    def _files(self) -> Iterator[str]:
        """Source of both measurements, with the digests of their files."""
        for name, origin in (("before", self.origin_before), ("after", self.origin_after)):
            told = str(Source.from_json(origin.source)) if origin.source else "not read from a file"
            yield f"{name}: {told}"

    def _table(self, seen: set[float]) -> AmountTable:
        """Harmonics of these upr."""
        table = self.to_dataframe().loc[sorted(seen)]
        columns = [Amounts.of("upr", table.index.astype(int), heading="undulations per revolution")]
        columns += [
            Amounts.of("amplitude", table[name], "mm", name) for name in ("before", "after", "change")
        ]
        columns.append(Amounts.of("ratio", table["ratio"], "1", "after/before"))
        told = f"Largest undulations, change: after less before ({self.filter})"
        return AmountTable(told, columns)

    @property
    def dataset(self) -> xr.Dataset:
        """Harmonics over upr as labelled arrays, in mm and rad; RONt of both."""
        columns = {
            f"{name}_{field}": ("upr", getattr(getattr(self, name), field), _label(unit, f"{field} {name}"))
            for name in ("before", "after")
            for field, unit in (("amplitude", "mm"), ("phase", "rad"), ("sd", "mm"))
        }
        numbers = {name: ((), getattr(self, name), _label(*label)) for name, label in _NUMBERS.items()}
        if self.probability is not None:
            numbers["probability"] = ((), self.probability, _label("1", "probability that RONt fell"))
        parts = {name: stored.encode(getattr(self, name)) for name in (*_PARTS, *_ORIGINS)}
        upr = {"upr": ("upr", self.before.upr, _label("1", "undulations per revolution"))}
        return xr.Dataset(columns | numbers, upr, parts | {"filter": self.filter})

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "FormChange":
        """Return the change of a `dataset` (mm, rad)."""
        known = (*_PARTS, *(name for name in _ORIGINS if name in dataset.attrs))  # not in files of before
        parts: dict[str, Any] = {name: stored.decode(dataset.attrs[name]) for name in known}
        numbers: dict[str, Any] = {name: float(dataset[name]) for name in _NUMBERS}
        chance = float(dataset["probability"]) if "probability" in dataset else None
        return cls(**parts, **numbers, probability=chance, filter=str(dataset.attrs["filter"]))

    def _told(self) -> str:
        heights = [
            f"{UM * value:.4g}" + ("" if ends is None else f" ({ends.ends})")
            for value, ends in (
                (self.ron_t_before, self.interval_before),
                (self.ron_t_after, self.interval_after),
            )
        ]
        chance = "" if self.probability is None else f", fell with probability {_chance(self.probability)}"
        return (
            f"RONt (LSC) {heights[0]} -> {heights[1]} µm{chance}; turned by {np.degrees(self.rotation):.4g}"
            f" degrees, correlation {self.correlation:.2g}; {self.filter}"
        )


def _chance(probability: float) -> str:
    """A probability of which no more than four places are sure."""
    if probability > 1 - _SURE:
        return f"above {1 - _SURE:g}"
    return f"below {_SURE:g}" if probability < _SURE else f"{probability:.4g}"


def _label(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}
