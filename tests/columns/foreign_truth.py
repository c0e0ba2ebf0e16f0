"""True arrays of foreign files, and plain writers of texts that share nothing with the library."""

from typing import Any, NamedTuple

import numpy as np


class Foreign(NamedTuple):
    """A file of another style: what is read, the call at first try, and the truth or the refusal."""

    data: Any
    call: dict[str, Any]
    truth: dict[str, Any] | str


def _cycle(rows=120, step=0.05, tau=0.3):
    """A bore: time (s), size (mm, steps of 0.1 um), commanded rate (mm/s), power (W, steps of 0.1 W)."""
    time = np.round(step * np.arange(rows), 2)
    rate = np.where(time < 3.0, 3.0, np.where(time < 4.5, 0.6, 0.0))  # mm/min
    actual = np.zeros(rows)
    for k in range(1, rows):
        actual[k] = actual[k - 1] + step / tau * (rate[k - 1] / 60 - actual[k - 1])
    size = np.round(np.concatenate([[0.0], np.cumsum(actual[:-1] * step)]), 4)
    return time, size, rate / 60, np.round(150.0 + 3.2e4 * actual, 1)


TIME, SIZE, RATE, POWER = _cycle()
TRUTH = {"time": TIME, "size": SIZE, "command_rate_command": RATE, "grinding_power": POWER}
CALL = {"time": "t", "size": "X", "command_rate": "v", "grinding_power": "P"}
HEADERS = ("t [s]", "X [um]", "v [mm/min]", "P [W]")


def digits(values, places, decimal=".", group=""):
    """Texts of numbers with fixed places and groups of three."""
    shown = (f"{value:,.{places}f}" for value in values)
    marks = str.maketrans({",": group, ".": decimal})
    return [text.translate(marks) for text in shown]


def columns(decimal=".", group=""):
    """Texts of the four columns in s, um, mm/min, W."""
    each = ((TIME, 2), (1e3 * SIZE, 1), (60 * RATE, 2), (POWER, 1))
    return [digits(values, places, decimal, group) for values, places in each]


def rows(texts, separator, end=""):
    """Lines of columns of texts."""
    return [separator.join(row) + end for row in zip(*texts, strict=True)]


def table(separator=",", decimal=".", headers=HEADERS, texts=None, end=""):
    """Lines of the four columns below their headers."""
    found = columns(decimal) if texts is None else texts
    return [separator.join(headers) + end, *rows(found, separator, end)]
