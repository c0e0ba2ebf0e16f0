"""Planned grinding sequence: simulation, risk, sheets for operators, files; look-ups are in `_solved`."""

import os
from concurrent.futures import Executor
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt
import xarray as xr

from sdpgrind import sdp
from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.by_name import called
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.progress import ProgressOption, reporting
from sdpgrind.base.quantities import another_unit
from sdpgrind.base.rng import Seed
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.weldbead.sequence._as_sdp import LEVELS, as_planned, sdp_problem, true_problem
from sdpgrind.weldbead.sequence._band_sheet import BandSheet
from sdpgrind.weldbead.sequence._exact import ExactTable
from sdpgrind.weldbead.sequence._operator_table import OperatorTable, operator_table
from sdpgrind.weldbead.sequence._problem import NOISES, SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._risk import Asked, Risk, as_text, of_text, risk_of, warn_if_unsure
from sdpgrind.weldbead.sequence._sheet import first_passes
from sdpgrind.weldbead.sequence._sheet_file import ending_of
from sdpgrind.weldbead.sequence._simple_policy import SimplifiedPolicy
from sdpgrind.weldbead.sequence._simplified import HEIGHTS, covered, followed
from sdpgrind.weldbead.sequence._solved import SolvedSequence

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe, TablesAsked

_PROMISED = "sdpgrind.weldbead.sequence._promise:promised"  # by name: it runs controllers of policies
_KNOWN = "sdpgrind.weldbead.sequence._known_beads:known_beads"


def _noise(value: float) -> float:
    """Check the standard deviation of a scan, mm."""
    sd = checks.nonnegative("height_noise", value, "mm")
    if sd > NOISES[1]:
        raise ValueError(another_unit("height_noise", value, "mm", NOISES, 0.002))
    return sd


