"""Errors and readings of a probe."""

import math
from fractions import Fraction
from typing import Any

import numpy as np

from centering._plant import probe_kernels as kernels
from centering._plant.ring import Ring, moved_by, shape_of
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, count, described, part, quantity


def _small(default: float) -> Any:
    """Declare a length of at most 0.25 mm; chosen: a larger number means micrometres."""
    return quantity("mm", at_least=0, at_most=0.25, hint="; units.um(...) for micrometres", default=default)


@described()
class ProbeErrors(Described):
    """Errors of a `Probe`.

    Parameters
    ----------
    probe_quantum, slide_quantum : float
        Steps of the encoders of probe and slide, mm. 0: none.
    counts : int
        Steps of the spindle's encoder in a turn, a whole number. 0: none.
    noise_sd : float
        Standard deviation of the reading, mm.
    skew : float
        Delay of the spindle's reading after those of probe and slide, s.
    runout : float
        Amplitude of the roller's runout, mm: ``runout*cos(R/tip_radius*(1 - slip)*beta - runout_phase)`` at
        the polar angle beta of the contact on the part.
    runout_phase : float, optional
        Phase of the runout, rad. None: drawn for each part.
    slip : float
        Slip of the roller over its rolled length, unit 1.
    dust : float
        Probability of dust under a sample, unit 1; it only adds.
    dust_size : float
        Mean height of dust, mm; uniform within 50 % of it.

    Raises
    ------
    ValueError
        When a value is out of range, or a length seems to be in micrometres.

    Examples
    --------
    >>> ProbeErrors(dust=0.01).replace(noise_sd=1e-4).dust_size  # mm
    0.01
    """

    probe_quantum: float = _small(5e-5)
    slide_quantum: float = _small(2e-5)
    counts: int = count(0, default=4000)
    noise_sd: float = _small(3e-5)
    skew: float = quantity("s", default=0.0)
    runout: float = _small(1.5e-3)
    runout_phase: float | None = quantity("rad", default=None)
    slip: float = quantity("1", at_least=-1, at_most=1, default=0.0)
    dust: float = quantity("1", at_least=0, at_most=1, default=0.0)
    dust_size: float = _small(0.01)


NO_ERRORS = ProbeErrors(probe_quantum=0.0, slide_quantum=0.0, counts=0, noise_sd=0.0, runout=0.0)


@described()
class ProbeScan(Described, ByValue):
    """Samples of a ring on a turning table; made by `Probe.scan`.

    Parameters
    ----------
    angle : array
        Spindle angle, rad, continuous over turns.
    reading : array
        Position of the surface on the probe line, mm from the spindle's axis: slide plus probe. NaN: none.
    slide, probe : array
        Readings of slide and probe, mm.
    time : array
        Time, s.
    ring : Ring
        The ring as it lay at the start.

    Examples
    --------
    >>> import hwsim
    >>> scan = hwsim.Probe(hwsim.Ring(61.94, 3.6), errors=None).scan(turns=0.25)
    >>> scan
    ProbeScan(75 readings on 0.2467 turns in 0.74 s: radius 61.94 mm, offset 3.6 mm)
    """

    angle: Floats = array("rad", finite=False)
    reading: Floats = array("mm", finite=False)
    slide: Floats = array("mm", finite=False)
    probe: Floats = array("mm", finite=False)
    time: Floats = array("s", finite=False)
    ring: Ring = part(Ring)

    def __repr__(self) -> str:
        missing = int(np.isnan(self.reading).sum())
        none = f" ({missing} without the surface)" if missing else ""
        turns = float(np.ptp(self.angle)) / (2 * np.pi)
        sampled = (
            f"{self.reading.size} readings{none} on {counted(turns, 'turn')} in {np.ptp(self.time):.4g} s"
        )
        return f"ProbeScan({sampled}: radius {self.ring.radius:.7g} mm, offset {self.ring.offset:.4g} mm)"


def probe_shape(probe: Any, ring: Ring) -> Floats:
    """The ring under the tip for the compiled core, before and after a move; `probe` is a `hwsim.Probe`."""
    shape = shape_of(ring, probe.tip_radius)
    if probe.moved is not None:
        there = shape_of(moved_by(ring, *probe.moved[1:]), probe.tip_radius)
        shape[kernels.SCAN] = max(shape[kernels.SCAN], there[kernels.SCAN])
    return shape


def probe_settings(probe: Any, ring: Ring, tick: Fraction, phase: float) -> Floats:
    """Settings of the compiled core; `phase` (rad) of the roller's runout where the errors give none."""
    errors, cell = NO_ERRORS if probe.errors is None else probe.errors, np.zeros(kernels.SETTINGS)
    cell[kernels.TICK_ABOVE], cell[kernels.TICK_BELOW] = tick.numerator, tick.denominator
    cell[kernels.PER_TURN], cell[kernels.COUNTS] = probe.samples_per_turn or 0, errors.counts
    cell[kernels.START] = probe.start_angle
    if errors.counts:
        cell[kernels.START] = math.floor(probe.start_angle * errors.counts / (2 * math.pi) + 0.5)
    cell[kernels.RUNOUT_PHASE] = phase if errors.runout_phase is None else errors.runout_phase
    if probe.tip_radius > 0:
        cell[kernels.RUNOUT] = errors.runout
        cell[kernels.ROLL] = ring.radius / probe.tip_radius * (1 - errors.slip)
    cell[kernels.SKEW], cell[kernels.NOISE_SD] = errors.skew, errors.noise_sd
    cell[kernels.DUST], cell[kernels.DUST_SIZE] = errors.dust, errors.dust_size
    cell[kernels.PROBE_QUANTUM], cell[kernels.SLIDE_QUANTUM] = errors.probe_quantum, errors.slide_quantum
    cell[kernels.FOLLOW_TIME], cell[kernels.HALF_STROKE] = probe.follow_time, 0.5 * probe.stroke
    moved = (math.inf, 0.0, 0.0) if probe.moved is None else probe.moved
    cell[kernels.MOVE_TIME], cell[kernels.MOVE_X], cell[kernels.MOVE_Y] = moved
    return cell


def probe_state(probe: Any, ring: Ring, cell: Floats) -> Floats:
    """Initial state of the compiled core."""
    state = np.zeros(kernels.STATES)
    state[kernels.SPEED] = probe.spindle_speed
    state[kernels.ANGLE] = kernels.edge_angle(cell, 0.0) if probe.samples_per_turn else probe.start_angle
    state[kernels.CENTER_X], state[kernels.CENTER_Y] = ring.center_x, ring.center_y
    return state
