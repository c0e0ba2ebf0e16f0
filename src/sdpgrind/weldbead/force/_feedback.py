"""Feedback laws of the force loop, and the loop they close: drive, sensor, contact stiffness, delay."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, count, described, part, quantity, text
from sdpgrind.control import Law, Sampled, continuous, held, same_sample_time
from sdpgrind.weldbead.force._drive import TableDrive, table_drive
from sdpgrind.weldbead.force._sensor import SensorChain

_System = tuple[Floats, Floats, Floats, float]
# source: Brown (1988), (7.1b): rotational stiffness over the squared radius of a 7 inch disc, N/mm
CONTACT_STIFFNESS = 6e5 / 88.9**2


@described("force.plant")
class ForcePlant(Described):
    """Plant of a force controller: table drive, contact, sensor, and delay of computing and sending.

    Parameters
    ----------
    drive : TableDrive
        Drive from command to platform position, mm/mm.
    sensor : SensorChain
        Sensor from force to reading, N/N.
    contact_stiffness : float
        Contact stiffness K_x = K_theta/R^2, Brown (7.1b), N/mm.
    delay_samples : int
        Samples from reading to command, a whole number >= 0.

    Examples
    --------
    >>> plant = ForcePlant()
    >>> round(plant.sampled.dc_gain, 2)  # N/mm
    75.92
    """

    drive: TableDrive = part(TableDrive, ", as table_drive() gives it", default_factory=table_drive)
    sensor: SensorChain = part(SensorChain, default_factory=SensorChain)
    contact_stiffness: float = quantity("N/mm", above=0, default=CONTACT_STIFFNESS)
    delay_samples: int = count(0, default=1)

    @property
    def sample_time(self) -> float:
        """Time between two samples, s."""
        return self.sensor.sample_time

    @property
    def lag(self) -> float:
        """Lag of the force behind a command, s: drive, hold, delay. 47 ms: Brown's model, one sample."""
        return self.drive.lag_time + (0.5 + self.delay_samples) * self.sample_time

    @cached_property
    def undelayed(self) -> Sampled:
        """Exact sampled model from command (mm) to reading (N) without friction and delay."""
        drive = continuous(*self.drive.polynomials)
        sensor = continuous(*self.sensor.analogue)
        A, B, C = _series(drive, sensor)
        chain = held(A, B, C, 0.0, self.sensor.inner_time)
        return (
            chain.then(self.sensor.digital_system)
            .every(self.sensor.inner_rate or 1)
            .scaled(self.contact_stiffness)
        )

    @cached_property
    def sampled(self) -> Sampled:
        """Exact sampled model from command (mm) to reading (N) with the delay."""
        return self.undelayed.delayed(self.delay_samples)


def _series(first: _System, second: _System) -> tuple[Floats, Floats, Floats]:
    """Continuous state spaces in series; the first has no direct gain."""
    A, B, C, _ = first
    if not len(second[1]):
        return A, B, second[3] * C
    lower = np.hstack([np.outer(second[1], C), second[0]])
    whole = np.vstack([np.hstack([A, np.zeros((len(B), len(second[1])))]), lower])
    return whole, np.concatenate([B, np.zeros(len(second[1]))]), np.concatenate([second[3] * C, second[2]])


