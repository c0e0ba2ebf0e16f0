"""Result of every estimator: values with their covariance, a status and a sentence."""

import dataclasses
from enum import StrEnum

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri, stdtrit

from sdpgrind.base import checks, notebook
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored


class Status(StrEnum):
    """Outcome of an estimation: its cause and the remedy, in words. No unit.

    For "not identified" the message of the estimate gives the reason: faulty, too few or uninformative
    readings. For "does not fit" it gives what the residuals of the model are.
    """

    OK = "the data determine the values"
    UNSURE = "determined, but not yet as surely as was asked"
    UNDETERMINED = "the data do not determine all values: take points at more, and more different, conditions"
    NOT_IDENTIFIED = "not identified"
    MISFIT = "does not fit"
    IMPOSSIBLE = "the values are physically impossible: look for bad readings or a wrong unit"


@stored("identify.estimate")
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Estimate(Frozen):
    """Estimated values with their covariance.

    Parameters
    ----------
    names : tuple of str
        Names of the p values.
    value : array, shape (p,)
        Values, in `units`.
    covariance : array, shape (p, p)
        Their covariance, in products of `units`.
    status : Status
        Outcome.
    message : str
        Sentence on the data. Default: that of the status.
    units : tuple of str
        Unit of each value, for display only.
    freedom : float
        Degrees of freedom of the covariance, unit 1. inf: the noise was known.
    noise_sd : float
        Standard deviation of a reading about the model, in the unit of the readings. 0: not estimated.
    noise_correlation : float
        Correlation of the noise from one reading to the next, unit 1. 0: white.

    Raises
    ------
    ValueError
        When the shapes do not agree.

    Examples
    --------
    >>> estimate = Estimate(("specific_energy", "idle_power"), [10.0, 100.0], [[0.01, 0.0], [0.0, 4.0]],
    ...                     units=("J/mm^3", "W"))
    >>> estimate["idle_power"], estimate.sd.tolist()
    (100.0, [0.1, 2.0])
    >>> estimate
    Estimate(specific_energy = 10 ± 0.1 J/mm^3, idle_power = 100 ± 2 W; the data determine the values)
    """

    names: tuple[str, ...]
    value: Floats
    covariance: Floats
    status: Status = Status.OK
    message: str = ""
    units: tuple[str, ...] = ()
    freedom: float = np.inf
    noise_sd: float = dataclasses.field(default=0.0, kw_only=True)
    noise_correlation: float = dataclasses.field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        size = len(checks.unique("names", self.names))
        value, covariance = np.array(self.value, dtype=float), np.array(self.covariance, dtype=float)
        if value.shape != (size,) or covariance.shape != (size, size):
            raise ValueError(
                f"value and covariance must be of shape {(size,)} and {(size, size)} for {size} names;"
                f" got {value.shape} and {covariance.shape}"
            )
        value.flags.writeable = covariance.flags.writeable = False
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "covariance", covariance)
        object.__setattr__(self, "status", Status(self.status))
        object.__setattr__(self, "message", self.message or str(self.status))
        object.__setattr__(self, "units", tuple(self.units) or ("",) * size)

    def __getitem__(self, name: str) -> float:
        """Return the value of `name`, in its unit."""
        return float(self.value[self.names.index(checks.one_of("name", name, self.names))])

    @property
    def ok(self) -> bool:
        """Whether the values may be used."""
        return self.status is Status.OK

    @property
    def sd(self) -> Floats:
        """Standard deviations, shape (p,), in `units`."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Floats:
        """Correlations, shape (p, p), unit 1; 0 where a standard deviation is 0 or infinite."""
        sd = np.where(np.isfinite(self.sd) & (self.sd > 0), self.sd, np.inf)
        off = np.where(np.isfinite(self.covariance), self.covariance, 0.0) / np.outer(sd, sd)
        return np.asarray(np.where(np.eye(len(self.names), dtype=bool), 1.0, off))

    def interval(self, confidence: float = 0.95) -> Floats:
        """Return the ends of the two-sided interval of each value.

        Parameters
        ----------
        confidence : float
            Probability in (0, 1) that an interval holds the true value, unit 1.

        Returns
        -------
        array, shape (p, 2)
            Low and high end, in `units`, in the order of `names`; Student's law with `freedom` degrees of
            freedom.

        Examples
        --------
        >>> found = Estimate(("specific_energy", "idle_power"), [10.0, 100.0], [[0.01, 0.0], [0.0, 4.0]])
        >>> dict(zip(found.names, found.interval().round(2).tolist(), strict=True))
        {'specific_energy': [9.8, 10.2], 'idle_power': [96.08, 103.92]}
        """
        share = 0.5 + checks.probability("confidence", confidence) / 2
        reach = (stdtrit(self.freedom, share) if np.isfinite(self.freedom) else ndtri(share)) * self.sd
        return np.stack([self.value - reach, self.value + reach], axis=1)

    def __repr__(self) -> str:
        units = ("" if unit == "1" else unit for unit in self.units)
        rows = zip(self.names, self.value, self.sd, units, strict=True)
        shown = ", ".join(
            f"{name} = {value:.6g} ± {sd:.2g} {unit}".rstrip() if sd < np.inf else f"{name} not determined"
            for name, value, sd, unit in rows
        )
        return f"Estimate({shown}; {self.message})"

    def _repr_html_(self) -> str:
        ends = self.interval()
        rows = [
            (name, f"{value:.6g}", f"{sd:.2g}", f"{low:.6g} to {high:.6g}", "" if unit == "1" else unit)
            if sd < np.inf
            else (name, "not determined", "", "", "")
            for name, value, sd, (low, high), unit in zip(
                self.names, self.value, self.sd, ends, self.units, strict=True
            )
        ]
        head = ("name", "value", "standard deviation", "95 % interval", "unit")
        return notebook.table(f"Estimate: {self.message}", head, rows)


def finished(estimate: Estimate, throw: bool) -> Estimate:
    """Return `estimate`; raise its message if it failed and `throw` is set."""
    if throw and not estimate.ok:
        raise ValueError(estimate.message)
    return estimate


def columns(**arrays: npt.ArrayLike) -> tuple[Floats, ...]:
    """Return finite one-dimensional float arrays of one length; an error names the array at fault."""
    checked = [checks.finite_array(name, values) for name, values in arrays.items()]
    for name, values in zip(arrays, checked, strict=True):
        if values.ndim != 1 or values.size != checked[0].size:
            raise ValueError(
                f"{name} must be one-dimensional with {checked[0].size} entries; got shape {values.shape}"
            )
    return tuple(checked)
