"""Controller of the contact torque: constant current, PID with feedforward and observer, damped, or LQG."""

import hashlib
from collections.abc import Mapping
from dataclasses import KW_ONLY
from functools import cached_property
from math import nan
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.base.quantities import Described, choice, custom, described, part, quantity, units_of
from sdpgrind.base.states import floats, places
from sdpgrind.finishing.torque._axis import TorqueAxis, true_axis
from sdpgrind.finishing.torque._controller_kernels import command_step, torque_at
from sdpgrind.finishing.torque._gains import Gains
from sdpgrind.finishing.torque._law import KINDS, OBSERVERS, Setting, TorqueLaw, setting
from sdpgrind.finishing.torque._loop import AxisLoop
from sdpgrind.finishing.torque._model import continuous, sampled
from sdpgrind.finishing.torque._poles import AxisPoles, check_stable, poles_of
from sdpgrind.finishing.torque._reference import TorqueReference, reference
from sdpgrind.finishing.torque._states import CONTROLLER

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

_UNDAMPED = 0.5  # s, chosen: waiting time for an undamped contact
_DIGEST = 12  # chosen: hexadecimal digits
_PATH_TIME, _ESTIMATE, _REFERENCE = places(CONTROLLER, "path_time", "estimate", "reference")


@described(eq=False)
class TorqueController(Stateful, Described):
    """Hold the contact torque by the motor's current, from current and motor angle alone.

    ========== ===============================================================================================
    `kind`     law
    ========== ===============================================================================================
    "constant" current T*/k_t: no loop, undamped contact
    "pidff"    PID plus feedforward of Wang and Jan (2001) (6) with the torque observer (9), errata corrected
    "damped"   T* less damping by the motor's speed (`DampingGains`): the reference for comparisons
    "lqg"      Kalman filter and state feedback (`LqgGains`): fastest, least tolerant of a stiffer contact
    ========== ===============================================================================================

    No law can separate a load torque from the contact torque: even with an exact estimate the contact is off
    by the unknown load torque. Measure it before touch-down (`identify_load_torque`) and pass it as
    `load_torque`. A relative error of k_t is the same relative error of the force.

    The motion waits until the contact has settled (feed override 0); then it plays, and the torque follows
    `torque_per_force`.

    Parameters
    ----------
    axis : TorqueAxis
        Believed axis.
    motion : Motion, optional
        Motion with arrays ``time`` (s), ``torque_per_force`` (N m/N) and ``profile``. None: the tool stands
        still, F = T/R.
    normal_force : float
        Force to hold, N.
    kind : {"pidff", "constant", "damped", "lqg"}
        Law.
    gains : PidffGains, DampingGains or LqgGains, optional
        Gains of the law. Default: those of its class; for "pidff" the source's, whose observer is slower than
        its loop (slowest poles at -16.5 1/s, not at -61): ``PidffGains.of_poles(axis)`` designs others.
    observer : {"pid", "state", "ideal"}
        Observer of "pidff": (9), corrected; its state form, which with the gains of the source hardly decays
        and is unstable on a contact half as stiff; or "ideal", the true contact torque, in simulation only.
    prefilter : bool
        For "pidff": filter T* by p/(3s + p), which removes the overshoot of (8). At 1.667 N that overshoot
        exceeds the current limit of 1 A.
    load_torque : float or array (m,)
        Known load torque, N m, constant or at the times of the motion.
    settle_time : float, optional
        Waiting time of the motion, s. Default: four time constants of the slowest pole.

    Raises
    ------
    ValueError
        The loop is unstable (the message has its poles), the sample time is too long for it, the force
        exceeds the motor, or a value is out of range.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> controller = fin.TorqueController(fin.TorqueAxis(), normal_force=1.111, kind="lqg")
    >>> controller.step(motor_angle=0.0)
    {'current': 0.3369140625}
    >>> print(controller.poles)
    -42.08±142.80j, -72.00±34.87j, -105.02±57.21j 1/s; slowest sampled 0.949034±0.136j
    """

    _changing = ("state",)
    axis: TorqueAxis = part(TorqueAxis)
    motion: Any = custom(default=None)
    _: KW_ONLY
    normal_force: float = quantity("N", above=0)
    kind: str = choice(*KINDS, default="pidff")
    gains: Gains | None = custom(default=None)
    observer: str = choice(*OBSERVERS, default="pid")
    prefilter: bool = custom(lambda name, value: bool(value), default=False)
    load_torque: npt.ArrayLike = custom(unit="N m", default=0.0)
    settle_time: float | None = quantity("s", at_least=0, default=None)

    reports: ClassVar[Mapping[str, str]] = {"torque_estimate": "N m", "torque_ref": "N m"}

    def _check(self) -> None:
        self.setting.check_sampling()
        check_stable(self.setting)
        _ = self.reference

    @cached_property
    def setting(self) -> Setting:
        """Parts of the loop: kind, gains (in their units) and observer."""
        return setting(self.axis, self.kind, self.gains, self.observer, self.prefilter)

    @cached_property
    def reference(self) -> TorqueReference:
        """Torque reference along the motion, s and N m."""
        return reference(self.axis, self.motion, self.normal_force, self.load_torque)

    @property
    def period(self) -> float:
        """Sample time, s."""
        return self.axis.sample_time

    @property
    def reads(self) -> Mapping[str, str]:
        """Name of each measurement to its unit."""
        return {"motor_angle": "rad"} if self.motion is None else {"motor_angle": "rad", "path_time": "s"}

    @property
    def commands(self) -> Mapping[str, str]:
        """Name of each command to its unit (A)."""
        return (
            {"current": "A"} if self.motion is None else {"current": "A", "feed_override": "", "motion": ""}
        )

    @property
    def job(self) -> Mapping[str, object]:
        """Data of the motion and the normal force (N) that controller and plant must share."""
        planned = getattr(getattr(self.motion, "problem", None), "job", None) or {}
        return {**planned, "target_force": (self.normal_force, units_of(type(self))["normal_force"])}

    @property
    def description(self) -> Mapping[str, float | str]:
        """The motion for the log: time law, duration (s), digest of its profile."""
        if self.motion is None:
            return {}
        digest = hashlib.sha256(np.ascontiguousarray(self.motion.profile).tobytes()).hexdigest()[:_DIGEST]
        law, duration = str(getattr(self.motion, "method", "")), float(self.reference.time[-1])
        return {"motion_method": law, "motion_duration": duration, "motion_digest": digest}

    @cached_property
    def poles(self) -> AxisPoles:
        """Poles of axis, law and observer together, 1/s, and of the sampled loop."""
        return poles_of(self.setting)

    @cached_property
    def settling(self) -> float:
        """Waiting time of the motion, s."""
        if self.settle_time is not None:
            return self.settle_time
        return _UNDAMPED if self.setting.gains is None else 4.0 / self.poles.slowest

    @cached_property
    def law(self) -> TorqueLaw:
        """Arrays for compiled loops, in N m, A, rad and s."""
        known = self.reference
        return TorqueLaw(
            self.setting.parameters(self.settling),
            floats(CONTROLLER),
            known.time,
            known.torque + known.load,
            known.load,
        )

    @cached_property
    def state(self) -> Floats:
        """State of the compiled law, in N m, A, rad and s."""
        return self.law.start.copy()

    def loop(self, truth: TorqueAxis | None = None, *, sampled_time: bool = False) -> AxisLoop:
        """Return the closed loop, linear in rad, s, N m, without prefilter, rounding, limits and lift-off.

        Parameters
        ----------
        truth : TorqueAxis, optional
            True axis. Default: the believed one.
        sampled_time : bool
            Whether the loop is sampled; else in continuous time.
        """
        real = true_axis(self.axis, truth)
        return sampled(self.setting, real) if sampled_time else continuous(self.setting, real)

    def poles_at(self, truth: TorqueAxis) -> AxisPoles:
        """Return the poles (1/s) on another axis than the believed one.

        Parameters
        ----------
        truth : TorqueAxis
            True axis.
        """
        return poles_of(self.setting, true_axis(self.axis, truth))

    def reset(self) -> None:
        """Forget the part before."""
        self.state[:] = self.law.start

    def step(self, *, motor_angle: float, path_time: float = nan, **others: Any) -> dict[str, Any]:
        """Return the current (A) until the next sample and, with a motion, its feed override.

        Parameters
        ----------
        motor_angle : float
            Reading of the encoder, rad; NaN: none.
        path_time : float
            Time of the motion played so far, s; NaN: that of the last sample.
        **others
            Other measurements; not used.

        Returns
        -------
        dict
            ``current`` (A); with a motion ``feed_override`` (0 until the contact has settled, then 1), and in
            the first sample ``motion``, the profile to play.

        Raises
        ------
        ValueError
            The observer is "ideal", which needs the true torque (N m).
        """
        law, state = self.law, self.state
        if self.observer == "ideal":
            raise checks.refuse(
                "observer", "'pid' or 'state' on a machine: no sensor has the true contact torque", "ideal"
            )
        current, override, starts = command_step(
            law.parameters, state, float(motor_angle), float(path_time), law.time, law.torque
        )
        if self.motion is None:
            return {"current": current}
        command = {"current": current, "feed_override": override}
        return {**command, "motion": self.motion.profile} if starts else command

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it; the profile of the motion stays on the machine."""
        from sdpgrind.finishing.torque._recipe import recipe_of

        if self.observer == "ideal":
            raise checks.refuse(
                "observer", "'pid' or 'state': no sensor has the true contact torque", "ideal"
            )
        return recipe_of(self)

    def report(self) -> dict[str, float]:
        """Return estimate and reference of the contact torque, N m."""
        law, state = self.law, self.state
        load = float(torque_at(law.time, law.load, state[_PATH_TIME], state))
        return {
            "torque_estimate": float(state[_ESTIMATE]) - load,
            "torque_ref": float(state[_REFERENCE]) - load,
        }
