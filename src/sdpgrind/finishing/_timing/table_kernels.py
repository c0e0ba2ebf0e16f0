"""The table's position loop, one sample after the other."""

from numba import njit


@njit(cache=True, nogil=True)
def follow(transition, old, new, output, state, command, position):
    """Fill position (m,) with the answer to a command (m,), a straight line between samples; `state` (3,) goes on."""
    for k in range(command.size):
        if k > 0:
            a, b, before, after = state[0], state[1], command[k - 1], command[k]
            c = state[2]
            for i in range(3):
                free = transition[i, 0] * a + transition[i, 1] * b + transition[i, 2] * c
                state[i] = free + old[i] * before + new[i] * after
        position[k] = output[0] * state[0] + output[1] * state[1] + output[2] * state[2]
