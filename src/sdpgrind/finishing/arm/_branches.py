"""Choice of branch, and of wrist radius, for the runs of a path, by dynamic programming."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm import _kinematics_kernels as kernels
from sdpgrind.finishing.arm._inverse import BRANCHES, Excess, checked_runs, excess, joints_of
from sdpgrind.finishing.arm._robot import Robot, angular

if TYPE_CHECKING:
    from sdpgrind.finishing.arm._arm import Arm

# rad, chosen: greatest turn between neighbouring poses; with more the arm leaves the path between them
TURN = 1.0


class TurnError(ValueError):
    """No branch is within limits, one because of a turn between neighbouring poses: closer ones may do."""


class ArmChoice(NamedTuple):
    """Branch, wrist radius and joints of the arm on one run.

    Attributes
    ----------
    branch : int
        Branch 0 to 3, see `Arm.inverse`.
    wrist_radius : float
        Distance of the wrist from the first axis, mm.
    joints : array (m, 7)
        Joints, rad, and table, mm.
    """

    branch: int
    wrist_radius: float
    joints: Floats


class Way(NamedTuple):
    """One candidate on one run: joints at both ends, duration (s), and why it is impossible, or None."""

    first: Floats
    last: Floats
    time: float
    wrong: Excess | None


def choose_branches(
    arm: "Arm", runs: Sequence[npt.ArrayLike], *, wrist_radii: float | Sequence[float] = 350.0
) -> tuple[ArmChoice, ...]:
    """Choose branch and wrist radius for every run in contact with the least travel of the joints.

    Both are constant within a run. Travel is the time that the slowest joint needs at its greatest speed,
    from pose to pose and between runs. `sdpgrind.sdp` solves the choice as a decision process with a mode for
    every pair of branch and radius and a stage for every run. Where the limits allow whole turns, each run
    lies nearest to the middle of the limits.

    Parameters
    ----------
    arm : Arm
        With limits in rad, mm and s.
    runs : sequence of array_like (m, 4, 4)
        Poses of P in the frame of the work with the table at zero, mm; each run one smooth path.
    wrist_radii : float or sequence of float
        Candidate distances of the wrist from the first axis, mm.

    Returns
    -------
    tuple of ArmChoice
        One for each run: branch, wrist radius (mm), joints (rad, mm).

    Raises
    ------
    ValueError
        When no pair takes a run within the limits; with index, joint and amount of the nearest candidate.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> arm = finishing.Arm.generic()
    >>> poses = arm.forward_work([[0.0, 0.2, -1.0, -0.5, 0.1, 0.0, y] for y in (0.0, 5.0, 10.0)])
    >>> [chosen] = finishing.arm.choose_branches(arm, [poses], wrist_radii=[300.0, 400.0])
    >>> chosen.branch, chosen.wrist_radius
    (0, 300.0)
    """
    checked = checked_runs(runs)
    if not checked:
        raise ValueError("runs must be at least one; got none")
    pairs = [(branch, radius) for radius in _radii(wrist_radii) for branch in range(4)]
    ways = [[_way(arm, poses, *pair) for pair in pairs] for poses in checked]
    for k, row in enumerate(ways):
        _refuse_impossible(k, row, pairs)
    picked = [pairs[p] for p in least_travel(arm, ways, [f"{BRANCHES[b]} at {r!r} mm" for b, r in pairs])]
    taken = [
        joints_of(arm, poses, radius, branch, True)[0]
        for poses, (branch, radius) in zip(checked, picked, strict=True)
    ]
    return tuple(
        ArmChoice(branch, radius, joints) for (branch, radius), joints in zip(picked, taken, strict=True)
    )


def _radii(wrist_radii: float | Sequence[float]) -> list[float]:
    """Check the radii, mm."""
    array = np.atleast_1d(checks.finite_array("wrist_radii", wrist_radii, "mm"))
    if array.ndim != 1 or not array.size:
        raise ValueError(
            f"wrist_radii must be one number or a list of them (mm); got {checks.shown(wrist_radii)}"
        )
    return [checks.positive(f"wrist_radii[{k}]", value, "mm") for k, value in enumerate(array.tolist())]


def _way(arm: "Arm", poses: Floats, branch: int, radius: float) -> Way:
    """Return one branch at one radius on one run."""
    joints, reached = joints_of(arm, poses, radius, branch, True)
    time, at = travel_of(arm, joints)
    # A jump also exceeds limits; the message names the jump.
    wrong = jump(arm, joints, at) if at >= 0 else excess(arm, poses, radius, joints, reached)
    return Way(joints[0], joints[-1], time, wrong)


def travel_of(robot: Robot, joints: Floats) -> tuple[float, int]:
    """Time through the poses, s, and the pose after which an angle turns too far, or -1."""
    time, at = kernels.travel(joints, np.array(robot.speed_max, dtype=float), angular(robot), TURN)
    return float(time), int(at)


def jump(arm: Robot, joints: Floats, at: int, through: str = "the tool comes through the vertical") -> Excess:
    """Name the angle that turns too far from pose `at` to the next; `through`: what makes it do so."""
    turns = np.where(angular(arm), np.abs(joints[at + 1] - joints[at]), 0.0)
    j = int(np.argmax(turns))
    text = (
        f"{arm.names[j]} must turn by at most {TURN:g} (rad) from pose to pose of a run;"
        f" got {turns[j]:.4g} between poses[{at}] and poses[{at + 1}],"
        f" where the heading has a corner, or {through}"
    )
    return Excess(at, text, float(turns[j] / TURN), turns=True)


def _refuse_impossible(k: int, row: list[Way], pairs: list[tuple[int, float]]) -> None:
    wrong = [(way.wrong, pair) for way, pair in zip(row, pairs, strict=True) if way.wrong is not None]
    if len(wrong) < len(row):
        return
    found, (branch, radius) = min(wrong, key=lambda each: each[0].share)
    raise refusal(each for each, _ in wrong)(
        f"runs[{k}] has no branch within limits; nearest comes branch {branch} ({BRANCHES[branch]}) at wrist"
        f" radius {radius:g} mm: {found.text}"
    )


def refusal(wrong: Iterable[Excess]) -> type[ValueError]:
    """Return the class of the error where all candidates are impossible."""
    return TurnError if any(each.turns for each in wrong) else ValueError


def least_travel(arm: Robot, ways: list[list[Way]], names: list[str]) -> list[int]:
    """Return the index of the candidate for every run."""
    count, size = len(ways), len(names)
    cost = _costs(arm, ways)
    problem = sdp.Problem(
        axes=(),
        moves=(
            sdp.Move(
                "take",
                {"pair": np.arange(size)},
                sdp.Stay(),
                into=names,
                timed=True,
                charge=lambda s, c: np.nan_to_num(cost[count - _whole(s.left), s.mode, c.pair], posinf=0.0),
                allowed=lambda s, c: np.isfinite(cost[count - _whole(s.left), s.mode, c.pair]),
            ),
        ),
        stops=(sdp.Stop("end", lambda s: 0.0 * s.mode, allowed=lambda s: s.left == 0),),
        stages=sdp.Stages(count, 1.0, "left", ""),
        modes=(*names, "start"),
    )
    policy = sdp.plan(problem)
    left, mode = np.meshgrid(np.arange(1.0, count + 1), np.arange(size + 1), indexing="ij")
    best = np.asarray(policy.action(left=left, mode=mode).pair).astype(int)
    taken = [size]
    for k in range(count):
        taken.append(int(best[count - 1 - k, taken[-1]]))
    return taken[1:]


def _whole(left: npt.ArrayLike) -> npt.NDArray[np.int64]:
    return np.rint(left).astype(np.int64)


def _costs(arm: Robot, ways: list[list[Way]]) -> Floats:
    """Time (s) from a pair, or from the start, through a run in a pair: (run, from, to); inf: impossible."""
    count, size = len(ways), len(ways[0])
    inside = np.array([[np.inf if way.wrong is not None else way.time for way in row] for row in ways])
    cost = np.repeat(inside[:, None, :], size + 1, axis=1)
    if count > 1:
        last = np.array([[way.last for way in row] for row in ways[:-1]])
        first = np.array([[way.first for way in row] for row in ways[1:]])
        way = np.abs(first[:, None, :, :] - last[:, :, None, :])
        cost[1:, :size] += np.max(way / np.array(arm.speed_max), axis=-1)
    return cost
