"""Search a placement of the work for a robot, or prove that there is none."""

import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.progress import Progress, ProgressOption, portion, reporting
from sdpgrind.finishing._problem.joint_runs import PostureError, check_ends, posture_of, samples_of
from sdpgrind.finishing._problem.problem import FinishingProblem, check_outside
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._spin_states import spins_of
from sdpgrind.finishing.placement._carried import compared
from sdpgrind.finishing.placement._grid import FREE, above_base, grid, in_base, on_work, sifted
from sdpgrind.finishing.placement._placement import Placement
from sdpgrind.finishing.placement._proof import Proof
from sdpgrind.finishing.placement._proofs import proof_of
from sdpgrind.finishing.placement._refine import refined
from sdpgrind.finishing.placement._task import PlacingTask, ToolHold, spread, task_of
from sdpgrind.finishing.placement._worth import PlacementRows, Sides, rated

SPINS = 8  # chosen: turns of the tool that are compared; `plan` takes all of them
REFINED = 20  # chosen (spec): placements of the grid that are refined
GRID_SHARE, REFINED_SHARE = 0.5, 0.9  # chosen: portions of progress at the ends of these stages


@reporting
def place(
    problem: FinishingProblem,
    *,
    box: npt.ArrayLike | None = None,
    progress: ProgressOption = None,
) -> Placement:
    """Search a placement of the work, with a turn about z and an azimuth of the tool, or prove there is none.

    Compared are origins on a grid of 50 mm, 8 turns of the work and, with a fixed heading, 8 azimuths of the
    tool, by their least margin at 30 poses spread over the path. The best of each pair of turn and azimuth is
    refined, 20 of them at most. The placement is the first by rank that takes the robot along the whole path.
    Time laws are left to `plan`. **Collisions are not looked at.**

    Where axes carry the work (`mounted`) they stay where they are, and searched is how the work lies on them,
    in the box that they offer: its origin in the base with the axes at zero, its turn about z, the azimuth.
    At each pose the axes take the best of some of their candidates.

    A proof is a necessary condition that fails for every origin, turn and azimuth, with its numbers: travel
    of a table or of the wrist ("span", "height"), distance from the first axis ("reach"). With axes under the
    work "reach" alone is looked at, for all that they travel, and only where turntables are upright. Where
    there is neither a proof nor a placement, the answer is "not found", not "impossible".

    Parameters
    ----------
    problem : FinishingProblem
        Path, robot and tool; its placement is not used, its azimuth (rad) is one of those compared.
    box : array_like (2, 3), optional
        Two opposite corners, mm, the lesser first, between which the origin of the surface may lie in the
        base; equal coordinates hold it. Default: wherever the robot reaches, for robots with an upright first
        axis straight ahead of it (their first joint turns the work around), and below z = 0 of the base only
        if nothing is found above. Needed where axes carry the work.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Placement
        The problem ready to plan (mm, rad), a proof, or the best try.

    Raises
    ------
    ValueError
        When the box is not two corners (mm) or missing, or a heading "feed_aligned" meets sharp corners of
        the path.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> path = finishing.zigzag(finishing.surface.flat_surface(500.0), pitch=50.0)
    >>> problem = finishing.FinishingProblem(path)
    >>> proof = finishing.place(problem).proof
    >>> proof.condition, round(proof.needed), round(proof.available), proof.unit
    ('span', 450, 400, 'mm')
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, FinishingProblem, " (see finishing.preset)")
    if isinstance(problem.robot, MountedRobot) and box is None:
        raise ValueError(
            "box must be given where axes carry the work: the corners between which its origin may lie on"
            f" them (mm), with {', '.join(problem.robot.axis_names)} at zero; got None"
        )
    sides = _sides(box)
    if box is not None:
        check_outside("box", box, problem)
    progress(0.0, "conditions that every placement must fulfil")
    _refuse_corners(problem)
    task = placing_task(problem)
    proof = proof_of(task, sides)
    if proof is not None:
        return Placement(False, None, proof, None, math.nan)
    above = above_base(task)
    if sides != FREE or above == FREE:
        return _searched(problem, task, sides, progress)
    found = _searched(problem, task, above, progress)
    return found if found.found else _searched(problem, task, FREE, progress)


def _refuse_corners(problem: FinishingProblem) -> None:
    """Raise where a tool along the feed would turn at a sharp corner, wherever the work is."""
    if problem.heading == "feed_aligned":
        with suppress(PostureError):
            posture_of(problem.replace(placement=(0.0, 0.0, 0.0)), problem.path.sample(per_leg=1))


def placing_task(problem: FinishingProblem) -> PlacingTask:
    """Return contacts at the nodes of the path, tool and robot; of axes under the work some candidates."""
    hold = ToolHold(
        problem.contact_angle, problem.lever_arm, problem.heading, problem.pushed, _spins(problem)
    )
    return task_of(compared(problem.robot), problem.path.sample(per_leg=1), hold)


def _spins(problem: FinishingProblem) -> tuple[float, ...]:
    """Turns of the tool about its own axis that are compared, rad."""
    angles = spins_of(problem.spin).angles.tolist()
    return tuple(angles[:: math.ceil(len(angles) / SPINS) or 1])


def quick_proof(problem: FinishingProblem) -> Proof | None:
    """Return a proof that no placement of a problem exists, or None; without a search."""
    return proof_of(placing_task(problem), FREE)


def _sides(box: Any) -> Sides:
    if box is None:
        return FREE
    corners = checks.finite_array("box", box, "mm")
    if corners.shape != (2, 3):
        raise checks.refuse("box", "two corners, (2, 3)", corners.shape, "mm")
    if not (corners[0] <= corners[1]).all():
        raise checks.refuse("box", "two corners, none of the first above those of the second", box, "mm")
    x, y, z = zip(*corners.tolist(), strict=True)
    return x, y, z


def _searched(problem: FinishingProblem, task: PlacingTask, sides: Sides, progress: Progress) -> Placement:
    few = task.at(spread(task))
    rows, worth = sifted(few, grid(few, sides, problem.azimuth), sides, portion(progress, 0.0, GRID_SHARE))
    tries = sorted(
        _refined(few, rows, worth, sides, portion(progress, GRID_SHARE, REFINED_SHARE)),
        key=lambda each: -each[1],
    )
    nearest = None
    samples = samples_of(problem.path)
    for k, (row, value) in enumerate(tries):
        progress(REFINED_SHARE + (1 - REFINED_SHARE) * k / len(tries), "the whole path")
        placed = _placed(problem, rated_on_path(task, row, sides))
        why = stopped(placed, samples)
        if not why:
            return Placement(True, placed, None, placed, value)
        nearest = nearest or Placement(False, None, None, placed, value, why)
    assert nearest is not None
    return nearest


def _refined(
    few: PlacingTask, rows: PlacementRows, worth: Any, sides: Sides, progress: Progress
) -> Iterator[tuple[PlacementRows, float]]:
    """Placements and their worths: the best of the grid refined, the others as they are."""
    for k in range(len(worth)):
        one = rows.take([k])
        if k >= REFINED:
            yield one, float(worth[k])
            continue
        progress(k / min(REFINED, len(worth)), f"refining placement {k + 1}")
        yield refined(few, one, sides)


def rated_on_path(task: PlacingTask, row: PlacementRows, sides: Sides) -> PlacementRows:
    """Return the placement with the table in the middle of what the whole path needs."""
    return row._replace(origin=rated(task, row, sides).origin)


def worth_of(problem: FinishingProblem) -> float:
    """Return the least margin of the joints at 30 poses of the path, unit 1, where a problem is placed."""
    assert problem.placement is not None
    x, y, z, *turn = problem.placement
    angle = turn[0] if turn else 0.0
    task = placing_task(problem)._replace(robot=problem.robot)
    azimuth = on_work(problem.azimuth, angle)
    row = PlacementRows(np.array([[x, y, z]]), np.array([angle]), np.array([azimuth]))
    there = ((x, x), (y, y), (z, z))  # a table stays where it is
    return float(rated(task.at(spread(task)), row, there).worth[0])


def _placed(problem: FinishingProblem, row: PlacementRows) -> FinishingProblem:
    turn = math.remainder(float(row.turn[0]), 2 * math.pi)
    place = (*row.origin[0].tolist(), turn)
    azimuth = in_base(float(row.azimuth[0]), float(row.turn[0]))
    fixed = problem.heading == "fixed"
    return problem.replace(placement=place, azimuth=azimuth if fixed else problem.azimuth)


def stopped(problem: FinishingProblem, samples: Any) -> str:
    """Return what stops a placed problem on its path: the sentence of the planner; empty: nothing does."""
    try:
        check_ends(problem)
        posture_of(problem, samples)
    except ValueError as error:
        return str(error)
    return ""
