"""Base of the plunge controllers: a compiled core, stepped once per sample."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.controllers import Stateful
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import control_step, start_control
from sdpgrind.plunge._model.problem import CycleProblem

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe


class SampledCycle(Stateful, ABC):
    """Controller with a compiled core, stepped once per sample; simulated parts run the same kernels."""

    problem: CycleProblem
    reads: ClassVar[Mapping[str, str]] = {"size": "mm", "grinding_power": "W", "power_saturated": ""}
    commands: ClassVar[Mapping[str, str]] = {"command_rate": "mm/s", "balancing": "", "retract": ""}
    reports: ClassVar[Mapping[str, str]] = at.REPORTS
    _changing = ("state",)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = super().__deepcopy__(memo)
        twin.__dict__["law"] = self.law  # computed once for all copies
        return twin

    @property
    def period(self) -> float:
        """Sample time, s."""
        return self.problem.sample_time

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine that the controller is made for, name -> (value, unit)."""
        return self.problem.job

    @property
    def description(self) -> Mapping[str, float | str]:
        """What is known of the burn threshold, for the log; its doubt is relative, unit 1."""
        return {"burn_threshold": self.problem.uncertainty.burn_threshold}

    @cached_property
    def law(self) -> Floats:
        """Parameters of the compiled core, a row of `LAW` in mm, s and N."""
        return self._compiled()

    @abstractmethod
    def _compiled(self) -> Floats:
        """Parameters from the problem and the controller's own."""

    @cached_property
    def state(self) -> Floats:
        """State of the compiled core, in mm, s and N."""
        state = np.zeros(at.STATES)
        start_control(state, self.law)
        return state

    def reset(self) -> None:
        """Start the next part."""
        start_control(self.state, self.law)

    def step(
        self, *, size: float, grinding_power: float = np.nan, power_saturated: float = 0.0, **others: Any
    ) -> dict[str, float]:
        """Return the command rate (mm/s) of the next sample, or ``{"retract": 1.0}``.

        Parameters
        ----------
        size : float
            Radial stock removed, mm; NaN: no reading. Five missing readings in a row end the part.
        grinding_power : float
            Power, W; NaN: no reading.
        power_saturated : float
            Not 0: the power is clipped and not used; unit 1.
        **others
            Other measurements of the plant; not used.

        Returns
        -------
        dict
            ``command_rate`` (mm/s) and ``balancing`` (1 while damage and stock are balanced); or ``retract``.

        Raises
        ------
        ValueError
            If the size (mm) leaves no stock before any feed.
        """
        command = control_step(
            self.state, self.law, float(size), np.nan if power_saturated else float(grinding_power)
        )
        if self.state[at.SECTION] == at.RETRACT:
            self.check_fed()
            return {"retract": 1.0}
        return {"command_rate": float(command), "balancing": float(self.state[at.BALANCED])}

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it."""
        from sdpgrind.plunge._control.recipe import recipe_of

        return recipe_of(self)

    def report(self) -> dict[str, float]:
        """Return section, rate (mm/s), stock and contact zero (mm), wear flat area, scale of deflection.

        ``saturated`` is 1 where no infeed rate keeps the confidence at size, by what is known of the wheel
        then, and the part is to end at the coolest; else 0.
        """
        area = self.problem.model.wear_flat_area
        s = self.state
        values = (s[at.SECTION], s[at.RATE], s[at.REMAINING])
        learned = (s[at.SHARPNESS] * area, s[at.ZERO], s[at.SCALE], s[at.SATURATED])
        return dict(zip(self.reports, map(float, (*values, *learned)), strict=True))

    def check_fed(self) -> None:
        """Raise ValueError if the part is done before any feed, as the size (mm) leaves no stock."""
        if self.state[at.SECTION] == at.RETRACT and self.state[at.COMMANDED] == 0.0 and not self.lost:
            size, stock = float(self.state[at.SIZE]), self.problem.stock
            raise checks.refuse("size", f"< stock = {stock:g} before any feed", size, "mm")

    @property
    def lost(self) -> bool:
        """Whether the part ended as the size was missing, frozen or jumped for 5 samples (dimensionless)."""
        return bool(self.state[at.MISSED] >= at.MISSED_MAX)
