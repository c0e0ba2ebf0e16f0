"""Controllers that follow a plan of a weld bead."""

from collections.abc import Mapping
from math import isnan, nan
from typing import TYPE_CHECKING, Any

from sdpgrind.base import checks
from sdpgrind.base.controllers import Stateful

if TYPE_CHECKING:
    from sdpgrind.weldbead.sequence._policy import SequencePolicy


_SCAN = 0.01  # of the greatest height planned for; a scan of a bead of just that height may read so much more


class SequenceController(Stateful):
    """Looks up the next pass in a policy, after each pass, from what was really removed.

    Steps once for each event (a pass is over, the bead was scanned). Commands ``duration`` (s), ``feed_rate`` (mm/s)
    and ``normal_force`` (N) of the next pass, or ``stop``. Reports the expected penalty from here on (``penalty``, $),
    the mean depth that it expects of the pass (``mean_cut``, mm) and the gap to the next best duration (``gap``, $).

    A scan that reads up to 1 % more than the height that the policy was planned for is taken for that height: a bead of just
    that height is read higher half of the time, and a policy with a margin for it would decide the same.

    A missing scan (NaN) is replaced by what the last pass was expected to leave, a missing clock by its duration.

    Parameters
    ----------
    policy : SequencePolicy
        The plan to follow, as `plan` gives it.

    Raises
    ------
    ValueError
        From `step`: the bead is higher (mm) or the deadline farther (s) than the policy was planned for; the first
        reading is missing.

    Examples
    --------
    >>> from sdpgrind import weldbead
    >>> controller = weldbead.SequenceController(weldbead.plan(weldbead.preset("P1"), tolerance=1e-2))
    >>> command = controller.step(height=1.0, time_left=10.0)
    >>> command["duration"], command["stop"], controller.report()["penalty"] > 0
    (10.0, 0.0, True)
    >>> controller.step(height=0.0, time_left=0.0)
    {'stop': 1.0}
    """

    period: float | None = None
    tier = "sequence"
    reads: Mapping[str, str] = {"height": "mm", "time_left": "s"}
    commands: Mapping[str, str] = {"duration": "s", "feed_rate": "mm/s", "normal_force": "N", "stop": ""}
    reports: Mapping[str, str] = {"penalty": "$", "mean_cut": "mm", "gap": "$"}

    def __init__(self, policy: "SequencePolicy") -> None:
        self.follow(policy)
        self.reset()

    def follow(self, policy: "SequencePolicy") -> None:
        """Follow another policy from here on; what is known of the bead (mm, s) stays.

        Parameters
        ----------
        policy : SequencePolicy
            As `plan` gives it, of the same durations (s).

        Raises
        ------
        TypeError
            When it is no policy.
        """
        self._policy = checks.able("policy", policy, "a policy, as weldbead.plan gives it", "action")

    @property
    def policy(self) -> "SequencePolicy":
        """The plan that is followed."""
        return self._policy

    @property
    def identity(self) -> tuple[Any, ...]:
        """What tells this controller from another one: the problem and the tables of its policy."""
        return type(self).__name__, self._policy.problem, self._policy.dataset

    @property
    def job(self) -> Mapping[str, object]:
        """Part and machine that the policy was planned for (mm, s, N); `hwsim` refuses to run it on others."""
        return self._policy.problem.job

    def reset(self) -> None:
        """Forget the bead before.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> controller = weldbead.SequenceController(weldbead.plan(weldbead.preset("P1"), tolerance=1e-2))
        >>> command = controller.step(height=1.0, time_left=10.0)
        >>> controller.reset()
        >>> controller.report()["penalty"]
        nan
        """
        self._expected_height = self._expected_time = nan
        self._last: dict[str, float] = {}  # the last pass, where its finish is charged for
        self._report = dict.fromkeys(self.reports, nan)

    def step(self, *, height: float, time_left: float, **others: Any) -> dict[str, float]:
        """Return the next pass, or ``{"stop": 1.0}``.

        Parameters
        ----------
        height : float
            Height of the bead as scanned (mm); < 0: overground.
        time_left : float
            Time to the deadline (s); < 0: late.
        **others
            Further measurements; not used.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> controller = weldbead.SequenceController(weldbead.plan(weldbead.preset("P1"), tolerance=1e-2))
        >>> {name: round(value, 2) for name, value in controller.step(height=1.0, time_left=10.0).items()}
        {'duration': 10.0, 'feed_rate': 6.25, 'normal_force': 50.0, 'stop': 0.0}
        """
        height, time_left = self._known(height, time_left)
        self._check(height, time_left)
        height = min(height, self._policy.problem.height_max)
        action = self._policy.action(height, time_left, **self._last)
        stop = bool(action.stop)
        mean_cut = 0.0 if stop else float(action.mean_cut)
        value = float(self._policy.value(height, time_left, **self._last))
        self._report = {"penalty": value, "mean_cut": mean_cut, "gap": float(action.gap)}
        if stop:
            return {"stop": 1.0}
        self._remember(height - mean_cut, time_left, float(action.duration))
        return {name: float(getattr(action, name)) for name in ("duration", "feed_rate", "normal_force")} | {
            "stop": 0.0
        }

    def report(self) -> dict[str, float]:
        """Return expected penalty-to-go ($), mean cut (mm) and gap ($) of the last step.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> controller = weldbead.SequenceController(weldbead.plan(weldbead.preset("P1"), tolerance=1e-2))
        >>> command = controller.step(height=1.0, time_left=10.0)
        >>> sorted(controller.report())
        ['gap', 'mean_cut', 'penalty']
        """
        return self._report

    def _remember(self, height: float, time_left: float, duration: float) -> None:
        """What the pass should leave, for a reading that is missing after it."""
        self._expected_height, self._expected_time = height, time_left - duration
        if self._policy.problem.finish_charge is not None:
            self._last = {"last_duration": duration}

    def _known(self, height: float, time_left: float) -> tuple[float, float]:
        """Fill in missing readings."""
        height = self._expected_height if isnan(height) else float(height)
        time_left = self._expected_time if isnan(time_left) else float(time_left)
        if isnan(height) or isnan(time_left):
            raise ValueError("height (mm) and time_left (s) must both be read before the first pass; got nan")
        return height, time_left

    def _check(self, height: float, time_left: float) -> None:
        problem = self._policy.problem
        if height > problem.height_max * (1 + _SCAN):
            raise ValueError(
                f"height must be <= height_max = {problem.height_max:g} of the policy (mm); got {height!r}: "
                "plan with a larger height_max, it costs little"
            )
        if time_left > problem.horizon:
            raise ValueError(
                f"time_left must be <= horizon = {problem.horizon:g} of the policy (s); got {time_left!r}: "
                "plan with a longer horizon"
            )
