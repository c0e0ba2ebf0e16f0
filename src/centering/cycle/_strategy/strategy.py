"""Strategy: push and expected time for every offset and friction belief."""

from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.as_sdp import finish_offset, friction_axis, offset_axis, packed_axes
from centering.cycle._strategy.belief import Belief, FrictionScaleBelief, PushEvidence
from centering.cycle._strategy.belief_kernels import learned, push_cells
from centering.cycle._strategy.choice import PushChoice
from centering.cycle._strategy.cycle_times import WORTH, cycle_timing
from centering.cycle._strategy.density import moments, prior
from centering.cycle._strategy.draw_kernels import table_speed
from centering.cycle._strategy.lookup_kernels import choose, value_at
from centering.cycle._strategy.outcomes import FRICTION_SCALES, OutcomeTable
from centering.cycle._strategy.timing import CycleTiming
from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.rng import Seed
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.base.stored import decode, encode
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from centering.cycle._strategy.risk import RiskTable
    from centering.cycle._strategy.runs import CenteringRuns
    from sdpgrind.codegen import Recipe

_FEW = 60  # chosen: parts at each factor for a summary; their mean time is known to some 5 %
_ROUNDING = 1.0 + 1e-9  # chosen: tolerance of the greatest offset


class Strategy(Plan):
    """Next push by offset, believed friction and pushes seen: a plan, immutable, made by `plan`.

    The friction scale is the part's friction over that of the model. Its belief has a mean, which is looked
    up, and a standard deviation, which follows from the number of pushes seen.

    Parameters
    ----------
    problem : CenteringProblem
        Planned problem.
    outcomes : OutcomeTable
        Travel of its pushes, mm.
    speeds : array, (offsets,)
        Table speeds at the nodes of the offset, rad/s.
    table : tuple of array, (pushes, offsets, frictions)
        Expected time (s), index of the best kind of push, and intended mean travel over offset.

    Attributes
    ----------
    problem : CenteringProblem
        Planned problem.
    outcomes : OutcomeTable
        Travel of its pushes, mm.
    timing : CycleTiming
        Times of its cycles, s.
    kinds : tuple of PushKind
        Kinds of push.
    belief : FrictionScaleBelief
        Friction belief about a part, relative.
    finish : float
        Measured offset at which the part counts as centred, mm: tolerance less the error of the measurement.
    """

    kind = "centering.strategy"

    def __init__(
        self,
        problem: CenteringProblem,
        outcomes: OutcomeTable,
        speeds: Floats,
        table: tuple[Floats, Any, Floats],
    ) -> None:
        self.problem, self.outcomes = problem, outcomes
        self.kinds, self.finish = outcomes.kinds, finish_offset(problem)
        self._speeds = lasting(speeds)
        self._value, self._kind, self._share = (
            lasting(x, kind) for x, kind in zip(table, (float, np.int64, float), strict=True)
        )
        self.belief = FrictionScaleBelief.of(problem.scatter)
        self._settled = self._value.shape[0] - 1
        self._axes = packed_axes(
            offset_axis(problem, self._value.shape[1]), friction_axis(problem, self._value.shape[2])
        )
        self._outcomes = (outcomes.travel, outcomes.mean_travel, outcomes.last, outcomes.grid)

    def push(self, *, offset: float, friction: float = 1.0, evidence: float = 0) -> PushChoice:
        """Return the push with the least expected time to the end.

        Parameters
        ----------
        offset : float
            Measured offset, mm, > `finish`.
        friction : float
            Mean of the believed friction scale, unit 1.
        evidence : float
            Evidence from `update_belief`, or the number of pushes so far.

        Raises
        ------
        ValueError
            The offset is not > `finish` (the part is centred), or beyond `offset_max`; the friction is NaN,
            or the evidence not >= 0.
        """
        if not offset > self.finish:
            raise checks.refuse("offset", f"> {self.finish:g}, at which the part is centred", offset, "mm")
        self._refuse_beyond(offset)
        kind, aim, stroke, speed = choose(
            (self._kind, self._share),
            self._outcomes,
            self._speeds,
            self._axes,
            offset,
            friction,
            self._mode(evidence),
        )
        if kind < 0:
            raise checks.refuse("friction", "a number", friction)
        how = self.kinds[kind]
        return PushChoice(aim, stroke, how.push_speed, how.shape, how.retract, speed, kind)

    def value(self, *, offset: float, friction: float = 1.0, evidence: float = 0) -> float:
        """Return the expected time from the touch of the next push to the end, s; 0 for a centred part.

        Parameters
        ----------
        offset : float
            Measured offset, mm.
        friction : float
            Mean of the believed friction scale, unit 1.
        evidence : float
            Evidence from `update_belief`.

        Raises
        ------
        ValueError
            The offset is beyond `offset_max`, the friction is NaN, or the evidence not >= 0.
        """
        self._refuse_beyond(offset)
        if offset <= self.finish:
            return 0.0
        if friction != friction:
            raise checks.refuse("friction", "a number", friction)
        return float(value_at(self._value, self._axes, offset, friction, self._mode(evidence)))

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it: the look-up of a push."""
        from centering.cycle._strategy.recipe import recipe_of

        tables = (self._value, self._kind, self._share, self._outcomes, self._speeds, self._axes)
        return recipe_of(self, tables, self.offset_max * _ROUNDING)

    @property
    def offset_max(self) -> float:
        """Greatest offset of the table, mm."""
        return float(np.exp(self._axes[0] + self._axes[1] * (self._axes[2] - 1)))

    def _refuse_beyond(self, offset: float) -> None:
        """Refuse an offset beyond the table."""
        if not offset <= self.offset_max * _ROUNDING:
            raise checks.refuse("offset", f"<= {self.offset_max:g} (the strategy's)", offset, "mm")

    def _mode(self, evidence: float) -> int:
        """Row of the table for an evidence; a push counts less than a fully informative one."""
        settled: int = self._settled
        if not evidence >= 0:
            raise checks.refuse("evidence", ">= 0", evidence)
        return int(min(evidence / WORTH + 0.5, settled))

    def cycle_time(self, offset: float) -> float:
        """Return the expected time of a whole cycle from an `offset` (mm), the table at rest, s.

        Raises
        ------
        ValueError
            The offset is negative or beyond `offset_max`.
        """
        return self.start_time(offset) + self.value(offset=offset)

    def start_time(self, offset: float) -> float:
        """Return the mean time from rest to the first touch at an `offset` (mm), s.

        Raises
        ------
        ValueError
            The offset is negative or beyond `offset_max`.
        """
        checks.nonnegative("offset", offset, "mm")
        self._refuse_beyond(offset)
        return self.timing.start_time(offset)

    @cached_property
    def timing(self) -> CycleTiming:
        """Times of its cycles, s."""
        low, step, nodes = self._axes[:3]
        return cycle_timing(self.problem, self.outcomes, np.exp(low + step * np.arange(nodes)), self._speeds)

    def spindle_speed(self, offset: float) -> float:
        """Return the table speed at an `offset` (mm), rad/s."""
        return float(table_speed(self._speeds, self._axes[:2], offset))

    def profile(self, choice: PushChoice) -> TipProfile:
        """Return the motion of the tip from the first touch on, for a `choice` of `push` (mm, s)."""
        kind = self.kinds[choice.kind]
        return kind.profile(self.problem.model, choice.stroke, self.problem.limits.acceleration_max)

    def update_belief(
        self,
        friction: float,
        evidence: float,
        commanded: PushChoice,
        travelled: float,
        *,
        weights: Floats | None = None,
        shown: PushEvidence | None = None,
    ) -> Belief:
        """Return the belief after a push by Bayes' rule; the push scatters about the friction of the part.

        Before the first push the friction of a part is that told, with its scatter, or, with a weight of a
        tenth, that of any factor of the problem's range.

        Parameters
        ----------
        friction : float
            Mean of the friction scale before.
        evidence : float
            Evidence before: 0 at the first push, then from this method.
        commanded : PushChoice
            Commanded push.
        travelled : float
            Travel of the part, mm: distance of two measured places.
        weights : array, (R,), optional
            Weights of the friction scales before, unit 1, from this method. None: those of friction and
            evidence.
        shown : PushEvidence, optional
            What the push shows of friction (mm, N). None: its travel, on a table at rest.

        Returns
        -------
        Belief
            Mean, evidence and weights; an uninformative push adds little, a contradicting one reduces the
            evidence.
        """
        before = prior(self.problem, friction, evidence) if weights is None else weights
        if shown is None:
            expected = self.outcomes.travels(commanded.kind, commanded.stroke)
            shown = PushEvidence(expected[None], np.array([self._noise]), np.array([travelled]))
        after = learned(shown.expected, self._pushes, before, shown.noise, shown.seen)
        mean, sd = moments(after)
        return Belief(mean, self.belief.evidence(sd), after)

    @cached_property
    def _pushes(self) -> tuple[Any, Floats]:
        """Where the friction scales of pushes lie among those of the tables."""
        cells: tuple[Any, Floats] = push_cells(self.outcomes.grid, FRICTION_SCALES.size, self.belief.push_sd)
        return cells

    @cached_property
    def _noise(self) -> float:
        """Standard deviation of a measured travel, mm."""
        return float(np.hypot(self.problem.scatter.stop_sd, np.sqrt(2.0) * self.problem.scatter.measuring_sd))

    def simulate(
        self, *, runs: int = 200, rng: Seed = 0, start: npt.ArrayLike | None = None
    ) -> "CenteringRuns":
        """Follow the strategy on the model: pushes simulated exactly, friction of each part; no machine.

        Parameters
        ----------
        runs : int
            How many parts.
        rng : int, SeedSequence or Generator
            Source of randomness.
        start : float or array (runs,), optional
            Offset at the start, mm; by default uniform from a tenth of the problem's greatest offset to the
            greatest.

        Returns
        -------
        CenteringRuns
            Time (s), pushes, final offset (mm) and whether it was finished, for each part.
        """
        from centering.cycle._strategy.simulation import simulate

        return simulate(self, runs, rng, start)

    def robust(
        self, friction_range: tuple[float, float] | None = None, *, runs: int = 200, rng: Seed = 0
    ) -> "RiskTable":
        """Return what the strategy risks where the true mean friction is not that of the model.

        Parts of another friction are followed by the tables of the plan, with the belief that they would
        leave; no machine.

        Parameters
        ----------
        friction_range : tuple of float, optional
            Lowest and highest factor of friction, unit 1, in [0.41, 2.46]. None: the problem's.
        runs : int
            How many parts at each of five factors.
        rng : int, SeedSequence or Generator
            Source of randomness.

        Returns
        -------
        RiskTable
            Times (s), pushes, and shares of parts thrown and not centred, by factor.

        Raises
        ------
        ValueError, TypeError
            The range does not hold 1, or reaches beyond the friction that the tables hold.

        Examples
        --------
        >>> strategy.robust((0.6, 1.4)).to_dataframe()  # doctest: +SKIP
        """
        from centering.cycle._strategy.risk import robust

        chosen = self.problem.friction_range if friction_range is None else friction_range
        return robust(self, chosen, runs, rng)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The strategy as labelled arrays: value (s), kind of push, share of the offset, outcomes (mm)."""
        dims = ("pushes", "offset", "friction")
        low, step, nodes, first, spacing, count = self._axes
        table = self.outcomes
        variables: dict[str, Any] = {
            "value": (
                dims,
                self._value,
                {"units": "s", "long_name": "expected time from the next touch to the end"},
            ),
            "kind": (
                dims,
                self._kind,
                {"long_name": "kind of push: " + "; ".join(k.name for k in self.kinds)},
            ),
            "share": (dims, self._share, {"units": "1", "long_name": "wanted mean travel over offset"}),
            "spindle_speed": (("offset",), self._speeds, {"units": "rad/s", "long_name": "table speed"}),
            "travel": (
                ("push_kind", "stroke", "friction_scale"),
                table.travel,
                {"units": "mm", "long_name": "travel of the part"},
            ),
            "contact_time": (
                ("push_kind", "stroke"),
                table.contact_time,
                {"units": "s", "long_name": "time of contact"},
            ),
            "last": (
                ("push_kind",),
                table.last,
                {"long_name": "greatest stroke of a kind of push, its number"},
            ),
        }
        coordinates = {
            "pushes": ("pushes", np.arange(self._settled + 1), {"long_name": "pushes seen"}),
            "offset": ("offset", np.exp(low + step * np.arange(nodes)), {"units": "mm"}),
            "friction": (
                "friction",
                first + spacing * np.arange(count),
                {"units": "1", "long_name": "mean friction scale"},
            ),
            "stroke": ("stroke", table.strokes, {"units": "mm"}),
        }
        plain = encode(
            {
                "problem": self.problem,
                "kinds": self.kinds,
                "strokes": table.stroke_range,
            }
        )
        return xr.Dataset(variables, coordinates, {"strategy": plain})

    def _figures(self) -> tuple[AmountTable, AmountTable]:
        """Whole cycles from offsets over the range of the table with their first push, and the risk."""
        places = np.geomspace(2.0 * self.finish, self.offset_max, 8)
        first = [self.push(offset=float(place)) for place in places]
        columns = (
            Amounts.of("offset", places, "mm"),
            Amounts.of(
                "cycle_time", [self.cycle_time(float(place)) for place in places], "s", "expected time"
            ),
            Amounts.of("stroke", [push.stroke for push in first], "mm", "stroke of the first push"),
            Amounts.of("push_speed", [push.push_speed for push in first], "mm/s"),
            Amounts.of("spindle_speed", [push.spindle_speed for push in first], "rad/s"),
        )
        finish = f"centred where {UM * self.finish:.3g} µm are measured"
        whole = AmountTable(f"Whole cycle by the offset at its start; {finish}", columns)
        return whole, self._risk.table()

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        plain = decode(dataset.attrs["strategy"])
        arrays = {name: dataset[name].values for name in dataset.data_vars}
        first, ratio = plain["strokes"]
        outcomes = OutcomeTable(
            plain["kinds"], first, ratio, arrays["travel"], arrays["contact_time"], arrays["last"]
        )
        table = arrays["value"], arrays["kind"], arrays["share"]
        return cls(plain["problem"], outcomes, arrays["spindle_speed"], table)

    def plot(self) -> Any:
        """Draw expected time and best push over offset, and effect of the friction belief; return the figure.

        Specks in the map of the kinds of push are pushes that are equal within the noise of the table.
        """
        return pictures.drawn("centering.cycle._strategy.picture:plot", self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Strategy) and bool(self.dataset.identical(other.dataset))

    def __hash__(self) -> int:
        return hash((self._value.tobytes(), self._share.tobytes()))

    def _told(self) -> str:
        middle, end = 0.5 * self.problem.offset_max, 1e3 * self.problem.tolerance
        expected = f"{self.cycle_time(middle):.2f} s expected from {middle:g} mm"
        risk, (low, high) = self._risk, self.problem.friction_range
        worst = f"friction x {low:g} to {high:g}, worst x {risk.factor[risk.worst]:g}"
        doubt = f"{worst}: {risk.time[risk.worst]:.2f} s on average"
        return f"{self.problem.model.part.mass:g} kg to {end:g} µm: {expected}; {doubt}"

    @cached_property
    def _risk(self) -> "RiskTable":
        """Risk over the range of the problem, of few parts."""
        return self.robust(runs=_FEW)
