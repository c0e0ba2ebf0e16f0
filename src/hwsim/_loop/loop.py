"""Runs of several parts, in one or more processes, with a journal and learning."""

import copy
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from hwsim._live.live import Aborted, Live
from hwsim._live.series import check_live, operated, rehearse, run_live
from hwsim._log.acts import OperatorAct
from hwsim._log.journal import Journal
from hwsim._log.labels import Labels, aborted
from hwsim._log.log import Log
from hwsim._loop.check import checked_clock, other_job
from hwsim._part.clock import Clock
from hwsim._part.kept_motions import KeptMotions
from hwsim._part.part import LivePart, run_part
from hwsim.faults._plant import warn_of_idle
from hwsim.protocols import Adaptation, Controller, Plant
from sdpgrind.base import checks
from sdpgrind.base.budget import afford
from sdpgrind.base.parallel import in_order
from sdpgrind.base.progress import ProgressOption, logger, quiet
from sdpgrind.base.rng import Seed, one_by_one

Numbered = tuple[int, np.random.Generator]
AHEAD = 64  # parts handed to workers at once; chosen: enough for many workers, and bounded for many parts
WAITS = "executor must be None where adapt is given: each part needs the one before"


@quiet
def run(
    plant: Plant,
    controller: Controller,
    *,
    parts: int = 1,
    rng: Seed = 0,
    adapt: Adaptation | None = None,
    journal: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    live: Live | None = None,
    progress: ProgressOption = None,
) -> Log:
    """Run a controller on a plant, part after part.

    Each part gets its own child of `rng` and its own copy of the controller: part k does not depend on the
    number of parts, workers or interruptions.

    Parameters
    ----------
    plant : Plant
        The machine, simulated, recorded or real; see `hwsim.protocols`.
    controller : Controller
        The controller, reset at each part. The object itself does not change.
    parts : int
        Number of parts, >= 1.
    rng : int, Generator or SeedSequence
        Random source; part k draws from its k-th child.
    adapt : Adaptation, optional
        Learns between parts: ``next(controller, part_log)`` returns the controller of the next part.
    journal : path, optional
        SQLite file to which each finished part is written. With an existing file the run resumes after its
        last part, with the results of an uninterrupted run; `parts` may be greater than before, and `adapt`
        is replayed.
    executor : concurrent.futures.Executor, optional
        Runs parts in parallel, bit-equal to serial results. Not with `adapt`, nor on a plant that parts
        change (``after``, see `hwsim.protocols`).
    live : Live, optional
        Run against the clock, with a safe command, a deadline and an operator; see `Live`. Not with
        `executor`. An aborted part stays in the journal. A run that resumes does it again on a simulated
        plant; on a real machine it goes on with the next.
    progress : callable(share, text), True or None
        Called with the completed share (0..1) and a text; True: a line with the time left. Default: silent.

    Returns
    -------
    Log
        Tables by tier and the outcome of each part, in the units of the plant.

    Raises
    ------
    ValueError
        Before the first tick: controller and plant do not fit (see `check`), or the journal is of another
        run. During the run: an unknown or NaN command, or one that the machine refuses.
    Aborted
        With `live`, whatever ended the part, once the machine is safe. Errors before the first step (`start`
        of the plant, `reset` of the controller) are raised as they are: nothing has moved.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class OnePass:
    ...     period = None
    ...     def reset(self):
    ...         self.begun = False
    ...     def step(self, **measured):
    ...         begun, self.begun = self.begun, True
    ...         return {"stop": 1.0} if begun else {"duration": 20.0, "normal_force": 40.0}
    >>> log = hwsim.run(hwsim.WeldBeadStand(weldbead.preset("P1")), OnePass(), parts=5, rng=1)
    >>> log.outcome.height.dims, log.outcome.time.values
    (('part',), array([20., 20., 20., 20., 20.]))
    """
    parts = checks.count("parts", parts)
    assert callable(progress)  # made by the decorator
    check_executor(executor)
    if adapt is not None:
        check_adaptation("adapt", adapt)
    if adapt is not None and executor is not None:
        raise ValueError(WAITS)
    if live is not None and checks.kind("live", live, Live, ": hwsim.Live(safe=...)").shadow:
        plant = getattr(plant, "listening", lambda: plant)()
    plant, clock = checked_clock(plant, controller)
    check_order(plant, executor)
    if live is not None:
        check_live(live, plant, controller)
        if executor is not None:
            raise ValueError(
                "executor must be None where live is given: one machine makes one part at a time"
            )
        rehearse(plant, controller, clock, live)
    labels = Labels.of(plant, controller)
    with _book(
        journal, {"plant": plant, "controller": controller, "rng": rng, "adapt": adapt}, labels
    ) as book:
        series = RunSeries(plant, clock, controller, copy.deepcopy(adapt), labels, KeptMotions(), live)
        if book and live:
            book.ready_for_clock()
        done = [series.kept.of(part) for part in book.read(parts)] if book else []
        if done and aborted(done[-1].outcome) and not hasattr(plant, "start_live"):
            done.pop()  # a simulated part is run again, from its own seed
        for part in done:
            series.learn(part)
        waiting = islice(enumerate(one_by_one(rng)), len(done), parts)
        for part in series.finished(waiting, executor, done, book):
            done.append(part)
            if len(done) == 1:
                _afford(parts, part)
            logger.debug("part %d of %d is finished", len(done), parts)
            progress(len(done) / parts, f"part {len(done)} of {parts}")
    warn_of_idle(plant, [part.outcome for part in done])
    log = Log.of(done, labels)
    log.made_of = {"plant": plant, "controller": controller, "rng": rng, "adapt": adapt}
    return log


