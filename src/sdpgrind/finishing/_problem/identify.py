"""Identification of roughness model and load torque from measurements."""

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
    part: int | str | Sequence[int | str] | None = None,
    until: float | None = None,
    throw: bool = True,
) -> Estimate:
    """Estimate parameters of the model from measurements.

    ============== =========================================================================================
    `what`         estimate and data
    ============== =========================================================================================
    "roughness"    Coefficients and scatter of `RoughnessModel`, for `FinishingProblem.updated`. Data: a
                   `Study` with the factors pattern, tool_diameter (mm) and normal_force (N), or arrays of
                   one length of these and of roughness_ra (mm), or a log with these columns.
    "load_torque"  T_L (N m), for `TorqueController`, as no controller can separate it from the contact
                   torque. Data: free motion before touch-down as arrays time (s), motor_angle (rad) and
                   current (A, applied from that time on), or a log; needs `axis` and, if there is a
                   touch-down, `until`.
    ============== =========================================================================================

    Parameters
    ----------
    data : Study, mapping of arrays, table of a log, or log
        Measurements, see the table.
    what : {"roughness", "load_torque"}
        Quantity to estimate.
    axis : TorqueAxis, optional
        Believed inertia (kg m^2) and torque constant (N m/A).
    part : int, str or sequence of them, optional
        Parts of a log to use: numbers (unit 1), or words of the file. Default: all.
    until : float, optional
        End of the data to use, s.
    throw : bool
        Raise when the data do not determine the values; else the status says so.

    Returns
    -------
    Estimate
        Values with their covariance. With ``throw=False`` a failed estimate has finite values and a status
        with the reason.

    Raises
    ------
    ValueError, TypeError
        For missing, bad or too few data, or an option that the quantity does not take.

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
