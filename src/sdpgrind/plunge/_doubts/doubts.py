"""Doubts about a plunge cycle: its model against the sizes, commands and powers of parts."""

from typing import Any

import numpy as np

from sdpgrind.base.brief import counted
from sdpgrind.base.doubts import assumed
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.alignment import alignment_sentence
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import Doubt, compared, complete, untold
from sdpgrind.base.tables import table_of
from sdpgrind.identify import Estimate
from sdpgrind.plunge._doubts import alignment, cost, experiments
from sdpgrind.plunge._doubts.jobs import against_the_problem
from sdpgrind.plunge._doubts.residuals import MODEL, law_of, of_model, of_models, of_readings
from sdpgrind.plunge._identify import contact, sharpness
from sdpgrind.plunge._identify.cycles import Cycle, cycles, fault, mean_of_parts
from sdpgrind.plunge._identify.time_constant import NAME, UNIT, by_output_error
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._model.time_constants import of_deflection

_POWER = "grinding_power at three infeed rates or more; at fewer, chips and sliding cannot be told apart"
_LINEAR, _DEFLECTION = "linear lag", "deflection of the model, scaled"
_SAME = "deflection of the model, scaled as normal_force_ratio"
_BURNT = "parts ground beyond the burn limit and etched"
_ROUND = "the measured roundness of parts ground with two final rates"
_DRAWING = "the drawing or the machine; no column shows it"
HINTS = {
    "specific_energy": _POWER,
    "ploughing_force": _POWER,
    "stiffness": "a force gauge; sizes show only normal_force_ratio/stiffness",
    "u0": _BURNT,
    "B": _BURNT,
    "diffusivity": _BURNT,
    "roundness_base": _ROUND,
    "grinding_ratio": "the diameter of the wheel before and after many parts",
    "roundness_gain": _ROUND,
    **dict.fromkeys(("wheel_diameter", "work_diameter", "width", "wheel_speed", "work_rotation"), _DRAWING),
    "coefficient": _POWER,
    "exponent": _POWER,
    "normal_force_ratio": "nothing: it has no effect where the lag is linear",
    "wear_flat_area": "a column grinding_power",
}
"""Experiment that would tell a number of the model."""

_IDENTIFY = 'plunge.identify(log, "time_constant")'
_AREA = 'plunge.identify(log, "wear_flat_area", problem=problem)'
_RATIO = 'plunge.identify(log, "normal_force_ratio", problem=problem)'
_ON_THE_DEFLECTION = (contact.CONTACT[0], contact.RATIO[0], sharpness.NAME)
_MISFIT = "a model whose deflection fits the sizes; a linear lag fits these better"


def doubts(problem: CycleProblem, data: Any) -> Doubts:
    """Compare a problem with parts; see `CycleProblem.doubts`."""
    table, _ = table_of(data, "controller")
    each = cycles(data, power="grinding_power" in table)
    usable = [cycle for cycle in each if not fault(cycle)]
    reader = assumed.reader_of(data, table)
    aligned = alignment.of_cycles(usable, reader.commands_at) if usable else None
    deflected = of_model(problem, usable)
    law = law_of(aligned.fit, deflected) if aligned and deflected else None
    misfits = law is not None and law.sure and law.best != MODEL
    by_model = law is not None and not misfits
    if aligned and deflected and by_model:
        aligned = alignment.by_model(aligned, usable, reader.commands_at, problem, deflected)
    of = contact.secant if by_model else lambda cycle, _: by_output_error(cycle)
    tau = mean_of_parts(each, lambda cycle: of(cycle, problem), NAME, UNIT)
    area = _area(problem, each)
    told = _told(problem, each, tau, area, _SAME if by_model else _LINEAR)
    if misfits:
        told = [_not_to_rely_on(row) for row in told]
    model = complete(told, problem.model, HINTS)
    measured = {row.name for row in model if row.measured}
    sharp = problem.updated(area) if area and sharpness.NAME in measured else problem
    lag = _ratio(sharp, each) if by_model else tau
    figure, stakes = cost.of_plan(
        problem,
        [row for row in model if row.note != _SAME],
        (lambda: sharp.updated(lag)) if lag.ok else None,
    )
    sentences = [fault(cycle) for cycle in each if fault(cycle)]
    if aligned:
        sentences += [
            alignment_sentence(aligned.alignment, reader.commands_at, NAME, aligned.time_constants, UNIT)
        ]
        sentences += of_readings(usable, aligned.fit, deflected if by_model else None)
        sentences += against_the_problem(problem, usable, figure)
        if not aligned.alignment.sure or aligned.alignment.preferred == reader.commands_at:
            sentences += of_models(usable, aligned.fit, deflected)
            sentences += _into_the_plan(problem, lag, sharp is not problem)
            sentences += experiments.sentences(usable, aligned, tau)
    return Doubts(
        _subject(each), (*model, *reader.rows), sentences, aligned and aligned.alignment, figure, stakes
    )


