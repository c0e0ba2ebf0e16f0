"""Cubic Hermite interpolation, compiled, for kernels of all areas."""

from sdpgrind.base.compiling.compiled import compiled


@compiled
def hermite(t, first, last, left, right):
    """Cubic from `first` to `last` at the fraction `t` of an interval; `left`, `right`: end slopes by `t`."""
    rise = last - first
    return first + t * (left + t * (3.0 * rise - 2.0 * left - right + t * (left + right - 2.0 * rise)))
