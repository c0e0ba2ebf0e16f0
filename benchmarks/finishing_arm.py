"""Arm and serial robots of finishing: ``python benchmarks/finishing_arm.py [--times N] [--poses N]``. Medians; peer
roboticstoolbox.
"""

import argparse
import importlib.util

import numpy as np
from measure import median

from sdpgrind import units
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._branches import choose_branches
from sdpgrind.finishing.arm._robot_presets import robot as preset
from sdpgrind.finishing.arm._serial import SerialRobot
from sdpgrind.finishing.arm._tool import tool_poses
from sdpgrind.finishing.surface._presets import nominal_surface

BAR = 2.0  # us a pose
BRANCHES_BAR = 3.0  # us a pose, all eight branches of a serial robot
NUMERIC_BAR = 100.0  # us a pose, all eight branches of a calibrated one
DEVIATIONS = np.array(
    [2e-3, 1.0, 1.0, 2e-3]
)  # of each entry of a Denavit-Hartenberg row at most: rad, mm, mm, rad
QUARTER = np.pi / 2
NOMINAL = {
    "ur10": [
        (0, 127.3, 0, QUARTER), (0, 0, -612.0, 0), (0, 0, -572.3, 0), (0, 163.941, 0, QUARTER),
        (0, 115.7, 0, -QUARTER), (0, 92.2, 0, 0),
    ],
    "irb2400": [
        (0, 615.0, 100.0, -QUARTER), (-QUARTER, 0, 705.0, 0), (0, 0, 135.0, -QUARTER), (0, 755.0, 0, QUARTER),
        (0, 0, 0, -QUARTER), (0, 85.0, 0, 0),
    ],
}  # fmt: skip
"""Denavit-Hartenberg rows (theta, d, a, alpha; rad, mm) of the presets."""
WIDE = 3000.0  # mm


def free(arm: Arm) -> Arm:
    """The same arm with all branches open."""
    turn = (np.pi,) * 5
    return arm.replace(position_min=(*(-a for a in turn), -WIDE, -WIDE), position_max=(*turn, WIDE, WIDE))


def random_poses(arm: Arm, count: int, rng: np.random.Generator) -> np.ndarray:
    """Poses of random joints whose wrist is beside the first axis at 350 mm: q2 and q3 make the radius."""
    q = rng.uniform(-1, 1, (count, 7)) * ([3.0, 0.0, 0.0, 3.0, 3.0] + [150.0] * 2)
    height = rng.uniform(-400, 400, count)
    cosine = (350.0**2 + height**2 - arm.a2**2 - arm.a3**2) / (2 * arm.a2 * arm.a3)
    q[:, 2] = -np.arccos(cosine)
    q[:, 1] = np.arctan2(height, 350.0) - np.arctan2(arm.a3 * np.sin(q[:, 2]), arm.a2 + arm.a3 * cosine)
    return arm.forward_work(q)


def zigzag(count: int) -> np.ndarray:
    """Tool poses along lines over the nominal surface, as one smooth path there and back."""
    surface, angle = nominal_surface(), np.linspace(0, 16 * np.pi, count)
    u, v = 0.5 - 0.48 * np.cos(angle), 0.02 + 0.96 * angle / angle[-1]
    at = surface.derivatives(u, v)
    du, dv = 0.48 * np.sin(angle), np.full(count, 0.96 / angle[-1])
    feed, normal = du[:, None] * at.u + dv[:, None] * at.v, np.cross(at.u, at.v)
    feed, normal = (each / np.linalg.norm(each, axis=1)[:, None] for each in (feed, normal))
    poses = tool_poses(at.point, feed, normal, contact_angle=units.deg(30), lever_arm=95.0, azimuth=np.pi)
    poses[:, :3, 3] += [490.0, -20.0, 100.0]
    return poses


def told(what: str, took: float, count: int, bar: float | None = None) -> None:
    each = 1e6 * took / count
    held = "" if bar is None else f"<= {bar:g}: {'yes' if each <= bar else 'NO'}"
    print(f"| {what} | {1e3 * took:.2f} | {each:.3f} | {held} |")


