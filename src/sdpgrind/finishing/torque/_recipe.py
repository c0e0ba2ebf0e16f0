"""Recipe of a torque controller: step, law, reference, and inputs of its self-test."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.states import named, places
from sdpgrind.codegen import Recipe, Role, Signal
from sdpgrind.finishing.torque._controller_kernels import exported_hold, exported_step
from sdpgrind.finishing.torque._law import TorqueLaw
from sdpgrind.finishing.torque._states import CONTROLLER, LAW

_NAMED = (
    "count",
    "current",
    "reading",
    "motion_speed",
    "estimate",
    "obs_angle",
    "obs_speed",
    "obs_torque",
    "path_time",
)
_CURRENT = Signal("A", "current to command, > 0 presses the tool onto the part")
_OF_MOTION = {
    "feed_override": Signal("", "0 while the motion waits for the contact to settle, 1 while it plays"),
    "start_motion": Signal("", "1 in the first step: the motion is to be handed to the robot, else 0"),
}
_TABLES = {
    "law": "law of the controller, by entry: " + ", ".join(LAW.names or ()),
    "time": "times of the torque reference, s",
    "torque": "torque reference at these times, N m",
}
_ANGLE_MAX, _TIME_MAX = 1e6, 1e6  # chosen: rad, s; 160 000 turns; 12 days
_CHAINS = 12  # chosen: parts of the self-test
_SIZES = (0.02, 0.3, 1.0, 3.0, 30.0)  # chosen: movements over the deflection under the force


def recipe_of(controller: Any) -> Recipe:
    """Return the recipe of a controller, in N m, A, rad and s; the profile of its motion stays here."""
    law, period, moves = controller.law, controller.period, controller.motion is not None
    part = _Readings(law, float(law.torque.max() / named(law.parameters, LAW).stiffness), period, moves)
    return Recipe(
        "torque",
        exported_step if moves else exported_hold,
        _inputs(part),
        {"current": _CURRENT, **(_OF_MOTION if moves else {})},
        law=(law.parameters, law.time, law.torque),
        state=law.start,
        tables=_TABLES,
        period=period,
        places=dict(zip(_NAMED, places(CONTROLLER, *_NAMED), strict=True)),
        equations="Wang and Jan (2001), (6), (8), (9) corrected; LQG, damping: docs of finishing.torque.",
        vectors=part.chains,
        kind="TorqueController",
        role=Role(
            commands=controller.commands,
            answer=None if controller.motion is None else partial(_played, controller.motion.profile),
            job=controller.job,
            description=controller.description,
        ),
    )


def _inputs(part: "_Readings") -> dict[str, Signal]:
    """Return the inputs, varied (rad, s) about those of a part."""
    angle = "angle of the motor, growing as it turns the tool into the contact"
    time, late = "time along the motion that plays, from its start", 0.2 * max(part.law.time[-1], part.period)
    found = {
        "motor_angle": Signal("rad", angle, -_ANGLE_MAX, _ANGLE_MAX, missing=True, spread=part.deflection),
        "path_time": Signal("s", time, -_TIME_MAX, _TIME_MAX, missing=True, spread=float(late)),
    }
    return found if part.moves else {"motor_angle": found["motor_angle"]}


def _played(profile: Any, status: int, found: dict[str, float]) -> dict[str, Any]:
    """Return the command, with the motion in the first sample."""
    command: dict[str, Any] = {name: found[name] for name in ("current", "feed_override")}
    return {**command, "motion": profile} if found["start_motion"] == 1.0 else command


@dataclass(frozen=True)
class _Readings:
    """Readings of parts: the motor swings about the contact, a little or much; the motion plays."""

    law: TorqueLaw
    deflection: float
    period: float
    moves: bool

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` readings, in rad and s."""
        length = max(count // _CHAINS, 1)
        return [self._chain(rng, length, _SIZES[k % len(_SIZES)]) for k in range(_CHAINS)]

    def _chain(self, rng: np.random.Generator, length: int, size: float) -> Floats:
        time = np.arange(length) * self.period
        swing = np.sin(rng.uniform(10.0, 200.0) * time) + 0.3 * rng.standard_normal(length)
        angle = rng.normal(0.0, 1.0) + self.deflection * (1.0 + size * swing)
        angle[rng.random(length) < 0.05] = np.nan
        if not self.moves:
            alone: Floats = angle[:, None]
            return alone
        end = float(self.law.time[-1])
        played = np.cumsum(rng.choice([0.0, 1.0, 8.0], length)) * 1.3 * end / (3.0 * length)
        played[rng.random(length) < 0.05] = np.nan
        back = rng.random(length) < 0.03
        played[back] = rng.uniform(0.0, 1.1, int(back.sum())) * end
        at_node = rng.random(length) < 0.1
        played[at_node] = rng.choice(self.law.time, int(at_node.sum()))
        return np.column_stack([angle, played])
