"""A reference circle, the roundness about it, and its certificate."""

import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from centering.roundness._budget import Budget, budget_of
from centering.roundness._circle_noise import NORMS, interval_of, is_mostly_noise, methods_of
from centering.roundness._deviations_about import DeviationsAbout
from centering.roundness._form_change import FormChange
from centering.roundness._former_names import FormerSpread
from centering.roundness._harmonics import Harmonics
from centering.roundness._instrument import Instrument
from centering.roundness._origin import remarks_on
from centering.roundness._ront_verdict import ront_decision, ront_verdict
from centering.roundness._roundness_interval import RoundnessInterval, limit_in_mm, remark_on
from sdpgrind.base import checks, units
from sdpgrind.base.by_name import called
from sdpgrind.base.quantities import described


@described("centering.roundness")
class Roundness(FormerSpread, DeviationsAbout):
    """Reference circle with the roundness about it, the result of `reference_circle`.

    Parameters
    ----------
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Kind of circle.
    center : array, (2,)
        Centre of the circle, mm, in the frame of the points.
    radius : float
        Radius of the part's circle, mm, without the tip; for MZC the mean of the two.
    contacts : array of int, (m,)
        Indices of the points that fix the circle; none for LSC.
    outer : array of bool, (m,)
        Whether a contact is on the outer circle: all of MCC, none of MIC, two of the four of MZC.
    bound : float
        Proved bound of the extreme length, mm. Lower: of `ron_q` (LSC, nearby), `radius` (MCC) or, within
        half the inner radius, `value` (MZC). Upper: of the `radius` of circles centred among the points
        (MIC).
    points : array, (n, 2)
        Points of the profile, mm; those of the tip's centre if there is a tip.
    tip_radius : float
        Radius of the tip, mm; negative for a bore read from within.
    noise_sd : array, (1,) or (n,)
        Standard deviation of the readings, mm, of all or each; empty if unknown.
    noise_upr : array, (m,)
        Relative amplitudes of filtered noise at 0 to m - 1 upr; empty for that of readings.
    filter : str
        Filter of the points.
    certificate : str
        Sentence on the proof.
    origin : Origin
        Steps of the profile, its source, and standard deviations of its harmonics (mm) by upr (unit 1).
    internal : bool
        Whether a bore is read, from within, with the material outside the circle. Default: as the tip says.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import reference_circle
    >>> angle = np.radians(np.arange(360.0))
    >>> radius = 30.0 + 0.001 * np.cos(2.0 * angle - np.pi / 3)
    >>> found = reference_circle(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), "MZC")
    >>> found
    Roundness(MZC: RONt 2 µm about (0, 0) mm, radius 30 mm; 4 contacts)
    >>> np.degrees(found.contact_angles).round().tolist(), found.outer.tolist()
    ([30.0, 120.0, -150.0, -60.0], [True, False, True, False])
    >>> print(found.certificate)
    contacts alternate, two outer and two inner: no centre within 15 mm, half the inner radius, is better
    """

    def interval(self, confidence: float = 0.95, method: str | None = None) -> RoundnessInterval:
        """Return an interval for RONt that holds the true one, for all that noise does to it, mm.

        How far noise lifts RONt depends on how many places of the form tie for the highest and the lowest.
        The calibrated interval draws noise about the harmonics that stand out of it; in simulations
        of 13 forms it held the truth in 90 to 100 of 100 copies at a confidence of 0.95, for which its
        factors were found. The guaranteed one assumes nothing of the form and is twice as wide; it is
        taken also where more than half of RONt is lift by noise, as in angles in a wrong order or turns of
        two parts, or where the other reaches 0: its factors were not found for such.

        Parameters
        ----------
        confidence : float
            Chance that such an interval holds the truth, 0.5 ... 0.999, unit 1.
        method : {"calibrated", "guaranteed"}, optional
            Method. Default: calibrated after a low pass or a Gaussian band, guaranteed after a high pass or
            another band, for which no simulation was made, without a filter and where a gap was bridged.

        Returns
        -------
        RoundnessInterval
            Both ends and the value without the lift, mm.

        Raises
        ------
        ValueError
            For MCC and MIC, whose RONt is no norm, and after a robust filter, whose noise is not known: no
            method is; where the noise of the readings is not known; for the calibrated method without a
            filter.

        Examples
        --------
        >>> import numpy as np
        >>> from centering import Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 1024, endpoint=False)
        >>> form, noise = 0.001 * np.cos(3 * angle), 0.0003 * np.random.default_rng(0).normal(size=1024)
        >>> found = Profile(angle, 30.0 + form + noise).filter("gaussian", upr=50).roundness("MZC")
        >>> found.ron_t > 0.0021, found.interval().low < 0.002 < found.interval().high
        (True, True)
        >>> found.interval(method="guaranteed")
        RoundnessInterval(1.62 .. 2.33 µm, 95 %, guaranteed)
        """
        share = checks.within("confidence", confidence, 0.5, 0.999)
        if self.kind not in NORMS:
            raise checks.refuse(
                "kind", "LSC or MZC for an interval; no method is known for others", self.kind
            )
        if not self.noise_sd.size:
            raise ValueError(
                "an interval needs the noise of the deviations: measure several turns, or give noise_sd (mm)"
                " to reference_circle; after a robust filter it is not known"
            )
        if self.origin.hidden:
            raise ValueError(self.why_no_interval)
        methods = methods_of(self)
        asked = methods[0] if method is None else checks.one_of("method", method, methods)
        return interval_of(self, share, asked)

    @property
    def why_no_interval(self) -> str:
        """Reason why RONt (mm) has no interval, and a limit no decision; empty where it has one."""
        if self.kind not in NORMS:
            return f"no interval of RONt is proved about {self.kind}, only about LSC and MZC"
        if self.noise_sd.size:
            return f"no interval of RONt: {self.origin.hidden}" if self.origin.hidden else ""
        if "robust" in self.filter:
            return "no interval of RONt is proved after a robust filter, which is not linear"
        return (
            "no interval of RONt without the noise: measure several turns, or give it, Profile.with_noise_sd"
        )

    @property
    def why_no_budget(self) -> str:
        """Reason why no uncertainty budget of RONt (mm) is known; empty where there may be one."""
        if self.kind not in NORMS:
            return f"of RONt about {self.kind} none is known, only about LSC and MZC"
        if self.origin.hidden:
            return f"of RONt none is known: {self.origin.hidden}"
        return "none is known after a robust filter, which is not linear" if "robust" in self.filter else ""

    @cached_property
    def _usual(self) -> RoundnessInterval | None:
        """The interval of 95 %; None where there is none."""
        return None if self.why_no_interval else self.interval()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences that a reader of RONt (mm) needs, as where it is above its own interval; mostly none."""
        ends = self._usual
        above = () if ends is None else remark_on(self.ron_t, ends, noisy=is_mostly_noise(self, ends))
        return (*above, *remarks_on(self.origin))

    def conforms(self, limit: float) -> str:
        """Return the decision on a limit of RONt by the interval of 95 %, without the tester's errors.

        Parameters
        ----------
        limit : float
            Limit, mm.

        Returns
        -------
        str
            "accepted" where the whole interval is within the limit, "rejected" where it is above, else "not
            decided"; that also where the steps of a separation do not agree. The interval is of the form
            without noise: a measured RONt above the limit may be accepted, which `verdict` says.
        """
        return ront_decision(self.interval(), limit_in_mm("limit", limit), self.origin.disagreement)

    def verdict(self, limit: float) -> str:
        """Return a sentence on a limit of RONt: value, interval and decision as of `conforms`, in µm.

        Parameters
        ----------
        limit : float
            Limit, mm.

        Returns
        -------
        str
            Without an interval "not decided", and why.

        Examples
        --------
        >>> from centering import Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
        >>> noise = 3e-4 * np.random.default_rng(0).normal(size=720)
        >>> noisy = Profile(angle, 30.0 + 0.001 * np.cos(3 * angle) + noise).filter(upr=50).roundness()
        >>> told, _, found = noisy.verdict(0.0023).partition("; ")
        >>> told
        'RONt (LSC) 2.36 µm as measured, 2.04 without the lift of noise (1.82 .. 2.20, 95 % calibrated)'
        >>> found  # by the whole interval
        'limit 2.3 µm: accepted after the correction for noise, as measured it is above the limit'
        """
        most = limit_in_mm("limit", limit)
        return ront_verdict(self, self._usual, most)

    def budget(self, instrument: Instrument, *, height: float | None = None) -> Budget:
        """Return the uncertainty budget of RONt by noise, form and tester.

        Parameters
        ----------
        instrument : Instrument
            Errors of the tester.
        height : float, optional
            Height of the section above the table, mm, which a spindle whose error grows with it needs.

        Returns
        -------
        Budget
            Table of the sources, total, interval and decision.

        Raises
        ------
        ValueError, TypeError
            For MCC and MIC, and after a robust filter, for which no bound is known; without noise in the
            profile and of the instrument; without a height that is needed.

        Examples
        --------
        >>> import numpy as np
        >>> from centering.roundness import Instrument, Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 1024, endpoint=False)
        >>> form, noise = 0.001 * np.cos(3 * angle), 0.0001 * np.random.default_rng(0).normal(size=1024)
        >>> found = Profile(angle, 30.0 + form + noise).filter("gaussian", upr=50).roundness()
        >>> for row in found.budget(Instrument(spindle_error=5e-5, gain_sd=0.01)).rows[:3]:
        ...     print(f"{row.source:14} {1e3 * row.contribution:.3f}")  # µm
        noise          0.037
        spindle error  0.020
        gain           0.020
        """
        return budget_of(self, instrument, height)

    def report(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        limits: Mapping[Any, float] | None = None,
        instrument: Instrument | None = None,
        height: float | None = None,
        harmonics: Harmonics | None = None,
        change: FormChange | None = None,
    ) -> str:
        """Write one HTML page to sign: decisions, parameters, circle, corrections, budget, source, digests.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder. None: only the text is returned.
        limits : mapping, optional
            Limits of "RONt", "RONp", "RONv", "RONq" about this circle, mm, and of harmonics after the
            filter, as of `Profile.harmonics`.
        instrument : Instrument, optional
            Errors of the tester, for the budget. None: the interval is that of noise and form. Where no
            budget is known, it is left out, and the page says why.
        height : float, optional
            Height of the section above the table, mm, as of `budget`.
        harmonics : Harmonics, optional
            Harmonics of the profile before the filter (mm, upr) with their own limits, which stand on the
            page instead of those after it.
        change : FormChange, optional
            Change since the measurement before grinding (mm), of `Profile.compare`. None: none is shown.

        Returns
        -------
        str
            The path of the file, or the text of the page.

        Raises
        ------
        ValueError
            For a limit of another name, not > 0, or above 0.5 mm; for limits of harmonics both before and
            after the filter; with an instrument as `budget`.
        ImportError
            With a path, without the extra ``report``.

        Examples
        --------
        >>> import numpy as np
        >>> from centering.roundness import Profile
        >>> angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
        >>> noise = 2e-5 * np.random.default_rng(0).normal(size=720)
        >>> form = Profile(angle, 30.0 + 0.001 * np.cos(3 * angle) + noise).filter(upr=50).roundness("MZC")
        >>> print(form.report(limits={"RONt": 0.0025}).splitlines()[3].partition("; ")[2])
        limit 2.5 µm: accepted (by noise alone)
        """
        asked = instrument is not None
        why = self.why_no_budget if asked else ""
        budget = self.budget(instrument, height=height) if instrument is not None and not why else None
        more = (limits, budget, harmonics, change, why)
        return str(called("centering.roundness._sheet:report", self, path, *more))

    def plot(self, ax: Any = None) -> Any:
        """Draw the profile magnified about the circle's centre, with circles and contacts; return the figure.

        A ring of the paper is a division of the scale, in µm; inner circles are dashed, contacts dots, the
        points of LSC farthest out and in triangles.

        Parameters
        ----------
        ax : matplotlib polar axes, optional
            Axes to draw into. Default: a new figure.
        """
        return called("centering.roundness._circle_picture:plot", self, ax)

    def __str__(self) -> str:
        return "\n".join([repr(self), *self.remarks])

    def __repr__(self) -> str:
        x, y = (np.round(self.center, 9) + 0.0).tolist()
        usual = self._usual
        spread = "" if usual is None else f" ({usual.ends}, 95 %)"
        contacts = f"; {self.contacts.size} contacts" if self.contacts.size else ""
        filtered = f"; {self.filter}" if self.filter else ""
        value = f"{self.value / units.um(1.0):.4g}{spread} µm"
        radius = f"{self.radius:.8g} mm" if self.origin.radius_known else "not known"
        place = f"about ({x:.6g}, {y:.6g}) mm, radius {radius}"
        return f"Roundness({self.kind}: RONt {value} {place}{contacts}{filtered})"
