"""Places in the one array that is the state of a streaming estimator, as compiled code sees them."""

RING = 30
"""Latest readings that are kept: a start is screened over them, a part that has moved is recognised in them."""
DOUBTFUL = 7
"""Refused readings among the latest 30 that may be dust (less than 1 % of windows with 10 % of dust have more); from more on, and
while the newest is refused, the estimate is in doubt."""
TABLE = 64
"""Quantiles of Student's law that are kept, for 1, 2, ... degrees of freedom."""

(
    LIMACON, TIP, NOISE, REL_TOL, ABS_TOL, ARC_MIN, LOG_FORGETTING, JOINT, BEYOND, NORMAL, FORM_GATE, FORMS, KNOWN, SETTINGS,
) = range(14)  # fmt: skip
"""Settings: whether the limacon is fitted, tip radius (mm), least noise (mm), tolerances (1, mm), least arc (rad), logarithm of
the weight left per rad of travel, whether both coordinates are meant, logarithm of the probability beyond, quantile of the
normal law, what form may add to a residual (mm), number of lobes assumed and of harmonics known; and how many they are."""

PRIOR_RADIUS, PRIOR_SD, PRIOR_NOISE, PRIOR_FREEDOM = range(SETTINGS, SETTINGS + 4)
"""What is known of the radius, tip included (mm; sd 0: nothing), and of the noise from fits before (mm, degrees of freedom)."""

_RUN = PRIOR_FREEDOM + 1
INDEX, RESTARTS, LAST_ANGLE, SEEN = range(_RUN, _RUN + 4)
"""Readings ever, restarts, last angle as read (rad); then what `clear` forgets: readings since the (re)start, and on to TAIL."""
(
    USED, LARGEST, REFERENCE, PER_REFERENCE, CENTER_X, CENTER_Y, POSITION, TRAVEL, LOW, HIGH, COVERED, WIDENINGS, PATH, MOVES,
    DIRECTION, LAST_STEP, COARSE, BAD, IN_A_ROW, LAGGED, RATIO, QUANTUM, REPEATS, LATEST, GATE_FROM, DOUBT,
) = range(SEEN + 1, SEEN + 27)  # fmt: skip
"""Used of these, largest reading and the first (mm, with tip), the inverse of the first, latest centre (mm), unwrapped angle, way
travelled, ends of what was seen and how much of it is covered (rad), steps that widened it, way and number of steps that moved,
sense of rotation, last step (rad), even coarse steps in a row, readings refused in the ring and in a row, whether there is a row
before, radius over the first reading, least step from reading to reading (mm; 0: none), readings equal to the one before, the
latest (mm), the arc from which on wild ones are refused (rad), and whether those of less than a turn disagree."""

SUM = DOUBT + 1
WEIGHT, SQUARES, LAG, BIAS = SUM, SUM + 1, SUM + 2, SUM + 12
"""What is forgotten with the readings: sum of their weights, of squared residuals (mm^2), sums of products of differences of
successive rows with their targets (upper triangle by rows), and what noise of variance 1 adds to the normal equations, (q, x, y)
over the square of the ratio, (x, y) over the ratio."""
SUMS = 17
"""How many these are."""
KEPT = SUM + SUMS
KEPT_WAY, KEPT_COVERED, KEPT_SIZE = SUMS, SUMS + 1, SUMS + 2
"""The same as they were when the two older triangles were kept, the younger first, each with the way and what was covered."""
LOOKS, SCATTER, WAITING = range(KEPT + 2 * KEPT_SIZE, KEPT + 2 * KEPT_SIZE + 3)
LOOK_SIZE = 4
"""Looks at a window whether the part has moved that are old enough to be compared with, the sum of what they found (mm^2), and
what the latest two found; of the shorter window, then of the longer."""

PREVIOUS = LOOKS + 2 * LOOK_SIZE
"""The row before, with its target (4)."""
NEW_BIAS = PREVIOUS + 4
"""What noise adds by the new row, as in BIAS: (q, x, y) over the row, then (x, y)."""

_FORM = NEW_BIAS + 3
(
    BLOCK_BEGIN, TURN_BEGIN, BLOCK_COUNT, TURN_COUNT, TURNS, LOW_SQUARES, FORM_SQUARES, TOLD_COUNT,
) = range(_FORM, _FORM + 8)  # fmt: skip
"""Way by which the block and the turn of now began (rad), their readings, turns that told form from noise, their squares of the
waves above form and of the differences from reading to reading that form makes (mm^2), readings of these turns."""
BLOCK_SUM = TOLD_COUNT + 1
"""Sum of the rows and targets of the block (4)."""
WAVES, ABOVE = 8, 8
"""Waves fitted to a turn: four of form (2 to 5 upr) and four above; cosines and sines of the latter."""
CIRCLE_AND_FORM = 11
"""Columns of circle and form; those of the waves above follow, then the target."""
SIDE = 20
"""Columns of the normal equations of a turn."""
TURN = BLOCK_SUM + 4
TOTAL = TURN + SIDE * SIDE
"""Normal equations of the turn of now and of those before (SIDE, SIDE); their upper triangles."""

VECTOR = TOTAL + SIDE * SIDE
"""Room for one row of these."""

_RESULT = VECTOR + SIDE
(
    RADIUS, FIT_X, FIT_Y, FIT_NOISE, FREEDOM, INFLATION, SPREAD, FORM_BOUND, REACH, BAND, TOLERANCE, SCALE, SCALE_FREEDOM, FREED,
) = range(_RESULT, _RESULT + 14)  # fmt: skip
"""Of the latest fit: radius and centre (mm), sd of a reading (mm), degrees of freedom, inflation, sd of the centre in its worst
direction for noise 1, bound on form (mm), quantile times noise (mm), band and tolerance (mm), the noise that made the band (mm),
its degrees of freedom (0: known), and whether form was told from noise."""
SHAPE = FREED + 1
"""Covariance of (radius, x, y) for noise 1 (3, 3)."""
VALUE, INFORMATION = SHAPE + 9, SHAPE + 12
"""Room for the values (q, x, y) and their covariance for noise 1 (3, 3)."""
STUDENT = INFORMATION + 9
"""Quantiles of Student's law."""
WAVES_AT = STUDENT + TABLE
"""Undulations per revolution of the waves that are fitted to a turn (WAVES)."""
RING_AT = WAVES_AT + WAVES
"""The latest readings: rows of angle (rad), reading (mm), whether refused, way travelled (rad), number (RING, 5)."""
CELL = 5
"""Columns of the ring."""
TAIL = RING_AT + RING * CELL
"""Then the assumed lobes (upr; amplitude, mm), the known harmonics (upr, cosine, sine, mm), and the arrays of `width` columns:
the triangle (3), two older ones (3 each), room to work (6), a row (1)."""
ARRAYS = 16
"""Rows of `width` columns at the end."""


def lobes_at(known: int, forms: int) -> tuple[int, int, int]:
    """Begin of the assumed lobes, of the known harmonics and of the arrays."""
    return TAIL, TAIL + 2 * forms, TAIL + 2 * forms + 3 * known


def width(forms: int) -> int:
    """Columns of the triangle: three values, the target, a cosine and a sine of every assumed lobe."""
    return 4 + 2 * forms
