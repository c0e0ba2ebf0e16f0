"""Recipe of a force controller: its law, and readings of passes for the self-test."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.states import floats
from sdpgrind.codegen import Recipe, Role, Signal, StepProgram
from sdpgrind.weldbead.force._kernels import ControlCore, exported_step
from sdpgrind.weldbead.force._pass_kernels import PASS, SETTINGS, exported_pass
from sdpgrind.weldbead.force._predictive_kernels import (
    PredictiveCore,
    exported_answer,
    exported_ask,
)
from sdpgrind.weldbead.force._reference import ForceReference

_OUTPUTS = {
    "platform_command": Signal(
        "mm", "position of the platform to command, > 0 up: it carries the part towards the disc"
    )
}
_READING_MAX, _POSITION_MAX = 1e6, 1e5  # chosen: N, mm; beyond any force sensor, any platform
_TABLES = {
    "plan": "plan of the pass, by rows: time (s), normal force (N), fly height (mm), center of the disc (mm)",
    "settings": "settings, by entry: " + ", ".join(SETTINGS.names or ()),
    "settled": "state of law and model after an endless demand: the first of the plan, and 1 N",
}
_EQUATIONS = "feedforward of the planned height, feedback on the difference to the model of the loop"
_TIME_MAX = 1e6  # chosen: s; 12 days
_CHAINS = 8  # chosen: passes of the self-test
_EXACT = -12  # chosen: place in a chain from which on time and place are those of the plan
_SPREAD = 0.2  # chosen: share of the greatest force by which readings are off; mm of the planned position


def pass_recipe(
    core: ControlCore,
    reference: ForceReference,
    settings: Mapping[str, float],
    settled: Floats,
    force_max: float,
    job: Mapping[str, object],
) -> Recipe:
    """Return the recipe of a controller with a plan, in N, s, mm; `settled` as in `exported_pass`."""
    place = np.full(reference.time.size, np.nan) if reference.center_x is None else reference.center_x
    plan = np.array([reference.time, reference.normal_force, reference.fly_height, place])
    row, state = floats(SETTINGS), np.concatenate([np.zeros(settled.shape[1]), floats(PASS)])
    for name, value in settings.items():
        row.view(SETTINGS)[name] = value
    behind = state[settled.shape[1] :].view(PASS)
    for name in ("time", "clock", "demand"):
        behind[name] = np.nan
    period = float(settings["period"])
    clock = "time since the start of the pass; one that goes back starts another; NaN: steps count"
    along = "position of the disc's center along the bead: it gives the time, where the plan has it"
    return Recipe(
        "force",
        exported_pass,
        {
            "force": _force(force_max),
            "pass_time": Signal("s", clock, -_TIME_MAX, _TIME_MAX, missing=True, spread=0.3 * period),
            "center_x": Signal("mm", along, -_POSITION_MAX, _POSITION_MAX, missing=True, spread=_SPREAD),
        },
        _OUTPUTS,
        law=(core, plan, row, settled),
        state=state,
        tables=_TABLES,
        period=period,
        places={
            "correction": settled.shape[1] - 4,
            "command": settled.shape[1] - 3,
            "demand": settled.shape[1] + 3,
        },
        equations=_EQUATIONS,
        vectors=_PlannedPasses(plan, period, force_max).chains,
        kind="ForceController",
        role=Role(job=job),
    )


def predictive_recipe(recipe: Recipe, core: PredictiveCore, program: StepProgram, order: int) -> Recipe:
    """Return the recipe of a predictive controller with a plan, made from that of its loop (N, s, mm).

    `order`: entries of the estimate, behind the state of the loop.
    """
    return replace(
        recipe,
        step=exported_ask,
        program=replace(program, finish=exported_answer),
        law=(core, *recipe.law[1:]),
        state=np.concatenate([recipe.state, np.zeros(order)]),
        equations="least squares of force errors and moves over a horizon, within limits",
        kind="PredictiveController",
    )


def law_recipe(core: ControlCore, state: Floats, period: float, force_max: float) -> Recipe:
    """Return the recipe of a force law, in N, mm and samples.

    Planned force and platform position come from the plan, ahead by the lag of the loop.
    """
    rest = core.law.B.size + core.model.B.size
    planned = "planned force, ahead by the lag of the loop, > 0 onto the bead"
    place = "planned position of the platform, ahead by the lag of the loop, > 0 up"
    return Recipe(
        "force",
        exported_step,
        {
            "force": _force(force_max),
            "normal_force_plan": Signal("N", planned, 0.0, force_max, spread=0.0),
            "position_plan": Signal("mm", place, -_POSITION_MAX, _POSITION_MAX, spread=_SPREAD),
        },
        _OUTPUTS,
        law=(core,),
        state=state,
        period=period,
        places={"correction": rest, "command": rest + 1, "samples_lost": rest + 2, "error": rest + 3},
        equations=_EQUATIONS,
        vectors=_Passes(force_max).chains,
        kind="ForceController",
    )


def _force(force_max: float) -> Signal:
    """Return the reading of the sensor, varied by a share of the greatest force, N."""
    told = "reading of the force sensor, > 0 where the disc presses onto the bead"
    return Signal("N", told, -_READING_MAX, _READING_MAX, missing=True, spread=_SPREAD * force_max)


@dataclass(frozen=True)
class _PlannedPasses:
    """Passes along a plan: by the clock, by the place, by counted steps; readings as of `_Passes`."""

    plan: Floats
    period: float
    force_max: float

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return about `count` readings with clock (s) and place (mm)."""
        length = max(count // _CHAINS, 1)
        readings = _Passes(self.force_max).chains(rng, length * _CHAINS)
        return [self._placed(rng, rows[:, 0], k) for k, rows in enumerate(readings)]

    def _placed(self, rng: np.random.Generator, force: Floats, way: int) -> Floats:
        """Return rows: the pass from before its start to behind its end, and once again."""
        count, (first, last) = len(force), self.plan[0, [0, -1]]
        span = max(last - first, self.period)
        time = np.linspace(first - 0.1 * span * (way % 3), first + 1.2 * span, count)
        time[2 * count // 3 :] -= span * (way % 2)
        place = np.interp(time, self.plan[0], self.plan[3]) + rng.normal(0.0, 0.5, count)
        if way % 4 >= 2:
            place[rng.random(count) < 0.1] *= 3.0
        nodes = np.arange(len(place[_EXACT:])) % self.plan.shape[1]
        time[_EXACT:], place[_EXACT:] = self.plan[0, nodes], self.plan[3, nodes]
        time[rng.random(count) < (1.0 if way == 3 else 0.1)] = np.nan
        place[rng.random(count) < (1.0 if way % 2 else 0.2)] = np.nan
        return np.column_stack([force, time, place])


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
