"""Position loop of the table, sample by sample."""

from sdpgrind.base.compiling.compiled import compiled

# Derived, of a loop: transition (3, 3), command weights (3,) before and after, output (3,); their number.
OLD, NEW, OUTPUT, LOOP = 9, 12, 15, 18
# Derived, of the state of an axis of the table: three of the loop, then the last command; their number.
COMMAND, TABLE = 3, 4


@compiled
def table_step(loop, state, command):
    """Advance an axis of the table by a sample and return its position, mm from its start (Wang, section 3).

    Parameters
    ----------
    loop : array, (LOOP,)
        `TableLoop.sampled(period).parameters`; empty: the table follows its command exactly.
    state : array, (TABLE,)
        State of the loop and last command; zeros at the start. It is changed.
    command : float
        Command at the end of the sample, mm from its start; a straight line from the last command.
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
    """Fill position (m,) with the response to a command (m,) that starts at 0."""
    for k in range(command.size):
        position[k] = table_step(loop, state, command[k])
