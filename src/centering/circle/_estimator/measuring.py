"""The controller that turns the part and stops the machine when the estimator is valid."""

from collections.abc import Mapping
from math import isfinite, nan, pi
from typing import Any, ClassVar

from centering.circle._estimator.estimator import GeometryEstimator
from sdpgrind.base import checks
from sdpgrind.identify import Status

_KNOWN = (Status.OK, Status.UNSURE)
_FEWEST = 3  # derived: fewer readings determine no circle


class MeasuringController:
    """Turn the part until its centre is certain enough; see `hwsim.protocols.Controller`.

    Each sample with a reading goes to the estimator. Once that is valid, or after `turns_max`, the controller
    commands ``stop``. It reports ``radius``, ``center_x``, ``center_y`` and their ``band`` (mm), and
    ``valid`` (1: certain enough), from the sample on that determines a circle.

    Parameters
    ----------
    estimator : GeometryEstimator
        Streaming estimator, reset at each part; a copy of the controller has an estimator of its own.
    turns_max : float
        Limit of turns, unit 1.
    period : float, optional
        Time between two samples, s, on a machine that can be read at any time; None: one at each sample of
        the machine.

    Raises
    ------
    ValueError
        When turns or period are not positive.
    TypeError
        When `estimator` is no estimator.

    Examples
    --------
    >>> import centering, hwsim
    >>> estimator = centering.GeometryEstimator(noise_sd=0.0012, tip_radius=3.75, confidence=0.999)  # mm
    >>> controller = centering.MeasuringController(estimator)
    >>> log = hwsim.run(hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5)), controller)
    >>> last = log["probe"].isel(row=-1)
    >>> error = abs(last.center_x_planned - log.outcome.true_center_x[0])
    >>> bool(log.outcome.turns[0] < 0.5), bool(error < 0.108)  # mm
    (True, True)
    """

    tier: ClassVar[str] = "probe"
    reads: ClassVar[Mapping[str, str]] = {"angle": "rad", "reading": "mm"}
    commands: ClassVar[Mapping[str, str]] = {"stop": ""}
    reports: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("radius", "center_x", "center_y", "band"), "mm"),
        "valid": "",
    }

    def __init__(
        self, estimator: GeometryEstimator, *, turns_max: float = 10.0, period: float | None = None
    ) -> None:
        self.estimator = checks.able(
            "estimator", estimator, "an estimator such as centering.GeometryEstimator()", "update", "reset"
        )
        self.turns_max = checks.positive("turns_max", turns_max, "turns")
        self.period = None if period is None else checks.positive("period", period, "s")
        self._begun, self._valid, self._taken = nan, False, 0

    def reset(self) -> None:
        """Forget the part before."""
        self.estimator.reset()
        self._begun, self._valid, self._taken = nan, False, 0

    def step(self, *, angle: float, reading: float, **others: Any) -> dict[str, float]:
        """Take a sample; return ``stop`` when the measurement is complete.

        Parameters
        ----------
        angle : float
            Spindle angle, rad.
        reading : float
            Position of the surface on the probe line, mm from the axis; NaN: no reading.
        **others
            Other measurements of the plant; ignored.
        """
        if isfinite(angle) and isfinite(reading):
            self.estimator.update(angle=angle, reading=reading)
            self._taken += 1
        if not isfinite(self._begun):
            self._begun = angle
        self._valid = self.estimator.valid
        stop = self._valid or abs(angle - self._begun) >= 2 * pi * self.turns_max
        return {"stop": 1.0} if stop else {}

    def report(self) -> dict[str, float]:
        """Return radius, centre and band (mm) and validity; empty while no circle is determined."""
        if self._taken < _FEWEST or (circle := self.estimator.estimate).status not in _KNOWN:
            return {}
        where = {"radius": circle.radius, "center_x": circle.center_x, "center_y": circle.center_y}
        return {**where, "band": self.estimator.band, "valid": float(self._valid)}
