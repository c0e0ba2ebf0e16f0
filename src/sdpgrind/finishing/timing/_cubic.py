"""Motion at constant jerk, for numbers, arrays, compiled loops and symbols."""

from typing import Any


def advanced(t: Any, s: Any, v: Any, a: Any, j: Any) -> tuple[Any, Any, Any]:
    """Length, feed, acceleration after a time `t` (s) at jerk `j`, from `s`, `v`, `a` (mm, mm/s, mm/s^2)."""
    return s + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
