"""Runs: part after part through the loop, on one process or many, into a journal, with learning between parts."""

import copy
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim import _frames
from hwsim._check import checked_clock, other_job
from hwsim._clock import Clock
from hwsim._fingerprint import fingerprint
from hwsim._journal import Journal
from hwsim._labels import Labels
from hwsim._log import Log
from hwsim._part import Part, run_part
from hwsim.protocols import Adaptation, Controller, Plant
from sdpgrind.base import checks
from sdpgrind.base.parallel import execute
from sdpgrind.base.progress import Progress, silent
from sdpgrind.base.rng import Seed, children

if TYPE_CHECKING:
    import xarray as xr

_Numbered = tuple[int, np.random.Generator]
_BLOCK = 64  # parts between two entries into the journal when an executor runs them; no matter how many workers
_PIECE = 8  # parts in one piece of work: the controller travels once for each


def run(
    plant: Plant,
    controller: Controller,
    *,
    parts: int = 1,
    rng: Seed = 0,
    adapt: Adaptation | None = None,
    journal: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Log:
    """Let a controller work on a plant, part after part.

    Each part gets its own child of `rng` and its own copy of the controller, so that part k is the same whatever the
    number of parts, of workers, or of interruptions.

    Parameters
    ----------
    plant : Plant
        The machine, simulated, recorded or real; see `hwsim.protocols`.
    controller : Controller
        Decides; it is reset at each part. Yours is left as it is.
    parts : int
        Number of parts, >= 1.
    rng : int, Generator or SeedSequence
        Random source; part k draws from its k-th child.
    adapt : Adaptation, optional
        Learns between parts: its ``next(controller, part_log)`` gives the controller of the next part.
    journal : path, optional
        SQLite file to which each finished part is written. Where the file exists the run resumes after the last part in
        it, with the results that it would have had without the interruption; `parts` may have grown. Adaptation is
        replayed from the parts in the journal.
    executor : concurrent.futures.Executor, optional
        Runs parts in parallel, with results equal to serial ones bit for bit. Not together with `adapt`, where a part
        needs the one before.
    progress : callable
        Told the share done (0..1) and a text.

    Returns
    -------
    Log
        Tables by tier and the outcome of each part, in the units of the plant.

    Raises
    ------
    ValueError
        Before the first tick: controller and plant do not fit (`check` says more), or the journal is of another run.
        During it: an unknown or NaN command, or one that the machine refuses.

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
    _check_helpers(executor, progress)
    if adapt is not None:
        checks.able("adapt", adapt, "None or an adaptation, with next(controller, part_log)", "next")
    if adapt is not None and executor is not None:
        raise ValueError("executor must be None where adapt is given: each part needs the one before")
    plant, clock = checked_clock(plant, controller)
    labels = Labels.of(plant, controller)
    with _book(journal, {"plant": plant, "controller": controller, "rng": rng, "adapt": adapt}, labels) as book:
        series = _Series(plant, clock, controller, copy.deepcopy(adapt), labels)
        done = list(book.read(parts)) if book else []
        for part in done:
            series.learn(part)
        waiting = list(enumerate(children(rng, parts)))[len(done) :]
        for part in series.in_order(waiting, executor):
            if book:
                book.add(len(done), part)
            done.append(part)
            progress(len(done) / parts, f"part {len(done)} of {parts}")
    return Log.of(done, labels)


def compare(
    plant: Plant,
    controllers: Mapping[str, Controller],
    *,
    parts: int = 1,
    rng: Seed = 0,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Log:
    """Let several controllers work on the same parts.

    Parameters
    ----------
    plant : Plant
        The machine.
    controllers : mapping
        Name -> controller. Part k of each draws from the same child of `rng`: the same hidden truth, paired results.
    parts : int
        Number of parts for each, >= 1.
    rng : int, Generator or SeedSequence
        Random source.
    executor : concurrent.futures.Executor, optional
        Runs parts in parallel, with results equal to serial ones bit for bit.
    progress : callable
        Told the share done (0..1) and a text.

    Returns
    -------
    Log
        As that of `run`, the outcome with a dimension ``controller``, the tables with a coordinate ``controller``.

    Raises
    ------
    ValueError
        When there is no controller, or one does not fit the plant.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import weldbead
    >>> class OnePass:
    ...     period = None
    ...     def __init__(self, duration):
    ...         self.duration = duration
    ...     def reset(self):
    ...         self.begun = False
    ...     def step(self, **measured):
    ...         begun, self.begun = self.begun, True
    ...         return {"stop": 1.0} if begun else {"duration": self.duration, "normal_force": 40.0}
    >>> stand = hwsim.WeldBeadStand(weldbead.preset("P1"))
    >>> log = hwsim.compare(stand, {"fast": OnePass(10.0), "slow": OnePass(20.0)}, parts=5)
    >>> log.outcome.time.mean("part").values
    array([10., 20.])
    """
    if not isinstance(controllers, Mapping):
        given = checks.shown(controllers)
        raise TypeError(f"controllers must be a mapping name -> controller, such as {{'mine': controller}}; got {given}")
    if not controllers:
        raise ValueError("controllers must be a mapping name -> controller with at least one; got none")
    _check_helpers(executor, progress)
    parts = checks.count("parts", parts)
    rngs = children(rng, parts)
    runs = {}
    for k, (name, controller) in enumerate(controllers.items()):
        fitted, clock = checked_clock(plant, controller, name)
        labels = Labels.of(fitted, controller)
        series = _Series(fitted, clock, controller, None, labels)
        done = list(series.in_order(list(enumerate(copy.deepcopy(rngs))), executor))
        runs[name] = _frames.from_parts(done, labels)
        progress((k + 1) / len(controllers), f"{name}: {parts} parts")
    return Log(lambda: _frames.side_by_side(runs))


def _check_helpers(executor: Executor | None, progress: Progress) -> None:
    checks.able("progress", progress, "a function of the share done (0..1) and a text", "__call__")
    if executor is not None:
        checks.able("executor", executor, "None or a concurrent.futures.Executor", "submit")


def repeat(
    plant: Plant,
    controller: Controller,
    *,
    series: int,
    parts: int = 1,
    rng: Seed = 0,
    adapt: Adaptation | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> "xr.Dataset":
    """Run the same series again and again, each with random numbers of its own: what learning is worth, and what it risks.

    Parameters
    ----------
    plant, controller, parts, adapt
        As for `run`.
    series : int
        Number of series, >= 1.
    rng : int, Generator or SeedSequence
        Random source; series k is ``run`` with the k-th child.
    executor : concurrent.futures.Executor, optional
        Runs series in parallel, with results equal to serial ones bit for bit.
    progress : callable
        Told the share done (0..1) and a text.

    Returns
    -------
    xarray.Dataset
        The outcomes, dimensions ``series`` and ``part``, units in the attributes.

    Raises
    ------
    ValueError
        As `run`.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem, safety_margin=0.002)
    >>> outcome = hwsim.repeat(hwsim.PlungeGrinder(problem), controller, series=3, parts=2)
    >>> outcome.time.dims, outcome.burned.values.sum()
    (('series', 'part'), np.float64(0.0))
    """
    rngs = children(rng, checks.count("series", series))
    plant, clock = checked_clock(plant, controller)
    labels = Labels.of(plant, controller)
    work = partial(_outcomes, plant, controller, clock, labels, checks.count("parts", parts), adapt)
    done: list[list[Part]] = []
    for piece in _batched(list(enumerate(rngs)), _BLOCK):
        done += [each for few in execute(work, _batched(piece, _PIECE), executor) for each in few]
        progress(len(done) / series, f"series {len(done)} of {series}")
    return _frames.repeated(done, labels)


def _outcomes(
    plant: Plant, controller: Controller, clock: Clock, labels: Labels, parts: int, adapt: Any, piece: Sequence[_Numbered]
) -> list[list[Part]]:
    """A few series; of each part the outcome alone travels back."""
    done = []
    for _, rng in piece:
        series = _Series(plant, clock, controller, copy.deepcopy(adapt), labels)
        done.append([Part({}, part.outcome) for part in series.in_order(list(enumerate(children(rng, parts))), None)])
    return done


@dataclass
class _Series:
    """Parts one after the other, the controller changing in between where something is learned."""

    plant: Plant
    clock: Clock
    controller: Controller
    adapt: Adaptation | None
    labels: Labels

    def learn(self, part: Part) -> None:
        """Take the next controller from the adaptation; it sees the last one as it was before its part."""
        if self.adapt is not None:
            self.controller = self.adapt.next(self.controller, Log.of([part], self.labels))
            if not isinstance(self.controller, Controller):
                raise TypeError(f"next of the adaptation must return a controller; got {checks.shown(self.controller)}")
            if faults := other_job(self.plant, self.controller):
                raise ValueError(f"next of the adaptation must return a controller that fits: {faults[0]}")

    def in_order(self, waiting: Sequence[_Numbered], executor: Executor | None) -> Iterator[Part]:
        """Run the parts that are waiting and give them in order, each as soon as it can be had."""
        if executor is not None:
            yield from self._parallel(waiting, executor)
            return
        for numbered in waiting:
            part = _run_one(self.plant, self.controller, self.clock, numbered)
            yield part
            self.learn(part)

    def _parallel(self, waiting: Sequence[_Numbered], executor: Executor) -> Iterator[Part]:
        work = partial(_run_piece, self.plant, self.controller, self.clock)
        for block in _batched(waiting, _BLOCK):
            for piece in execute(work, _batched(block, _PIECE), executor):
                yield from piece


def _batched(items: Sequence[_Numbered], size: int) -> Iterator[Sequence[_Numbered]]:
    """Cut a sequence into pieces of `size`."""
    return (items[k : k + size] for k in range(0, len(items), size))


def _run_piece(plant: Plant, controller: Controller, clock: Clock, piece: Sequence[_Numbered]) -> list[Part]:
    return [_run_one(plant, controller, clock, numbered) for numbered in piece]


def _run_one(plant: Plant, controller: Controller, clock: Clock, numbered: _Numbered) -> Part:
    """Run one part on a copy of the controller, so that nothing leaks into the next."""
    number, rng = numbered
    try:
        return run_part(plant, copy.deepcopy(controller), clock, rng)
    except Exception as error:
        error.add_note(f"in part {number}")
        raise


@contextmanager
def _book(path: str | os.PathLike[str] | None, ingredients: Mapping[str, Any], labels: Labels) -> Iterator[Journal | None]:
    """Open or begin the journal; refuse one that was begun with other ingredients."""
    if path is None:
        yield None
        return
    prints = {name: fingerprint(thing) for name, thing in ingredients.items()}
    with Journal(path) if Path(path).exists() else Journal.create(path, prints, labels) as journal:
        journal.refuse_other(prints)
        yield journal
