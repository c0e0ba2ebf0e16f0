"""An interval for RONt, with its method."""

from math import ceil, log10

from sdpgrind.base import checks
from sdpgrind.base.quantities import Described, another_unit, custom, described, quantity
from sdpgrind.base.results import Result
from sdpgrind.base.units import UM

CALIBRATED, GUARANTEED, WORST = "calibrated", "guaranteed", "worst case of the spindle"
ACCEPTED, REJECTED, NOT_DECIDED = "accepted", "rejected", "not decided"
_SHOWN = 1e-3  # chosen: least width over the value that adds digits; an interval without width has five
_USUAL, _TYPICAL = (1e-6, 0.5), 0.003  # mm; chosen: limits of roundness, from a gauge's ball to a forged ring


@described("centering.roundness_interval")
class RoundnessInterval(Described, Result):
    """An interval for RONt, the result of `Roundness.interval`.

    Parameters
    ----------
    low, high : float
        Both ends, mm.
    value : float
        RONt without what the noise lifts it by, mm; of the guaranteed method the measured RONt.
    confidence : float
        Chance that such an interval holds the truth, unit 1.
    method : {"calibrated", "guaranteed"} or str
        Method; of `Budget.worst_case` "worst case of the spindle".

    Examples
    --------
    >>> RoundnessInterval(0.0019, 0.0021, 0.002, 0.95, "calibrated")
    RoundnessInterval(1.90 .. 2.10 µm, 95 %, calibrated)
    """

    low: float = quantity("mm", at_least=0)
    high: float = quantity("mm", at_least=0)
    value: float = quantity("mm", at_least=0)
    confidence: float = quantity("1", above=0, below=1)
    method: str = custom()

    def __repr__(self) -> str:
        chance = f"{100 * self.confidence:g} %"
        if self.method == WORST:  # an extreme: the chance is that of the other sources
            return f"RoundnessInterval({self.ends} µm, {WORST}; by the other sources {chance})"
        return f"RoundnessInterval({self.ends} µm, {chance}, {self.method})"

    @property
    def ends(self) -> str:
        """Both ends as text, µm (not mm), to a hundredth of the width."""
        return f"{1e3 * self.low:.{self._places}f} .. {1e3 * self.high:.{self._places}f}"

    @property
    def middle(self) -> str:
        """The value as text, µm (not mm), to a hundredth of the width."""
        return f"{1e3 * self.value:.{self._places}f}"

    @property
    def _places(self) -> int:
        width = 1e3 * (self.high - self.low)
        return max(0, 2 - ceil(log10(max(width, _SHOWN * 1e3 * self.high, 1e-6))))


def remark_on(measured: float, ends: RoundnessInterval, *, noisy: bool = False) -> tuple[str, ...]:
    """Sentence on a measured RONt (mm) that is `noisy`, mostly noise, or above its own interval.

    It is never below it.

    Of noise e and -e one at least raises RONt, a convex function of the form: the lower end, V less the
    97.5 % quantile of the lift, is below the measured V.
    """
    if noisy:
        return (
            f"most of the measured RONt of {UM * measured:.4g} µm is noise: no correction for noise is known"
            " there, and the interval is the guaranteed one",
        )
    if measured <= ends.high:
        return ()
    return (
        f"the measured RONt of {UM * measured:.4g} µm is above its interval: noise lifts the measured"
        " value, and the interval is that of the form without noise",
    )


def limit_in_mm(name: str, given: float) -> float:
    """A limit of roundness in mm; one in micrometres is refused."""
    limit = checks.positive(name, given, "mm")
    if not _USUAL[0] <= limit <= _USUAL[1]:
        raise ValueError(another_unit(name, limit, "mm", _USUAL, _TYPICAL))
    return limit


def decided(ends: RoundnessInterval, limit: float) -> str:
    """Decision on a limit (mm) by an interval (ISO 14253-1)."""
    return ACCEPTED if ends.high <= limit else REJECTED if ends.low > limit else NOT_DECIDED
