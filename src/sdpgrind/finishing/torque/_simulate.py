"""Runs of the torque axis under a controller: exact between samples, digital at them, over the phases of the encoder."""

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

    Between samples the axis moves exactly, in contact and in flight; the surface is straight and the load torque held. Where in a
    count of the encoder the surface lies decides what rounding does: figures are to be averaged over it.

    Parameters
    ----------
    controller : TorqueController
        Its own state is left alone.
    truth : TorqueAxis, optional
        The axis as it really is, at the sample time of the controller; by default as the controller believes it to be.
    duration : float
        s.
    height_error : callable, optional
        How much higher than planned the surface is (mm) at times (n,) in s; none: as planned.
    load_torque : float or callable
        Load torque T_L, N m: constant, or at times (n,) in s; whatever the controller knows of it.
    start_angles : int or array (runs,)
        How many surfaces, spread evenly over a count of the encoder; or their angles, rad.
    start : {"touching", "pressed"}
        The axis at rest as it just touches, or pressed as hard as it shall.

    Returns
    -------
    AxisRecord
        Runs over time.

    Raises
    ------
    ValueError
        When a value is out of range, or a function gives NaN.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> record = fin.torque.simulate_axis(fin.TorqueController(fin.TorqueAxis(), normal_force=1.111, kind="lqg"))
    >>> {name: round(value, 3) for name, value in record.figures.items()}  # s, s, 1, N, N, N
    {'settling_2': 0.064, 'settling_5': 0.053, 'overshoot': 0.007, 'ripple': 0.005, 'rms_error': 0.005, 'offset': 0.001}
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
    batch(
        law.parameters, law.start, law.time, law.torque, axis.parameters, resolution, offsets, depth, angles, load, out
    )  # fmt: skip
    return _record(controller, axis, time[:-1], height[:-1], out)


def _rise(controller: TorqueController, axis: TorqueAxis) -> float:
    """By how much the tip rises for an angle, mm/rad: R cos(theta_f)."""
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
    """Times of the samples, and that of the end."""
    samples = round(checks.positive("duration", duration, "s") / step)
    if samples < 2:
        raise checks.refuse("duration", f">= {2 * step:g}, two samples", duration, "s")
    return np.asarray(np.arange(samples + 1) * step, dtype=float)


def _along(
    name: str, given: float | Callable[[Floats], npt.ArrayLike] | None, time: Floats, unit: str
) -> Floats:
    """A number, or a function of time, at all times."""
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
