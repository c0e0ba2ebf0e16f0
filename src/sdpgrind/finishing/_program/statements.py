"""Moves that readers collect, statement by statement."""

from dataclasses import dataclass, field

import numpy as np

from sdpgrind.base.checks import Floats, shown
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.turns import turns_of

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def misread(language: str, number: int, line: str) -> ValueError:
    """Return the error of a line that is not understood."""
    return ValueError(f"text must be {language} as written here; line {number} is {shown(line)}")


def numbers(words: str) -> list[float]:
    """Return numbers parted by commas."""
    return [float(word) for word in words.split(",")]


def single(values: list[float]) -> list[float]:
    """Return numbers as a controller keeps them in single precision."""
    return [float(np.float32(value)) for value in values]


@dataclass
class Moves:
    """Moves so far."""

    target: str
    name: str = ""
    ended: bool = False
    work: Floats = field(default_factory=lambda: np.eye(4))
    tool: Floats = field(default_factory=lambda: np.eye(4))
    approach: list[Floats] = field(default_factory=list)
    time: list[float] = field(default_factory=list)
    joints: list[Floats] = field(default_factory=list)
    retract: list[Floats] = field(default_factory=list)
    paces: list[float] = field(default_factory=list)
    poses: list[Floats] = field(default_factory=list)
    feeds: list[float] = field(default_factory=list)
    radii: list[float] = field(default_factory=list)
    configuration: list[tuple[int, ...]] = field(default_factory=list)
    unit: str = ""
    begun: list[list[float]] = field(default_factory=list)
    axes: list[list[float]] = field(default_factory=list)

    def turn_joints(self, joints: Floats, pace: float | None = None) -> None:
        """Take a joint move, rad, and the speed of its leading joint, rad/s, where the text tells it."""
        self.paces += [] if pace is None else [pace]
        (self.retract if self.time or self.poses else self.approach).append(joints)

    def line(
        self,
        pose: Floats,
        feed: float,
        radius: float,
        configuration: tuple[int, ...],
        axes: list[float] | None = None,
    ) -> None:
        """Take a straight move to a pose, mm, mm/s, with external axes as told, deg or mm."""
        if not self.approach:
            raise ValueError("text must begin by a move of the joints; a straight one comes first")
        if feed <= 0.0 or radius < 0.0:
            raise ValueError(
                f"text must have feeds > 0 (mm/s) and blends >= 0 (mm); got {feed:g} and {radius:g}"
            )
        self.poses.append(pose)
        self.feeds.append(feed)
        self.radii.append(radius)
        self.configuration.append(configuration)
        self.axes.append(axes or [])
        if len(self.axes[-1]) != len(self.begun[-1] if self.begun else []):
            raise ValueError(
                f"text must name the same external axes in every move; move {len(self.axes)} has"
                f" {len(self.axes[-1])}"
            )

    def stream(self, joints: Floats, step: float, number: int) -> None:
        """Take joints, rad, that are reached a step (s) later."""
        if not self.approach or step <= 0.0:
            raise ValueError(
                "text must have steps > 0 (s) after a move of the joints; line"
                f" {number} has a step of {step:g} after {len(self.approach)} such moves"
            )
        if not self.time:
            self.time.append(0.0)
            self.joints.append(self.approach[-1])
        self.time.append(self.time[-1] + step)
        self.joints.append(joints)

    def path(self) -> ProgramPath:
        """Return all moves."""
        count = len(self.approach[0]) if self.approach else 6
        poses = np.array(self.poses).reshape(-1, 4, 4)
        if not (self.time or self.poses):
            raise ValueError("text must have moves; got none")
        return ProgramPath(
            self.target,
            self.name,
            approach=np.array(self.approach).reshape(-1, count),
            time=np.array(self.time),
            joints=np.array(self.joints).reshape(-1, count),
            retract=np.array(self.retract).reshape(-1, count),
            paces=np.array(self.paces),
            points=poses[:, :3, 3].copy(),
            turns=turns_of(poses) if len(poses) else np.empty((0, 4)),
            feeds=np.array(self.feeds),
            radii=np.array(self.radii),
            work=self.work,
            tool=self.tool,
            configuration=np.array(self.configuration, dtype=float).reshape(len(poses), -1)
            if len(poses)
            else np.empty((0, 0)),
            unit=self.unit,
            begun=np.array(self.begun[-1] if self.begun else []),
            axes=np.array(self.axes, dtype=float).reshape(len(poses), -1) if len(poses) else np.empty((0, 0)),
        )
