"""The uncertainty budget of RONt: sources, total by Monte Carlo and by GUM's linear law, decision."""

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from math import sqrt
from typing import Any, Self

import numpy as np
import xarray as xr

from centering.roundness._budget_draws import lift_of, totals
from centering.roundness._budget_rows import AT_BOTH_ENDS, BudgetRow, rows_of, spindle_bound
from centering.roundness._circle_noise import NORMS, is_mostly_noise
from centering.roundness._circle_protocol import Circle
from centering.roundness._instrument import Instrument
from centering.roundness._origin import remarks_on
from centering.roundness._ront_verdict import ront_decision, ront_verdict, worst_above
from centering.roundness._roundness_interval import WORST, RoundnessInterval, limit_in_mm, remark_on
from sdpgrind.base import checks, notebook, stored
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, part, quantity
from sdpgrind.base.results import Result
from sdpgrind.base.text_table import aligned
from sdpgrind.base.units import UM

_DIM = "source"
HEADS = ("source", "law", "half width", "sensitivity", "contribution [µm]")
_COLUMNS = {"half_width": "in unit", "sensitivity": "mm per unit", "contribution": "mm"}


@described("centering.roundness_budget")
class Budget(Described, ByValue, Result):
    """Uncertainty budget of a RONt, the result of `Roundness.budget`; printed, it is a table.

    Parameters
    ----------
    roundness : Roundness
        Circle with its RONt (mm), about LSC or MZC.
    instrument : Instrument
        Errors of the tester.
    height : float
        Height of the section above the table, mm. Default: 0.

    Examples
    --------
    >>> from centering.roundness import Instrument, Profile
    >>> from sdpgrind import units
    >>> angle = np.linspace(0.0, 2 * np.pi, 1024, endpoint=False)
    >>> form, noise = 0.001 * np.cos(3 * angle), 0.0001 * np.random.default_rng(0).normal(size=1024)
    >>> zone = Profile(angle, 30.0 + form + noise).filter("gaussian", upr=50).roundness("MZC")
    >>> budget = zone.budget(Instrument(spindle_error=units.um(0.05), gain_sd=0.01))
    >>> budget
    Budget(MZC: RONt 1.87 .. 2.02 µm, 95 %; sd 0.035 µm, linear law 0.04 µm; spindle ± 0.05 µm at most)
    >>> budget.conforms(units.um(2.5))
    'accepted'
    """

    roundness: Circle = custom()
    instrument: Instrument = part(Instrument)
    height: float = quantity("mm", at_least=0, default=0.0)

    def _check(self) -> None:
        circle = self.roundness
        if circle.kind not in NORMS:
            rule = "LSC or MZC for a budget: about others no bound of a spindle's effect on RONt is known"
            raise checks.refuse("kind", rule, circle.kind)
        if circle.origin.hidden:
            raise ValueError(f"no budget of RONt: {circle.origin.hidden}")
        if not circle.noise_sd.size:
            raise ValueError(
                "a budget needs the noise of the deviations: measure several turns, or give noise_sd (mm) of"
                " the instrument; after a robust filter, which is not linear, no budget is known"
            )

    @cached_property
    def rows(self) -> tuple[BudgetRow, ...]:
        """Sources with law, half width and unit, sensitivity (mm per unit) and contribution (mm)."""
        return rows_of(self.roundness, self.instrument, self.height)

    @property
    def spindle_bound(self) -> float:
        """Most by which the spindle can change RONt, mm: its error from valley to peak; 0 if taken off."""
        return spindle_bound(self.roundness, self.instrument, self.height)

    @property
    def linear_sd(self) -> float:
        """Standard uncertainty of RONt by GUM's linear law, mm: root of the sum of squared contributions."""
        return sqrt(sum(row.contribution**2 for row in self.rows))

    @cached_property
    def sd(self) -> float:
        """Standard uncertainty of RONt by Monte Carlo, mm; larger than linear where places nearly tie."""
        return float(np.std(totals(self._lift, self.rows)))

    def interval(self, confidence: float = 0.95) -> RoundnessInterval:
        """Return an interval for RONt that holds the true one for all sources together, mm.

        Draws of noise are stretched on both sides of their median to the ends of `Roundness.interval`, so
        that a tester without errors gives these.

        Parameters
        ----------
        confidence : float
            Chance that such an interval holds the truth, 0.5 ... 0.999, unit 1.

        Returns
        -------
        RoundnessInterval
            Both ends and the value without the lift by noise, mm; its method is that of the noise.
        """
        return self._interval(confidence, self.rows)

    def worst_case(self, confidence: float = 0.95) -> RoundnessInterval:
        """Return the interval for the least favourable error of the spindle, mm.

        RONt is subadditive, so that the spindle changes it by its error from valley to peak at most; both
        ends move by that.

        Parameters
        ----------
        confidence : float
            Chance by the other sources, 0.5 ... 0.999, unit 1.

        Returns
        -------
        RoundnessInterval
            Both ends, mm; its method is "worst case of the spindle". Without an error of the spindle
            `interval`.
        """
        ends = self._interval(confidence, [row for row in self.rows if row.law != AT_BOTH_ENDS])
        if not (most := self.spindle_bound):
            return ends
        return ends.replace(method=WORST, low=max(ends.low - most, 0.0), high=ends.high + most)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences that a reader of RONt (mm) needs, as of `Roundness.remarks`, by this interval."""
        ends, circle = self.interval(), self.roundness
        above = remark_on(circle.ron_t, ends, noisy=is_mostly_noise(circle, ends))
        return (*above, *remarks_on(self.roundness.origin))

    def conforms(self, limit: float) -> str:
        """Return the decision on a limit of RONt by the interval of 95 % (ISO 14253-1).

        Parameters
        ----------
        limit : float
            Limit, mm.

        Returns
        -------
        str
            "accepted" where the whole interval is within the limit, "rejected" where it is above, else "not
            decided".
        """
        disagreement = self.roundness.origin.disagreement
        return ront_decision(self.interval(), limit_in_mm("limit", limit), disagreement)

    def verdict(self, limit: float) -> str:
        """Return a sentence on a limit of RONt, as of `Roundness.verdict`, by this interval.

        Parameters
        ----------
        limit : float
            Limit, mm.

        Returns
        -------
        str
            Value, interval and decision in µm, and the worst case of the spindle where it is above the limit.
        """
        most = limit_in_mm("limit", limit)
        found = ront_verdict(self.roundness, self.interval(), most)
        return found + (worst_above(self.worst_case().high, most) if self.spindle_bound else "")

    def report(
        self, path: str | os.PathLike[str] | None = None, *, limits: Mapping[Any, float] | None = None
    ) -> str:
        """Write the sheet of `Roundness.report`, with this budget.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits as of `Roundness.report`, mm.

        Returns
        -------
        str
            The path of the file, or the text of the page.
        """
        return str(called("centering.roundness._sheet:report", self.roundness, path, limits, self))

    @cached_property
    def _lift(self) -> Floats:
        """Increase of RONt by each draw of noise, mm."""
        return lift_of(self.roundness)

    def _interval(self, confidence: float, rows: Sequence[BudgetRow]) -> RoundnessInterval:
        ends = self.roundness.interval(confidence)
        tail = 0.5 * (1 - ends.confidence)
        low, middle, high = np.quantile(self._lift, (tail, 0.5, 1 - tail))
        fall = (ends.value - ends.low) / (high - middle) if high > middle else 0.0
        rise = (ends.high - ends.value) / (middle - low) if middle > low else 0.0
        away = self._lift - middle
        found = totals(ends.value - away * np.where(away > 0, fall, rise), rows)
        least, best, most = (max(float(each), 0.0) for each in np.quantile(found, (tail, 0.5, 1 - tail)))
        return RoundnessInterval(least, most, best, ends.confidence, ends.method)

    def _written(self) -> xr.Dataset:
        table = {
            name: (_DIM, [getattr(row, name) for row in self.rows], {"units": unit})
            for name, unit in _COLUMNS.items()
        }
        names = {name: (_DIM, [getattr(row, name) for row in self.rows]) for name in ("law", "unit")}
        whole = self.roundness._written().assign(table | names)
        sources = {_DIM: [row.source for row in self.rows]}
        more = {"instrument": stored.encode(self.instrument), "height": self.height, "height_unit": "mm"}
        return whole.assign_coords(sources).assign_attrs(more)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        """Return the budget of a `dataset` read from a file, with its units."""
        circle = stored.class_of("centering.roundness").restored(dataset.drop_dims(_DIM))
        return cls(circle, stored.decode(dataset.attrs["instrument"]), float(dataset.attrs["height"]))

    @property
    def cells(self) -> list[tuple[str, ...]]:
        """Texts of the table: source, law, half width and sensitivity with units, contribution in µm."""
        return [(row.source, row.law, *_shown(row), f"{UM * row.contribution:.3g}") for row in self.rows]

    def __str__(self) -> str:
        sizes = f"Monte Carlo {UM * self.sd:.3g} µm, linear law {UM * self.linear_sd:.3g} µm"
        found = f"RONt ({self.roundness.kind}) {self.interval().ends} µm, 95 %"
        table = aligned([HEADS, *self.cells], "<<>")
        return "\n".join([*table, f"standard uncertainty: {sizes}", found, *self.remarks])

    def _repr_html_(self) -> str:
        return notebook.table(repr(self), HEADS, self.cells)

    def __repr__(self) -> str:
        spindle = f"; spindle ± {UM * most:.3g} µm at most" if (most := self.spindle_bound) else ""
        size = f"sd {UM * self.sd:.2g} µm, linear law {UM * self.linear_sd:.2g} µm"
        return f"Budget({self.roundness.kind}: RONt {self.interval().ends} µm, 95 %; {size}{spindle})"


def _shown(row: BudgetRow) -> tuple[str, str]:
    """Half width and sensitivity with units, µm and per cent."""
    if row.unit == "mm":
        return f"{UM * row.half_width:.3g} µm", f"{row.sensitivity:.3g}"
    if row.unit == "1":
        return f"{100 * row.half_width:.3g} %", f"{UM * row.sensitivity / 100:.3g} µm/%"
    return f"{row.half_width:.3g} {row.unit}", f"{UM * row.sensitivity:.3g} µm/{row.unit}"


def budget_of(circle: Circle, instrument: Instrument, height: float | None) -> Budget:
    """The budget of a circle by a tester; its noise is the profile's, or that of the tester."""
    checks.kind("instrument", instrument, Instrument)
    if instrument.temperature_sd and not circle.origin.radius_known:
        raise ValueError(
            "temperature_sd needs the radius (mm), which deviations from the tester's own circle do not tell:"
            f" give Profile.from_deviation its radius; got {instrument.temperature_sd:g} K"
        )
    if height is None and instrument.spindle_error_per_height:
        raise ValueError("height must be given (mm): the error of this spindle grows with it; got None")
    if not circle.noise_sd.size and instrument.noise_sd and "robust" not in circle.filter:
        circle = circle.replace(noise_sd=np.array([instrument.noise_sd]))
    return Budget(circle, instrument, 0.0 if height is None else height)
