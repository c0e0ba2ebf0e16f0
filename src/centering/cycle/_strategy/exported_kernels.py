"""Push of a strategy at one state, compiled, as exports have it."""

from centering.cycle._strategy.draw_kernels import table_speed
from centering.cycle._strategy.lookup_kernels import choose, value_at
from sdpgrind.base.compiling.compiled import compiled

AIM, STROKE, PUSH_SPEED, GENTLE, RETRACT, SPINDLE_SPEED, TIME, KIND = range(8)
"""Places of the outputs."""


@compiled(error_model="numpy")
def exported_push(
    state, policy, value, kinds, outcomes, speeds, axes, finish, worth, offset, friction, evidence, out
):
    """Fill `out` by the push with the least expected time to the end. Return 0: push, 1: the part is centred.

    `kinds`: of each kind of push its speed (mm/s), 1 where it is gentle, 1 where the tip retracts at once;
    `worth`: evidence of a push.
    """
    if offset <= finish:
        out[SPINDLE_SPEED], out[KIND] = table_speed(speeds, (axes[0], axes[1]), finish), -1.0
        return 1
    pushes = min(int(evidence / worth + 0.5), value.shape[0] - 1)
    kind, out[AIM], out[STROKE], out[SPINDLE_SPEED] = choose(
        policy, outcomes, speeds, axes, offset, friction, pushes
    )
    for k in range(kinds.shape[1]):
        out[PUSH_SPEED + k] = kinds[kind, k]
    out[TIME] = value_at(value, axes, offset, friction, pushes)
    out[KIND] = kind
    return 0
