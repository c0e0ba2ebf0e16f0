"""Next action of a planned sequence."""

from typing import Any

import numpy as np

from sdpgrind.weldbead.sequence._problem import SequenceProblem


class SequenceAction:
    """Next action of a sequence; fields are arrays where states were.

    Attributes
    ----------
    stop : bool
        Stop grinding.
    duration : float
        Duration of the pass, reset included, s; 0 when stopping.
    feed_rate : float
        Feed of the pass, mm/s; NaN when stopping.
    normal_force : float
        Normal force, N; NaN when stopping.
    gap : float
        Extra expected penalty of the best other duration, or of stopping, $.
    """

    __slots__ = ("_problem", "duration", "feed_rate", "gap", "normal_force", "stop")

    def __init__(
        self, stop: Any, duration: Any, feed_rate: Any, normal_force: Any, gap: Any, problem: SequenceProblem
    ) -> None:
        self.stop, self.duration, self.feed_rate = stop, duration, feed_rate
        self.normal_force, self.gap, self._problem = normal_force, gap, problem

    @property
    def mean_cut(self) -> Any:
        """Mean depth of the pass, mm; 0 when stopping."""
        problem = self._problem
        going = ~np.asarray(self.stop)
        mean = problem.depths.moments(
            problem.model, np.where(going, self.normal_force, 0.0), np.where(going, self.feed_rate, 1.0)
        )[0]
        found = np.where(going, mean, 0.0)
        return float(found) if found.ndim == 0 else found

    def __repr__(self) -> str:
        if np.ndim(self.stop):
            return f"SequenceAction({np.size(self.stop)} states, {int(np.sum(self.stop))} of them stop)"
        if self.stop:
            return f"SequenceAction(stop, gap={self.gap:.4g} $)"
        return (
            f"SequenceAction(duration={self.duration:g} s, feed_rate={self.feed_rate:.4g} mm/s,"
            f" normal_force={self.normal_force:.4g} N, mean_cut={self.mean_cut:.4g} mm, gap={self.gap:.4g} $)"
        )
