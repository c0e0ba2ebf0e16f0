"""What grinding changed of a part's form: harmonics before and after, removed form, RONt of both."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from centering.roundness._harmonics import Harmonics, above_noise
from centering.roundness._roundness_interval import RoundnessInterval
from sdpgrind.base import pictures, stored
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable, Block, Sentences
from sdpgrind.base.units import UM

_SURE = 1e-4  # chosen: chances nearer to 0 or 1 rest on the tails of a normal law
_ROWS = 12  # chosen: largest undulations of each in the table of the page
_PARTS = ("before", "after", "interval_before", "interval_after")
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

    @property
    def removed(self) -> Harmonics:
        """Removed form, before minus after as vectors: amplitude, mm, phase, rad, and their sd by noise."""
        first, second = (each.amplitude * np.exp(-1j * each.phase) for each in (self.before, self.after))
        apart = first - second
        sd = np.hypot(self.before.sd, self.after.sd)
        return self.before.replace(amplitude=np.abs(apart), phase=-np.angle(apart), sd=sd)

    @property
    def ratio(self) -> Floats:
        """Amplitude after over that before, (n,), unit 1; NaN where there was none."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found = self.after.amplitude / self.before.amplitude
        return np.where(np.isfinite(found), found, np.nan)

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of undulations: amplitudes and their sd in mm, ratio, removed amplitude in mm.

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
            "removed": self.removed.amplitude,
        }
        return pd.DataFrame(columns, index=pd.Index(self.before.upr, name="upr"))

    def plot(self) -> Any:
        """Draw both forms magnified (µm), and their amplitudes (µm) over upr; return the figure."""
        return pictures.drawn("centering.roundness._form_change_picture:plot", self)

    def _figures(self) -> Iterable[Block]:
        seen = {upr for each in (self.before, self.after) for upr, _ in above_noise(each, _ROWS)}
        if not seen:
            yield Sentences(["No undulation is above the noise of the readings."])
            return
        table = self.to_dataframe().loc[sorted(seen)]
        columns = [Amounts.of("upr", table.index.astype(int), heading="undulations per revolution")]
        columns += [
            Amounts.of("amplitude", table[name], "mm", name) for name in ("before", "after", "removed")
        ]
        columns.append(Amounts.of("ratio", table["ratio"], "1", "after/before"))
        yield AmountTable(f"Largest undulations ({self.filter})", columns)

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
        parts = {name: stored.encode(getattr(self, name)) for name in _PARTS}
        upr = {"upr": ("upr", self.before.upr, _label("1", "undulations per revolution"))}
        return xr.Dataset(columns | numbers, upr, parts | {"filter": self.filter})

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> "FormChange":
        """Return the change of a `dataset` (mm, rad)."""
        parts: dict[str, Any] = {name: stored.decode(dataset.attrs[name]) for name in _PARTS}
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
