"""Closed-form step response of Wang (8): PID plus feedforward with feedback of the true torque."""

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.optimize import brentq, minimize_scalar

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._gains import PidffGains
from sdpgrind.finishing.torque._loop import AxisLoop

_CURVE = 4000  # chosen: points of the search for extremes and crossings, before refinement


@dataclasses.dataclass(frozen=True)
class StepFigures:
    """Figures of a step response.

    Attributes
    ----------
    overshoot : float
        Overshoot over the step.
    peak_time : float
        s.
    settling : float
        Time from which the response stays within the band, s.
    band : float
        Half width of the band over the step.
    """

    overshoot: float
    peak_time: float
    settling: float
    band: float


def triple_pole_step(time: npt.ArrayLike, pole: float = 61.0, *, prefilter: bool = False) -> Floats:
    """Return T_f/T* after a step for Wang (8) with three poles at -p: 1 - exp(-x) (1 + x - x^2), x = p t.

    The zero at -p/3 causes an overshoot of 5 exp(-3) = 24.9 % at t = 3/p; a prefilter p/(3 s + p) cancels it:
    1 - exp(-x) (1 + x + x^2/2).

    Parameters
    ----------
    time : array
        s.
    pole : float
        p, 1/s.
    prefilter : bool
        Whether with prefilter.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.torque.triple_pole_step([0.01, 0.02, 0.05, 0.1, 0.15]).round(6).tolist()
    [0.327386, 0.78401, 1.248753, 1.067533, 1.007815]
    """
    x = checks.positive("pole", pole, "1/s") * checks.finite_array("time", time, "s")
    curve = 1.0 + x + 0.5 * x**2 if prefilter else 1.0 + x - x**2
    return np.asarray(1.0 - np.exp(-x) * curve)


def contact_step(
    time: npt.ArrayLike, axis: TorqueAxis | None = None, gains: PidffGains | None = None
) -> Floats:
    """Return T_f/T* after a step for Wang (8) with any gains, by its error equation.

    That equation is (7) corrected: e'' + k_fd e' + (k_fp + k_e/J) e + k_fi int e = (k_e/J) T_L, here with T_L
    = 0. As printed, its first line has e' for e'' and neither k_fp nor k_e/J before T_L; its second is one
    order too low.

    Parameters
    ----------
    time : array
        s, >= 0.
    axis : TorqueAxis, optional
        Default: that of the source.
    gains : PidffGains, optional
        Default: those of the source.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.torque.contact_step([0.01, 0.02, 0.05, 0.1, 0.15]).round(6).tolist()
    [0.327386, 0.78401, 1.248753, 1.067533, 1.007815]
    """
    axis, gains = TorqueAxis() if axis is None else axis, PidffGains() if gains is None else gains
    stiff = gains.kp + axis.contact_angular_stiffness / axis.inertia
    chain = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-gains.ki, -stiff, -gains.kd]])  # of e, e', e''
    start = np.array([1.0, 0.0, -stiff])  # torque and its rate begin at 0, its acceleration at k_fp + k_e/J
    times = checks.finite_array("time", time, "s")
    return np.asarray(1.0 - (scipy.linalg.expm(times[..., np.newaxis, np.newaxis] * chain) @ start)[..., 0])


def step_figures(
    answer: Callable[[Floats], Floats] | AxisLoop, *, horizon: float = 1.0, band: float = 0.02
) -> StepFigures:
    """Return overshoot, peak and settling of a step response.

    Parameters
    ----------
    answer : callable or AxisLoop
        Torque over the step at times (n,) in s; or a loop from `TorqueController.loop`.
    horizon : float
        Duration, s.
    band : float
        Half width of the band over the step.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> figures = fin.torque.step_figures(fin.torque.triple_pole_step)
    >>> round(figures.overshoot, 5), round(figures.peak_time, 5), round(figures.settling, 4)  # 1, s, s
    (0.24894, 0.04918, 0.1293)
    """
    end, share = checks.positive("horizon", horizon, "s"), checks.share("band", band)
    curve = (lambda t: answer.step_response(t)[..., 0]) if isinstance(answer, AxisLoop) else answer
    time = np.linspace(0.0, end, _CURVE + 1)
    values = np.asarray(curve(time))
    k = int(np.argmax(values))
    near = (time[max(k - 1, 0)], time[min(k + 1, _CURVE)])
    found = minimize_scalar(
        lambda t: -float(curve(np.array([t]))[0]),
        bounds=near,
        method="bounded",
        options={"xatol": 1e-12 * end},
    )
    return StepFigures(
        max(-float(found.fun) - 1.0, 0.0), float(found.x), _settled(curve, time, values, share), share
    )


def _settled(curve: Callable[[Floats], Floats], time: Floats, values: Floats, band: float) -> float:
    outside = np.flatnonzero(np.abs(values - 1.0) > band)
    if not outside.size:
        return 0.0
    k = int(outside[-1])
    if k == time.size - 1:
        return float("inf")
    return float(brentq(lambda t: abs(float(curve(np.array([t]))[0]) - 1.0) - band, time[k], time[k + 1]))
