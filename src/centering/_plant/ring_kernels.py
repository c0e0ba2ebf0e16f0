"""Laws of a ring on a turning table that a tip pushes: contact force, friction, a step of its motion.

In the table's frame M u' = F_c + M (w^2 c + 2 w J'u + w' J'c) - (F_k f + k_v |u|) u/|u|, with the contact
force F_c = k d + b d' >= 0 of the closure d, along the normal of the rim at the tip. When the table changes
its speed under a sliding ring, the rim speed s of its spin obeys M s' = -M R w' - (F_k m + k_v |s|) s/|s| for
a thin ring. f and m, of |u| and |s|, are shares of force and moment with even pressure, 1 and 0 without spin.
A ring at rest stays until the pull exceeds F_s; friction that holds its spin cannot hold its position. The
rim is a circle of the radius at the tip, updated at each step. Arrays are those of `slide_kernels`.
"""

import numpy as np

from centering._plant import friction_kernels as friction
from centering._plant import slide_kernels as slide
from sdpgrind.base.compiling.compiled import compiled

_ONWARD = 0.3  # cosine; chosen: a ring that slides farther off its direction stopped in between


@compiled
def pose(state, cell, profile, aim, time):
    """Where table and tip are at a time (s) within the current piece, for all that is asked of that time.

    Angle, its cosine and sine, speed (rad/s), rate (rad/s^2) of the table; place (mm from the axis) and
    speed of the tip; `aim`: cosine and sine of the push's direction off the normal.
    """
    rate = slide.spindle_rate(state, cell)
    angle = state[slide.ANGLE] + (state[slide.SPEED] + 0.5 * rate * time) * time
    tip, velocity = slide.tip_at(state, cell, profile, time)
    return angle, np.cos(angle), np.sin(angle), state[slide.SPEED] + rate * time, rate, tip, velocity, aim


@compiled
def aim_of(cell):
    """Cosine and sine of the direction of the push off the normal."""
    return np.cos(cell[slide.AIM]), np.sin(cell[slide.AIM])


@compiled
def rim(state, cell, lobes, pose):
    """Distance of the rim from the centre of the ring on the side of the tip, mm."""
    if lobes.shape[0] == 0:
        return cell[slide.ROUND]
    angle, cosine, sine, _, _, tip, _, _ = pose
    along, across = (
        state[slide.X] * cosine + state[slide.Y] * sine - tip,
        state[slide.Y] * cosine - state[slide.X] * sine,
    )
    at, radius = angle + np.arctan2(-across, -along), cell[slide.ROUND]
    for k in range(lobes.shape[0]):
        radius += lobes[k, 1] * np.cos(lobes[k, 0] * at - lobes[k, 2])
    return radius


@compiled
def contact_force(cell, pose, x, y, speed_x, speed_y):
    """Force (N) of the tip on the ring along x and y of the table, its size, the closure (mm, < 0: gap)."""
    _, cosine, sine, spin, _, tip, velocity, aim = pose
    along, across = x * cosine + y * sine - tip, y * cosine - x * sine
    distance = np.sqrt(along * along + across * across)
    closure = cell[slide.RADIUS] - distance
    if closure <= 0.0:
        return 0.0, 0.0, 0.0, closure
    normal_x, normal_y = along / distance, across / distance
    # the ring's own speed over ground; the tip goes at -velocity along the line
    ground_x = speed_x * cosine + speed_y * sine + spin * across + velocity
    ground_y = speed_y * cosine - speed_x * sine - spin * (along + tip)
    force = cell[slide.STIFFNESS] * closure - cell[slide.CONTACT_DAMPING] * (
        normal_x * ground_x + normal_y * ground_y
    )
    if force <= 0.0:
        return 0.0, 0.0, 0.0, closure
    turned, aside = aim
    push_x, push_y = normal_x * turned - normal_y * aside, normal_y * turned + normal_x * aside
    return (
        force * (push_x * cosine - push_y * sine),
        force * (push_y * cosine + push_x * sine),
        force,
        closure,
    )


@compiled
def pull(cell, pose, x, y, speed_x, speed_y):
    """Forces on the ring except friction along x and y of the table, N, and the closure, mm."""
    spin, rate, inertia = pose[3], pose[4], cell[slide.INERTIA]
    push_x, push_y, _, closure = contact_force(cell, pose, x, y, speed_x, speed_y)
    pull_x = push_x + inertia * (spin * spin * x - 2.0 * spin * speed_y - rate * y)
    pull_y = push_y + inertia * (spin * spin * y + 2.0 * spin * speed_x + rate * x)
    return pull_x, pull_y, closure


