"""Running correction of the stroke, Mears (6.16)-(6.18)."""

from math import cos, sqrt

from sdpgrind.base import checks

_MISSED = 0.05  # chosen: of the wanted push: a part that moved less was not touched


def travelled(offset_before: float, offset_angle_before: float, offset: float, offset_angle: float) -> float:
    """Return the travel of a part, mm, from its offsets before and after: law of cosines in Mears (6.18).

    Parameters
    ----------
    offset_before, offset : float
        Distance of its centre from the axis before and after, mm.
    offset_angle_before, offset_angle : float
        Directions of the centre on the table, rad.

    Raises
    ------
    ValueError
        An offset is negative, or a value is not finite.

    Examples
    --------
    >>> from math import pi
    >>> round(travelled(3.0, 0.0, 4.0, pi / 2), 12)  # mm
    5.0
    """
    before = checks.nonnegative("offset_before", offset_before, "mm")
    after = checks.nonnegative("offset", offset, "mm")
    between = checks.number("offset_angle", offset_angle, "rad") - checks.number(
        "offset_angle_before", offset_angle_before, "rad"
    )
    # The difference form keeps its digits where the two nearly agree.
    return sqrt((before - after) ** 2 + 2.0 * before * after * (1.0 - cos(between)))


class StrokeCorrection:
    """Correction added to each stroke: P + d_remain + d_stroke, Mears (6.16), within a limit.

    A push that moved the part by less than 5 % of the wanted travel missed it and adds the remaining gap at
    the end of the stroke, (6.17). Any other push adds its shortfall, wanted less travelled, (6.18); never
    both. The source swaps the two positions in (6.17) between its places: here the gap is positive where the
    tip did not reach the part.

    Parameters
    ----------
    limit : float
        Greatest ``|P|``, mm.

    Raises
    ------
    ValueError
        `limit` is not > 0.

    Examples
    --------
    >>> correction = StrokeCorrection(limit=0.5)
    >>> correction.update(wanted=1.0, travelled=0.98)  # mm
    0.020000000000000018
    >>> correction.update(wanted=1.0, travelled=0.01, gap_left=0.2)  # missed
    0.22000000000000003
    >>> correction.update(wanted=2.0, travelled=1.0), correction.value
    (0.5, 0.5)
    """

    def __init__(self, limit: float = 0.5) -> None:
        self.limit = checks.positive("limit", limit, "mm")
        self._value = 0.0

    @property
    def value(self) -> float:
        """P, mm, to be added to the next stroke."""
        return self._value

    def reset(self) -> None:
        """Set P to 0: at a new cycle, or after a manual move."""
        self._value = 0.0

    def update(self, *, wanted: float, travelled: float, gap_left: float = 0.0) -> float:
        """Evaluate a push; return P for the next, mm.

        Parameters
        ----------
        wanted : float
            Wanted travel, mm, > 0.
        travelled : float
            Actual travel, mm.
        gap_left : float
            Gap between tip and part at the end of the stroke, mm, of a push that missed; negative counts as
            0.

        Raises
        ------
        ValueError
            A value is out of range.
        """
        goal = checks.positive("wanted", wanted, "mm")
        way = checks.nonnegative("travelled", travelled, "mm")
        gap = checks.number("gap_left", gap_left, "mm")
        missed = way < _MISSED * goal
        step = max(gap, 0.0) if missed else goal - way
        self._value = min(max(self._value + step, -self.limit), self.limit)
        return self._value
