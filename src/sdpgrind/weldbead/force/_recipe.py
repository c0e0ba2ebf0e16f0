"""What is exported of a force controller: its law, and readings of passes for the self-test."""

from dataclasses import dataclass

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.codegen import Recipe
from sdpgrind.weldbead.force._kernels import ControlCore, exported_step

_INPUTS = {"force": "N", "normal_force_plan": "N", "position_plan": "mm"}
_MEANINGS = {
    "force": "reading of the force sensor, > 0 where the disc presses onto the bead",
    "normal_force_plan": "planned force, ahead by the lag of the loop, > 0 onto the bead",
    "position_plan": "planned position of the platform, ahead by the lag of the loop, > 0 up",
    "platform_command": "position of the platform to command, > 0 up: it carries the part towards the disc",
}
_READING_MAX, _POSITION_MAX = 1e6, 1e5  # chosen: N, mm; beyond any force sensor, any platform
_CHAINS = 8  # chosen: passes of the self-test
_SPREAD = 0.2  # chosen: share of the greatest force by which readings are off; mm of the planned position


def recipe_of(core: ControlCore, state: Floats, period: float, force_max: float) -> Recipe:
    """Return what is exported of a force law, in N, mm and samples.

    Planned force and platform position come from the plan, ahead by the lag of the loop.
    """
    law, model = core.law.B.size, core.model.B.size
    rest = law + model
    return Recipe(
        "force",
        exported_step,
        _INPUTS,
        {"platform_command": "mm"},
        law=(core,),
        state=state,
        missing=("force",),
        ranges={
            "force": (-_READING_MAX, _READING_MAX),
            "normal_force_plan": (0.0, force_max),
            "position_plan": (-_POSITION_MAX, _POSITION_MAX),
        },
        meanings=_MEANINGS,
        period=period,
        places={"correction": rest, "command": rest + 1, "samples_lost": rest + 2, "error": rest + 3},
        equations="feedforward of the planned height, feedback on the difference to the model of the loop",
        vectors=_Passes(force_max).chains,
        spread=(_SPREAD * force_max, 0.0, _SPREAD),
        kind="ForceController",
    )


@dataclass(frozen=True)
class _Passes:
    """Passes: the planned force rises and falls, the reading follows it, is lost, or shows no contact."""

    force_max: float

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` readings with planned force (N) and position (mm)."""
        length = max(count // _CHAINS, 1)
        return [self._one(rng, length, k % 4) for k in range(_CHAINS)]

    def _one(self, rng: np.random.Generator, length: int, fault: int) -> Floats:
        time = np.linspace(0.0, 1.0, length)
        demand = self.force_max * np.clip(1.2 * np.sin(np.pi * time) * rng.uniform(0.3, 1.0), 0.0, 1.0)
        position = -10.0 + np.cumsum(rng.normal(0.0, 0.05, length)) * rng.choice([0.2, 1.0, 20.0])
        force = demand * rng.uniform(0.5, 1.3) + rng.normal(0.0, 0.02 * self.force_max, length)
        if fault == 1:
            force[rng.random(length) < 0.2] = np.nan
        elif fault == 2:
            force[length // 4 : length // 2] = 0.0
        elif fault == 3:
            force[rng.random(length) < 0.1] *= 8.0
        return np.column_stack([force, demand, position])