@described(eq=False)
class ForceLoop(Described):
    """Feedback law and its plant, for `margins` and `ForceController`.

    Parameters
    ----------
    law : Law
        Law from force error (N) to command (mm).
    plant : ForcePlant
        Drive, contact, sensor, delay.
    name : str
        Name in tables.

    Raises
    ------
    ValueError
        When law and plant differ in sample time (s), or the closed loop is unstable.

    Examples
    --------
    >>> loop = PI.design(crossover=2 * 3.141592653589793 * 3.0)
    >>> loop.plant.delay_samples, round(loop.sample_time * 60, 9)
    (1, 1.0)
    """

    law: Law = part(Law)
    plant: ForcePlant = part(ForcePlant)
    name: str = text(default="law")

    def _check(self) -> None:
        same_sample_time(self.plant, self.law.system)
        worst = float(np.max(np.abs(self.open.closed().poles)))
        if worst >= 1:
            raise ValueError(
                "law must give a stable loop: poles inside the unit circle;"
                f" the largest modulus is {worst:.4g}"
            )

    @property
    def sample_time(self) -> float:
        """Time between two samples, s."""
        return self.plant.sample_time

    @property
    def open(self) -> Sampled:
        """Open loop, from force error (N) to reading (N)."""
        return self.law.system.then(self.plant.sampled)

    @property
    def identity(self) -> tuple[Any, ...]:
        """Name, law in plain numbers (mm per N) and plant: equal ones are the same loop."""
        core = self.law.core
        return self.name, *(np.asarray(each).tolist() for each in core), self.plant

    def delayed(self, delay_samples: int) -> "ForceLoop":
        """Return the same law on a plant with a delay of `delay_samples`, a whole number >= 0."""
        return self.replace(plant=self.plant.replace(delay_samples=delay_samples))


@described("force.pi")
class PI(Described):
    """Sampled proportional and integral law by Tustin's rule: Brown (1988), (7.4) and (7.6).

    u_k = K_I T xi_k + (K_p + K_I T/2) e_k, xi_{k+1} = xi_k + e_k.

    Parameters
    ----------
    kp : float
        K_p, mm/N.
    ki : float
        K_I, mm/(N s).
    sample_time : float
        T, s.

    Examples
    --------
    >>> PI(kp=0.1, ki=6.0, sample_time=1 / 60).law.simulate([1.0, 1.0]).round(6).tolist()  # mm
    [0.15, 0.25]
    """

    kp: float = quantity("mm/N", at_least=0)
    ki: float = quantity("mm/(N s)", above=0)
    sample_time: float = quantity("s", above=0, default=1 / 60)

    @property
    def law(self) -> Law:
        """Law in plain arrays, mm per N; at a limit its sum follows the applied command."""
        step = self.ki * self.sample_time
        one = np.ones(1)
        return Law(
            Sampled(np.ones((1, 1)), one, step * one, self.kp + step / 2, self.sample_time), one / step
        )

    def loop(self, plant: ForcePlant | None = None) -> ForceLoop:
        """Return the loop closed by this law on a `plant` (mm to N); default: Brown's design model."""
        return ForceLoop(self.law, ForcePlant() if plant is None else plant, "PI")

    @classmethod
    def design(
        cls,
        *,
        crossover: float,
        drive: TableDrive | None = None,
        sensor: SensorChain | None = None,
        delay_samples: int = 1,
        contact_stiffness: float = CONTACT_STIFFNESS,
    ) -> ForceLoop:
        """Return a loop whose law cancels the slowest pole of the drive: K_I = crossover/K_x, K_p = K_I/b1.

        Parameters
        ----------
        crossover : float
            Frequency of loop gain 1 without the other lags, rad/s.
        drive : TableDrive, optional
            Drive from command to position (mm/mm). Default: `table_drive`.
        sensor : SensorChain, optional
            Sensor from force to reading (N/N).
        delay_samples : int
            Samples from reading to command, a whole number >= 0.
        contact_stiffness : float
            Contact stiffness, N/mm.

        Raises
        ------
        ValueError
            When the loop is unstable at this crossover (rad/s), or a value is out of its range.

        Examples
        --------
        >>> from sdpgrind import units
        >>> loop = PI.design(crossover=units.hz(3.0), drive=table_drive())
        >>> loop.name
        'PI'
        """
        crossover = checks.positive("crossover", crossover, "rad/s")
        plant = ForcePlant(
            table_drive() if drive is None else drive,
            SensorChain() if sensor is None else sensor,
            contact_stiffness,
            delay_samples,
        )
        ki = crossover / plant.contact_stiffness
        try:
            return cls(kp=ki / plant.drive.reduced[0], ki=ki, sample_time=plant.sample_time).loop(plant)
        except ValueError as unstable:
            raise ValueError(f"crossover must be lower ({crossover:.4g} rad/s): {unstable}") from None
