"""Solved grinding sequence and its look-ups: expected penalty, next pass, what else may be done."""

from math import nan
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.weldbead.sequence._action import SequenceAction
from sdpgrind.weldbead.sequence._problem import SequenceProblem


def _is_one(height: Any, time_left: Any) -> bool:
    """Whether both are single numbers."""
    given = isinstance(height, float | int) and isinstance(time_left, float | int)
    return given and type(height) is not bool and type(time_left) is not bool


class SolvedSequence:
    """Table of a sequence with its problem and how far it is exact, looked up by height (mm) and time (s)."""

    def __init__(self, problem: SequenceProblem, table: sdp.Policy) -> None:
        self.problem, self.table = problem, table
        self._durations = [move.duration * problem.stage for move in table.layout.moves]
        self._feeds = [problem.feed_rate(each) for each in self._durations]

    @property
    def error(self) -> float | None:
        """Estimated error of the expected penalty, $; None after a plan anew between passes."""
        return self.table.error

    @property
    def error_away(self) -> float | None:
        """Estimated error, $, over one cell from a jump of the over side's charge; None: that everywhere."""
        return self.table.error_away

    @property
    def told_away(self) -> str:
        """Words for `error_away`, $, behind those for `error`; "": there is none."""
        return "" if self.error_away is None else f" ({self.error_away:.1g} $ away from its jump at 0 mm)"

    @property
    def nodes(self) -> int:
        """Nodes of the height (mm)."""
        return int(self.table.layout.axes[0].nodes)

    @property
    def levels(self) -> int:
        """Levels of the normal force (N); with `nodes`, `plan` solves the same grid again, to the bit."""
        moves = self.table.need_problem("the number of levels").moves
        return max(move.levels.count for move in moves if move.levels)

    @property
    def status(self) -> str:
        """Why the error ($) is no smaller: "tolerance reached", "time limit" or others of `sdp.Policy`."""
        return self.table.status

    def value(self, height: Any, time_left: Any, *, last_duration: Any = None) -> Any:
        """Return the expected penalty-to-go, $.

        Parameters
        ----------
        height : float or array
            Mean bead height, mm; < 0: overground.
        time_left : float or array
            Time to the deadline, s; < 0: late. Between stages the answer is that of the stage below.
        last_duration : float or array, optional
            Duration of the last pass, s, one of the plan's; None: no pass yet. It matters where the finish is
            charged.

        Raises
        ------
        ValueError
            Above the greatest height or the horizon of the plan, at a late time between stages of the table,
            or for a last duration that is none of the plan's.
        """
        single = self.table.single
        if last_duration is None and single and _is_one(height, time_left):
            found = single.value(float(time_left), float(height))
            if found is not None:
                return found
        return self.table.value(**self._state(height, time_left, last_duration))

    def action(self, height: Any, time_left: Any, *, last_duration: Any = None) -> SequenceAction:
        """Return the action at a height (mm) and a time left (s); see `value` for the arguments.

        Within one duration the force is interpolated between nodes. Where neighbouring nodes differ in their
        action, both are compared one step ahead; the answer is that of the side on which the state lies.
        """
        single = self.table.single
        if last_duration is None and single and _is_one(height, time_left):
            one = single.act(float(time_left), float(height))
            if one is not None:
                _, move, _, level, gained = one
                if move < 0:
                    return SequenceAction(True, 0.0, nan, nan, gained, self.problem)
                seconds, speed = self._durations[move], self._feeds[move]
                return SequenceAction(False, seconds, speed, level, gained, self.problem)
        place = self.table.locate(self._state(height, time_left, last_duration))
        best, _, force, gap = self.table.act(place)
        which, stop = np.maximum(best, 0), best < 0
        duration = np.where(stop, 0.0, np.asarray(self._durations)[which])
        feed = np.where(stop, np.nan, np.asarray(self._feeds)[which])
        fields: list[Any] = [stop, duration, feed, np.where(stop, np.nan, force), gap]
        shaped = [x.reshape(place.shape) if place.shape else x.item() for x in fields]
        return SequenceAction(shaped[0], shaped[1], shaped[2], shaped[3], shaped[4], self.problem)

    def gradient(self, height: Any, time_left: Any, *, last_duration: Any = None) -> Any:
        """Return the derivative of the expected penalty by height, $/mm; see `value` for the arguments."""
        return self.table.gradient(height=height, time_left=time_left, **self._mode(last_duration))["height"]

    def alternatives(
        self, height: float, time_left: float, *, within: float, last_duration: float | None = None
    ) -> dict[str, float]:
        """Return each duration, or "stop", within `within` $ of the best, with its expected penalty, $.

        `height` (mm), `time_left` (s) and `last_duration` (s) are numbers, as in `value`.
        """
        return self.table.alternatives(within, **self._state(height, time_left, last_duration))

    def _state(self, height: Any, time_left: Any, last_duration: Any) -> dict[str, Any]:
        """State for the table. Where the finish is charged, a bead just ground down gets no further pass.

        The table holds at 0 the limit from above, where one more pass may pay: 0 counts as below.
        """
        mode = self._mode(last_duration)
        if self.problem.finish_charge is not None:
            height = checks.reals("height", height, "mm")
            height = np.where(height == 0.0, -np.finfo(float).tiny, height)
        return {"height": height, "time_left": time_left} | mode

    def _mode(self, last_duration: Any) -> dict[str, Any]:
        if last_duration is None:
            return {}
        durations = np.asarray(self._durations)
        given = checks.reals("last_duration", last_duration, "s")
        mode = np.argmin(np.abs(durations - given[..., None]), axis=-1)
        for k in np.flatnonzero(np.abs(durations[np.ravel(mode)] - np.ravel(given)) > 1e-9):
            raise checks.refuse(
                "last_duration",
                "one of " + ", ".join(f"{t:g}" for t in durations),
                float(np.ravel(given)[k]),
                "s",
            )
        return {} if self.problem.finish_charge is None else {"mode": mode + 1}