def _afford(parts: int, first: LivePart) -> None:
    """Refuse a log that memory does not hold, as soon as the size of a part is known."""
    columns = [*first.outcome.values(), *(each for table in first.tables.values() for each in table.values())]
    size = 2.0 * parts * sum(each.nbytes for each in columns)  # the parts, and the log that is made of them
    afford(f"parts = {parts}", size, "several runs of fewer parts need less")


def check_adaptation(name: str, adapt: Any) -> None:
    if isinstance(adapt, type):
        raise TypeError(
            f"{name} must be an adaptation, not its class: {adapt.__name__}(); got {adapt.__name__}"
        )
    checks.able(name, adapt, "None or an adaptation, with next(controller, part_log)", "next")


def check_executor(executor: Executor | None) -> None:
    if executor is not None:
        checks.able("executor", executor, "None or a concurrent.futures.Executor", "submit")


def check_order(plant: Plant, executor: Executor | None) -> None:
    """Refuse to run parts in parallel on a plant that each part changes."""
    if executor is not None and hasattr(plant, "after"):
        name = type(plant).__name__
        raise ValueError(
            f"executor must be None on a {name}, which each part leaves changed; "
            "hwsim.repeat runs whole series"
        )


@dataclass
class RunSeries:
    """Consecutive parts; between them the plant may change and the controller may learn."""

    plant: Plant
    clock: Clock
    controller: Controller
    adapt: Adaptation | None
    labels: Labels
    kept: KeptMotions
    live: Live | None = None

    def learn(self, part: LivePart) -> None:
        """Update the plant by a finished part, and the controller by the adaptation."""
        if aborted(part.outcome):  # it tells nothing about a whole part
            return
        after = getattr(self.plant, "after", None)
        if after is not None:
            self.plant = after({name: _own(value) for name, value in part.outcome.items()})
        if self.adapt is not None:
            seen = Log.of([self.kept.whole(part)], self.labels)  # the same in a resumed run
            self.controller = self.adapt.next(self.controller, seen)
            if not isinstance(self.controller, Controller):
                raise TypeError(
                    f"next of the adaptation must return a controller; got {checks.shown(self.controller)}"
                )
            if faults := other_job(self.plant, self.controller):
                raise ValueError(f"next of the adaptation must return a controller that fits: {faults[0]}")

    def finished(
        self,
        waiting: Iterable[Numbered],
        executor: Executor | None,
        done: list[LivePart],
        book: Journal | None,
    ) -> Iterator[LivePart]:
        """Run the waiting parts and write each to the journal, an aborted one before its error is raised."""
        with operated(self.live) if self.live else nullcontext():
            try:
                for part in self.in_order(waiting, executor):
                    self._write(book, len(done), part)
                    yield part
                self._note(book)
            except Aborted as error:
                if error.part is not None:
                    done.append(self.kept.of(error.part))
                error.log = Log.of(done, self.labels)
                try:
                    if error.part is not None:
                        self._write(book, len(done) - 1, done[-1])
                    self._note(book)
                except Exception as refused:
                    error.add_note(f"and the journal could not be written: {refused}")
                raise
            except BaseException:  # the caller's too: what the operator did is not lost by it
                with suppress(Exception):  # the error that is on its way is told
                    self._note(book)
                raise

    def _write(self, book: Journal | None, number: int, part: LivePart) -> None:
        if book:
            acts = self.live.unwritten_acts() if self.live else ()
            book.add(number, part, acts)
            self._written(acts)

    def _note(self, book: Journal | None) -> None:
        """Write what the operator did after the last part."""
        if book and self.live and (acts := self.live.unwritten_acts()):
            book.note(acts)
            self._written(acts)

    def _written(self, acts: Sequence[OperatorAct]) -> None:
        """Mark acts, once they are in the journal: an error before loses none."""
        if self.live:
            self.live.note_written(len(acts))

    def in_order(self, waiting: Iterable[Numbered], executor: Executor | None) -> Iterator[LivePart]:
        """Run the waiting parts and yield them in order, each as soon as it is finished, as `kept`."""
        if executor is not None:
            yield from map(self.kept.of, self._parallel(waiting, executor))
            return
        for numbered in waiting:
            part = self.kept.of(_run_one(self.plant, self.controller, self.clock, numbered, self.live))
            yield part
            self.learn(part)

    def _parallel(self, waiting: Iterable[Numbered], executor: Executor) -> Iterator[LivePart]:
        work = partial(_run_one, self.plant, self.controller, self.clock)
        yield from in_order(work, waiting, executor, AHEAD)


def _run_one(
    plant: Plant, controller: Controller, clock: Clock, numbered: Numbered, live: Live | None = None
) -> LivePart:
    """Run one part on a copy of the controller."""
    number, rng = numbered
    controller = copy.deepcopy(controller)
    try:
        if live is not None:
            live.wait_while_paused(number)
            return run_live(plant, controller, clock, rng, live)
        return run_part(plant, controller, clock, rng)
    except Exception as error:
        if not isinstance(error, Aborted):  # which says it
            error.add_note(f"in part {number}")
        raise


@contextmanager
def _book(
    path: str | os.PathLike[str] | None, ingredients: Mapping[str, Any], labels: Labels
) -> Iterator[Journal | None]:
    """Open or create the journal; refuse one of another run."""
    if path is None:
        yield None
        return
    known = Path(path).exists()
    with Journal(path) if known else Journal.create(path, ingredients, labels) as journal:
        if known:
            journal.refuse_other(ingredients)
        yield journal


def _own(value: Any) -> Any:
    """A number or a copy, so that a plant cannot change the log."""
    return value.item() if np.ndim(value) == 0 else np.copy(value)
