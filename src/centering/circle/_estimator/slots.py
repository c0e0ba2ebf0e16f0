"""Slots of the state array of a streaming estimator."""

# chosen: size of the ring buffer; the first readings are screened together, a move shows in the last
RING = 30
DOUBTFUL = 7  # derived: refused readings of 30; fewer than 1 % of windows with 10 % of dust have more
TABLE = 64  # chosen: tabulated Student quantiles, 1, 2, ...; the expansion beyond is exact to 1e-8

(
    LIMACON, TIP, NOISE, REL_TOL, ABS_TOL, ARC_MIN, LOG_FORGETTING, JOINT, BEYOND, NORMAL, FORM_GATE, FORMS,
    KNOWN, SETTINGS,
) = range(14)  # fmt: skip
"""Settings: flag of the limacon, tip radius (mm), least noise (mm), tolerances (1, mm), least arc (rad),
logarithm of the weight left per rad of travel, flag of both coordinates, logarithm of the tail probability,
normal quantile, largest residual by form (mm), number of assumed lobes and of known harmonics; SETTINGS is
their count."""

PRIOR_RADIUS, PRIOR_SD, PRIOR_NOISE, PRIOR_FREEDOM = range(SETTINGS, SETTINGS + 4)
"""Prior radius with the tip (mm; sd 0: none), and noise of the fits before (mm, degrees of freedom)."""

_RUN = PRIOR_FREEDOM + 1
INDEX, RESTARTS, LAST_ANGLE, SEEN = range(_RUN, _RUN + 4)
"""Total of readings, restarts, last angle as read (rad); from SEEN on `clear` resets: readings since the
(re)start, and so on."""
(
    USED, LARGEST, REFERENCE, PER_REFERENCE, CENTER_X, CENTER_Y, POSITION, TRAVEL, LOW, HIGH, COVERED,
    WIDENINGS, PATH, MOVES, DIRECTION, LAST_STEP, COARSE, BAD, IN_A_ROW, LAGGED, RATIO, QUANTUM, REPEATS,
    LATEST, GATE_FROM, DOUBT,
) = range(SEEN + 1, SEEN + 27)  # fmt: skip
"""Readings used, largest reading and the first (mm, with tip), inverse of the first, latest centre (mm),
unwrapped angle, angle travelled, limits of the arc and its covered part (rad), steps that widened it, angle
and number of moving steps, sense of rotation, last step (rad), coarse even steps in a row, refused readings
in the ring buffer and in a row, flag of a previous row, radius over the first reading, least step between
readings (mm; 0: none), repeated readings, the latest (mm), arc from which on outliers are refused (rad), flag
of doubt within the first turn."""

SUM = DOUBT + 1
WEIGHT, SQUARES, LAG, BIAS = SUM, SUM + 1, SUM + 2, SUM + 12
"""Sums subject to forgetting: weights, squared residuals (mm^2), products of differences of successive rows
with their targets (upper triangle by rows), and bias of the normal equations by noise of variance 1, (q, x,
y) over the square of the ratio, (x, y) over the ratio."""
SUMS = 17  # derived: number of these sums
KEPT = SUM + SUMS
KEPT_WAY, KEPT_COVERED, KEPT_SIZE = SUMS, SUMS + 1, SUMS + 2
"""The same sums stored with the two older triangles, the younger first, each with angle travelled and arc
covered."""
LOOKS = KEPT + 2 * KEPT_SIZE
LOOK_SIZE = 4  # derived: slots of a window, as follows
"""Looks for a move, for the shorter and then the longer window: number of those old enough for comparison,
sum of their results (mm^2), results of the latest two."""

PREVIOUS = LOOKS + 2 * LOOK_SIZE
"""The previous row with its target (4)."""
NEW_BIAS = PREVIOUS + 4
"""Bias by the new row, as in BIAS: (q, x, y) over the row, then (x, y)."""

_FORM = NEW_BIAS + 3
(
    BLOCK_BEGIN, TURN_BEGIN, BLOCK_COUNT, TURN_COUNT, TURNS, LOW_SQUARES, FORM_SQUARES, TOLD_COUNT,
) = range(_FORM, _FORM + 8)  # fmt: skip
"""Angle travelled at the start of the present block and turn (rad), their readings, turns that separated form
from noise, their squares of the waves above form and of the successive differences made by form (mm^2),
readings of these turns."""
BLOCK_SUM = TOLD_COUNT + 1
"""Sum of rows and targets of the block (4)."""
WAVES, ABOVE = 8, 8  # derived: 4 + 4, and 2 of each of 4
"""Waves fitted to a turn: four of form (2 to 5 upr) and four above; and number of cosines and sines of the
latter."""
CIRCLE_AND_FORM = 11  # derived: columns, 3 of the circle, 2 of each wave of form
SIDE = 20  # derived: columns of circle, form and waves above, and the target
TURN = BLOCK_SUM + 4
TOTAL = TURN + SIDE * SIDE
"""Normal equations of the present turn and of all before, upper triangles (SIDE, SIDE)."""

VECTOR = TOTAL + SIDE * SIDE
"""Work space for one row of these."""

_RESULT = VECTOR + SIDE
(
    RADIUS, FIT_X, FIT_Y, FIT_NOISE, FREEDOM, INFLATION, SPREAD, FORM_BOUND, REACH, BAND, TOLERANCE, SCALE,
    SCALE_FREEDOM, FREED,
) = range(_RESULT, _RESULT + 14)  # fmt: skip
"""Latest fit: radius and centre (mm), sd of a reading (mm), degrees of freedom, inflation, sd of the centre
in its worst direction for unit noise, form bound (mm), quantile times noise (mm), band and tolerance (mm),
noise of the band (mm) and its degrees of freedom (0: known), flag of form separated from noise."""
SHAPE = FREED + 1
"""Covariance of (radius, x, y) for unit noise (3, 3)."""
VALUE, INFORMATION = SHAPE + 9, SHAPE + 12
"""Work space for the values (q, x, y) and their covariance for unit noise (3, 3)."""
STUDENT = INFORMATION + 9
"""Student quantiles (TABLE)."""
WAVES_AT = STUDENT + TABLE
"""Undulations per revolution of the waves fitted to a turn (WAVES)."""
RING_AT = WAVES_AT + WAVES
"""Ring buffer (RING, CELL): angle (rad), reading (mm), flag of refusal, angle travelled (rad), number."""
CELL = 5  # derived: columns of the ring buffer
TAIL = RING_AT + RING * CELL
"""Begin of the assumed lobes (upr; amplitude, mm), the known harmonics (upr, cosine, sine, mm), and the
arrays of `width` columns: the triangle (3 rows), two stored ones (3 each), work space (6), a row (1)."""
ARRAYS = 16  # derived: rows of `width` columns at the end


def lobes_at(known: int, forms: int) -> tuple[int, int, int]:
    """Begin of the assumed lobes, of the known harmonics and of the arrays."""
    return TAIL, TAIL + 2 * forms, TAIL + 2 * forms + 3 * known


def width(forms: int) -> int:
    """Columns of the triangle: three values, the target, cosine and sine of every assumed lobe."""
    return 4 + 2 * forms