@compiled
def hold(cell, scale):
    """Set friction over that of the model, and the share left for holding while the table speed changes."""
    cell[slide.FRICTION] = scale
    spin = cell[slide.SPINDLE_ACCELERATION] * cell[slide.ROUND] * cell[slide.INERTIA]
    cell[slide.HELD] = friction._held(spin / (cell[slide.BREAKAWAY] * scale))


@compiled
def holds(state, cell):
    """Largest force that holds the position of a ring at rest, N."""
    share = cell[slide.HELD] if slide.spindle_rate(state, cell) != 0.0 else 1.0
    return cell[slide.BREAKAWAY] * cell[slide.FRICTION] * share


@compiled
def way(state, cell, pose):
    """Direction in which the ring slides on the table, or begins to slide."""
    way_x, way_y = state[slide.SPEED_X], state[slide.SPEED_Y]
    if way_x == 0.0 and way_y == 0.0:
        way_x, way_y, _ = pull(cell, pose, state[slide.X], state[slide.Y], 0.0, 0.0)
    length = np.sqrt(way_x * way_x + way_y * way_y)
    return (way_x / length, way_y / length) if length > 0.0 else (1.0, 0.0)


@compiled
def slope(cell, pose, way_x, way_y, x, y, speed_x, speed_y, spin):
    """Accelerations of a sliding ring on the table, mm/s^2, and of its rim by the spin.

    A ring that has stopped has the friction of a sliding one.
    """
    inertia, rate = cell[slide.INERTIA], pose[4]
    pull_x, pull_y, _ = pull(cell, pose, x, y, speed_x, speed_y)
    speed, turn = np.sqrt(speed_x * speed_x + speed_y * speed_y), -rate * cell[slide.RADIUS]
    if speed_x * way_x + speed_y * way_y > _ONWARD * speed:
        way_x, way_y = speed_x / speed, speed_y / speed
    most = cell[slide.COULOMB] * cell[slide.FRICTION]
    force, moment, sense = 1.0, 0.0, np.sign(spin)
    if spin != 0.0:
        force, moment = friction._shares(speed, abs(spin))
    elif turn != 0.0 and speed == 0.0:
        onward, around = friction._begins(
            np.sqrt(pull_x * pull_x + pull_y * pull_y), inertia * abs(turn), most
        )
        force, moment = friction._shares(onward, around)
        sense = np.sign(turn)
    pull_x -= most * force * way_x + cell[slide.VISCOUS] * speed_x
    pull_y -= most * force * way_y + cell[slide.VISCOUS] * speed_y
    turn -= (most * moment * sense + cell[slide.VISCOUS] * spin) / inertia
    return pull_x / inertia, pull_y / inertia, turn


@compiled
def slide_on(state, cell, poses, w, z, step):
    """Position, speed and spin of a ring sliding in the direction (w, z) after a step of fourth order.

    `poses` at begin, middle and end of the step.
    """
    begin, middle, end = poses
    x, y, s = state[slide.X], state[slide.Y], state[slide.SPIN]
    u, v = state[slide.SPEED_X], state[slide.SPEED_Y]
    half, sixth = 0.5 * step, step / 6.0
    a1, b1, c1 = slope(cell, begin, w, z, x, y, u, v, s)
    u2, v2 = u + half * a1, v + half * b1
    a2, b2, c2 = slope(cell, middle, w, z, x + half * u, y + half * v, u2, v2, s + half * c1)
    u3, v3 = u + half * a2, v + half * b2
    a3, b3, c3 = slope(cell, middle, w, z, x + half * u2, y + half * v2, u3, v3, s + half * c2)
    u4, v4 = u + step * a3, v + step * b3
    a4, b4, c4 = slope(cell, end, w, z, x + step * u3, y + step * v3, u4, v4, s + step * c3)
    x += sixth * (u + 2.0 * u2 + 2.0 * u3 + u4)
    y += sixth * (v + 2.0 * v2 + 2.0 * v3 + v4)
    u += sixth * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    v += sixth * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
    return x, y, u, v, s + sixth * (c1 + 2.0 * c2 + 2.0 * c3 + c4)
