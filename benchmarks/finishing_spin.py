"""Turns of a tool about its own axis: ``python benchmarks/finishing_spin.py [--times N]``. Medians, CPU s.

A sphere of 25 mm by a zigzag of 4 mm, a UR10 with a face-on tool of 150 mm, straight along the last axis or tilted by 0.5
rad. Rivals: the best of 24 turns that is held, the best of 24 azimuths that is held, and a sweep in numpy, a pose at a time.
"""

import argparse
import math

import numpy as np
from measure import median

from sdpgrind import finishing
from sdpgrind.finishing._problem.joint_runs import posture_of, samples_of
from sdpgrind.finishing._problem.placed import placed
from sdpgrind.finishing.arm._branches import travel_of
from sdpgrind.finishing.arm._spin_choice import stations
from sdpgrind.finishing.arm._spin_states import SpinStates, spins_of, states_of
from sdpgrind.finishing.arm._spin_sweep import FAR, kept_of, swept

PLACE = (650.0, -25.0, 100.0)  # mm
COUNT = 24
LESS, SLOWER = 0.04, 0.01  # bars: travel under the best turn that is held; 24 values against 96


def problem(tilt: float, **changes: object) -> finishing.FinishingProblem:
    robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0, tilt=tilt))
    path = finishing.zigzag(finishing.surface.sphere_surface(25.0), pitch=4.0)
    fields = {"contact_angle": math.pi / 2, "placement": PLACE, "spin": COUNT} | changes
    return finishing.FinishingProblem(path, robot=robot, **fields)


def travel(of: finishing.FinishingProblem) -> float:
    """Travel of the slowest joint at full speed along the path, s; inf where there is none."""
    try:
        joints = posture_of(of, samples_of(of.path))[0].joints
    except ValueError:
        return math.inf
    return travel_of(of.robot, joints)[0]


def batched(states: SpinStates, poses: np.ndarray) -> float:
    """Least travel by numpy: all pairs of candidates of a group at once, a pose after another; no limits."""
    joints = states.joints(poses)
    kept = kept_of(states.robot, joints)
    speed = np.array(states.robot.speed_max)
    cost = np.where(kept[0], 0.0, np.inf)
    for before, after, may in zip(joints[:-1], joints[1:], kept[1:], strict=True):
        way = after[:, None] - before[:, :, None]
        way = np.abs(way - 2 * np.pi * np.round(way / (2 * np.pi)))
        time = np.where((way <= FAR).all(axis=-1), (way / speed).max(axis=-1), np.inf)
        cost = np.where(may, (cost[:, :, None] + time).min(axis=1), np.inf)
    return float(np.nanmin(cost))


def travels(tilt: float) -> None:
    of = problem(tilt)
    turns = [travel(of.replace(spin=(angle,))) for angle in spins_of(COUNT).angles]
    azimuths = [travel(of.replace(spin=(), azimuth=angle)) for angle in spins_of(COUNT).angles]
    free = travel(of)
    held = 1 - free / min(turns) >= LESS
    print(f"\n## Travel, tool tilted by {tilt:g} rad\n| way | s | under the best turn |\n|---|---|---|")
    print(
        f"| best turn of {COUNT} | {min(turns):.4f} | |\n| best azimuth of {COUNT} | {min(azimuths):.4f} | |"
    )
    print(f"| turning | {free:.4f} | {100 * (1 - free / min(turns)):.1f} % >= 4: {'yes' if held else 'NO'} |")


def laws(tilt: float, feed: float) -> None:
    of = problem(tilt, feed_rate=feed)
    found = {
        n: finishing.plan(of.replace(spin=n), method="min_time").duration for n in ((0.0,), COUNT, 4 * COUNT)
    }
    held, few, many = found.values()
    kept = "yes" if few <= (1 + SLOWER) * many else "NO"
    print(
        f"| {tilt:g} | {feed:g} | {held:.3f} | {few:.3f} | {many:.3f} | {100 * (few / many - 1):.2f} %: {kept} |"
    )


def times(count: int) -> None:
    of = problem(0.0)
    samples = samples_of(of.path)
    poses = placed(of.tool_poses(samples), of.placement)
    chosen = poses[stations(poses, samples.length)]
    spread = poses[np.linspace(0, len(poses) - 1, 539).astype(int)]
    states = states_of(of.robot, spins_of(COUNT))
    print(f"\n## Times, {COUNT} x 8 candidates a pose\n| what | poses | s |\n|---|---|---|")
    inverse = median(lambda: states.joints(spread), count)
    both = median(lambda: swept(states, spread), count)
    print(
        f"| inverse | {len(spread)} | {inverse:.3f} |\n| inverse, singular sets, sweep | {len(spread)} | {both:.3f} |"
    )
    joints = states.joints(spread)
    checks = median(lambda: kept_of(of.robot, joints), count)
    print(f"| sweep alone, by difference | {len(spread)} | {both - inverse - checks:.3f} |")
    print(f"| the same in numpy | {len(spread)} | {median(lambda: batched(states, spread), 1):.3f} |")
    print(f"| as planned | {len(chosen)} | {median(lambda: posture_of(of, samples), count):.3f} |")
    print(
        f"\nLeast travel of both sweeps: {swept(states, spread).time:.6f} and {batched(states, spread):.6f} s."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=5)
    given = parser.parse_args()
    for tilt in (0.0, 0.5):
        travels(tilt)
    print(
        f"\n## Laws of limited jerk, s\n| tilt | feed | one turn | {COUNT} | {4 * COUNT} | slower |\n|---|---|---|---|---|---|"
    )
    for tilt in (0.0, 0.5):
        for feed in (25.0, 200.0):
            laws(tilt, feed)
    times(given.times)


if __name__ == "__main__":
    main()
