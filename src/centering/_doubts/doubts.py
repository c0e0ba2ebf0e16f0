"""Doubts about centering: radius and place of a part against scans, its friction against pushes."""

from typing import Any

from centering._doubts import cost, scans
from centering._problem.problem import CenteringProblem
from centering.friction._estimator import identify_friction
from sdpgrind.base.brief import counted
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.assumed import reader_of
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import DIFFERS, Doubt, compared, complete, untold
from sdpgrind.base.tables import table_of, tables_in
from sdpgrind.identify import Estimate, Status

_PUSHED = "with the peak force and the displacement of the part"
_TOUCH = "the force of a tip pressed on a clamped part, over its displacement"
_HINTS = {
    "radius": "a scan of a whole turn (angle, reading)",
    "mass": "scales",
    "mu_static": f"slow pushes {_PUSHED}",
    "mu_kinetic": f"fast pushes {_PUSHED}, which slides on freely",
    "viscous_coefficient": "pushes at two speeds",
    "contact_stiffness": _TOUCH,
    "contact_damping": _TOUCH,
    "restitution": "a part that rebounds from a clamped tip",
}

_NARROWED = 0.7  # chosen: share of the believed scatter to which pushes must narrow it; half its variance


def doubts(problem: CenteringProblem, data: Any) -> Doubts:
    """Compare a problem with a scan or with pushes; see `CenteringProblem.doubts`."""
    found: list[Doubt] = []
    sentences: list[str] = []
    subject = []
    friction: Estimate | None = None
    if each := scans.scans_of(data):
        row, words = scans.of_scans(problem, each)
        found, sentences = [row], words
        subject.append(counted(len(each), "scan"))
    if not each or _pushed(data):
        friction = identify_friction(data, problem, throw=False)
        found += [_of_friction(problem, friction, name) for name in friction.names]
        sentences.append(f"Friction: {friction.message}.")
        subject.append("pushes")
    rows = complete(found, problem.model, _HINTS)
    sentences += _into_the_plan(found)
    reader = reader_of(data, data)
    figure, stakes = cost.of_plan(problem, rows, friction)
    return Doubts(
        f"centering, {' and '.join(subject)}", (*rows, *reader.rows), sentences, None, figure, stakes
    )


def _of_friction(problem: CenteringProblem, friction: Estimate, name: str) -> Doubt:
    """Row of a coefficient; the scatter from part to part is believed before, and alone tells nothing."""
    believed, share = getattr(problem.model, name), problem.scatter.friction_part_sd
    narrowed = friction.sd[friction.names.index(name)] < _NARROWED * share * believed
    if friction.status is Status.IMPOSSIBLE or not narrowed:
        return untold(name, "1", believed, _HINTS[name])
    prior = f"with {100 * share:.2g} % from part to part believed before"
    return compared(friction.replace(status=Status.OK), name, believed, note=prior)


def _into_the_plan(found: list[Doubt]) -> list[str]:
    """Sentences with the calls that plan with what is told: of friction, and of a radius that differs."""
    measured = {row.name: row for row in found if row.measured}
    radius = measured.pop("radius", None)
    told = to_plan_with(['centering.identify(log, "friction", problem=problem)'] if measured else [])
    if radius is not None and radius.verdict == DIFFERS:
        told.append(f"For a part of this radius: problem.replace(radius={radius.told:.6g}).")
    return told


def _pushed(data: Any) -> bool:
    """Whether a log or a table holds pushes beside readings of a probe."""
    try:
        names = tables_in(data, "control")
        return "pushing" in (table_of(data, "control")[0] if names else data)
    except (TypeError, ValueError):
        return False
