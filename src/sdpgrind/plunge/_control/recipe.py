"""Recipe of a controller of plunge cycles: step, law, state, and inputs of its self-test."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.states import named
from sdpgrind.codegen import Recipe, Role, Signal
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import exported_step, start_control
from sdpgrind.plunge._model.kernels import PlungeCore, rate

_OUTPUTS = {
    "command_rate": Signal("mm/s", "infeed rate to command, > 0 into the part, < 0 away from it; 0 with the"
                           " status retract"),
    "balancing": Signal("", "1 while depth of burning and remaining stock are held in balance, else 0"),
}  # fmt: skip
_POWER_MAX = 1e6  # chosen: W; no grinding spindle has a megawatt
_PLACES = {
    name: getattr(at, name.upper())
    for name in (
        "section",
        "rate",
        "remaining",
        "commanded",
        "missed",
        "size",
        "touched",
        "zero",
        "scale",
        "sharpness",
    )
}
_LONGEST = 420  # chosen: samples of a part of the self-test; parts of the presets take some 400
_HELD = 60  # chosen: sample from which a gauge shows the same
_MORE = 3  # chosen: samples after the end of a part
_SIZE_SPREAD, _POWER_SPREAD = 4e-4, 0.02  # chosen: mm; share of the power at the greatest rate


def recipe_of(controller: Any) -> Recipe:
    """Return the recipe of a controller, in mm, s, N and W."""
    law, model = controller.law, controller.problem.model
    core = model.core
    greatest = named(law, at.LAW).rate_max
    watts = float(core.power0 + core.power1 * greatest + core.power2 * greatest**core.p)
    part = _Part(law, core, watts)
    return Recipe(
        "cycle",
        exported_step,
        _inputs(model.work_diameter, watts),
        _OUTPUTS,
        law=(law,),
        state=np.zeros(at.STATES),
        start=start_control,
        tables={"parameters": "law of the controller, by entry: " + ", ".join(at.LAW.names or ())},
        period=controller.period,
        status=("go on", "retract"),
        places=_PLACES,
        equations="Dong, Danai and Malkin (2004), section 2; safe position of the axis.",
        vectors=part.chains,
        kind=type(controller).__name__,
        role=Role(
            commands=controller.commands,
            answer=lambda status, found: {"retract": 1.0} if status == 1 else found,
            job=controller.job,
            description=controller.description,
        ),
    )


def _inputs(diameter: float, watts: float) -> dict[str, Signal]:
    """Return the inputs at a work of this diameter (mm), with this power (W) at the greatest rate."""
    size = "radial stock removed as the gauge shows it: 0 at the start, growing as the part shrinks"
    power = "power as the monitor shows it, idle power included, > 0 while the wheel turns"
    saturated = "not 0 where the power meter is at its end: the power is then not used"
    return {
        "size": Signal("mm", size, -diameter, diameter, missing=True, spread=_SIZE_SPREAD),
        "grinding_power": Signal(
            "W", power, -_POWER_MAX, _POWER_MAX, missing=True, spread=_POWER_SPREAD * watts
        ),
        "power_saturated": Signal("", saturated, 0.0, 1.0, default=0.0, spread=0.0),
    }


@dataclass(frozen=True)
class _Part:
    """Coarse part that answers to the controller, with readings that go wrong in all ways."""

    law: Floats
    core: PlungeCore
    watts: float

    def chains(self, rng: np.random.Generator, count: int) -> list[Floats]:
        """Return the readings of parts, about `count` samples at least, each fault once at least."""
        found: list[Floats] = []
        while sum(map(len, found)) < count or len(found) < len(_FAULTS):
            fault = _FAULTS[len(found) % len(_FAULTS)]
            found.append(np.array(list(self._readings(rng, fault))))
        return found

    def _readings(self, rng: np.random.Generator, fault: str) -> Iterator[tuple[float, float, float]]:
        state, law = np.zeros(at.STATES), named(self.law, at.LAW)
        start_control(state, self.law)
        command, out, after, held = 0.0, np.zeros(2), 0, 0.0
        deflection, removed = (
            -self.core.K0 * rng.uniform(0.5, 1.5),
            rng.normal(0.0, 2e-3) * (fault == "stock"),
        )
        dull = {"sharp": 0.15, "dull": 6.0}.get(fault, rng.uniform(0.7, 1.6))
        for k in range(_LONGEST):
            v = float(rate(deflection, self.core)) / dull
            deflection, removed = deflection + (command - v) * law.sample_time, removed + v * law.sample_time
            row = self._reading(rng, fault, k, removed, v, deflection)
            if fault == "held" and k >= _HELD:
                row = held, *row[1:]
            held = row[0]
            yield row
            after += exported_step(state, self.law, *row, out)
            if after > _MORE:
                return
            command = out[0]

    def _reading(
        self, rng: np.random.Generator, fault: str, k: int, removed: float, v: float, deflection: float
    ) -> tuple[float, float, float]:
        """Return size (mm), power (W) and whether it is clipped, of sample `k`."""
        core = self.core
        x = deflection + core.K0
        cutting = core.power0 + core.power1 * v + core.power2 * v**core.p
        power = cutting if v > 0.0 else core.power0 * max(x, 0.0) / core.K0 if core.K0 > 0.0 else 0.0
        size = removed + 2e-4 * rng.standard_normal()
        power *= 1.0 + 0.02 * rng.standard_normal()
        if fault == "powerless" and k < 60:
            power = np.nan
        elif fault == "idle":
            power = 0.0
        elif fault == "air":  # the wheel never touches
            size, power = 1e-4 * rng.standard_normal(), core.power0
        elif fault == "dull":
            power = core.power0 + (power - core.power0) * 6.0
        elif fault == "gaps" and rng.random() < 0.2:
            size, power = (np.nan, power) if rng.random() < 0.6 else (size, np.nan)
        elif fault == "jumps" and rng.random() < 0.1:
            size += rng.choice([-1.0, 1.0]) * rng.choice([0.002, 0.05])
        elif fault == "frozen" and k > 80:
            size = removed - removed % 0.02
        elif fault == "lost" and k > 120:
            size = np.nan
        return size, power, float(fault == "clipped" and rng.random() < 0.3)


_FAULTS = (
    "none", "stock", "powerless", "idle", "gaps", "jumps", "frozen", "lost", "clipped", "air", "held",
    "sharp", "dull",
)  # fmt: skip
