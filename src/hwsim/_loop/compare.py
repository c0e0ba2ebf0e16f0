"""Several controllers on the same parts, and one series repeated."""

import copy
from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log import frames as _frames
from hwsim._log.labels import Labels
from hwsim._log.log import Log
from hwsim._loop.check import checked_clock
from hwsim._loop.loop import (
    AHEAD,
    WAITS,
    RunSeries,
    check_adaptation,
    check_executor,
    check_order,
)
from hwsim._part.clock import Clock
from hwsim._part.kept_motions import KeptMotions
from hwsim._part.part import LivePart
from hwsim.faults._plant import warn_of_idle
from hwsim.protocols import Adaptation, Controller, Plant
from sdpgrind.base import checks
from sdpgrind.base.parallel import in_order
from sdpgrind.base.progress import ProgressOption, quiet
from sdpgrind.base.rng import Seed, children

if TYPE_CHECKING:
    import xarray as xr


@quiet
def compare(
    plant: Plant,
    controllers: Mapping[str, Controller],
    *,
    parts: int = 1,
    rng: Seed = 0,
    adapt: Mapping[str, Adaptation | None] | None = None,
    executor: Executor | None = None,
    progress: ProgressOption = None,
) -> Log:
    """Run several controllers on the same parts.

    Parameters
    ----------
    plant : Plant
        The machine.
    controllers : mapping
        Name -> controller. Part k of each draws from the same child of `rng`: the same hidden truth, paired
        results. A part changes the plant (``after``, see `hwsim.protocols`) for later parts of the same
        controller only.
    parts : int
        Number of parts for each controller, >= 1.
    rng : int, Generator or SeedSequence
        Random source.
    adapt : mapping, optional
        Name of a controller -> adaptation that learns between its parts; the others do not learn.
    executor : concurrent.futures.Executor, optional
        Runs parts in parallel, bit-equal to serial results; not with `adapt`, nor on a plant that parts
        change.
    progress : callable(share, text), True or None
        Called with the completed share (0..1) and a text; True: a line with the time left. Default: silent.

    Returns
    -------
    Log
        Log as of `run`, with a dimension ``controller`` in the outcome and a coordinate ``controller`` in the
        tables.

    Raises
    ------
    ValueError
        When there is no controller, one does not fit the plant, or an adaptation is for none of them.

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
        raise TypeError(
            f"controllers must be a mapping name -> controller, such as {{'mine': controller}}; got {given}"
        )
    if not controllers:
        raise ValueError("controllers must be a mapping name -> controller with at least one; got none")
    assert callable(progress)  # made by the decorator
    check_executor(executor)
    learning = _adaptations(adapt, controllers, executor)
    parts = checks.count("parts", parts)
    rngs = children(rng, parts)
    runs, kept, outcomes = {}, KeptMotions(), list[Mapping[str, Any]]()
    for k, (name, controller) in enumerate(controllers.items()):
        fitted, clock = checked_clock(plant, controller, name)
        check_order(fitted, executor)
        labels = Labels.of(fitted, controller)
        series = RunSeries(fitted, clock, controller, copy.deepcopy(learning.get(name)), labels, kept)
        done = []
        for part in series.in_order(list(enumerate(copy.deepcopy(rngs))), executor):
            done.append(part)
            progress((k + len(done) / parts) / len(controllers), f"{name}: part {len(done)} of {parts}")
        runs[name] = _frames.from_parts(done, labels)
        outcomes += [part.outcome for part in done]
    warn_of_idle(plant, outcomes)
    log = Log(lambda: _frames.side_by_side(runs))
    log.made_of = {"plant": plant, "controllers": dict(controllers), "rng": rng, "adaptations": learning}
    return log


def _adaptations(
    adapt: Mapping[str, Adaptation | None] | None,
    controllers: Mapping[str, Controller],
    executor: Executor | None,
) -> dict[str, Adaptation]:
    """Adaptations by controller, checked."""
    if adapt is None:
        return {}
    if not isinstance(adapt, Mapping):
        raise TypeError(
            f"adapt must be a mapping from names of controllers to adaptations; got {checks.shown(adapt)}"
        )
    if executor is not None:
        raise ValueError(WAITS)
    for name, each in adapt.items():
        checks.one_of("adapt", name, tuple(controllers))
        if each is not None:
            check_adaptation(f"adapt[{name!r}]", each)
    return {name: each for name, each in adapt.items() if each is not None}


@quiet
def repeat(
    plant: Plant,
    controller: Controller,
    *,
    series: int,
    parts: int = 1,
    rng: Seed = 0,
    adapt: Adaptation | None = None,
    executor: Executor | None = None,
    progress: ProgressOption = None,
) -> "xr.Dataset":
    """Run a series several times with different random numbers, to measure what learning gains.

    Parameters
    ----------
    plant, controller, parts, adapt
        As for `run`.
    series : int
        Number of series, >= 1.
    rng : int, Generator or SeedSequence
        Random source; series k is ``run`` with the k-th child.
    executor : concurrent.futures.Executor, optional
        Runs series in parallel, bit-equal to serial results.
    progress : callable(share, text), True or None
        Called with the completed share (0..1) and a text; True: a line with the time left. Default: silent.

    Returns
    -------
    xarray.Dataset
        Outcomes, dimensions ``series`` and ``part``, units in the attributes.

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
    assert callable(progress)  # made by the decorator
    rngs = children(rng, checks.count("series", series))
    plant, clock = checked_clock(plant, controller)
    labels = Labels.of(plant, controller)
    work = partial(_outcomes, plant, controller, clock, labels, checks.count("parts", parts), adapt)
    done: list[list[LivePart]] = []
    for outcomes in in_order(work, rngs, executor, AHEAD):
        done.append(outcomes)
        progress(len(done) / series, f"series {len(done)} of {series}")
    warn_of_idle(plant, [part.outcome for each in done for part in each])
    return _frames.repeated(done, labels)


def _outcomes(
    plant: Plant,
    controller: Controller,
    clock: Clock,
    labels: Labels,
    parts: int,
    adapt: Any,
    rng: np.random.Generator,
) -> list[LivePart]:
    """Run a series and keep the outcomes of its parts only."""
    series = RunSeries(plant, clock, controller, copy.deepcopy(adapt), labels, KeptMotions())
    numbered = list(enumerate(children(rng, parts)))
    return [LivePart({}, part.outcome) for part in series.in_order(numbered, None)]
