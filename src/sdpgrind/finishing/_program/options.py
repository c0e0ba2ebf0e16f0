"""Options of the program of a motion, and of which motions and robots there is one."""

import re
from collections.abc import Collection
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.quantities import another_unit
from sdpgrind.base.warned import warn
from sdpgrind.finishing._program import krl, rapid
from sdpgrind.finishing._program.carriers import alone, axis_names
from sdpgrind.finishing._program.course import PlannedMotion
from sdpgrind.finishing.arm._robot_presets import maker_of
from sdpgrind.finishing.arm._serial import SerialRobot

TARGETS = ("urscript", "rapid", "krl", "csv", "ros")
OVER_TIME = ("csv", "ros")  # joints over time, whatever the robot
_USUAL, _TYPICAL = (0.002, 5.0), 0.02  # mm, chosen: rounding of the numbers to what no finishing needs
# source: KRL 24 characters; RAPID 32, two of them for p_, t_, w_; others: chosen
NAMES = {"urscript": 60, "rapid": 30, "krl": 24, "csv": 60, "ros": 60}
_UNIT = 32  # source: RAPID, characters of an identifier
_TURNED = 0.35  # rad, source: specification, greatest turn of a joint from pose to pose
_STILL = 1e-6  # rad, chosen: turn of a tool at rest that is rounding
# source: words of URScript, RAPID and KRL that a program of ours uses, or that no program may be called
_WORDS = (
    "def end module endmodule proc endproc if elif else endif while for return thread halt exit stop stopl",
    "stopj movej movel movec movep servoj set_tcp pose_trans pose_inv p work true false and or not global",
    "local sleep moveabsj speeddata zonedata tooldata wobjdata robtarget jointtarget pers const var num bool",
    "string tperror lin ptp circ bas wait int real frame pos axis e6pos signal loop repeat until switch case",
    "default enum actunit deactunit confl confj mecunit rob_1",
)
_RESERVED = frozenset(" ".join(_WORDS).split())


def check_options(
    target: str,
    *,
    deviation: float = _TYPICAL,
    name: str = "finishing",
    timing: bool = False,
    date: str | None = None,
) -> float:
    """Refuse options that no program of a target has, before there is a motion; return the deviation, mm."""
    checks.one_of("target", target, TARGETS)
    allowed = _deviation(deviation)
    _check_name(target, name)
    if checks.kind("timing", timing, bool) and target not in ("urscript", *OVER_TIME):
        raise ValueError(f"timing must be False for {target}, which keeps no times; take urscript or csv")
    if date is not None and not (checks.kind("date", date, str).isascii() and date.isprintable()):
        raise checks.refuse("date", "a line of ASCII", date)
    return allowed


def _deviation(value: float) -> float:
    number = checks.positive("deviation", value, "mm")
    if not _USUAL[0] <= number <= _USUAL[1]:
        raise ValueError(another_unit("deviation", value, "mm", _USUAL, _TYPICAL))
    return number


def _check_name(target: str, name: str) -> None:
    longest = NAMES[target]
    if not _is_word(checks.kind("name", name, str), longest):
        rule = f"a letter, then letters, digits and _, at most {longest} in {target}, and no word of it"
        raise checks.refuse("name", rule, name)


def _is_word(name: str, longest: int, others: Collection[str] = _RESERVED) -> bool:
    """Whether a program may hold a name, which is none of others in lower case."""
    fits = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)
    return bool(fits) and len(name) <= longest and name.lower() not in others


def check_robot(motion: PlannedMotion, target: str) -> None:
    """Refuse robots whose flange is not known, and joints that the controller does not take."""
    robot = alone(motion.problem.robot)
    if not isinstance(robot, SerialRobot):
        raise ValueError(
            f"robot must be a SerialRobot, whose flange is known, for {target}; got {checks.shown(robot)};"
            " take csv or ros"
        )
    turn = float(np.abs(motion.joints[:, : len(robot.names)]).max())
    if target in ("urscript", "krl") and turn > 2 * np.pi:
        raise checks.refuse(f"joints for {target}", "within a turn of 0", turn, "rad")


def warn_of_maker(motion: PlannedMotion, target: str) -> None:
    """Warn of a language that is not that of a robot whose maker is known."""
    known = maker_of(alone(motion.problem.robot))
    if known is not None and target != known.language:
        warn(
            f"{target} is not the language of the {known.robot} of {known.maker}, whose controller takes"
            f" {known.language}"
        )


def check_axes(robot: Any, target: str, name: str) -> None:
    """Refuse axes that carry the work where the controller has none, too many, or not of that name."""
    names = axis_names(robot)
    if names and target == "urscript":
        raise ValueError(
            f"robot must be one whose work rests for urscript, as a UR controller has no external axes; got"
            f" {', '.join(names)}; take csv or ros, which tell all joints over time"
        )
    most = {"rapid": rapid.AXES_MAX, "krl": krl.AXES_MAX}.get(target, len(names))
    if len(names) > most:
        raise ValueError(
            f"axes that carry the work must be at most {most} in {target}; got {len(names)}; take csv or ros"
        )
    for each in names if target in ("rapid", "krl") else ():
        unit = target == "rapid" and each == names[-1]
        own = {f"{mark}{name}".lower() for mark in ("", *rapid.MARKS)}
        _check_axis_name(each, target, _RESERVED | own if unit else set())


def _check_axis_name(name: str, target: str, taken: Collection[str]) -> None:
    """Refuse the name of an axis; names are `taken` for one that is a mechanical unit."""
    if not _is_word(name, _UNIT, taken):
        rule = f"a letter, then letters, digits and _, at most {_UNIT} in {target}"
        more = ", and no other word of the program: it is the mechanical unit" if taken else ""
        raise checks.refuse("name of an axis that carries the work", f"{rule}{more}", name)


def check_spin(motion: PlannedMotion) -> None:
    """Refuse a tool whose turn about its own axis jumps from one row to the next."""
    jumps = np.abs(np.diff(motion.spin))
    jumps[np.diff(motion.length) > 0] -= _TURNED
    for k in np.flatnonzero(jumps > _STILL)[:1]:
        before, after = motion.spin[k : k + 2].tolist()
        raise ValueError(
            f"spin of the motion must not jump (rad): from {before:.6g} to {after:.6g} between rows {k} and"
            f" {k + 1}, at {motion.time[k]:.4g} s"
        )
