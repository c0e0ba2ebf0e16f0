"""Runs of the torque axis under a controller: exact between samples, over the phases of the encoder."""

from collections.abc import Callable
from math import cos, pi

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque import _batch_kernels as columns
from sdpgrind.finishing.torque._axis import TorqueAxis, true_axis
from sdpgrind.finishing.torque._batch_kernels import batch
from sdpgrind.finishing.torque._controller import TorqueController
from sdpgrind.finishing.torque._record import AxisRecord

_STARTS = ("touching", "pressed")


def simulate_axis(
    controller: TorqueController,
    *,
    truth: TorqueAxis | None = None,
    duration: float = 1.0,
    height_error: Callable[[Floats], npt.ArrayLike] | None = None,
    load_torque: float | Callable[[Floats], npt.ArrayLike] = 0.0,
    start_angles: int | npt.ArrayLike = 20,
    start: str = "touching",
) -> AxisRecord:
    """Run the axis under a controller, from several start angles in one compiled call.

    Between samples the axis moves exactly, in contact and in flight; the surface is linear and the load
    torque constant. The phase of the surface within an encoder count decides the effect of rounding: average
    over it.

    Parameters
    ----------
    controller : TorqueController
        Controller; its own state is not changed.
    truth : TorqueAxis, optional
        True axis, at the sample time of the controller. Default: the believed one.
    duration : float
        Duration of a run, s.
    height_error : callable, optional
        Height of the surface above plan (mm) at times (n,) in s. Default: 0.
    load_torque : float or callable
        True load torque T_L, N m: constant, or at times (n,) in s.
    start_angles : int or array (runs,)
        Number of surfaces, evenly spread over an encoder count; or their angles, rad.
    start : {"touching", "pressed"}
        Axis at rest at first touch, or at the reference force.

    Returns
    -------
    AxisRecord
        Runs over time.

    Raises
    ------
    ValueError
        A value is out of range, or a function gives NaN.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> controller = fin.TorqueController(fin.TorqueAxis(), normal_force=1.111, kind="lqg")
    >>> figures = fin.torque.simulate_axis(controller).figures
    >>> round(figures["settling_2"], 3), round(figures["overshoot"], 3), round(figures["ripple"], 3)
    (0.064, 0.007, 0.005)
    """
    checks.kind("controller", controller, TorqueController)
    axis = true_axis(controller.axis, truth)
    time = _times(duration, controller.period)
    height = _along("height_error(time)", height_error, time, "mm")
    load = _along("load_torque(time)", load_torque, time, "N m")
    offsets, law = _offsets(axis, start_angles), controller.law
    known = controller.reference
    depth = (
        known.torque[0] / axis.contact_angular_stiffness
        if checks.one_of("start", start, _STARTS) == "pressed"
        else 0.0
    )
    out = np.empty((offsets.size, time.size - 1, columns.COLUMNS))
    angles, resolution = height / _rise(controller, axis), 2 * pi / axis.encoder_counts
    reference = law.parameters, law.start, law.time, law.torque
    batch(*reference, axis.parameters, resolution, offsets, depth, angles, load, out)
    return _record(controller, axis, time[:-1], height[:-1], out)


def _rise(controller: TorqueController, axis: TorqueAxis) -> float:
    """Rise of the tip per angle, mm/rad: R cos(theta_f)."""
    tilt = getattr(getattr(controller.motion, "problem", None), "contact_angle", 0.0)
    return axis.lever_arm * cos(tilt)


def _record(
    controller: TorqueController, axis: TorqueAxis, time: Floats, height: Floats, out: Floats
) -> AxisRecord:
    longer = axis.lever_arm / controller.axis.lever_arm
    known, played = controller.reference, out[..., columns.PATH_TIME]
    torque = out[..., columns.TORQUE]
    return AxisRecord(
        time=time,
        angle=out[..., columns.SHOWN],
        current=out[..., columns.CURRENT],
        contact_torque=torque,
        estimate=out[..., columns.ESTIMATE] - np.interp(played, known.time, known.load),
        normal_force=torque / (longer * np.interp(played, known.time, known.per_force)),
        target_force=float(controller.normal_force),
        height_error=height,
    )


def _times(duration: float, step: float) -> Floats:
    """Times of the samples and of the end."""
    samples = round(checks.positive("duration", duration, "s") / step)
    if samples < 2:
        raise checks.refuse("duration", f">= {2 * step:g}, two samples", duration, "s")
    return np.asarray(np.arange(samples + 1) * step, dtype=float)


def _along(
    name: str, given: float | Callable[[Floats], npt.ArrayLike] | None, time: Floats, unit: str
) -> Floats:
    """Number or function of time, at all times."""
    if given is None:
        return np.zeros(time.size)
    if not callable(given):
        return np.full(time.size, checks.number(name.removesuffix("(time)"), given, unit))
    values = checks.finite_array(name, given(time), unit)
    if values.shape not in ((), time.shape):
        raise ValueError(
            f"{name} must have one value for each time ({unit}); got shape {values.shape} for {time.shape}"
        )
    return np.array(np.broadcast_to(values, time.shape))


def _offsets(axis: TorqueAxis, start_angles: int | npt.ArrayLike) -> Floats:
    if isinstance(start_angles, int | np.integer):
        count = checks.count("start_angles", start_angles)
        return np.array([(k + 0.5) / count * axis.angle_step for k in range(count)])
    angles = np.ascontiguousarray(checks.finite_array("start_angles", start_angles, "rad"))
    if angles.ndim != 1 or not angles.size:
        raise checks.refuse("start_angles", "a number, or of shape (runs,)", angles.shape)
    return angles
