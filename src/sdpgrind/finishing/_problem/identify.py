"""From finished parts and free motion back to the model: roughness and load torque."""

from collections.abc import Sequence
from typing import Any

from sdpgrind.base import checks
from sdpgrind.finishing.roughness._fit import identify_roughness
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._load_torque import identify_load_torque
from sdpgrind.identify import Estimate


def identify(
    data: Any,
    what: str,
    *,
    axis: TorqueAxis | None = None,
    part: int | Sequence[int] | None = None,
    until: float | None = None,
    throw: bool = True,
) -> Estimate:
    """Estimate from what was measured.

    ============== ================================================================================================
    `what`         result and data
    ============== ================================================================================================
    "roughness"    the coefficients of `RoughnessModel` and their scatter, what `FinishingProblem.updated` takes. From a
                   `Study` with the factors pattern, tool_diameter (mm) and normal_force (N), or from these and
                   roughness_ra (mm) as arrays of one length
    "load_torque"  T_L (N m), which no controller can tell from the contact torque: `TorqueController` takes it. From the
                   free motion before touch-down: arrays time (s), motor_angle (rad) and current (A, from that time on),
                   or a log; needs `axis` and, where there is a touch-down, `until`
    ============== ================================================================================================

    Parameters
    ----------
    data : Study, mapping of arrays, or log
        See above.
    what : {"roughness", "load_torque"}
        See above.
    axis : TorqueAxis, optional
        Inertia (kg m^2) and torque constant (N m/A) as they are believed.
    part : int or sequence of int, optional
        Which parts of a log, unit 1; all by default.
    until : float, optional
        Use what was before, s.
    throw : bool
        Raise when the data do not determine the values; else the status says so.

    Returns
    -------
    Estimate
        Values with their covariance; with ``throw=False`` also, never NaN, a status with the reason.

    Raises
    ------
    ValueError, TypeError
        For missing or bad data, too little of it, or an option that the quantity does not take.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> estimate = finishing.identify(finishing.Study.published("wang-2001"), "roughness")
    >>> round(estimate["tool_exponent"], 4), round(estimate["residual_sd"], 5)
    (-0.902, 0.06737)
    """
    checks.one_of("what", what, ("roughness", "load_torque"))
    if what == "roughness":
        for name, value in {"axis": axis, "part": part, "until": until}.items():
            if value is not None:
                raise ValueError(f"{name} must be None for 'roughness'; got {checks.shown(value)}")
        return identify_roughness(data, throw=throw)
    if axis is None:
        raise ValueError("axis must be a TorqueAxis for 'load_torque'; got None")
    return identify_load_torque(data, axis, part=part, until=until, throw=throw)
