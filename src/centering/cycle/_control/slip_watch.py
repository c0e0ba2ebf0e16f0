"""Watch on a ring that nothing pushes: readings that leave what the turned angle explains."""

_SURE = 5.0  # chosen: standard deviations; two good Gaussian readings in a row exceed them once in 1e12
_IN_A_ROW = 2  # chosen: samples; one may be dust under the probe


class SlipWatch:
    """Whether the table throws the ring: two readings in a row, further and further off.

    Examples
    --------
    >>> watch = SlipWatch()
    >>> [watch.leaves(off, 0.002) for off in (0.001, 0.03, 0.001, 0.012, 0.04)]  # mm
    [False, False, False, False, True]
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the readings."""
        self._count, self._off = 0, 0.0

    def leaves(self, off: float, sd: float) -> bool:
        """Return whether the ring leaves its place.

        Parameters
        ----------
        off : float
            Reading less the one expected at its angle, mm.
        sd : float
            Standard deviation of that difference, mm.
        """
        further = abs(off) > _SURE * sd and (self._count == 0 or off / self._off > 1.0)
        self._count, self._off = (self._count + 1, off) if further else (0, 0.0)
        return self._count >= _IN_A_ROW
