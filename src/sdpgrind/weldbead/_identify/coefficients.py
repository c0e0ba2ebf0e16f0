"""K1, K2 and mu from readings: removal rate regressed on power, tangential on normal force."""

from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks, serial
from sdpgrind.base.checks import Floats

POWER = ("specific_energy", "idle_power")
_LINE = ("at_no_power", "per_watt")  # removal rate = at_no_power + per_watt * power
_POWER_UNITS = ("J/mm^3", "W")
FRICTION = ("friction_ratio",)
_RARELY = 0.01  # chosen: probability of so alike residuals by chance from which the estimate says it
_ORDERED = (
    "residuals resemble those of the pass before (Durbin-Watson {d:.2f}, by chance {share:.2g}):"
    " the interval is too short"
)
_OF_POWER = {"grinding_power": "W", "removal_rate": "mm^3/s"}
_OF_FRICTION = {"normal_force": "N", "tangential_force": "N"}


def estimate_power(
    data: Any, method: str, *, forgetting: float, noise_ratio: float | None, throw: bool
) -> idf.Estimate:
    """K1 and K2 of Pi = K1 Q + K2, by one of `POWER_METHODS`."""
    read = idf.readings(data, _OF_POWER, tier="sequence", each="passes").require(3).levels("grinding_power")
    power, rate = read["grinding_power"], read["removal_rate"]
    if method == "total":
        if noise_ratio is None:
            raise ValueError(
                "noise_ratio must be given with method 'total': sd of the power's noise over that of the "
                "removal rate's (J/mm^3); got None"
            )
        fit = _swapped(idf.total_least_squares(rate, power, noise_ratio=noise_ratio, throw=throw))
    elif method == "printed":
        fit = _swapped(
            _ordered(idf.least_squares(_with_one(rate), power, throw=throw), _with_one(rate), power)
        )
    elif method == "recursive":
        fit = _coefficients(_recursive(_LINE, _with_one(power), rate, forgetting))
    else:
        line = idf.least_squares(_with_one(power), rate, names=_LINE, throw=throw)
        fit = _coefficients(_ordered(line, _with_one(power), rate))
    return _concluded(fit, read, throw)


def estimate_friction(data: Any, method: str, *, forgetting: float, throw: bool) -> idf.Estimate:
    """Ratio mu = F_t'F_n/F_n'F_n, by one of `FRICTION_METHODS`.

    By regression with the variance of MacKinnon and White's HC3, as noise of forces may grow with them.
    """
    read = idf.readings(data, _OF_FRICTION, tier="sequence", each="passes").require(3)
    normal, tangential = read["normal_force"][:, None], read["tangential_force"]
    if method == "recursive":
        fit = _recursive(FRICTION, normal, tangential, forgetting, units=("1",))
    else:
        fit = idf.least_squares(normal, tangential, names=FRICTION, units=("1",), throw=throw)
        fit = _ordered(_uneven(fit, normal[:, 0], tangential), normal, tangential)
    return _concluded(fit, read, throw)


POWER_METHODS = ("regression", "total", "recursive", "printed")
FRICTION_METHODS = ("regression", "recursive")


def _with_one(x: Floats) -> Floats:
    return np.column_stack([np.ones(x.size), x])


def _uneven(fit: idf.Estimate, x: Floats, y: Floats) -> idf.Estimate:
    """Slope through the origin with the variance sum (x e/(1 - h))^2/(sum x^2)^2, h = x^2/sum x^2."""
    if not fit.ok:
        return fit
    square = float(x @ x)
    left = (y - fit.value[0] * x) / (1 - np.minimum(x * x / square, 0.999))
    return fit.replace(covariance=np.full((1, 1), float(np.sum((x * left) ** 2)) / square**2))


def _ordered(fit: idf.Estimate, matrix: Floats, target: Floats) -> idf.Estimate:
    """Say where residuals resemble those of the pass before (Durbin-Watson), so are no white noise."""
    if not fit.ok:
        return fit
    d, share = serial.durbin_watson(target - matrix @ fit.value, matrix)
    return fit.replace(message=_ORDERED.format(d=d, share=share)) if share < _RARELY else fit


def _recursive(
    names: tuple[str, ...], rows: Floats, goal: Floats, forgetting: float, units: tuple[str, ...] = ()
) -> idf.Estimate:
    rls = idf.RecursiveLeastSquares(names, forgetting=forgetting, units=units)
    for row, target in zip(rows, goal, strict=True):
        rls.update(row, float(target))
    return rls.estimate