def _not_to_rely_on(row: Doubt) -> Doubt:
    """Row, without its value where that rests on a deflection that does not fit."""
    if row.name not in _ON_THE_DEFLECTION or np.isnan(row.told):
        return row
    return untold(row.name, row.unit, row.believed, _MISFIT)


def _into_the_plan(problem: CycleProblem, lag: Estimate, sharp: bool) -> list[str]:
    """Sentence with the calls that plan with what is told of the lag, and of the area where that is told.

    The area comes first: the deflection, which the lag scales, depends on it.
    """
    if not lag.ok:
        return []
    by_model = lag.names == contact.RATIO[:1]
    if not by_model and problem.model.linear_time_constant is None:
        linear = f"problem = problem.replace(linear_time_constant={lag.value[0]:.4g})"
        return [
            f"To plan with what the data tell: {linear}; then problem.doubts(log), with the log given here,"
            " tells the rest. The deflection of the model fits at no scale: parts planned by it may burn and"
            " be out of round."
        ]
    if not (by_model and sharp):
        return to_plan_with([*[_AREA] * sharp, _RATIO if by_model else _IDENTIFY])
    (call,) = to_plan_with([_AREA])
    return [
        f"{call.removesuffix('.')}, as sharp; then sharp.updated({_RATIO.replace('=problem', '=sharp')}):"
        f" with the area told here the ratio is {lag.value[0]:.4g}."
    ]


def _ratio(problem: CycleProblem, each: tuple[Cycle, ...]) -> Estimate:
    return mean_of_parts(each, lambda cycle: contact.normal_force_ratio(cycle, problem), *contact.RATIO)


def _area(problem: CycleProblem, each: tuple[Cycle, ...]) -> Estimate | None:
    """Wear flat area that the powers tell; None: there are none."""
    if not any(np.any(np.isfinite(cycle.grinding_power)) for cycle in each):
        return None
    return mean_of_parts(
        each, lambda cycle: sharpness.wear_flat_area(cycle, problem, None), sharpness.NAME, sharpness.UNIT
    )


def _told(
    problem: CycleProblem, each: tuple[Cycle, ...], tau: Estimate, area: Estimate | None, law: str
) -> list[Doubt]:
    """Rows of the values that sizes, commands and powers may tell; `law`: that of the time constant."""
    model = problem.model
    found = [compared(tau, NAME, of_deflection(problem), note=law, least=0.0)]
    if model.linear_time_constant is not None:
        told = tau.replace(names=("linear_time_constant",))
        found.append(
            compared(told, "linear_time_constant", model.linear_time_constant, note=_LINEAR, least=0.0)
        )
    zero = mean_of_parts(each, lambda cycle: contact.contact_zero(cycle, problem), *contact.CONTACT)
    found.append(compared(zero, contact.CONTACT[0], 0.0, scale=problem.stock, note=_DEFLECTION))
    if model.linear_time_constant is None:
        ratio = _ratio(problem, each)
        found.append(compared(ratio, contact.RATIO[0], model.normal_force_ratio, note=_DEFLECTION, least=0.0))
    if area is not None:
        found.append(
            compared(area, sharpness.NAME, model.wear_flat_area, note="at the believed energy", least=0.0)
        )
    return found


def _subject(each: tuple[Cycle, ...]) -> str:
    count, readings = len(each), sum(int(cycle.read.sum()) for cycle in each)
    step = float(np.median(np.concatenate([cycle.step for cycle in each])))
    return f"plunge cycle, {counted(count, 'part')}, {counted(readings, 'size')}, one each {step:.3g} s"
