"""The sweep over turns of a tool: its twin, all sequences, parts, and what no way leads to."""

from types import SimpleNamespace

import numpy as np
import pytest
from finishing_inside import CourseTask, spin_choice, spin_kernels, spin_states, spin_sweep
from spin_twins import Candidates, all_sequences, recursion

from sdpgrind import finishing

UR10 = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0, tilt=0.5))


def candidates(seed, poses=5, count=4, **changes):
    """Two joints that turn and one that slides, on random courses beside each other, some not to be taken."""
    rng = np.random.default_rng(seed)
    drift = np.cumsum(rng.uniform(-0.15, 0.15, (poses, 2, 1, 3)), axis=0)
    joints = drift + rng.uniform(-0.2, 0.2, (poses, 2, count, 3)) + rng.uniform(-3, 3, (1, 2, 1, 3))
    joints[..., :2] -= 2 * np.pi * rng.integers(-1, 2, joints[..., :2].shape)
    fields = {
        "kept": rng.random(joints.shape[:3]) < 0.9,
        "values": np.arange(count) * 2 * np.pi / count,
        "low": np.full(3, -40.0),
        "high": np.full(3, 40.0),
        "turning": np.array([True, True, False]),
        "speed": np.array([1.0, 2.0, 0.7]),
    }
    return Candidates(joints, **fields | changes)


def swept(of, parts=1):
    """Least cost, group and picks by the kernel, the poses in parts."""
    shape, bounded = of.joints.shape, np.empty((len(of.values), 0)) if of.around else of.values[:, None]
    cost, course, before = np.empty(shape[1:3]), np.empty((*shape[1:3], 3, shape[3])), []
    for piece in np.array_split(np.arange(shape[0]), parts):
        links = np.empty((piece.size, *shape[1:3]), dtype=np.int32)
        at = spin_kernels.sweep(
            of.joints[piece], of.kept[piece], bounded, not before, of.low, of.high, of.turning, of.speed,
            of.far, 1e-9, of.held, cost, course, links,
        )  # fmt: skip
        if at >= 0:
            return np.inf, -1, None
        before.append(links)
    found = spin_sweep._traced(cost, np.concatenate(before))
    return found.time, found.group, found.picks.tolist()


# limits of less than a turn, such as a joint of an industrial robot has
NARROW = {"low": np.array([-2.5, -2.5, -2.4]), "high": np.array([2.5, 2.5, 2.4])}
CASES = [{}, {"around": False}, {"held": True}, NARROW, {"far": 0.2}]


@pytest.mark.parametrize("changes", CASES)
@pytest.mark.parametrize("seed", range(6))
def test_twin(seed, changes):
    of = candidates(seed, poses=9, count=5, **changes)
    cost, group, picks = swept(of)
    wanted = recursion(of)
    assert cost == pytest.approx(wanted[0], abs=1e-12)
    assert (group, picks) == wanted[1:]
    assert swept(of, parts=4) == (cost, group, picks)


@pytest.mark.parametrize("changes", CASES)
@pytest.mark.parametrize("seed", range(6))
def test_no_sequence_costs_less(seed, changes):
    of = candidates(seed, **changes)
    assert swept(of)[0] == pytest.approx(all_sequences(of), abs=1e-12)


def test_cases_differ():
    """The rules bind: with each of them some of the random cases cost more, or have no way."""
    free = [swept(candidates(seed))[0] for seed in range(6)]
    for changes in CASES[1:]:
        bound = [swept(candidates(seed, **changes))[0] for seed in range(6)]
        assert all(b >= f for b, f in zip(bound, free, strict=True)) and bound != free


def test_a_turn_that_winds_up_ends_at_the_limit():
    """One joint is carried round: within 4 pi it may go 2 pi from the middle either way, not farther."""
    angle = np.arange(0.0, 4 * np.pi, 0.3)
    of = Candidates(
        (angle % (2 * np.pi))[:, None, None, None],
        np.ones((angle.size, 1, 1), dtype=bool), np.zeros(1),
        np.array([-2 * np.pi]), np.array([2 * np.pi]), np.array([True]), np.ones(1),
    )  # fmt: skip
    assert swept(of)[0] == pytest.approx(angle[-1], abs=1e-9)
    of.joints = np.concatenate([of.joints, of.joints[-1:] + 0.3])
    of.kept = np.ones(of.joints.shape[:3], dtype=bool)
    assert swept(of)[0] == np.inf


