"""A measuring head on a turning table: slide, probe and spindle, read together."""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from typing import Any, ClassVar, TypeAlias

import numpy as np

from centering.kernels import ProbeErrors as ProbeErrors
from centering.kernels import ProbeScan as ProbeScan
from centering.kernels import Ring as Ring
from centering.kernels import moved_by, probe_settings, probe_shape, probe_state, within_a_turn
from hwsim._part.clock import Clock, exact
from hwsim.plants._probe.machine import ProbePart, checked_speed
from sdpgrind.base import checks, units
from sdpgrind.base.quantities import Described, count, custom, described, part, quantity, units_of
from sdpgrind.base.rng import Seed, children

Truth: TypeAlias = Ring | Callable[[np.random.Generator], Ring] | None
_LATCH = 1e-6  # tick with samples triggered by the angle, s; chosen: the smallest tick of the loop
_UNEVEN = 1e-9  # samples; chosen: above the rounding of whole turns


def _follow_time(name: str, value: Any) -> float:
    """Time constant of a slide, s; inf: it does not move."""
    return math.inf if value == math.inf else checks.positive(name, value, "s")


def _moved(name: str, moved: Any) -> Any:
    """Time (s) and displacement (mm) of a move."""
    if not isinstance(moved, tuple | list) or len(moved) != 3:
        raise TypeError(f"{name} must be (time in s, x in mm, y in mm) or None; got {checks.shown(moved)}")
    checks.nonnegative(f"{name}[0]", moved[0], "s")
    for k in (1, 2):
        checks.number(f"{name}[{k}]", moved[k], "mm")
    return moved


