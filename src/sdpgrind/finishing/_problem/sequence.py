"""Sequence of the pieces of one path, or of several patches, for the least travel in the air."""

from collections.abc import Iterator, Sequence
from typing import Any

from sdpgrind.base import checks
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing._problem.travel_times import travel_times
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._order import as_given, best_order, cost_of
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._sequenced_path import SequencedPath, travels

AnyPath = Path | LiftedPath | SequencedPath


def sequence(
    paths: AnyPath | Sequence[AnyPath],
    *,
    lift: Lift | None = None,
    robot: Robot | None = None,
    **held: Any,
) -> SequencedPath:
    """Put the pieces of one path, or of paths on several patches, in the sequence of the least travel in air.

    Order and direction of every piece are free, so are start and end, and pieces of a patch need not follow
    one another. Counted are the straight moves between pieces, at the height of the lifts: their lengths, or
    the times that a robot needs for them. What comes down to a piece and leaves it is the same in every
    sequence.

    **Up to 12 pieces the sequence is exact**, by dynamic programming over subsets. Beyond, the sequence as
    given and those in which the nearest piece follows, from up to 64 starts, the eight shortest of them, are
    improved until no reversal of a part (2-opt) and no part of up to three pieces elsewhere (Or-opt) makes
    them shorter: never longer than as given. A sequence as given that is as good stays. **Collisions are not
    looked at**: between patches a straight move may lead through the part; ``least_clearance`` of the path
    tells how near it comes to the work.

    Parameters
    ----------
    paths : Path, LiftedPath or SequencedPath, or a list of them
        Paths whose pieces are put in sequence; those of a `SequencedPath` as they were given. All lie in one
        frame.
    lift : Lift, optional
        The lifts, mm. Default: that of the paths, `Lift` where they have none.
    robot : Robot, optional
        Robot whose times count. Between two pieces it needs at least that of the slowest from rest to rest:
        the contact at the feed of the air, or a joint within its speed and acceleration. It has one branch
        for all pieces, as in `plan`, so that no move changes it. Where the tool follows the feed
        (``heading="feed_aligned"``) its pose at the end of a piece depends on where it goes on, so times are
        near ones, and no sequence is `exact`. Default: lengths count.
    **held
        Fields of `FinishingProblem` with a robot, such as `placement` (mm, rad) and `contact_angle` (rad),
        without `spin`.

    Returns
    -------
    SequencedPath
        The path, ready for a `FinishingProblem`; it tells what is saved: `travel` and `travel_given`, mm, and
        with a robot `times`, s.

    Raises
    ------
    ValueError
        When lifts of the paths differ and none is given, the robot does not reach the work or axes carry it
        (`mounted`), or fields are held without a robot.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> flat = fin.surface.flat_surface(50.0)
    >>> rows = [fin.Path(flat, [(0.1, b), (0.9, b)]) for b in (0.5, 0.1, 0.9)]
    >>> path = fin.sequence(rows, lift=fin.Lift(radius=5.0))
    >>> path.order, path.backwards
    ((1, 0, 2), (False, True, False))
    >>> round(path.travel, 6), round(path.travel_given, 6)  # mm: 2 times 20; all from left to right
    (40.0, 117.88289)
    """
    found = tuple(_flat(paths))
    how = _lift(paths, lift)
    given = _as_given(found, how)
    if robot is None:
        if held:
            raise checks.refuse("robot", f"given for {', '.join(held)}", None)
        table, timed, steady = travels(given.pieces, how), False, True
    else:
        if "spin" in held:
            raise checks.refuse(
                "spin", "left to plan: a sequence is found with a tool that is held", held["spin"]
            )
        if isinstance(robot, MountedRobot):
            raise ValueError(
                "robot must be one whose work rests: positions of"
                f" {', '.join(robot.axis_names)} are left to plan; give sequence the robot alone, or none"
            )
        problem = FinishingProblem(given, robot=robot, **held)
        table, timed, steady = travel_times(problem, given), True, problem.heading == "fixed"
    best = best_order(table)
    both = (as_given(len(given.order)), best.states)
    times = tuple(cost_of(table, each) for each in both) if timed else None
    exact = best.exact and steady
    return given.replace(order=best.pieces, backwards=best.backwards, exact=exact, times=times)


def _flat(paths: Any) -> Iterator[Path | LiftedPath]:
    """Paths, those of a sequence as they were given."""
    for k, each in enumerate(paths if isinstance(paths, list | tuple) else [paths]):
        if isinstance(each, SequencedPath):
            yield from each.paths
        elif isinstance(each, Path | LiftedPath):
            yield each
        else:
            raise TypeError(
                f"paths[{k}] must be a Path, LiftedPath or SequencedPath (see finishing.zigzag); got"
                f" {checks.shown(each)}"
            )


def _lift(paths: Any, lift: Lift | None) -> Lift:
    """The lift given, or that of all paths that have one."""
    if lift is not None:
        return checks.kind("lift", lift, Lift)
    every = paths if isinstance(paths, list | tuple) else [paths]
    own = {each.lift for each in every if isinstance(each, LiftedPath | SequencedPath)}
    if len(own) > 1:
        raise checks.refuse("lift", f"given: those of the paths are {len(own)} different ones", None)
    return own.pop() if own else Lift()


def _as_given(paths: tuple[Path | LiftedPath, ...], lift: Lift) -> SequencedPath:
    """The pieces in their own sequence, all forward."""
    count = sum(len(each.pieces) if isinstance(each, LiftedPath) else 1 for each in paths)
    return SequencedPath(paths, order=tuple(range(count)), backwards=(False,) * count, lift=lift)
