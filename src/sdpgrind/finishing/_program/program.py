"""A motion as a program of a robot's controller."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.programs import Program
from sdpgrind.base.stored import encode
from sdpgrind.base.whole_files import whole_file
from sdpgrind.finishing._program import krl, rapid, urscript
from sdpgrind.finishing._program.blocks import Blocks, blocks_of, joined
from sdpgrind.finishing._program.carriers import axis_names, axis_units, described_unit, unit_frame
from sdpgrind.finishing._program.compare import MotionCheck
from sdpgrind.finishing._program.course import (
    SINGLE,
    PlannedMotion,
    RobotFrames,
    contacts,
    frames_of,
    greatest_feed,
    lifted,
    runs_of,
    way_per_turn,
)
from sdpgrind.finishing._program.cuts import parts_of, rests_in_air
from sdpgrind.finishing._program.form import TextForm
from sdpgrind.finishing._program.options import (
    NAMES,
    OVER_TIME,
    check_axes,
    check_options,
    check_robot,
    check_spin,
    warn_of_maker,
)
from sdpgrind.finishing._program.read_program import read_text
from sdpgrind.finishing._program.table import table
from sdpgrind.finishing._program.trajectory import trajectory
from sdpgrind.finishing._program.turns import inverse, turns_of

ENDINGS = {"urscript": ".script", "rapid": ".mod", "krl": ".src", "csv": ".csv", "ros": ".json"}
_POINTS = 5000  # source: specification, size of a KRL program that its editor takes


@dataclass(frozen=True, repr=False)
class MotionProgram(Program):
    """Program of a robot for a motion; immutable.

    Attributes
    ----------
    text : str
        The program, ASCII.
    deviation : float
        Greatest distance of the contact from the plan that the program states, mm.
    target : {"urscript", "rapid", "krl", "csv", "ros"}
        Language.
    name : str
        Name of the program.
    motion : Motion
        The plan, mm, s, rad.
    """

    target: str
    name: str
    motion: PlannedMotion

    @property
    def ending(self) -> str:
        """Ending of its file: .script, .json (m, rad), .mod (mm), .src (mm, deg) or .csv (s, rad, mm)."""
        return ENDINGS[self.target]

    def check(self) -> MotionCheck:
        """Read the text back and follow it, corners as circles.

        Returns
        -------
        MotionCheck
            `deviation`: greatest distance of the contact from the plan, or of a turn of the tool times the
            lever arm, mm; `angle_deviation`, rad; `feed_excess`: greatest feed beyond the planned one, mm/s;
            `joint_speed_excess`: greatest speed of a joint beyond its limit, share of it.
        """
        return read_text(self.text).check(self.motion)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = True) -> None:
        """Check the program and write it at `path`, complete or not at all.

        A KRL program that is cut at lifts calls one for each part: their files come first, those of an older
        version go last.

        Parameters
        ----------
        path : str or path
            File in an existing folder; that of a KRL program has its name.
        overwrite : bool
            False: a file there that holds another text stays, as somebody may have changed it by hand.

        Raises
        ------
        FileExistsError
            When a file holds another text and `overwrite` is False.
        ValueError
            If the text read back is farther from the plan than stated (mm), faster (mm/s), or exceeds the
            speed of a joint (rad/s, mm/s), or a KRL file has another name than its program.
        """
        file = Path(checks.path("path", path))
        if self.target == "krl" and file.stem.lower() != self.name.lower():
            raise checks.refuse("path", f"named {self.name}.src, as the program in it", file.name)
        self._refuse_faulty()
        texts = {file.parent / f"{name}.src": part for name, part in self.parts.items()}
        texts[file] = self._programs[0]
        contents = {target: text.encode("ascii") for target, text in texts.items()}
        if not overwrite:
            _refuse_other(contents)
        for target, content in contents.items():
            with whole_file(target) as temporary:
                temporary.write_bytes(content)
        if self.target == "krl":
            self._clear(file.parent)

    def _clear(self, folder: Path) -> None:
        """Remove the parts of other versions."""
        former = re.compile(rf"{re.escape(self.name)}_[0-9a-f]{{{krl.MARK}}}_\d+\.src")
        for other in folder.iterdir():
            if former.fullmatch(other.name) and other.stem not in self.parts:
                other.unlink()

    @property
    def parts(self) -> dict[str, str]:
        """Programs (mm, deg) that a KRL program calls, name -> text; empty where it is whole."""
        _, *others = self._programs
        return {text.split("(", 1)[0].removeprefix("DEF "): text for text in others}

    @property
    def _programs(self) -> list[str]:
        return re.split(r"(?m)^(?=DEF )", self.text)[1:] if self.target == "krl" else [self.text]

    def _fault(self, found: MotionCheck) -> str:
        if found.feed_excess > SINGLE * self.motion.problem.feed_rate:
            return (
                f"text must not be faster than the plan (mm/s); read back, it is by {found.feed_excess:.4g}"
            )
        if found.joint_speed_excess > SINGLE:
            share = 100 * found.joint_speed_excess
            return (
                f"text must keep the speed limits of the joints; read back, one is over it by {share:.4g} %"
            )
        return super()._fault(found)


def _refuse_other(contents: Mapping[Path, bytes]) -> None:
    """Refuse files that are there and hold something else."""
    for file, content in contents.items():
        if file.exists() and file.read_bytes() != content:
            raise FileExistsError(
                f"{file} holds another program, or was changed by hand: move it elsewhere, or write into"
                " another folder"
            )


def program_of(
    motion: PlannedMotion, target: str, deviation: float, name: str, timing: bool, date: str | None
) -> MotionProgram:
    """Write a motion as a program after a check of the arguments, see `Motion.program`."""
    allowed = check_options(target, deviation=deviation, name=name, timing=timing, date=date)
    check_spin(motion)
    head = list(_head(motion, target, allowed, name, date))
    if target in OVER_TIME:
        return (_table if target == "csv" else _trajectory)(motion, head, allowed, name)
    check_robot(motion, target)
    check_axes(motion.problem.robot, target, name)
    warn_of_maker(motion, target)
    text = _stream(motion, head, name) if timing else _lines(motion, target, head, name, allowed)
    return MotionProgram(text, allowed, target, name, motion)


def _head(motion: PlannedMotion, target: str, deviation: float, name: str, date: str | None) -> Iterator[str]:
    """Lines on plan, frames and deviation; ASCII."""
    from sdpgrind import __version__

    problem = motion.problem
    digest = hashlib.sha256(encode(problem).encode()).hexdigest()[:12]
    yield f"{name}: {motion.length[-1]:.1f} mm of path in {motion.time[-1]:.3f} s" + (
        f", {date}" if date else ""
    )
    yield f"sdpgrind {__version__}, problem {digest}, planned feed at most {_feeds(motion)}"
    yield f"deviation: contact within {deviation:g} mm of the plan; a turn of the tool counts"
    yield f"times the lever arm of {problem.lever_arm:g} mm"
    if target in OVER_TIME:
        return
    yield "starts and ends 20 mm off the work; not run on a controller: try it slowly, above the work"
    yield f"branch {motion.posture.branch} of the model; joints and base are those of the model of the robot"


def _feeds(motion: PlannedMotion) -> str:
    """Greatest planned feeds, and the commanded one where joints or corners forbid it."""
    feed, asked = greatest_feed(motion), motion.problem.feed_rate
    slower = f" of {asked:g} commanded" if feed < asked else ""
    in_air = motion.feed_rate[~motion.contact]
    return f"{feed:g} mm/s{slower}" + (f", {in_air.max():g} in the air" if in_air.size else "")


def _lines(motion: PlannedMotion, target: str, head: list[str], name: str, deviation: float) -> str:
    """Straight moves: down to the work, along the runs, and off again."""
    problem, frames = motion.problem, frames_of(motion)
    runs = [blocks_of(run, deviation, problem.lever_arm) for run in runs_of(motion, frames)]
    down, up = motion.joints[:1], lifted(motion, -1)[None]
    runs[0] = joined([_exact(motion, frames, down), runs[0]])
    runs[-1] = joined([runs[-1], _exact(motion, frames, up)])
    form = _form(motion, target, head, name, frames)
    if target == "krl":
        return krl.source(_parts(motion, runs, name, deviation), form, motion.posture.branch)
    if target == "urscript":
        return urscript.script(joined(runs), form)
    return rapid.module(joined(runs), form, motion.posture.branch)


def _form(motion: PlannedMotion, target: str, head: list[str], name: str, frames: RobotFrames) -> TextForm:
    """What a writer of straight moves is handed."""
    robot = motion.problem.robot
    names, unit = axis_names(robot), unit_frame(robot)
    more = {"urscript": urscript.head(False), "rapid": rapid.head(names), "krl": krl.head(names)}[target]
    there = frames._replace(work=inverse(unit) @ frames.work)
    shown = krl.aggregate if target == "krl" else rapid.frame
    lines, start = [*head, *more, *described_unit(robot, shown)], lifted(motion, 0)
    return TextForm(name, lines, there, start, motion.problem.acceleration, names, axis_units(robot))


def _parts(motion: PlannedMotion, runs: list[Blocks], name: str, deviation: float) -> list[Blocks]:
    """Parts that a KRL program takes, cut in the air."""
    parts = parts_of(runs, rests_in_air(motion).tolist(), _POINTS)
    longest = max(len(part.feeds) for part in parts)
    if longest > _POINTS:
        rule = f"greater: krl takes {_POINTS} points in a program, and these are {longest} without a lift"
        raise checks.refuse("deviation", rule, deviation, "mm")
    most = NAMES["krl"] - krl.MARK - 2 - len(str(len(parts)))
    if len(parts) > 1 and len(name) > most:
        raise checks.refuse("name", f"at most {most} characters, with those of its {len(parts)} parts", name)
    return parts


def _exact(motion: PlannedMotion, frames: RobotFrames, joints: Floats) -> Blocks:
    """Exact move to the contact at joints (1, n), at the greatest planned feed."""
    pose = contacts(motion, frames, joints)
    feed = np.array([greatest_feed(motion)])
    return Blocks(pose[:, :3, 3], turns_of(pose), feed, np.zeros(1), joints)


def _table(motion: PlannedMotion, head: list[str], deviation: float, name: str) -> MotionProgram:
    """Joints at the rows of the motion, and between them where straight lines would leave it."""
    robot, told = motion.problem.robot, "times are kept: joints over time, straight lines between them"
    rows, program = motion.profile, None
    for _ in range(2):  # the second time with rows as near as the first tells
        text = table([*head, told], rows, robot.names, robot.units)
        program = MotionProgram(text, deviation, "csv", name, motion)
        parts = int(np.ceil(np.sqrt(1.1 * program.check().deviation / deviation)))
        if parts < 2:
            break
        time = np.interp(np.arange(parts * (len(rows) - 1) + 1) / parts, np.arange(len(rows)), rows[:, 0])
        rows = np.column_stack([time, motion.at(time).joints])
    assert program is not None  # made in the first round
    return program


def _trajectory(motion: PlannedMotion, head: list[str], deviation: float, name: str) -> MotionProgram:
    """Joints and their speeds at the rows of the motion, which is a cubic between them."""
    robot = motion.problem.robot
    told = ["times are kept: a cubic in each joint between points, as of a joint_trajectory_controller"]
    text = trajectory([*head, *told], motion.profile, motion.profile_speed, robot.names, robot.units)
    return MotionProgram(text, deviation, "ros", name, motion)


def _stream(motion: PlannedMotion, head: list[str], name: str) -> str:
    """Joints every 8 ms, the last step shorter."""
    end = float(motion.time[-1])
    time = np.append(np.arange(0.0, end - 1e-6, urscript.PERIOD), end)
    form = TextForm(name, [*head, *urscript.head(True)], frames_of(motion), lifted(motion, 0), 0.0)
    joints, above = motion.at(time).joints, lifted(motion, -1)
    feed, ends = greatest_feed(motion), ((form.start, joints[0]), (joints[-1], above))
    down, up = (feed / way_per_turn(motion, *each) for each in ends)
    return urscript.stream(time, joints, form, above, (down, up))