def path_of(pitch=12.0):
    path = finishing.zigzag(finishing.surface.sphere_surface(25.0), pitch=pitch)
    problem = finishing.FinishingProblem(path, robot=UR10, contact_angle=np.pi / 2)
    samples = path.sample(per_leg=6)
    poses = problem.tool_poses(samples)
    poses[:, :3, 3] += [650.0, -25.0, 100.0]
    return poses, samples.length


def test_real_candidates_and_parts(monkeypatch):
    """Poses of a UR10: the sweep in parts of 5 poses, and the twin on the joints of the branches."""
    poses = path_of()[0][:24]
    states = spin_states.states_of(UR10, spin_states.spins_of(6))
    joints = states.joints(poses)
    turned = poses.copy()
    turned[:, :3, :3] = poses[:, :3, :3] @ [[np.cos(1 / 3 * np.pi), -np.sin(1 / 3 * np.pi), 0],
                                            [np.sin(1 / 3 * np.pi), np.cos(1 / 3 * np.pi), 0], [0, 0, 1]]  # fmt: skip
    np.testing.assert_allclose(joints[:, :, 1], UR10.solutions(turned), atol=1e-9)
    whole = spin_sweep.swept(states, poses)
    monkeypatch.setattr(spin_sweep, "_CHUNK", 5 * 8 * 6)
    parts = spin_sweep.swept(states, poses)
    assert (parts.group, parts.time) == (whole.group, whole.time)
    np.testing.assert_array_equal(parts.picks, whole.picks)
    away = np.array([list(UR10.singularities(each).values()) for each in np.nan_to_num(joints)])
    kept = ~np.isnan(joints[..., 0]) & (away.min(axis=1) >= 0.1)
    low, high = np.array(UR10.position_min), np.array(UR10.position_max)
    of = Candidates(joints, kept, states.values[:, 0], low, high, np.full(6, True), np.array(UR10.speed_max))
    wanted = recursion(of)
    assert (whole.group, whole.picks.tolist()) == wanted[1:]
    assert whole.time == pytest.approx(wanted[0], rel=1e-12)


def test_stations_are_near_and_far_enough():
    poses, length = path_of(pitch=4.0)
    chosen = spin_choice.stations(poses, length)
    assert chosen[0] == 0 and chosen[-1] == len(poses) - 1 and np.all(np.diff(chosen) > 0)
    assert np.diff(length[chosen]).max() <= 1.0 + np.diff(length).max()
    turn = np.diff(poses[chosen][:, :3, 2], axis=0)
    assert np.linalg.norm(turn, axis=1).max() <= 0.1 + 0.05  # and a sample further


def test_nothing_leads_on():
    poses, length = path_of()
    poses[40:, :3, 3] += [0.0, 0.0, 900.0]
    with pytest.raises(
        ValueError, match=r"no turn of the tool takes poses\[\d+\]: of 48 candidates \d+ reach"
    ):
        spin_choice.spun_choices(UR10, poses, length, spin_states.spins_of(6))


def shared_by_two(low, high):
    """A robot of two slides that share a way: one is at s + v, the other at v, from `low` to `high`."""
    robot = SimpleNamespace(
        names=("a", "b"), units=("mm", "mm"), position_min=(-9.0, low), position_max=(9.0, high),
        speed_max=(1.0, 1.0), singularities=lambda joints: {"none": np.ones(joints.shape[:-1])},
    )  # fmt: skip
    length = np.linspace(0.0, 10.0, 101)

    def solved(_, values):
        return np.stack([length / 10 + values[:, 0], values[:, 0]], axis=-1)[:, None]

    states = SimpleNamespace(
        robot=robot,
        values=np.array([[-2.0], [2.0]]),
        around=np.array([False]),
        wound=np.zeros(2, dtype=bool),
        solved=solved,
    )
    return CourseTask(states, np.empty((101, 4, 4)), length, 0), length


@pytest.mark.parametrize(("low", "high", "least"), [(-9.0, 9.0, 0.5), (-0.25, 0.05, 0.58)])
def test_steps_are_smoothed_where_a_limit_is_in_the_way(low, high, least):
    """By hand: each takes half of the way; or the second all that its limits leave: 0.7^2 + 0.3^2."""
    task, length = shared_by_two(low, high)
    steps = -0.1 * np.floor(length / 4.0)[:, None]
    course = task.smoothed(steps)
    motion = (np.diff(course.joints, axis=0) ** 2).sum() / 0.1
    assert 10 * motion == pytest.approx(least, rel=1e-3)  # limits are kept from inside, by 2e-4 of a range
    assert low <= course.joints[:, 1].min() and course.joints[:, 1].max() <= high
