"""Controller of stages of constant rate."""

import dataclasses

from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, part, quantity
from sdpgrind.plunge._control.base import SampledCycle
from sdpgrind.plunge._control.state import staged_law
from sdpgrind.plunge._model.problem import CycleProblem


@described()
class StagedController(SampledCycle, Described):
    """Rough rate, stage rate, spark-out: the cycle of an ordinary machine.

    Parameters
    ----------
    problem : CycleProblem
        Problem as assumed by the controller.
    stage_remaining : float, optional
        Remaining stock at which the stage rate begins, mm.
    stage_rate : float, optional
        Second rate, mm/s. Default of both: the fastest of the model with the margin.
    safety_margin : float
        Slack of the default stages, mm; without effect where they are given.
    rough_rate : float, optional
        First rate, mm/s. Default: `problem.command_rate_max`.
    final_rate : float, optional
        Infeed rate at size, mm/s. Default: `problem.final_rate`, which is just round enough.
    observer_gain : float
        Gain of the size observer, (0, 1], unit 1.
    size_sd : float
        Standard deviation of the gauge, mm.

    Raises
    ------
    ValueError
        If a value is out of range, or only one of `stage_remaining` and `stage_rate` is given.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> controller = plunge.StagedController(plunge.preset("simulation"))
    >>> round(controller.stage_remaining, 2), round(controller.stage_rate, 3)  # mm, mm/s
    (0.09, 0.008)
    """

    problem: CycleProblem = part(CycleProblem, " (see plunge.preset)")
    stage_remaining: float | None = quantity("mm", default=None)
    stage_rate: float | None = quantity("mm/s", above=0, default=None)
    _: dataclasses.KW_ONLY
    safety_margin: float = quantity("mm", default=0.001)
    rough_rate: float | None = quantity("mm/s", above=0, default=None)
    final_rate: float | None = quantity("mm/s", above=0, default=None)
    observer_gain: float = quantity("1", above=0, at_most=1, default=0.1)
    size_sd: float = quantity("mm", default=5e-4)

    def _check(self) -> None:
        stock, rate_max = self.problem.stock, self.problem.command_rate_max
        for name, own in {"rough_rate": rate_max, "final_rate": self.problem.final_rate}.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, own)
        self._check_within("safety_margin", 0.5 * stock)
        self._check_within("rough_rate", rate_max)
        if (self.stage_remaining is None) != (self.stage_rate is None):
            raise ValueError("stage_remaining and stage_rate must both be given, or none")
        if self.stage_remaining is None or self.stage_rate is None:
            from sdpgrind.plunge._stages.search import fastest_stages

            for name, value in zip(
                ("stage_remaining", "stage_rate"),
                fastest_stages(self.problem, self.safety_margin),
                strict=True,
            ):
                object.__setattr__(self, name, value)
        self._check_within("stage_remaining", stock)
        self._check_within("stage_rate", rate_max)

    def _check_within(self, name: str, most: float) -> None:
        if not 0.0 <= getattr(self, name) <= most:
            raise self._refused(name, f"in [0, {most:g}]")

    def _compiled(self) -> Floats:
        assert self.stage_remaining is not None and self.stage_rate is not None
        assert self.rough_rate is not None and self.final_rate is not None
        return staged_law(
            self.problem, self.stage_remaining, self.stage_rate, rough_rate=self.rough_rate,
            final_rate=self.final_rate, gain=self.observer_gain, size_sd=self.size_sd,
        )  # fmt: skip
