"""Curves through nodes with slopes: Hermite's cubic, one for every kernel that needs it."""

from sdpgrind.base.compiled import compiled


@compiled
def hermite(t, first, last, left, right):
    """Cubic from `first` to `last` at the share `t` of an interval; `left` and `right`: slopes at its ends by the share."""
    rise = last - first
    return first + t * (left + t * (3.0 * rise - 2.0 * left - right + t * (left + right - 2.0 * rise)))