@described()
class Probe(Described):
    """A ring turns on a table, and a round tip on a slide follows its rim: Mears (2006), chapters 3 and 4.

    Each sample is an event; the first one is at the start. It has the ``angle`` of the spindle (rad,
    continuous over turns), the readings of ``slide`` and ``probe`` (mm, both positive away from the axis) and
    their sum, the ``reading`` (mm). It accepts another ``spindle_speed`` (rad/s, at once) and ``stop``.

    The tip touches where a circle of its radius touches the ring, exactly (`Ring.reading`). The slide follows
    the reading of the sample before; where this leaves the probe beyond its stroke the reading is NaN.

    Outcome of a part: ``time`` (s), ``turns``, ``samples``, number of readings ``lost``, ``timed_out`` (1:
    not stopped), and the hidden final ``true_radius``, ``true_center_x``, ``true_center_y``, ``true_offset``
    and ``true_roundness`` (mm, peak to valley).

    Parameters
    ----------
    ring : Ring
        The ring, unless `truth` is given.
    truth : Ring or callable, optional
        True ring, or a function of a Generator that draws it for each part. None: `ring`.
    tip_radius : float
        Radius of tip or roller, mm. 0: a point, without runout.
    spindle_speed : float
        Initial speed, rad/s: units.rpm(20); at least three samples in a turn.
    start_angle : float
        Spindle angle of the first sample, rad, within a turn; with `samples_per_turn` the nearest edge of the
        encoder.
    sample_time : float
        Time between two samples, s.
    samples_per_turn : int, optional
        Samples in a turn triggered by edges of the encoder, at exact angles; evenly spaced if they divide its
        counts. None: one sample each sample time.
    errors : ProbeErrors, optional
        Errors of the readings (mm, s, rad). None: none, not even steps of encoders.
    follow_time : float
        Time constant of the slide, s. inf: it does not move.
    stroke : float
        Stroke of the probe, mm, half of it on either side of the slide's target.
    moved : tuple, optional
        Time (s) at which the part is moved, and displacement along x and y of the table (mm); the axis stays
        within the part.
    turns_max : float
        Limit for one part, turns.

    Raises
    ------
    ValueError
        When a value is out of range or seems to have another unit, or a command cannot be carried out.

    Examples
    --------
    >>> import hwsim
    >>> probe = hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5))
    >>> scan = probe.scan(turns=2.0)
    >>> len(scan.angle), float(scan.reading.max().round(2))  # mm
    (600, 65.54)
    """

    ring: Ring = part(Ring)
    _: KW_ONLY
    truth: Truth = part(Ring, ", a function of rng, or None", or_function=True, default=None)
    tip_radius: float = quantity("mm", at_least=0, usual=(0.0, 300.0), typical=3.75, default=3.75)
    spindle_speed: float = quantity("rad/s", above=0, default_factory=lambda: units.rpm(20.0))
    start_angle: float = custom(within_a_turn, "rad", default=0.0)
    sample_time: float = quantity("s", above=0, default=0.01)
    samples_per_turn: int | None = count(3, default=None)
    errors: ProbeErrors | None = part(ProbeErrors, " or None", default_factory=ProbeErrors)
    follow_time: float = custom(_follow_time, "s", default=0.03)
    stroke: float = quantity("mm", above=0, default=25.0)
    moved: tuple[float, float, float] | None = custom(_moved, default=None)
    turns_max: float = quantity("turns", above=0, default=100.0)

    _inside: ClassVar[str] = "errors"

    def _check(self) -> None:
        checked_speed(self.spindle_speed, self.sample_time if self.samples_per_turn is None else None)
        counts = self.errors.counts if self.errors is not None else 0
        if counts and self.samples_per_turn is not None and self.samples_per_turn > counts:
            raise self._refused("samples_per_turn", f"<= counts of the spindle's encoder, {counts}")
        if self.moved is not None and not callable(self.truth):
            moved_by(self.truth or self.ring, *self.moved[1:])

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        return {"angle": "rad", "reading": "mm", "slide": "mm", "probe": "mm"}

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands (rad/s)."""
        return {"spindle_speed": units_of(Probe)["spindle_speed"], "stop": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that ends the measurement, at any moment; unit 1."""
        return {"stop": 1.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command, unit 1."""
        return {"stop": (0.0, 1.0)}

    @property
    def outcomes(self) -> Mapping[str, str]:
        """Name -> unit of the outcomes."""
        true = dict.fromkeys(("radius", "center_x", "center_y", "offset", "roundness"), "mm")
        told = {"time": "s", "turns": "", "samples": "", "lost": "", "timed_out": ""}
        return {**told, **{f"true_{name}": unit for name, unit in true.items()}}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Radius of the tip (mm) and spindle speed (rad/s), for the log."""
        return {"tip_radius": float(self.tip_radius), "spindle_speed": float(self.spindle_speed)}

    @property
    def tick(self) -> float:
        """Sample time, s; 1 µs where the angle triggers the samples."""
        return self.sample_time if self.samples_per_turn is None else _LATCH

    def start(self, rng: np.random.Generator) -> ProbePart:
        """Draw the truth of the next part from a child of `rng`, readings from another; return it at 0 s."""
        of_truth, of_readings = rng.spawn(2)
        truth = self.ring if self.truth is None else self.truth
        ring = truth if isinstance(truth, Ring) else checks.kind("truth(rng)", truth(of_truth), Ring)
        clock = Clock(exact("sample_time", self.tick))
        cell = probe_settings(self, ring, clock.tick, of_readings.uniform(-math.pi, math.pi))
        return ProbePart(
            ring,
            probe_shape(self, ring),
            cell,
            probe_state(self, ring, cell),
            float(self.turns_max),
            clock,
            of_readings,
        )

    def scan(self, turns: float = 1.0, *, rng: Seed = 0) -> ProbeScan:
        """Return the samples of some turns, the last one excluded, bit-equal to those of `hwsim.run`.

        Parameters
        ----------
        turns : float
            Number of turns, unit 1.
        rng : int, Generator or SeedSequence
            Random source; the scan is that of the first part of a run with it.

        Returns
        -------
        ProbeScan
            Angle (rad), reading, slide, probe (mm), time (s), and the true ring.

        Examples
        --------
        >>> import centering, hwsim
        >>> scan = hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5), errors=None).scan()
        >>> exact = centering.circle.circle_reading(scan.angle, 61.94, 3.6, 0.5, 3.75)
        >>> bool(abs(scan.reading - exact).max() < 1e-11)  # mm
        True
        """
        per_turn = (
            2 * math.pi / (self.spindle_speed * self.sample_time)
            if self.samples_per_turn is None
            else self.samples_per_turn
        )
        number = math.ceil(checks.positive("turns", turns) * per_turn - _UNEVEN)
        part = self.start(children(rng, 1)[0])
        return part.scan(number)