def _swapped(line: idf.Estimate) -> idf.Estimate:
    """Estimate of (K1, K2) from that of the line power = K2 + K1 rate."""
    return line.replace(
        names=POWER, value=line.value[::-1], covariance=line.covariance[::-1, ::-1], units=_POWER_UNITS
    )


def _coefficients(line: idf.Estimate) -> idf.Estimate:
    """Estimate of K1 = 1/b, K2 = -a/b from that of the line rate = a + b power."""
    a, b = line.value
    if not line.ok or b <= 0:
        status = idf.Status.UNDETERMINED if not line.ok else idf.Status.IMPOSSIBLE
        endless = np.diag(np.full(2, np.inf))
        return line.replace(
            names=POWER, value=np.zeros(2), covariance=endless, status=status, message="", units=_POWER_UNITS
        )
    slope = np.array([[0.0, -1 / b**2], [-1 / b, a / b**2]])
    value, covariance = np.array([1 / b, -a / b]), slope @ line.covariance @ slope.T
    return line.replace(names=POWER, value=value, covariance=covariance, units=_POWER_UNITS)


def _concluded(fit: idf.Estimate, read: idf.Readings, throw: bool) -> idf.Estimate:
    """Complete the estimate with its data; fail one without physical sense."""
    if fit.ok and fit.value[0] <= 0:  # specific energy or friction ratio
        fit = fit.replace(status=idf.Status.IMPOSSIBLE)
    if throw and not fit.ok:
        raise ValueError(f"{fit.status} ({read.message})")
    told = f"; {fit.message}" if fit.message != str(fit.status) else ""
    return fit.replace(message=f"{fit.status} ({read.message})" if not fit.ok else read.message + told)


class _Streaming:
    """Recursive regression of readings by name."""

    def __init__(self, names: tuple[str, ...], units: tuple[str, ...], forgetting: float) -> None:
        self._rls = idf.RecursiveLeastSquares(names, forgetting=forgetting, units=units)

    def reset(self) -> None:
        """Forget every pass."""
        self._rls.reset()


class PowerEstimator(_Streaming):
    """Specific energy and idle power, pass by pass: removal rate regressed on power with forgetting.

    Parameters
    ----------
    forgetting : float
        Weight of a pass relative to the next, in (0, 1], unit 1.

    Raises
    ------
    ValueError
        When the forgetting is out of range.

    Examples
    --------
    >>> estimator = PowerEstimator(forgetting=0.95)
    >>> for power in (200.0, 300.0, 400.0):
    ...     estimator.update(grinding_power=power, removal_rate=(power - 100.0) / 10.0)
    >>> round(estimator.estimate["specific_energy"], 6), round(estimator.estimate["idle_power"], 6)
    (10.0, 100.0)
    """

    def __init__(self, *, forgetting: float = 1.0) -> None:
        super().__init__(_LINE, (), forgetting)

    def update(self, *, grinding_power: float, removal_rate: float) -> None:
        """Take in the power (W) and removal rate (mm^3/s) of a pass."""
        power = checks.number("grinding_power", grinding_power, "W")
        self._rls.update([1.0, power], checks.number("removal_rate", removal_rate, "mm^3/s"))

    @property
    def estimate(self) -> idf.Estimate:
        """Estimate of ``specific_energy`` (J/mm^3) and ``idle_power`` (W); not ok until determined."""
        return _coefficients(self._rls.estimate)


class FrictionEstimator(_Streaming):
    """Ratio of tangential to normal force (unit 1), pass by pass, with forgetting; see `PowerEstimator`.

    Examples
    --------
    >>> estimator = FrictionEstimator()
    >>> for force in (20.0, 40.0):
    ...     estimator.update(normal_force=force, tangential_force=0.3 * force)
    >>> round(estimator.estimate["friction_ratio"], 6)
    0.3
    """

    def __init__(self, *, forgetting: float = 1.0) -> None:
        super().__init__(FRICTION, ("1",), forgetting)

    def update(self, *, normal_force: float, tangential_force: float) -> None:
        """Take in the normal and the tangential force (N) of a pass."""
        normal = checks.number("normal_force", normal_force, "N")
        self._rls.update([normal], checks.number("tangential_force", tangential_force, "N"))

    @property
    def estimate(self) -> idf.Estimate:
        """Estimate of ``friction_ratio`` (unit 1); not ok until determined."""
        return self._rls.estimate
