"""Since when commands hold: a row's command leads to the row, is the mean about it, or holds from it on."""

import numpy as np

from sdpgrind.base.checks import Floats

ALIGNMENTS = ("begin", "centre", "end")
"""A command recorded with a row holds from the row on, is the mean about it, or led to it."""


def held(command: Floats, alignment: str) -> Floats:
    """Command that holds from each row to the next, of commands recorded with an `alignment`.

    The last row keeps its own: none after it is known.
    """
    if alignment == "begin":
        return command
    after = np.append(command[1:], command[-1:])
    return after if alignment == "end" else np.asarray((command + after) / 2)


def recorded(command: Floats, alignment: str) -> Floats:
    """Inverse of `held`: commands as recorded; the first is taken to be constant."""
    if alignment == "begin":
        return command
    if alignment == "end":
        return np.concatenate([command[:1], command[:-1]])
    found = command.copy()
    for k in range(1, found.size):
        found[k] = 2 * command[k - 1] - found[k - 1]
    return found


def read_as(command: Floats, commands_at: str, alignment: str) -> Floats:
    """Commands that were read with `commands_at`, as if they had been read with another alignment."""
    return command if alignment == commands_at else held(recorded(command, commands_at), alignment)
