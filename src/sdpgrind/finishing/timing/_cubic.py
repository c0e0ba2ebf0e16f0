"""Motion at constant jerk: one body for numbers, arrays, compiled loops and symbols."""

from typing import Any


def advanced(t: Any, s: Any, v: Any, a: Any, j: Any) -> tuple[Any, Any, Any]:
    """Length, feed and acceleration a time `t` (s) after `s`, `v`, `a` (mm, mm/s, mm/s^2), at jerk `j` (mm/s^3)."""
    return s + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
