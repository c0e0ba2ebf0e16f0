"""Identification of the model from passes: coefficients, scatter, and the way beside the bead."""

from typing import Any, Literal, TypedDict, Unpack, overload

from sdpgrind.base import checks
from sdpgrind.identify import Estimate
from sdpgrind.weldbead._identify.attribution import (
    LAW_METHODS,
    SCATTER_METHODS,
    ScatterEstimate,
    estimate_law,
    estimate_scatter,
)
from sdpgrind.weldbead._identify.coefficients import (
    FRICTION_METHODS,
    POWER_METHODS,
    estimate_friction,
    estimate_power,
)
from sdpgrind.weldbead._identify.lead_length import LEAD_METHODS, estimate_lead
from sdpgrind.weldbead._identify.scatter_of_beads import BeadScatterEstimate, estimate_components
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter

_METHODS = {
    "power": POWER_METHODS,
    "friction": FRICTION_METHODS,
    "scatter": SCATTER_METHODS,
    "law": LAW_METHODS,
    "lead_length": LEAD_METHODS,
}


class Options(TypedDict, total=False):
    """Keyword arguments of `identify`, in its units."""

    method: str | None
    model: GrindingProcess | None
    problem: SequenceProblem | None
    forgetting: float
    noise_ratio: float | None
    law: str
    depth_noise: float
    attribution: str | None
    bandwidth: float | None
    throw: bool


@overload
def identify(
    data: Any, what: Literal["power", "friction", "lead_length"], **options: Unpack[Options]
) -> Estimate: ...
@overload
def identify(
    data: Any,
    what: Literal["scatter"],
    *,
    method: Literal["components"],
    model: GrindingProcess | None = None,
    depth_noise: float = 0.0,
    tie: bool = True,
    conservative: bool = False,
) -> BeadScatterEstimate: ...
@overload
def identify(data: Any, what: Literal["scatter"], **options: Unpack[Options]) -> ScatterEstimate: ...
@overload
def identify(data: Any, what: Literal["law"], **options: Unpack[Options]) -> Scatter: ...
def identify(
    data: Any,
    what: str,
    *,
    method: str | None = None,
    model: GrindingProcess | None = None,
    problem: SequenceProblem | None = None,
    forgetting: float = 1.0,
    noise_ratio: float | None = None,
    law: str = "rayleigh",
    depth_noise: float = 0.0,
    attribution: str | None = None,
    bandwidth: float | None = None,
    tie: bool = True,
    conservative: bool = False,
    throw: bool = True,
) -> Estimate | ScatterEstimate | BeadScatterEstimate | Scatter:
    """Estimate coefficients, scatter or the way beside the bead from passes, for `SequenceProblem.updated`.

    ============= ============================ ===============================================================
    `what`        quantities of `data`         result and methods (the first is the default)
    ============= ============================ ===============================================================
    "power"       grinding_power, removal_rate `Estimate` of specific_energy (J/mm^3) and idle_power (W).
                                               "regression": removal rate on power, right where the first is
                                               noisy; "total": both noisy; "recursive": with forgetting;
                                               "printed": power on removal rate, flat by noise; Brown, 4.1
    "friction"    normal_force,                `Estimate` of friction_ratio (1): "regression", "recursive"
                  tangential_force
    "scatter"     normal_force, feed_rate,     `ScatterEstimate`: the coefficient that scatters. "fit": K1, K2
                  cut_depth                    fitted too, >= 4 passes; "model": from `model`
    "scatter"     both forces, grinding_power, `BeadScatterEstimate`: K1, K2 and mu from pass to pass and
                  removal_rate, part           from bead to bead, with intervals. "components": of many beads
    "law"         as "scatter"                 `Scatter` with the empirical distribution of the standardised
                                               depths. "kernel": smoothed, "sample": as they are
    "lead_length" feed_rate, duration          `Estimate` of lead_length (mm), the way beside the bead: "mean"
                                               of feed (duration - reset_time) - bead_length
    ============= ============================ ===============================================================

    Parameters
    ----------
    data : mapping of arrays, table of a log, or log
        Arrays of one length by name: grinding_power (W), removal_rate (mm^3/s), normal_force (N),
        tangential_force (N), feed_rate (mm/s), cut_depth (mm), duration (s, reset included), one entry per
        pass, no NaN. Or a log whose only table, or table "sequence", holds them, or that table; its rows with
        NaN (no reading) are left out and counted. A log without durations has the differences of its
        time_left, in whole stages; one of three tiers the feed of its table "pass". "components" and
        "lead_length" take a list of logs, too.
    what : {"power", "friction", "scatter", "law", "lead_length"}
        Quantity to estimate.
    method : str, optional
        See above.
    model : GrindingProcess, optional
        Process of the mean cut; required for "scatter" and "law".
    problem : SequenceProblem, optional
        Problem of the passes; required for "lead_length".
    forgetting : float
        For "recursive": weight of a pass relative to the next, in (0, 1], unit 1.
    noise_ratio : float, optional
        For "total": noise sd of the power over that of the removal rate, J/mm^3.
    law : str
        For "scatter" and "law": assumed distribution of the depths, as in `Scatter`; a scaled Rayleigh law
        scatters less than asked.
    depth_noise : float
        For "scatter" and "law": sd of the depth measurement, mm, no scatter of the process. "law" refuses
        depths below -5 of them, "scatter" one below 0 that the scatter of the others does not explain.
    attribution : str, optional
        For "law": attribution of the standardisation. Default: the favoured one.
    bandwidth : float, optional
        For "law": kernel in standard deviations, unit 1. Default: Silverman's rule.
    tie : bool
        For "components": K1 and K2 scatter alike; False: each is fitted, and where an upper limit is above
        four times the lower one, the component is `not_identified` and both scatter alike on its level.
    conservative : bool
        For "components": `updated` is told the upper limit of each 95 % interval, at most 1 (unit 1).
    throw : bool
        For "power", "friction" and "lead_length": raise when the passes do not determine the values; False:
        the status says so.

    Returns
    -------
    Estimate, ScatterEstimate, BeadScatterEstimate or Scatter
        See above.

    Raises
    ------
    ValueError, TypeError
        For missing or bad readings, fewer than 3 passes, one power level only, or (with `throw`) a failed
        estimate.

    Examples
    --------
    >>> power = [150.0, 300.0, 450.0, 600.0]
    >>> rate = [5.1, 19.8, 35.2, 49.9]
    >>> identify({"grinding_power": power, "removal_rate": rate}, "power")
    Estimate(specific_energy = 10.0134 ± 0.066 J/mm^3, idle_power = 99.6328 ± 2.1 W; from 4 passes)
    """
    methods = _METHODS[checks.one_of("what", what, _METHODS)]
    method = checks.one_of("method", methods[0] if method is None else method, methods)
    if what == "power":
        return estimate_power(data, method, forgetting=forgetting, noise_ratio=noise_ratio, throw=throw)
    if what == "friction":
        return estimate_friction(data, method, forgetting=forgetting, throw=throw)
    if what == "lead_length":
        return estimate_lead(data, problem=problem, throw=throw)
    noise = checks.nonnegative("depth_noise", depth_noise, "mm")
    if method == "components":
        return estimate_components(data, model=model, depth_noise=noise, tie=tie, conservative=conservative)
    if what == "scatter":
        return estimate_scatter(data, method, model=model, law=law, depth_noise=noise)
    return estimate_law(
        data, method, model=model, law=law, depth_noise=noise, attribution=attribution, bandwidth=bandwidth
    )
