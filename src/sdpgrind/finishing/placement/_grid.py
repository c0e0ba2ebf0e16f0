"""Coarse grid of placements: origins over the box or the reach, turns about z, azimuths of the tool."""

import math
from itertools import product

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.placement._azimuths import ranges
from sdpgrind.finishing.placement._reach import reach_of
from sdpgrind.finishing.placement._table import wrist_heights, wrist_travels
from sdpgrind.finishing.placement._task import PlacingTask
from sdpgrind.finishing.placement._worth import PlacementRows, Sides, rated, stations

STEP = 50.0  # mm, chosen (spec): distance of the origins of the grid
TURNS = 8  # chosen (spec): turns of the work, and azimuths of the tool
# chosen: origins of a grid, whose step is wider where there would be more; of a robot of a kind that is not
# known, whose singular poses cost some 0.1 ms a branch
ORIGINS_MAX, FEW_ORIGINS = 4000, 125
STAGES = (2, 8)  # chosen: poses on which placements are tried before all: most fall at the first two
KEPT = 4000  # chosen: placements that are rated by all poses
GUESSES = 256  # chosen: joints whose poses tell the reach of a robot of a kind that is not known
FREE: Sides = ((-math.inf, math.inf),) * 3


def grid(task: PlacingTask, sides: Sides, azimuth: float) -> PlacementRows:
    """Return the placements that are compared; `azimuth`: one of the azimuths in the base, rad."""
    turns = 2 * math.pi * np.arange(TURNS) / TURNS
    azimuths = azimuth + turns if task.turns_freely else np.array([azimuth])
    rows = []
    for turn, base in product(turns.tolist(), azimuths.tolist()):
        origin = _origins(task, sides, turn)
        rows.append(
            PlacementRows(origin, np.full(len(origin), turn), np.full(len(origin), on_work(base, turn)))
        )
    return PlacementRows(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


def on_work(azimuth: float, turn: float) -> float:
    """Azimuth on the work, rad, of an azimuth in the base: a dragged tool points against its heading."""
    return (azimuth + math.pi - turn) % (2 * math.pi)


def in_base(azimuth: float, turn: float) -> float:
    """Azimuth in the base, rad, in (-pi, pi], of one on the work."""
    return math.pi - (-(azimuth - math.pi + turn) + math.pi) % (2 * math.pi)


def above_base(task: PlacingTask) -> Sides:
    """Sides of origins with no contact below the base of a robot that stands upright; of others `FREE`."""
    reach = None if isinstance(task.robot, Arm) else reach_of(task.robot)
    if reach is None or not reach.upright:
        return FREE
    return *FREE[:2], (-float(task.point[:, 2].min()), math.inf)


def _origins(task: PlacingTask, sides: Sides, turn: float) -> Floats:
    """Origins (k, 3) at a turn of the work, mm."""
    robot = task.robot
    if isinstance(robot, Arm):
        heights = _line(*_heights(robot, task, sides[2]))
        return np.column_stack([np.zeros((len(heights), 2)), heights])
    reach = reach_of(robot)
    if np.isfinite(sides).all():
        known = reach is not None or isinstance(robot, MountedRobot)
        most = ORIGINS_MAX // stations(robot) if known else FEW_ORIGINS
        return _mesh([_line(*side) for side in sides], most)
    centre = task.point.mean(axis=0)
    c, s = math.cos(turn), math.sin(turn)
    centre = np.array([c * centre[0] - s * centre[1], s * centre[0] + c * centre[1], centre[2]])
    if reach is None or not reach.upright:
        guessed: Floats = _mesh([_line(*side) for side in _guessed(robot)], FEW_ORIGINS) - centre
        return guessed
    ahead = _line(0.0, reach.distance)
    lowest = sides[2][0] + float(centre[2] - reach.foot[2])
    up = _line(float(np.clip(lowest, -reach.distance, reach.distance)), reach.distance)
    out: Floats = _mesh([ahead, np.zeros(1), up], ORIGINS_MAX) + reach.foot - centre
    return out


def _heights(arm: Arm, task: PlacingTask, side: tuple[float, float]) -> tuple[float, float]:
    """Heights of the origin at which the wrist gets to some contact, within the box, mm."""
    wrist = np.concatenate([wrist_heights(arm, task, over.middle())[0] for over in ranges(task)])
    longest = arm.a2 + arm.a3
    travels = np.clip(wrist_travels(arm), -longest, longest)
    low = arm.d1 + min(travel[0] for travel in travels) - float(wrist.max())
    high = arm.d1 + max(travel[1] for travel in travels) - float(wrist.min())
    return float(np.clip(low, *side)), float(np.clip(high, *side))


def _guessed(robot: Robot) -> Sides:
    """Box of the tool at joints spread over their ranges, mm."""
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    ratio = 2.0 ** (1 / (1 + np.arange(len(low))))  # chosen: irrational steps, no two in step
    share = np.mod(np.outer(np.arange(1, GUESSES + 1), ratio), 1.0)
    places = robot.forward_work(low + share * (high - low))[:, :3, 3]
    x, y, z = zip(places.min(axis=0).tolist(), places.max(axis=0).tolist(), strict=True)
    return x, y, z


def _line(low: float, high: float) -> Floats:
    """Places at most a step apart from end to end, mm."""
    return np.linspace(low, high, max(1, math.ceil((high - low) / STEP - 1e-9)) + (high > low))


def _mesh(lines: list[Floats], count: int) -> Floats:
    """All combinations of places along x, y, z, (k, 3), of fewer places where they are more than a count."""
    while math.prod(map(len, lines)) > count:
        most = max(range(3), key=lambda k: len(lines[k]))
        lines[most] = np.linspace(lines[most][0], lines[most][-1], len(lines[most]) - 1)
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def sifted(
    task: PlacingTask, rows: PlacementRows, sides: Sides, progress: Progress
) -> tuple[PlacementRows, Floats]:
    """Return the best placement of every pair of turn and azimuth with its worth, the best first.

    The worth on some poses is at least that on all. Where no placement has a worth above 0 on the first, the
    nearest to it go on.
    """
    for stage, count in enumerate(STAGES):
        few = task.at(np.arange(min(count, len(task.point))))
        rows = _kept(rows, _by_parts(few, rows, sides, progress, stage))
    worth = _by_parts(task, rows, sides, progress, len(STAGES))
    pair = np.round(np.column_stack([rows.turn, rows.azimuth]), 9)
    order = np.argsort(-worth, kind="stable")
    first = np.unique(pair[order], axis=0, return_index=True)[1]
    best = order[np.sort(first)]
    return rows.take(best), worth[best]


def _kept(rows: PlacementRows, worth: Floats) -> PlacementRows:
    """Placements above 0, or the nearest to it; at most `KEPT`."""
    order = np.argsort(-worth, kind="stable")[:KEPT]
    above = order[worth[order] > 0]
    return rows.take(np.sort(above if len(above) else order))


def _by_parts(task: PlacingTask, rows: PlacementRows, sides: Sides, progress: Progress, stage: int) -> Floats:
    """Worth of placements, with progress."""
    worth = np.empty(len(rows.turn))
    many = max(1, 200_000 // len(task.point))
    for begin in range(0, len(worth), many):
        done = (stage + begin / len(worth)) / (len(STAGES) + 1)
        progress(done, f"{len(worth)} placements on {len(task.point)} poses")
        part = slice(begin, begin + many)
        worth[part] = rated(task, rows.take(np.arange(len(worth))[part]), sides).worth
    return worth
