"""Check a user's problem before a long solve, and report all faults at once."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.sdp._problem.coordinates import Axis, Forever, Stages
from sdpgrind.sdp._problem.grid import Grid, record
from sdpgrind.sdp._problem.moves import Move
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.forever import refuse_endless
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.sampled import Sampled


@dataclass(frozen=True)
class Report:
    """Findings of `check`.

    Attributes
    ----------
    problems : tuple of str
        Faults that stop or spoil a solve.
    notes : tuple of str
        Limitations (a callback that does not pickle cannot go to processes).
    """

    problems: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def __str__(self) -> str:
        lines = [f"wrong: {line}" for line in self.problems] + [f"note: {line}" for line in self.notes]
        return "\n".join(lines) if lines else "nothing is wrong"


def check(problem: Problem) -> Report:
    """Test every callback of a problem on a small grid.

    Tested: shapes and finiteness of charges, transitions that leave an axis, unreachable stops, agreement of
    numpy and compiled sampled steps on random points, and pickling (for executors of processes).

    Parameters
    ----------
    problem : Problem
        Problem to be solved (units are its own).

    Returns
    -------
    Report
        Findings; print it.

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> problem = sdp.Problem(
    ...     [sdp.Axis("x", 0.1, 1.0, 11)],
    ...     [sdp.Move("go", {"a": [1.0]}, sdp.Sampled(lambda s, c, e: (2 * s.x,)))],
    ...     [], sdp.Forever())
    >>> print(sdp.check(problem))
    wrong: move 'go' must keep x in [0.1, 1], or the axis needs another edge than 'refuse'; got 2
    note: ...
    """
    checks.kind("problem", problem, Problem, " of this package, as axes, moves, stops and stages make it")
    small = replace(problem, axes=[_small(axis) for axis in problem.axes])
    grid = Grid.of(small)
    problems: list[str] = []
    notes: list[str] = []
    for stop in small.stops:
        _try(
            problems,
            f"stop {stop.name!r}",
            partial(_stop, small if _edges(small) else replace(small, stops=(stop,)), grid),
        )
    for k, move in enumerate(small.moves):
        _try(problems, f"move {move.name!r}", partial(_move, small, grid, k, notes))
    if not problems and isinstance(small.stages, Forever):
        _try(problems, "stages", partial(refuse_endless, small, grid))
    return Report(tuple(problems), tuple(_notes(problem, small)))


def _small(axis: Axis) -> Axis:
    return replace(axis, nodes=min(axis.nodes, 21))


def _edges(problem: Problem) -> bool:
    return any("stop" in (axis.below, axis.above) for axis in problem.axes)


def _try(problems: list[str], what: str, run: Callable[[], None]) -> None:
    try:
        run()
    except Exception as error:  # a finding, of any type
        text = _readable(error)
        problems.append(text if text.startswith(what) else f"{what}: {text}")


def _readable(error: Exception) -> str:
    """Message and remedy for an error of a user's callback, one line."""
    text = next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)
    if isinstance(error, AttributeError) and hasattr(error.obj, "_fields"):
        fields = ", ".join(error.obj._fields) or "none"
        return f"{type(error.obj).__name__.lower()} has no field {error.name!r}; its fields are {fields}"
    if type(error).__module__.startswith("numba."):
        return f"step does not compile; pass compiled=False, or write it with what numba knows ({text})"
    if "truth value of an array" in text:
        return (
            "callbacks must be written elementwise: "
            "operators and numpy functions such as np.where, no if, and, or, min, max"
        )
    return text


def _stop(problem: Problem, grid: Grid) -> None:
    charge = StopCharges(problem, grid).at(0, 0.0)
    if np.any(np.isnan(charge)):
        raise ValueError("its charge must be a number everywhere ($); got NaN")
    if np.any(charge == -np.inf):
        raise ValueError("its charge must be > -inf ($)")


