"""Sweep along a path over candidates of a robot whose tool may turn about its own axis."""

import math

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.arm._kinematics_kernels import _joints_of

_TURN = 2 * math.pi


@compiled
def _nearest(way, turns):
    """Way of a joint, less whole turns where it turns."""
    return way - _TURN * math.floor(way / _TURN + 0.5) if turns and abs(way) > math.pi else way


@compiled
def _fits(least, most, low, high, turns, slack):
    """Whether a course from `least` to `most`, moved by whole turns, is within limits."""
    if not turns:
        return least >= low - slack and most <= high + slack
    up = _TURN * math.ceil((low - slack - least) / _TURN)
    return most + up <= high + slack


@compiled
def _follow(at, course, j, turns):
    """Position of joint j nearest to that of a course (last, least, most; n), and the new extremes."""
    there = course[0, j] + _nearest(at - course[0, j], turns)
    return there, min(course[1, j], there), max(course[2, j], there)


@compiled
def _passes(joints, course, low, high, turns, slack):
    """Whether a course may go on to joints (n,) within the limits."""
    for j in range(joints.size):
        _, least, most = _follow(joints[j], course, j, turns[j])
        if not _fits(least, most, low[j], high[j], turns[j], slack):
            return False
    return True


@compiled
def _time(joints, last, speed, turns, far, most):
    """Time of the slowest joint, s; inf where an angle turns by more than `far` or it is `most` or more.

    The last joint comes first, as a turn of the tool moves it most.
    """
    longest = 0.0
    for j in range(joints.size - 1, -1, -1):
        way = abs(_nearest(joints[j] - last[j], turns[j]))
        longest = max(longest, way / speed[j])
        if (turns[j] and way > far) or longest >= most:
            return np.inf
    return longest


@compiled
def _open(joints, kept, low, high, turns, slack, cost, course):
    """Begin a course of no cost at every candidate within limits; joints (g, c, n)."""
    for g in range(joints.shape[0]):
        for c in range(joints.shape[1]):
            for j in range(joints.shape[2]):
                for k in range(3):
                    course[g, c, k, j] = joints[g, c, j]
            fits = kept[g, c] and _passes(joints[g, c], course[g, c], low, high, turns, slack)
            cost[g, c] = 0.0 if fits else np.inf


@compiled
def _beyond(values, c, before):
    """Whether a freedom that does not come round again would do so between two candidates, values (c, f)."""
    out = False
    for f in range(values.shape[1]):
        out = out or abs(values[c, f] - values[before, f]) > math.pi
    return out


@compiled
def _best(joints, values, cost, course, c, low, high, turns, speed, far, slack, held):
    """Least cost to candidate c of a group, joints (n,), and the candidate before; inf and -1: none.

    Of equal ones the first is taken, c itself before all others.
    """
    least, found = np.inf, -1
    for turn in range(1 if held else cost.size):
        before = c if turn == 0 else (turn if turn > c else turn - 1)
        if cost[before] >= least:
            continue
        if _beyond(values, c, before):
            continue
        time = _time(joints, course[before, 0], speed, turns, far, least - cost[before])
        if cost[before] + time < least and _passes(joints, course[before], low, high, turns, slack):
            least, found = cost[before] + time, before
    return least, found


@compiled
def sweep(joints, kept, values, first, low, high, turns, speed, far, slack, held, cost, course, before):
    """Carry the least cost over poses; return the first pose to which nothing leads, or -1.

    Joints (m, g, c, n) of c candidates in each of g groups, `kept` (m, g, c) tells which may be taken, and
    `values` (c, f) those of their angles that stay between the outer ones. From pose to pose the group stays;
    no angle turns by more than `far`; the course of a joint from its start, moved by whole turns, stays
    within `low` and `high` (n,). `cost` (g, c) and `course` (g, c, 3, n: last, least and most of a joint) are
    those at the pose before, or begin at the first. `before` (m, g, c): candidate before each, -1: none.
    `held`: the candidate stays, too.
    """
    there, behind = np.empty_like(cost), np.empty_like(course)
    for i in range(len(joints)):
        alive = False
        if first and i == 0:
            _open(joints[0], kept[0], low, high, turns, slack, cost, course)
            for g in range(cost.shape[0]):
                for c in range(cost.shape[1]):
                    before[0, g, c] = -1
                    alive = alive or cost[g, c] < np.inf
            if not alive:
                return 0
            continue
        for g in range(cost.shape[0]):
            for c in range(cost.shape[1]):
                there[g, c], before[i, g, c] = np.inf, -1
                if not kept[i, g, c]:
                    continue
                at = joints[i, g, c]
                time, found = _best(
                    at, values, cost[g], course[g], c, low, high, turns, speed, far, slack, held
                )
                if found < 0:
                    continue
                there[g, c], before[i, g, c], alive = time, found, True
                for j in range(at.size):
                    place, least, most = _follow(at[j], course[g, found], j, turns[j])
                    behind[g, c, 0, j], behind[g, c, 1, j], behind[g, c, 2, j] = place, least, most
        if not alive:
            return i
        for g in range(cost.shape[0]):
            for c in range(cost.shape[1]):
                cost[g, c] = there[g, c]
                for k in range(3):
                    for j in range(joints.shape[3]):
                        course[g, c, k, j] = behind[g, c, k, j]
    return -1


@compiled
def inverse_of_radii(poses, lengths, radii, pitch, elbow, middle, joints):
    """Joints (m, 7) of an arm in one branch, each pose with a wrist radius of its own; NaN out of reach."""
    for i in range(len(poses)):
        if not _joints_of(poses[i], lengths, radii[i], pitch, elbow, middle[0], joints[i]):
            for j in range(7):
                joints[i, j] = np.nan
