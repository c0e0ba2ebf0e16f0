"""Noise of the readings: standard deviation, inflation by correlation, quantiles."""

from math import inf

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.form_kernels import _long_noise, _moved_by_form
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import back_substitute

_TELLING = 0.1  # chosen: least noise of residuals, over the given noise, to estimate a correlation from
_ROUNDING = 2.3e-16  # derived: relative rounding of a number; about sqrt(n) times this for a sum of n
_ABOVE_ROUNDING = 100.0  # chosen: smallest usable sum of squares, in rounding errors of the differences
_SIGNIFICANT = 2.0  # chosen: standard deviations above which a correlation of residuals counts


@compiled(error_model="numpy")
def _arrays(state):
    """Rows at the end of the state: 0 to 2 the triangle, 3 to 8 two stored ones, then work space."""
    forms = int(state[at.FORMS])
    begin = at.TAIL + 2 * forms + 3 * int(state[at.KNOWN])
    return state[begin:].reshape((at.ARRAYS, 4 + 2 * forms))


@compiled(error_model="numpy")
def _copy(array, out):
    """Copy a triangle and its targets; entries below the diagonal are never read."""
    for i in range(3):
        for j in range(i, array.shape[1]):
            out[i, j] = array[i, j]


@compiled(error_model="numpy")
def _write_covariance(array, out):
    """Write (R'R)^-1 of a triangle R."""
    a, b, c = 1.0 / array[0, 0], 1.0 / array[1, 1], 1.0 / array[2, 2]
    ab, bc = -array[0, 1] * a * b, -array[1, 2] * b * c
    ac = -(array[0, 1] * bc + array[0, 2] * c) * a
    out[0, 0], out[1, 1], out[2, 2] = a * a + ab * ab + ac * ac, b * b + bc * bc, c * c
    out[0, 1] = out[1, 0] = ab * b + ac * bc
    out[0, 2] = out[2, 0] = ac * c
    out[1, 2] = out[2, 1] = bc * c


@compiled(error_model="numpy")
def _student(state, freedom):
    """Student quantile: from the table, or expanded about the normal quantile (error 1e-8 from 64 on)."""
    if freedom < 1.0:
        return inf
    if freedom < at.TABLE:
        return state[at.STUDENT + int(freedom) - 1]
    z, n = state[at.NORMAL], freedom
    y = z * z
    first = (y + 1.0) / (4.0 * n)
    second = ((5.0 * y + 16.0) * y + 3.0) / (96.0 * n * n)
    third = (((3.0 * y + 19.0) * y + 17.0) * y - 15.0) / (384.0 * n**3)
    fourth = ((((79.0 * y + 776.0) * y + 1482.0) * y - 1920.0) * y - 945.0) / (92160.0 * n**4)
    return z * (1.0 + first + second + third + fourth)


@compiled(error_model="numpy")
def _quantile(state, freedom):
    """Quantile of the centre in standard deviations: Student's t, or sqrt(2 F) for both coordinates."""
    if state[at.JOINT] == 0.0:
        return _student(state, freedom)
    return np.sqrt(freedom * np.expm1(-2.0 * state[at.BEYOND] / freedom)) if freedom >= 1.0 else inf


@compiled(error_model="numpy")
def _known_quantile(state):
    """Quantile of the centre in standard deviations for known noise."""
    return np.sqrt(-2.0 * state[at.BEYOND]) if state[at.JOINT] != 0.0 else state[at.NORMAL]


@compiled(error_model="numpy")
def _differences(state, value):
    """Sum of squared differences of successive residuals, and its rounding error."""
    q, x, y, k = value[0], value[1], value[2], at.LAG
    squares = q * q * state[k] + x * x * state[k + 4] + y * y * state[k + 7] + state[k + 9]
    a, b, c = q * x * state[k + 1], q * y * state[k + 2], x * y * state[k + 5]
    d, e, f = q * state[k + 3], x * state[k + 6], y * state[k + 8]
    scale = squares + 2.0 * (abs(a) + abs(b) + abs(c) + abs(d) + abs(e) + abs(f))
    return squares + 2.0 * (a + b + c - d - e - f), _ROUNDING * np.sqrt(state[at.WEIGHT]) * scale


@compiled(error_model="numpy")
def correlation(squares, weight, lagged):
    """Correlation of successive residuals, corrected for bias; 0 unless significant."""
    plain = 1.0 - 0.5 * lagged / squares
    rho = plain + (2.0 + 5.0 * plain) / weight
    return min(rho, 0.9999) if rho > _SIGNIFICANT / np.sqrt(weight) else 0.0


@compiled(error_model="numpy")
def _inflation_of(state, squares, weight, lagged, rounding):
    """Inflation of the noise by correlation; 1 where the residuals are too small to estimate it."""
    least = _TELLING * state[at.NOISE] * state[at.RATIO]
    if weight <= 4.0 or squares <= weight * least * least or squares <= _ABOVE_ROUNDING * rounding:
        return 1.0
    rho = correlation(squares, weight, lagged)
    return np.sqrt((1.0 + rho) / (1.0 - rho))


@compiled(error_model="numpy")
def _freedom_of(weight, inflation):
    """Degrees of freedom f of inflated noise; its logarithm has variance 2/f for an estimated AR(1)."""
    return weight / (1.0 + 2.0 * inflation * inflation) - 3.0 if inflation > 1.0 else weight - 3.0


@compiled(error_model="numpy")
def _noise(state):
    """Noise of the triangle (sd), its degrees of freedom, inflation, squared differences of residuals."""
    rows = _arrays(state)
    value = rows[15, :3]
    back_substitute(rows, 3, value)
    lagged, rounding = _differences(state, value)
    weight = state[at.WEIGHT]
    inflation = _inflation_of(state, state[at.SQUARES], weight, lagged, rounding)
    freedom = _freedom_of(weight, inflation)
    sd = np.sqrt(state[at.SQUARES] / (weight - 3.0 * inflation**2)) if freedom > 0.0 else inf
    return sd, freedom, inflation, lagged


@compiled(error_model="numpy")
def _write_noise(state, ratio, form):
    """Write noise, freedom, inflation and form bound (both over the ratio) that make the smallest band."""
    sd, freedom, inflation, lagged = _noise(state)
    state[at.FREED] = 0.0
    if inflation > 1.0 and state[at.TURNS] > 0.0:  # noise freed of form, and the shift by form
        long, free = _long_noise(state, 0.5 * lagged / state[at.WEIGHT]), at.ABOVE * state[at.TURNS]
        if _quantile(state, free) * long < _quantile(state, freedom) * sd * inflation:
            state[at.FREED] = 1.0
            sd, freedom = np.sqrt(state[at.SQUARES] / (state[at.WEIGHT] - 3.0)), free
            inflation = long / sd
            form = max(form, _moved_by_form(state))
    state[at.FIT_NOISE], state[at.FREEDOM], state[at.INFLATION] = sd / ratio, freedom, inflation
    state[at.FORM_BOUND] = form * ratio