def _move(problem: Problem, grid: Grid, k: int, notes: list[str]) -> None:
    """Evaluate one move into the value-to-go 0 and test the result."""
    alone = replace(problem, moves=(problem.moves[k],))
    last = problem.stages.count if isinstance(problem.stages, Stages) else None
    bundles = Bundles(alone, grid)
    zero = np.zeros((len(problem.modes), grid.size))
    for _, found in bundles.best(zero, np.zeros(len(problem.modes)), 0 if last is not None else None, 10**9):
        if np.any(np.isnan(found.q)):
            raise ValueError("its charge or transition must give numbers; got NaN")
        if np.all(np.isinf(found.q)):
            notes.append(
                f"move {problem.moves[k].name!r} is not allowed "
                f"at any of {found.q.size} places tried (s.mode is a number)"
            )
    if isinstance(problem.moves[k].to, Sampled) and _compiles(Menu(alone, grid, 0)):
        _agree(Menu(alone, grid, 0))


def _steps(problem: Problem, k: int) -> bool:
    """Whether the step of a move compiles; True if it does not run, which is another finding."""
    try:
        return _compiles(Menu(problem, Grid.of(problem), k))
    except Exception:  # reported already
        return True


def _compiles(menu: Menu) -> bool:
    """Whether a sampled step compiles; an error if the move requires it."""
    from numba.core.errors import NumbaError

    move = menu.move.to
    assert isinstance(move, Sampled)
    if move.compiled is False:
        return False
    try:
        _agreement(menu, 1)
    except NumbaError:
        if move.compiled:
            raise
        return False
    return True


def _agree(menu: Menu) -> None:
    """Compare the compiled step with numpy on eight random points."""
    for s, c, e, numpy_says, kernel_says in _agreement(menu, 8):
        if not np.allclose(numpy_says, kernel_says, rtol=1e-12, atol=1e-12, equal_nan=True):
            raise ValueError(
                "step must give the same in numpy and compiled; "
                f"got {numpy_says} and {kernel_says} at {s}, {c}, {e}"
            )


def _agreement(menu: Menu, points: int) -> list[Any]:
    """State, control, noise, and the next states by numpy and compiled code, at random points."""
    from sdpgrind.sdp._transitions.step_kernels import compiled_step

    move = menu.move.to
    assert isinstance(move, Sampled)
    found = []
    rng = np.random.default_rng(0)
    noise, _ = move.quadrature()
    compiled = compiled_step(menu)
    for _ in range(points):
        point = [float(rng.uniform(axis.low, axis.high)) for axis in menu.grid.axes]
        choice, level = int(rng.integers(menu.move.choices)), float(rng.choice(menu.levels))
        s = menu.state(
            point,
            int(rng.integers(len(menu.problem.modes))) if len(menu.problem.modes) > 1 else None,
            menu.problem.step,
        )
        c = menu.controls(np.array(choice), np.array(level))
        c = type(c)(*(float(x) for x in c))
        e = record("E", tuple(noise))(**{name: float(rng.choice(x)) for name, x in noise.items()})
        found.append((s, c, e, move.step(s, c, e), compiled(s, c, e)))
    return found


def _notes(problem: Problem, small: Problem) -> list[str]:
    notes = []
    for k, move in enumerate(problem.moves):
        if isinstance(move.to, Sampled) and move.to.compiled is None and not _steps(small, k):
            notes.append(
                f"move {move.name!r}: step does not compile: "
                "fine while its table is small enough to be kept, else numpy evaluates it in every stage"
            )
        for name, callback in _callbacks(move):
            try:
                pickle.dumps(callback)
            except Exception:  # pickle raises errors of any type
                notes.append(
                    f"move {move.name!r}: {name} does not pickle (a lambda or closure?): "
                    "fine here and on threads, not on executors of processes"
                )
    return notes


def _callbacks(move: Move) -> list[tuple[str, Any]]:
    named = [("charge", move.charge), ("allowed", move.allowed)]
    named += [
        (name, getattr(move.to, name))
        for name in ("law", "others", "step", "charge")
        if hasattr(move.to, name)
    ]
    return [(name, callback) for name, callback in named if callable(callback)]
