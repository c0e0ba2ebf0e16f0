"""A force-controlled stand that grinds a bead pass by pass: a disc on a compliance over a moving table."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from hwsim.devices import Gauge, Scanner
from hwsim.plants._force_table.machine import ForceTable, ForceTableSetup
from sdpgrind.base import checks
from sdpgrind.base.quantities import (
    Described,
    count,
    custom,
    described,
    flag,
    part,
    quantity,
    units_of,
    valued,
)
from sdpgrind.weldbead import CoefficientScatter as CoefficientScatter
from sdpgrind.weldbead import SequenceProblem, preset
from sdpgrind.weldbead.force import SensorChain, TableDrive, table_drive
from sdpgrind.weldbead.kernels import FINE, SPACING, GroundBead, drawn_disc, reach
from sdpgrind.weldbead.kernels import Motor as Motor
from sdpgrind.weldbead.passes import PassProblem, TiltedDisc

Truth: TypeAlias = TiltedDisc | Callable[[np.random.Generator], TiltedDisc] | None


def _drive() -> TableDrive:
    return table_drive("appendix-b").replace(backlash=0.01)


def _checked_disc(disc: Any) -> TiltedDisc:
    if not isinstance(disc, TiltedDisc):
        raise TypeError(
            f"truth must be None, a TiltedDisc or a function of rng that gives one; got {checks.shown(disc)}"
        )
    return disc


def _checked_truth(name: str, truth: Any) -> Any:
    """Return the truth of the disc, or a function that draws it."""
    return truth if truth is None or callable(truth) else _checked_disc(truth)


@described()
class ForceTableStand(Described):
    """Passes over a weld bead under force control: Brown (1988), chapters 6, 7, with errors he leaves out.

    A tilted disc on a rotational compliance cuts the bead by volume balance; a motor-driven table with
    stiction and backlash moves the work up and down; force sensors are read once a sample. Each pass has its
    own coefficients.

    Accepts ``start`` (begin a pass) with ``feed_rate`` (mm/s) and optional ``start_x`` (centre of the disc,
    mm); ``platform_command`` (mm, up positive: the disc centre is ``datum`` minus the platform above the
    work); ``stop``. A pass begins at the lead-in, with the platform drawn back, and ends when the tip has
    left the bead by the lead-out; then the grinder returns (reset time) and the bead is scanned: that is the
    event. All of it takes time.

    Measures each sample ``force`` and ``friction_force`` (N; NaN outside a pass), ``disk_speed`` (rad/s),
    ``center_x`` and ``table_position`` (mm), ``pass_time`` (s from the start of the pass; NaN outside),
    ``time_left`` (s), ``phase`` (0 idle, 1 lead-in, 2 on the bead, 3 lead-out, 4 reset). At events only (NaN
    otherwise) the scanned ``profile`` and ``profile_x`` (mm), its mean ``height`` (mm) above the parent, and
    of the last pass, from sensors in contact and both scans, ``grinding_power`` (W), ``normal_force``,
    ``tangential_force`` (N), ``removal_rate`` (mm^3/s), ``feed_rate`` (mm/s) and ``cut_depth`` (mm), as
    `sdpgrind.weldbead.identify` reads them.

    Outcome of a bead: ``penalty`` ($), mean ``height`` (mm), ``overground`` (mm, mean depth below the
    parent), ``overground_worst`` (mm, deepest point), ``passes``, ``time``, ``lead_time``, ``lateness`` (s),
    ``stalls``, ``burned`` (passes with a sample of mean force beyond the burn limit), ``burn_time`` (s, of
    such samples), the final ``contour`` (mm), and of each pass ``true_cut_depth`` (mm),
    ``true_specific_energy`` (J/mm^3), ``true_idle_power`` (W), ``true_friction_ratio``, ``true_force`` (N,
    mean on the bead) and ``true_volume`` (mm^3).

    Parameters
    ----------
    problem : PassProblem
        Disc and bead.
    truth : TiltedDisc or callable, optional
        True mean disc and process, or a function of a Generator that draws them for each bead. None: those of
        the problem.
    pass_scatter, bead_scatter : CoefficientScatter
        Scatter of coefficients from pass to pass, and between beads, dimensionless.
    sequence : SequenceProblem, optional
        Charges ($), reset time (s), burn limit. None: those of the preset P4.
    time : float, optional
        Time until the deadline at the start, s. Default: half the horizon of `sequence`, or 60 s without one.
    motor : Motor, optional
        Motor of the disc; `Motor.air()`: an air motor. None: that of the process, electric where it has no
        droop.
    drive : TableDrive
        The table (mm).
    sensor : SensorChain
        Both force sensors; its sample time is the tick (s).
    delay_samples : int
        Samples between a command and its effect, a whole number.
    speed_gauge, feed_gauge, table_gauge : Gauge
        Tachometer (1 % noise), and gauges of disc centre and table position (mm).
    scanner : Scanner
        Scanner of the bead (mm).
    runout : float
        Amplitude of the axial runout of the disc, mm.
    grinder_inertia : float
        Moment of inertia of the grinder about its pivot, N mm s^2; about 5.4 for 1.5 kg. 0: massless, as in
        Brown.
    spring_first : bool
        Whether the compliance is between grinder and sensor, which then measures the spring alone (Brown,
        8.3.2). No difference without inertia.
    lead_in, lead_out : float
        Travel of the tip before and behind the bead, mm.
    clearance : float
        Height of the disc above the bead with the platform drawn back, mm.
    datum : float
        Height of the disc centre at platform position 0, mm.
    overload : float
        Force at which the stand breaks a pass off, N; it counts as a stall.

    Raises
    ------
    ValueError
        When a value is out of range, or a command cannot be carried out.

    Examples
    --------
    >>> import hwsim, numpy as np
    >>> from sdpgrind import units
    >>> from sdpgrind.weldbead import GrindingProcess, passes
    >>> process = GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    >>> disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    >>> bead = passes.Contour([0.0, 20.0], [1.0, 1.0])
    >>> stand = hwsim.ForceTableStand(passes.PassProblem(disc, bead, mean_cut=0.2, feed_rate=20.0))
    >>> machine = stand.start(np.random.default_rng(1))
    >>> round(machine.step({}, 0)["height"], 2)
    1.0
    """

    problem: PassProblem = part(PassProblem)
    _: KW_ONLY
    truth: Truth = custom(_checked_truth, default=None)
    pass_scatter: CoefficientScatter = part(CoefficientScatter, default_factory=CoefficientScatter)
    bead_scatter: CoefficientScatter = part(
        CoefficientScatter, default_factory=lambda: CoefficientScatter(0.0, 0.0, 0.0)
    )
    sequence: SequenceProblem | None = part(SequenceProblem, default=None)
    time: float | None = quantity("s", default=None)
    motor: Motor | None = part(Motor, default=None)
    drive: TableDrive = part(TableDrive, default_factory=_drive)
    sensor: SensorChain = part(SensorChain, default_factory=SensorChain)
    delay_samples: int = count(0, default=1)
    speed_gauge: Gauge = part(Gauge, default_factory=lambda: Gauge(relative_sd=0.01))
    feed_gauge: Gauge = part(Gauge, default_factory=lambda: Gauge(noise_sd=0.01))
    table_gauge: Gauge = part(Gauge, default_factory=lambda: Gauge(noise_sd=0.002))
    scanner: Scanner = part(Scanner, default_factory=Scanner)
    runout: float = quantity("mm", at_least=0, usual=(0.0, 10.0), typical=0.1, default=0.1)
    grinder_inertia: float = quantity("N mm s^2", at_least=0, default=0.0)
    spring_first: bool = flag(default=False)
    lead_in: float = quantity("mm", at_least=0, usual=(0.0, 1000.0), typical=10, default=10.0)
    lead_out: float = quantity("mm", at_least=0, usual=(0.0, 1000.0), typical=5, default=5.0)
    clearance: float = quantity("mm", at_least=0, usual=(0.0, 500.0), typical=2, default=2.0)
    datum: float = quantity("mm", default=0.0)
    overload: float = quantity("N", above=0, default=300.0)

    def _check(self) -> None:
        if self.grinder_inertia > 0 and self.problem.disc.rotational_stiffness is None:
            rule = "0 with a compliance table; a grinder with inertia needs rotational_stiffness"
            raise self._refused("grinder_inertia", rule)
        if self.bead.length <= self.scanner.spacing:
            raise checks.refuse(
                "bead", f"longer than the scanner's spacing {self.scanner.spacing:g}", self.bead.length, "mm"
            )

    @cached_property
    def bead(self) -> GroundBead:
        """The bead on the even grid of the stand, mm."""
        return GroundBead.of(self.problem, FINE if self.grinder_inertia > 0 else SPACING)

    @property
    def start_time(self) -> float:
        """Time until the deadline at the start (s)."""
        if self.time is not None:
            return self.time
        return 60.0 if self.sequence is None else 0.5 * self.sequence.horizon

    @property
    def charges(self) -> SequenceProblem:
        """Charges ($), reset time (s) and burn limit."""
        return preset("P4") if self.sequence is None else self.sequence

    @property
    def start_x(self) -> float:
        """Default centre of the disc at the start of a pass, mm: the tip at the lead-in."""
        return float(self.bead.x[0]) - self.lead_in + reach(self.problem.disc)

    @property
    def tick(self) -> float:
        """Sample time of the sensors, s."""
        return self.sensor.sample_time

    @property
    def measures(self) -> Mapping[str, str]:
        """Name -> unit of the measurements."""
        return {
            "force": "N",
            "friction_force": "N",
            "disk_speed": "rad/s",
            "center_x": "mm",
            "table_position": "mm",
            "pass_time": "s",
            "time_left": "s",
            "phase": "",
            "profile": "mm",
            "profile_x": "mm",
            "height": "mm",
            "grinding_power": "W",
            "normal_force": "N",
            "tangential_force": "N",
            "removal_rate": "mm^3/s",
            "feed_rate": "mm/s",
            "cut_depth": "mm",
        }

    @property
    def accepts(self) -> Mapping[str, str]:
        """Name -> unit of the commands: start of a pass, platform (mm), stop."""
        return {"start": "", "feed_rate": "mm/s", "start_x": "mm", "platform_command": "mm", "stop": ""}

    @property
    def safe(self) -> Mapping[str, float]:
        """Command that draws the platform back, at any moment; unit 1."""
        return {"stop": 1.0}

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of a command, unit 1."""
        return {"start": (0.0, 1.0), "stop": (0.0, 1.0)}

    @property
    def outcomes(self) -> Mapping[str, str | tuple[str, str]]:
        """Name -> unit (and dimension of arrays) of the outcomes."""
        scalars = {
            "penalty": "$",
            "height": "mm",
            "overground": "mm",
            "overground_worst": "mm",
            "passes": "",
            "time": units_of(type(self))["time"],
        }
        more = {"lead_time": "s", "lateness": "s", "stalls": "", "burned": "", "burn_time": "s"}
        of_pass = {
            "cut_depth": "mm",
            "specific_energy": "J/mm^3",
            "idle_power": "W",
            "friction_ratio": "",
            "force": "N",
        }
        arrays = {f"true_{name}": (unit, "pass") for name, unit in {**of_pass, "volume": "mm^3"}.items()}
        return {**scalars, **more, "contour": ("mm", "x"), **arrays}

    @property
    def description(self) -> Mapping[str, float | str]:
        """Start and size of the bead, in mm and s, for the log."""
        return {
            "start_height": self.bead.height(self.bead.z),
            "start_time": float(self.start_time),
            "bead_length": self.bead.length,
            "bead_width": float(self.problem.disc.model.bead_width),
            "grid_start": float(self.bead.x[0]),
            "grid_spacing": self.bead.spacing,
            "reset_time": float(self.charges.reset_time),
        }

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine (mm, s) that a plan must have been made for; `truth` may differ."""
        model = self.problem.disc.model
        own: dict[str, object] = {
            "bead_length": (self.bead.length, "mm"),
            "bead_width": (float(model.bead_width), "mm"),
            "disk_radius": (float(model.disk_radius), "mm"),
            **valued(self, ("datum", "lead_out")),
            "parent": self.problem.parent,
        } | self.problem.disc.job
        if self.sequence is not None:
            own |= {"reset_time": (self.sequence.reset_time, "s"), "burn_limit": self.sequence.burn_limit}
        return own

    def start(self, rng: np.random.Generator) -> ForceTable:
        """Draw the truth of the next bead from `rng` and return it at time 0 s.

        Bead, passes and noise draw from a child each: controllers are compared on equal draws.
        """
        of_truth, of_passes, of_noise = rng.spawn(3)
        disc = self.truth(of_truth) if callable(self.truth) else self.truth
        disc = drawn_disc(
            self.bead_scatter, _checked_disc(self.problem.disc if disc is None else disc), of_truth
        )
        return ForceTable(ForceTableSetup(self, self.bead, disc), of_passes, of_noise)
