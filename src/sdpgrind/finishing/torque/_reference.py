"""Torque reference: along a motion, with friction and contact angle, or on the lever arm alone."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque._axis import TorqueAxis


@dataclasses.dataclass(frozen=True, eq=False)
class TorqueReference:
    """Times of the motion (s), contact torque (N m), known load torque (N m), torque over force (N m/N)."""

    time: Floats
    torque: Floats
    load: Floats
    per_force: Floats


def reference(
    axis: TorqueAxis, motion: Any, normal_force: float, load_torque: npt.ArrayLike
) -> TorqueReference:
    """Reference along a motion; refused where it exceeds the current limit."""
    time, per_force = (
        (np.zeros(1), np.array([1e-3 * axis.lever_arm])) if motion is None else _motion(motion, axis)
    )
    load = checks.finite_array("load_torque", load_torque, "N m")
    if load.shape not in ((), time.shape):
        raise ValueError(
            f"load_torque must be one number or {time.size}, one for each time of the motion;"
            f" got shape {load.shape}"
        )
    # in a lift the tool does not press; what measures forces still divides by the lever
    pressed = np.asarray(getattr(motion, "contact", True), dtype=float)
    found = TorqueReference(
        time, normal_force * per_force * pressed, np.array(np.broadcast_to(load, time.shape)), per_force
    )
    _check_current(axis, found)
    return found


def _motion(motion: Any, axis: TorqueAxis) -> tuple[Floats, Floats]:
    missing = [name for name in ("time", "torque_per_force", "profile") if not hasattr(motion, name)]
    if missing:
        raise TypeError(
            f"motion must be a motion, as plan(problem) gives it, or None; it has no {', '.join(missing)}"
        )
    planned = getattr(getattr(motion, "problem", None), "lever_arm", axis.lever_arm)
    if planned != axis.lever_arm:
        raise checks.refuse("axis.lever_arm", f"that of the motion, {planned:g}", axis.lever_arm, "mm")
    # a copy, as that of a motion is read-only: kernels are compiled for one kind of array
    time = np.array(checks.finite_array("motion.time", motion.time, "s"), order="C")
    per_force = np.ascontiguousarray(
        checks.finite_array("motion.torque_per_force", motion.torque_per_force, "N m/N")
    )
    if time.ndim != 1 or not time.size or per_force.shape != time.shape:
        raise ValueError(
            "motion.torque_per_force must have one number for each time;"
            f" got {per_force.shape} and {time.shape}"
        )
    if time[0] != 0.0 or np.any(np.diff(time) < 0):
        raise ValueError("motion.time must begin at 0 and rise (s)")
    if np.any(per_force <= 0):
        raise checks.refuse("motion.torque_per_force", "> 0", float(per_force.min()), "N m/N")
    return time, per_force


def _check_current(axis: TorqueAxis, found: TorqueReference) -> None:
    """Refuse a torque beyond the motor."""
    current = (found.torque + found.load) / axis.torque_constant
    k = int(np.argmax(np.abs(current)))
    if abs(current[k]) > axis.current_limit:
        told = f"{found.torque[k]:.4g} N m and a load of {found.load[k]:.4g} N m need {current[k]:.4g} A"
        limit = f"current_limit = {axis.current_limit:g} A"
        raise ValueError(f"normal_force must be one that the motor can press: {told}, more than {limit}")
