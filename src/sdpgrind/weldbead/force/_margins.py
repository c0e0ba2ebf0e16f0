"""Margins of a force loop, and its exact response to disc runout."""

import dataclasses

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import hz
from sdpgrind.control import Margins, Sampled, loop_margins
from sdpgrind.weldbead.force._feedback import ForceLoop, ForcePlant

RUNOUT_BAND = (hz(20.0), hz(50.0))  # source: disc speeds of Brown's (1988) air motor under load, rad/s


def margins(loop: ForceLoop, delay_samples: int | None = None) -> Margins:
    """Return stability margins, bandwidths and the largest runout response of a force loop.

    Parameters
    ----------
    loop : ForceLoop
        Loop, from `PI.design` or another design.
    delay_samples : int, optional
        Delay of the plant, a whole number of samples >= 0. Default: the loop's own.

    Returns
    -------
    Margins
        Frequencies in rad/s, gains dimensionless, runout over disc speeds of 20 to 50 Hz.

    Raises
    ------
    ValueError
        When the loop is unstable with that delay, or the delay is not a whole number >= 0.

    Examples
    --------
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead import force
    >>> margin = force.margins(force.PI.design(crossover=units.hz(3.0)), delay_samples=1)
    >>> round(margin.gain_margin_db, 1)
    7.2
    """
    checks.kind("loop", loop, ForceLoop, ", as PI.design gives it")
    if delay_samples is not None:
        loop = loop.delayed(delay_samples)
    spin = np.linspace(*RUNOUT_BAND, 601)
    return dataclasses.replace(
        loop_margins(loop.open), runout_response=float(runout_response(loop, spin).max())
    )


def runout_response(loop: ForceLoop, spin: npt.ArrayLike) -> Floats:
    """Return the force of a `loop` at the alias of disc speeds `spin`, rad/s, per runout force (unit 1).

    Exact for a sampled loop in contact; a = alias(f): abs(sensor(f)) abs(C S)(a) abs(hold(a) drive(a)) K_x.

    Examples
    --------
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead import force
    >>> sensor = force.SensorChain(analogue_cutoff=None, inner_rate=None)
    >>> loop = force.PI.design(crossover=units.hz(3.0), sensor=sensor)
    >>> round(float(force.runout_response(loop, units.hz(50.0))), 3)
    0.111
    """
    f = checks.finite_array("spin", spin, "rad/s")
    seen = loop.plant.sensor.alias(f)
    law = loop.law.system.response(seen)
    control = law / (1 + law * loop.plant.sampled.response(seen))
    return np.asarray(np.abs(loop.plant.sensor.response(f) * control) * moved(loop.plant, seen))


def moved(plant: ForcePlant, frequency: Floats) -> Floats:
    """Force of a sampled command at its own frequency (rad/s) by hold, drive and contact, N/mm."""
    hold = np.sinc(frequency * plant.sample_time / (2 * np.pi))
    return np.asarray(np.abs(hold * plant.drive.response(frequency)) * plant.contact_stiffness)


def parametrised(loop: ForceLoop) -> Sampled:
    """Q = C/(1 + C P) of a loop, from set-point (N) to command (mm)."""
    law, plant = loop.law.system, loop.plant.sampled
    top = np.hstack([law.A, -np.outer(law.B, plant.C)])
    low = np.hstack([np.outer(plant.B, law.C), plant.A - law.D * np.outer(plant.B, plant.C)])
    B = np.concatenate([law.B, law.D * plant.B])
    C = np.concatenate([law.C, -law.D * plant.C])
    return Sampled(np.vstack([top, low]), B, C, law.D, law.sample_time)
