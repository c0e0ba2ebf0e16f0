"""The table's position loop, one sample after the other."""

from sdpgrind.base.compiled import compiled

OLD, NEW, OUTPUT, LOOP = 9, 12, 15, 18
"""A loop: matrix (3, 3) of the state, weights (3,) of the command before and after a sample, output (3,); how many they are."""
COMMAND, TABLE = 3, 4
"""State of an axis of the table: three of the loop and the last command; how many they are."""


@compiled
def table_step(loop, state, command):
    """Advance an axis of the table by a sample and return where it is, mm from where it began: Wang, section 3.

    Parameters
    ----------
    loop : array, (LOOP,)
        `TableLoop.sampled(period).parameters`; empty: the table is always where it is commanded to be.
    state : array, (TABLE,)
        State of the loop and last command; zeros at the start. It is changed.
    command : float
        Where it is to be at the end of the sample, mm from where it began; a straight line from the last command.
    """
    if loop.size == 0:
        return command
    a, b, c, before = state[0], state[1], state[2], state[COMMAND]
    place = 0.0
    for i in range(3):
        free = loop[3 * i] * a + loop[3 * i + 1] * b + loop[3 * i + 2] * c
        state[i] = free + loop[OLD + i] * before + loop[NEW + i] * command
        place += loop[OUTPUT + i] * state[i]
    state[COMMAND] = command
    return place


@compiled
def follow(loop, state, command, position):
    """Fill position (m,) with the answer to a command (m,) that begins at 0."""
    for k in range(command.size):
        position[k] = table_step(loop, state, command[k])