def kinematics(times: int, count: int) -> None:
    arm, rng = free(Arm.generic()), np.random.default_rng(0)
    poses = random_poses(arm, count, rng)
    joints = arm.inverse(poses, continuous=False)
    print(f"\n## {count} random poses\n| what | ms | us a pose | bar |\n|---|---|---|---|")
    for branch in range(4):
        took = median(lambda b=branch: arm.inverse(poses, branch=b, continuous=False), times)
        told(f"inverse, branch {branch}", took, count, BAR)
    told("inverse, as one path, unwrapped", median(lambda: arm.branches(poses), times) / 4, count, BAR)
    told("all four branches", median(lambda: arm.branches(poses, continuous=False), times), count)
    told("forward", median(lambda: arm.forward(joints), times), count)
    told("Jacobian", median(lambda: arm.jacobian(joints), times), count)
    off = [arm.forward_work(each) - poses for each in arm.branches(poses, continuous=False)[0]]
    print(
        f"\nForward of inverse: {np.abs(off)[..., :3, 3].max():.1e} mm, {np.abs(off)[..., :3, :3].max():.1e}."
    )
    low, high = arm.position_min, arm.position_max
    some = [(poses[k], np.clip(joints[k] + 0.05 * rng.normal(size=7), low, high)) for k in range(50)]
    told(
        "damped least squares from 3 deg off",
        median(lambda: [arm.solve(*each) for each in some], max(times // 4, 3)),
        50,
    )
    peer(arm, poses[:20], times)


def peer(arm: Arm, poses: np.ndarray, times: int) -> None:
    """The same arm, without its table, by Levenberg and Marquardt."""
    if importlib.util.find_spec("roboticstoolbox") is None:
        print("\nroboticstoolbox is not installed.")
        return
    import roboticstoolbox as rtb

    links = [
        (arm.d1, 0, np.pi / 2, 0),
        (0, arm.a2, 0, 0),
        (0, arm.a3, 0, 0),
        (0, 0, np.pi / 2, np.pi / 2),
        (arm.d5, 0, 0, 0),
    ]
    robot = rtb.DHRobot(
        [rtb.RevoluteDH(d=d, a=a, alpha=alpha, offset=offset) for d, a, alpha, offset in links]
    )
    reached = [robot.fkine(q[:5]) for q in arm.inverse(poses, continuous=False)]
    told(
        "roboticstoolbox ikine_LM",
        median(lambda: [robot.ikine_LM(pose) for pose in reached], max(times // 4, 3)),
        len(poses),
    )


def serial(times: int, count: int) -> None:
    """All eight branches of random poses: time, own joints among them, poses reached."""
    for name in ("ur10", "irb2400"):
        robot, rng = preset(name), np.random.default_rng(0)
        low, high = np.maximum(robot.position_min, -np.pi), np.minimum(robot.position_max, np.pi)
        joints = rng.uniform(low, high, (count, 6))
        poses = robot.forward(joints)
        found = robot.solutions(poses)
        print(f"\n## {name}, {count} random poses\n| what | ms | us a pose | bar |\n|---|---|---|---|")
        told(
            "inverse, all eight branches",
            median(lambda r=robot, p=poses: r.solutions(p), times),
            count,
            BRANCHES_BAR,
        )
        told("forward", median(lambda r=robot, q=joints: r.forward(q), times), count)
        told("Jacobian", median(lambda r=robot, q=joints: r.jacobian(q), times), count)
        there = ~np.isnan(found[..., 0])
        reached = robot.forward(found[there]) - np.broadcast_to(poses[:, None], (*there.shape, 4, 4))[there]
        apart = np.abs(np.mod(found - joints[:, None] + np.pi, 2 * np.pi) - np.pi).max(axis=2)
        far = np.min(list(robot.singularities(joints).values()), axis=0) > 1e-3
        print(
            f"\nForward of inverse: {np.linalg.norm(reached[:, :3, 3], axis=1).max():.1e} mm; own joints"
            f" {np.nanmin(apart, axis=1)[far].max():.1e} rad where 1e-3 away from singular poses;"
            f" {there.mean() * 8:.2f} solutions a pose."
        )


def calibrated(times: int, count: int) -> None:
    """All branches of calibrated robots: poses of joints whose sines are 0.05 away from singular sets."""
    limits = {"position_min": [-3.2] * 6, "position_max": [3.2] * 6, "speed_max": [3.0] * 6}
    for name, rows in NOMINAL.items():
        rng = np.random.default_rng(0)
        made = [np.array(rows), np.array(rows) + rng.uniform(-1, 1, (6, 4)) * DEVIATIONS]
        nominal, robot = (SerialRobot.from_dh(each, **limits, acceleration_max=[10.0] * 6) for each in made)
        joints = rng.uniform(-np.pi, np.pi, (4 * count, 6))
        joints = joints[np.min(list(nominal.singularities(joints).values()), axis=0) > np.sin(0.05)][:count]
        poses = robot.forward(joints)
        found = robot.solutions(poses)
        print(
            f"\n## {name}, calibrated, {count} random poses\n| what | ms | us a pose | bar |\n|---|---|---|---|"
        )
        took = median(lambda r=robot, p=poses: r.solutions(p), times)
        told("inverse, all eight branches, numeric", took, count, NUMERIC_BAR)
        there, expected = ~np.isnan(found[..., 0]), nominal.solutions(poses)
        asked = ~np.isnan(expected[..., 0])
        asked[asked] = np.min(list(nominal.singularities(expected[asked]).values()), axis=0) > np.sin(0.05)
        reached = robot.forward(found[there]) - np.broadcast_to(poses[:, None], (*there.shape, 4, 4))[there]
        apart = np.abs(np.mod(found - joints[:, None] + np.pi, 2 * np.pi) - np.pi).max(axis=2)
        print(
            f"\nForward of inverse: {np.linalg.norm(reached[:, :3, 3], axis=1).max():.1e} mm; own joints"
            f" {np.nanmin(apart, axis=1).max():.1e} rad; of {asked.sum()} branches of the nominal robot"
            f" {(asked & ~there).sum()} are beyond this one's reach or lost."
        )


def choices(times: int) -> None:
    print("\n## Branches and wrist radii on a path\n| runs | poses | pairs | ms |\n|---|---|---|---|")
    arm = Arm.generic()
    for runs, count, radii in ((1, 65536, 1), (1, 65536, 9), (64, 8192, 9), (1000, 16000, 3)):
        cut = np.array_split(zigzag(count), runs)
        choice = np.linspace(320, 380, radii) if radii > 1 else 350.0
        took = median(lambda c=cut, r=choice: choose_branches(arm, c, wrist_radii=r), max(times // 4, 3))
        print(f"| {runs} | {count} | {4 * radii} | {1e3 * took:.0f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=21)
    parser.add_argument("--poses", type=int, default=65536)
    given = parser.parse_args()
    kinematics(given.times, given.poses)
    serial(given.times, given.poses)
    calibrated(given.times, min(given.poses, 10_000))
    choices(given.times)


if __name__ == "__main__":
    main()
