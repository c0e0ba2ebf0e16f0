"""Mass under a load with a friction law, step by step; implicit where the law is stiff."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_FIRST_BRISTLE = 3  # derived: first `kind` of a law with a bond (3: Dahl, 4: LuGre, 5: elasto-plastic)


@compiled
def follow_load(kind, law, inertia, load, step, every, out):
    """Write position (mm), velocity (mm/s), friction (N) and deflection (mm) after every `every` steps.

    `law`: F_s, F_k, k_v, v_S, delta_S, s0, s1, z_ba. `inertia`: M, N s^2/mm. `load`, (n,): force in each step
    (N), repeated as needed. `step` in s. `out`, (rows, 4): its first row is the start.
    """
    x, v, z, friction = out[0, 0], out[0, 1], out[0, 3], out[0, 2]
    for k in range((out.shape[0] - 1) * every):
        push = load[k % load.size]
        before = v
        if kind >= _FIRST_BRISTLE:
            v, z, friction = _bristle_step(kind, law, inertia, push, step, v, z)
        else:
            v, friction = _steady_step(kind, law, inertia, push, step, v)
        x += 0.5 * step * (before + v)
        if (k + 1) % every == 0:
            row = (k + 1) // every
            out[row, 0], out[row, 1], out[row, 2], out[row, 3] = x, v, friction, z


@compiled
def _stribeck(kind, law, v):
    """Force of steady motion without its viscous share."""
    if kind == 0 or kind == 1 or kind == _FIRST_BRISTLE:
        return law[1]
    return law[1] + (law[0] - law[1]) * np.exp(-(np.abs(v / law[3]) ** law[4]))


@compiled
def _steady_step(kind, law, inertia, push, step, v):
    """Velocity and friction after a step of a law that holds up to F_s and slides beyond."""
    if v == 0.0 and np.abs(push) <= law[0]:
        return 0.0, push
    way = np.sign(v) if v != 0.0 else np.sign(push)
    after = (inertia * v + step * (push - way * _stribeck(kind, law, v))) / (inertia + step * law[2])
    if after * way <= 0.0:  # it stops within the step, and holds from the next one on if it can
        return 0.0, push + inertia * v / step
    return after, push - inertia * (after - v) / step


@compiled
def _bristle_step(kind, law, inertia, push, step, v, z):
    """Velocity, deflection and friction after an implicit step, with g and alpha of its beginning."""
    g = _stribeck(kind, law, v)
    decay = _yielding(kind, law, v, z, g) * law[5] * np.abs(v) / g
    keep = 1.0 / (1.0 + step * decay)
    drag = inertia + keep * step * (step * law[5] + law[6]) + step * law[2]
    after = (inertia * v + step * push - keep * step * law[5] * z + (1.0 - keep) * law[6] * z) / drag
    return after, keep * (z + step * after), push - inertia * (after - v) / step


@compiled
def _yielding(kind, law, v, z, g):
    """Share of the motion in which the bond yields."""
    if kind != 5:
        return 1.0
    if v * z <= 0.0:
        return 0.0
    rise = (np.abs(z) - law[7]) / (g / law[5] - law[7])
    return 0.5 + 0.5 * np.sin(np.pi * (min(max(rise, 0.0), 1.0) - 0.5))