class SequencePolicy(SolvedSequence, Plan):
    """Planned grinding sequence, immutable: expected penalty ($) and next pass by height (mm) and time (s).

    Attributes
    ----------
    problem : SequenceProblem
        Problem that was planned.
    table : sdp.Policy
        Table of the solver.
    method : str
        How what is not known of the bead was planned, as in `plan`.
    """

    kind = "weldbead.sequence"

    def __init__(self, problem: SequenceProblem, table: sdp.Policy, method: str = "cautious") -> None:
        super().__init__(problem, table)
        self.method = method
        self._promises: dict[Asked, Risk] = {}
        self._last_risk: tuple[str, Risk] | None = None  # what was asked: text and page of a run ask alike

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it."""
        from sdpgrind.weldbead.sequence._recipe import recipe_of

        return recipe_of(self, self._durations, self._feeds)

    def __export_tables__(self, asked: "TablesAsked") -> "Recipe":
        """Return the same with tables as asked: rounded, without the gap ($), with the value ($)."""
        from sdpgrind.weldbead.sequence._small_recipe import small_recipe_of

        return small_recipe_of(self, self._durations, self._feeds, asked)

    # -- predicting ------------------------------------------------------------------------------------

    def simulate(
        self,
        model: GrindingProcess | SequenceProblem | None = None,
        *,
        runs: int = 10_000,
        height: float,
        time_left: float,
        last_duration: float | None = None,
        rng: Seed = 0,
        snap: bool = False,
        height_noise: float = 0.0,
        executor: Executor | None = None,
    ) -> sdp.Runs:
        """Follow the policy on the model by Monte-Carlo, without machine or sensor.

        Parameters
        ----------
        model : GrindingProcess or SequenceProblem, optional
            Truth other than the planned one: process, scatter, charges. Forces and feeds are the policy's.
        runs : int
            Number of sequences.
        height, time_left : float
            Start of each sequence, mm and s.
        last_duration : float, optional
            Duration of the last pass, s, as in `value`.
        rng : int, SeedSequence or Generator
            Source of randomness.
        snap : bool
            Put outcomes on neighbour nodes at random, as the table does: the mean is then the table's value.
        height_noise : float
            Standard deviation of the scan by which the policy decides, mm. The plan assumes exact scans.
        executor : concurrent.futures.Executor, optional
            Runs blocks of sequences; results do not depend on it.

        Returns
        -------
        sdp.Runs
            Penalty ($), passes (`moves`), final height (mm) and time left (s) of each sequence.

        Raises
        ------
        ValueError
            When the truth is another job: lengths, durations, stages, or a charge unknown to the plan.
        """
        truth = model
        if not isinstance(truth, SequenceProblem):
            truth = self.problem if model is None else self.problem.replace(model=model)
        planned = as_planned(self.problem, self.method)
        same = model is None and planned is self.problem
        problem = self.table.problem if same else true_problem(planned, truth, self.nodes)
        start = self._state(height, time_left, last_duration)
        noise = {"height": _noise(height_noise)}
        found: sdp.Runs = self.table.simulate(
            runs=runs, rng=rng, problem=problem, snap=snap, noise=noise, executor=executor, **start
        )
        return found

    @reporting
    def risk(
        self,
        height: float,
        time_left: float,
        *,
        last_duration: float | None = None,
        confidence: float = 0.95,
        finished_within: float = 0.05,
        error: float | None = None,
        rng: Seed = 0,
        progress: ProgressOption = None,
    ) -> Risk:
        """Return risk figures from one state; where beads differ, what a controller that learns will cost.

        A forward recursion; with a `bead_scatter` drawn beads, each ground as `SequenceController` would:
        passes are drawn, the belief is updated, the next pass is planned anew. The same draws are ground by
        the plan alone and by one that knows the bead. The plan and its file keep what was drawn.

        Parameters
        ----------
        height, time_left, last_duration : float
            State, mm and s, as in `value`; where beads differ there is no last duration.
        confidence : float
            Probability of the CVaR.
        finished_within : float
            Height left of a finished bead, above or below the target, >= 0, mm.
        error : float, optional
            With a `bead_scatter`: 1.96 standard errors of the mean that are wanted, $. Default: 200 beads,
            some seconds; minutes where lateness or the finish are charged.
        rng : int, SeedSequence or Generator
            Source of the drawn beads.
        progress : callable(share, text), True or None
            True: a line with the time left. Default: a line on standard error when it takes long.

        Returns
        -------
        Risk
            Figures, each with its error.

        Warns
        -----
        UserWarning
            When the error of mean, overground, cvar or passes of the recursion exceeds 5 % of it plus 1e-4.
        """
        within = checks.nonnegative("finished_within", finished_within, "mm")
        if self.problem.bead_scatter is None:
            asked = repr((height, time_left, last_duration, confidence, within))
            if self._last_risk is None or self._last_risk[0] != asked:
                begun = self._state(height, time_left, last_duration)
                self._last_risk = asked, risk_of(self.table, begun, confidence, within)
            warn_if_unsure(self._last_risk[1])
            return self._last_risk[1]
        checks.within("confidence", confidence, 0.0, 1.0 - 1e-9)
        if last_duration is not None:
            raise checks.refuse("last_duration", "None where beads differ", last_duration, "s")
        wanted = None if error is None else checks.positive("error", error, "$")
        state = checks.number("height", height, "mm"), checks.number("time_left", time_left, "s")
        return self._promised((*state, float(confidence), within, wanted), rng, progress)

    def _promised(self, asked: tuple[float | None, ...], rng: Seed, progress: Any) -> Risk:
        """Return a promise from a state and options of `risk`; one from a seed is kept."""
        if not isinstance(rng, int | np.integer):
            found: Risk = called(_PROMISED, self, *asked, rng, progress)
            return found
        kept = (*asked, int(rng))
        if kept not in self._promises:
            self._promises[kept] = called(_PROMISED, self, *asked, rng, progress)
        return self._promises[kept]

    def lower_bound(self, height: npt.ArrayLike, time_left: npt.ArrayLike) -> Floats:
        """Return what beads whose coefficients are known would cost, $: no plan that learns costs less.

        27 beads by Gauss's rule; without a `bead_scatter` the value itself. That value counts each pass as
        one of another bead: where time suffices it is above what a plan that learns will cost, by up to five
        times; where it does not, below, and below this bound, too. `risk` tells what to expect.

        Parameters
        ----------
        height, time_left : float or array
            Mean bead height, mm, and time to the deadline, s, as in `value`; arrays broadcast.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> problem = weldbead.preset("P4").replace(
        ...     scatter=weldbead.Scatter(("K1", "K2", "mu"), (0.1, 0.1, 0.1), law="lognormal"),
        ...     bead_scatter=weldbead.CoefficientScatter(0.2, 0.0, 0.0))
        >>> policy = weldbead.plan(problem, tolerance=None, nodes=101)
        >>> bool(policy.lower_bound(1.0, 48.0) < policy.value(1.0, 48.0))
        True
        """
        if self.problem.bead_scatter is None:
            return np.asarray(self.value(height, time_left), dtype=float)
        stop = self.problem.height_charge  # of beads that no admissible force removes
        found = sum(
            w * np.asarray(stop(height) if known is None else known.value(height, time_left))
            for w, known in self._known_beads
        )
        return np.asarray(found, dtype=float)

    @cached_property
    def _known_beads(self) -> list[tuple[float, "SequencePolicy | None"]]:
        """Weights, and plans of beads whose coefficients are known; None: no force removes it."""
        found: list[tuple[float, SequencePolicy | None]] = called(_KNOWN, self)
        return found

    def operator_table(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        heights: npt.ArrayLike | None = None,
        times: npt.ArrayLike | None = None,
    ) -> OperatorTable:
        """Return the plan as a table by which an operator grinds, and what reading it in steps costs.

        Parameters
        ----------
        path : path, optional
            File that is written, too: ``.html`` (a sheet of A4 for the printer), ``.txt`` or ``.csv``.
        heights : array_like, optional
            Rows, rising, mm. Default: as many as keep the loss below 2 % of the penalty, or as fit on A4.
        times : array_like, optional
            Columns, rising, s. Default: likewise.

        Returns
        -------
        OperatorTable
            Duration (s) and force (N) of the next pass by height (mm) and time left (s).

        Raises
        ------
        ValueError
            For rows or columns that do not rise or lie outside the plan, or another ending of the file.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=101)
        >>> table = policy.operator_table(heights=[0.5, 1.0, 2.0], times=[20, 40, 60])
        >>> table.action(0.8, 45.0)  # row 1.0 mm, column 40 s: duration in s, force in N
        (8.0, 45.27)
        """
        if path is not None:
            ending_of(path)  # refused before the work
        table = operator_table(self.problem, self.table, heights, times)
        if path is not None:
            table.save(path)
        return table

    @reporting
    def simplified(
        self,
        *,
        loss: float = 3e-3,
        force_step: float = 1.0,
        durations: int | None = None,
        progress: ProgressOption = None,
    ) -> SimplifiedPolicy:
        """Return the plan in few bands of one duration and one force, with exactly what that loses.

        Bands are chosen at hundredths of the greatest height, where the plan is solved anew to be compared;
        heights in between lose more, see `SimplifiedPolicy.loss_between`.

        Parameters
        ----------
        loss : float
            Expected penalty that a decision may lose against the best one, and all together, >= 0, $.
        force_step : float
            Forces are multiples of it, > 0, N, or the limit of their duration.
        durations : int, optional
            Greatest number of different durations; each choice of so many is solved, and what it loses counts
            in no limit. Default: any.
        progress : callable(share, text), True or None
            True: a line with the time left. Default: a line on standard error when it takes long.

        Returns
        -------
        SimplifiedPolicy
            Bands, loss, and the sheet.

        Raises
        ------
        ValueError
            When forces in such steps alone lose more: the error names a step that does not. Where the finish
            or lateness is charged.

        Examples
        --------
        >>> from sdpgrind import weldbead
        >>> simple = weldbead.plan(weldbead.preset("P4"), tolerance=None, nodes=101).simplified(loss=0.003)
        >>> simple.loss <= 0.003, simple.action(0.5, 30.0).normal_force  # N
        (True, 45.0)
        """
        allowed = checks.nonnegative("loss", loss, "$")
        step = checks.positive("force_step", force_step, "N")
        count = None if durations is None else checks.count("durations", durations)
        assert callable(progress)  # made by the decorator
        planned = self._planned_values
        problem = as_planned(self.problem, self.method)
        return SimplifiedPolicy(self, planned, covered(problem, planned, allowed, step, count, progress))

    def following(self, sheet: BandSheet) -> SimplifiedPolicy:
        """Return what following a sheet of bands (mm, s, N) costs against this plan.

        Parameters
        ----------
        sheet : BandSheet
            From `SimplifiedPolicy.operator_table`, or read by `weldbead.sequence.operator_table`.

        Raises
        ------
        ValueError
            For a duration that is none of the problem's, or a force beyond its limits.
        """
        checks.kind("sheet", sheet, BandSheet)
        planned, problem = self._planned_values, as_planned(self.problem, self.method)
        sheet.check(problem)
        lines = [sheet.line(stage * problem.stage) for stage in range(len(planned))]
        return SimplifiedPolicy(self, planned, followed(problem, lines, planned.shape[1]))

    @cached_property
    def _planned_values(self) -> Floats:
        return self.planned_on(HEIGHTS)

    def planned_on(self, nodes: int) -> Floats:
        """Return the expected penalty at `nodes` even heights (mm), $, [stage, node], of a plan on these."""
        table = sdp.plan(sdp_problem(as_planned(self.problem, self.method), nodes))
        return np.asarray(table.table.value[-table.countdown.first :, 0])

    # -- keeping ---------------------------------------------------------------------------------------

    @property
    def dataset(self) -> xr.Dataset:
        """Table with labels and units, and the problem as JSON."""
        attributes: dict[str, Any] = {} if self.problem.bead_scatter is None else {"method": self.method}
        if isinstance(self.table, ExactTable):
            attributes["exact"] = 1
        elif self.levels != LEVELS:
            attributes["levels"] = self.levels
        return self.table.dataset.assign_attrs(problem=stored.encode(self.problem), **attributes)

    def _written(self) -> xr.Dataset:
        kept = self._promises
        return self.dataset.assign_attrs(promises=as_text(kept)) if kept else self.dataset

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        problem: SequenceProblem = stored.decode(dataset.attrs["problem"])
        method = str(dataset.attrs.get("method", "cautious"))
        if dataset.attrs.get("exact"):
            found = cls(problem, ExactTable.of(as_planned(problem, method)), method)
        else:
            levels = int(dataset.attrs.get("levels", LEVELS))
            asked = sdp_problem(as_planned(problem, method), dataset.sizes["height"], levels=levels)
            found = cls(problem, sdp.Policy.from_dataset(dataset, asked), method)
        found._promises.update(of_text(str(dataset.attrs.get("promises", "[]"))))
        return found

    def plot(self) -> Any:
        """Draw expected penalty, duration and force over time left and height; return the figure."""
        return pictures.drawn("sdpgrind.weldbead.sequence._picture:plot_policy", self, *self.states())

    def _figures(self) -> tuple[AmountTable]:
        return (first_passes(self),)

    def states(self) -> tuple[Floats, Floats]:
        """Return the heights (mm) and the times left (s, not late) of the table's nodes."""
        count = self.table.layout.count
        return self.table.grid.coordinates[0], np.arange(float(count + 1)) * self.problem.stage

    def _told(self) -> str:
        error = "not estimated" if self.error is None else f"{self.error:.2g} ${self.told_away}"
        return (
            f"{self.nodes} heights to {self.table.layout.axes[0].high:g} mm, {self.problem.horizon:g} s,"
            f" error {error}"
        )
