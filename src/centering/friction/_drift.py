"""Motion of a part under a load with any friction law, and its creep under an oscillating load."""

import dataclasses
from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.friction._bristle_laws import DahlFriction, FrictionLaw
from centering.friction._law_kernels import follow_load
from centering.friction._laws import CoulombFriction
from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats

_PER_CYCLE = 4000  # chosen: steps per cycle of the load; fewer exceed sqrt(M/s0) of a light part
_STEPS_MAX = 50_000_000  # chosen: a record of every step then takes 1.6 GB


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FrictionTrace:
    """Motion of a part under a load; `simulate_friction` makes it.

    Attributes
    ----------
    time : array, (n,)
        Times, s.
    load, friction : array, (n,)
        Force on the part, and mean friction against it, in the step that ends at `time`, N.
    position, velocity : array, (n,)
        Of the part, mm and mm/s.
    state : array, (n,)
        Deflection of laws with a bond, mm.
    """

    time: Floats
    load: Floats
    position: Floats
    velocity: Floats
    friction: Floats
    state: Floats

    def plot(self) -> Any:
        """Draw position (µm) and forces (N) over time; return the figure."""
        figure, (above, below) = pictures.subplots(2, 1, sharex=True)
        above.plot(self.time, 1e3 * self.position)
        above.set_ylabel("position [µm]")
        below.plot(self.time, self.load, label="load")
        below.plot(self.time, self.friction, label="friction")
        below.set(xlabel="time [s]", ylabel="force [N]")
        below.legend()
        return figure

    def __repr__(self) -> str:
        return (
            f"FrictionTrace({self.time.size} points over {self.time[-1]:.6g} s, the part moved by"
            f" {self.position[-1] - self.position[0]:.6g} mm)"
        )


def simulate_friction(
    law: FrictionLaw, load: npt.ArrayLike, *, mass: float, step: float, repeats: int = 1, every: int = 1
) -> FrictionTrace:
    """Simulate a part, at rest at first, under a force over time against a friction law.

    M v' = load - friction, in first-order steps implicit in velocity and deflection: stiff laws are stable,
    but laws with a bond need steps well below sqrt(M/s0) for accuracy. Laws without a bond hold exactly at
    rest.

    Parameters
    ----------
    law : friction law
        See `friction_law`.
    load : array_like, (n,)
        Force in each step, N.
    mass, step : float
        Of the part, kg; duration of a step, s.
    repeats, every : int
        Number of runs through the load; steps between points of the record, a divisor of all steps.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range, or for more than 50 million steps.

    Examples
    --------
    >>> from centering.friction import CoulombFriction
    >>> law, load = CoulombFriction(37.0, 28.0), [36.0] * 100 + [40.0] * 100  # N
    >>> trace = simulate_friction(law, load, mass=18.9, step=1e-3)
    >>> trace.position[100].item(), round(trace.velocity[-1].item(), 3)  # mm, mm/s: 12 N on 18.9 kg for 0.1 s
    (0.0, 63.492)
    """
    if not isinstance(law, CoulombFriction | DahlFriction):
        raise TypeError(f"law must be a friction law, as friction_law gives it; got {checks.shown(law)}")
    force, each = checks.finite_array("load", load, "N").ravel(), checks.count("every", every)
    if not force.size:
        raise checks.refuse("load", "at least one force", load, "N")
    steps = force.size * checks.count("repeats", repeats)
    if steps % each or steps > _STEPS_MAX:
        raise checks.refuse("steps in all", f"a multiple of every = {each}, up to {_STEPS_MAX}", steps)
    inertia, length = checks.positive("mass", mass, "kg") * 1e-3, checks.positive("step", step, "s")
    rows = np.zeros((steps // each + 1, 4))
    follow_load(law.kind, law.parameters, inertia, force, length, each, rows)
    shown = np.arange(rows.shape[0]) * each
    position, velocity, friction, state = rows.T
    return FrictionTrace(
        np.asarray(shown * length, dtype=float),
        force[(shown - 1) % force.size],
        position,
        velocity,
        friction,
        state,
    )


def friction_drift(
    law: FrictionLaw,
    *,
    mass: float,
    mean_load: float,
    load_amplitude: float,
    frequency: float = 20.0,
    cycles: tuple[int, int] = (10, 300),
) -> float:
    """Return the creep of a part under a load that oscillates below its breakaway force, mm.

    The difference of its positions after two numbers of cycles. A true law gives 0.

    Parameters
    ----------
    law : friction law
        See `friction_law`.
    mass : float
        Mass of the part, kg.
    mean_load, load_amplitude : float
        Of the load mean + amplitude sin(2 pi frequency t), N.
    frequency : float
        Frequency of the load, Hz.
    cycles : pair of int
        Numbers of cycles after which the position counts first and last.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range.

    Examples
    --------
    >>> from centering import preset
    >>> from centering.friction import friction_law
    >>> model = preset("printed").model
    >>> load = {"mean_load": 0.2 * model.breakaway_force, "load_amplitude": 0.3 * model.breakaway_force}
    >>> for name in ("lugre", "elasto_plastic"):
    ...     print(name, round(friction_drift(friction_law(model, name), mass=18.9, **load), 3))
    lugre 0.025
    elasto_plastic 0.0
    """
    first, last = (checks.count("cycles", number) for number in cycles)
    if first >= last:
        raise checks.refuse("cycles", "two rising numbers", cycles)
    phase = 2 * pi * (np.arange(_PER_CYCLE) + 0.5) / _PER_CYCLE
    mean = checks.number("mean_load", mean_load, "N")
    load = mean + checks.number("load_amplitude", load_amplitude, "N") * np.sin(phase)
    step = 1.0 / checks.positive("frequency", frequency, "Hz") / _PER_CYCLE
    trace = simulate_friction(law, load, mass=mass, step=step, repeats=last, every=_PER_CYCLE)
    return float(trace.position[last] - trace.position[first])
