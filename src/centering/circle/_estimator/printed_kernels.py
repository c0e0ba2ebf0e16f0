"""The source's own estimators, by readings, on one flat state for each part: steps and batches are bit-equal.

A state begins with the outputs after each reading (`OUTPUTS` slots), then the internal values:

========== ===============================================================================================
"rls"      two values [cos, sin] and their inverse information, Mears (4.40)-(4.44)
"prls"     triangle of all rows [1, cos, sin] so far, and the first two directions seen, (4.45)
"kalman"   the filtered reading and its variance (4.35)-(4.39), extremes of all filtered readings (4.48)
========== ===============================================================================================
"""

from math import cos, inf, nan, sin

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import covariance_step, measure, rotate, solve

RLS, PRLS, KALMAN = range(3)
RADIUS, CENTER_X, CENTER_Y, SQUARES, COUNT, LOW, HIGH = range(7)
OUTPUTS = 7  # derived: number of the output slots above
# derived: slots after the outputs, of each estimator
_VALUE, _MATRIX, _WORK, _COST = 7, 9, 13, 17  # rls
_ARRAY, _ROW, _SEEN, _MEAN, _TIMES, _DISTINCT, _LEFT, _WITHIN = 7, 19, 23, 27, 29, 31, 32, 33  # derived: prls
_FILTERED, _VARIANCE, _GAIN, _ONE, _MOST, _LEAST, _AT = range(7, 14)  # kalman
STATES = 34  # derived: slots of the largest state, of "prls"
_SAME = 1e-6  # chosen: directions that differ by less (|cos| + |sin|) are one


@compiled
def printed_start(state, kind, settings):
    """Empty a state; `settings` are known radius and initial inverse information, or variances Q and R."""
    state[:] = 0.0
    state[LOW], state[HIGH] = inf, -inf
    if kind == RLS:
        state[RADIUS] = settings[0]
        state[_MATRIX] = state[_MATRIX + 3] = settings[1]
    elif kind == KALMAN:
        state[_ONE], state[_MOST], state[_LEAST], state[SQUARES] = 1.0, -inf, inf, nan


@compiled
def printed_step(state, kind, settings, angle, reading):
    """Take one reading (rad, mm) into a state, in place."""
    state[COUNT] += 1.0
    state[LOW], state[HIGH] = min(state[LOW], angle), max(state[HIGH], angle)
    if kind == RLS:
        _rls(state, settings, angle, reading)
    elif kind == PRLS:
        _prls(state, angle, reading)
    else:
        _kalman(state, settings, angle, reading)


@compiled
def _rls(state, settings, angle, reading):
    """(4.40) for [cos, sin]; the cost, with the distance from the start, grows by error^2/(1 + h'Ph)."""
    value, matrix = state[_VALUE : _VALUE + 2], state[_MATRIX : _MATRIX + 4].reshape((2, 2))
    gain, row = state[_WORK : _WORK + 2], state[_WORK + 2 : _WORK + 4]
    row[0], row[1] = cos(angle), sin(angle)
    target = reading - settings[0]
    error = target - row[0] * value[0] - row[1] * value[1]
    covariance_step(value, matrix, row, target, 1.0, gain)
    state[_COST] += error * error * (1.0 - row[0] * gain[0] - row[1] * gain[1])
    state[CENTER_X], state[CENTER_Y] = value[0], value[1]
    state[SQUARES] = max(state[_COST] - (value[0] ** 2 + value[1] ** 2) / settings[1], 0.0)


@compiled
def _prls(state, angle, reading):
    """(4.45): least squares on all readings; of least norm until three directions have been seen."""
    array, row = state[_ARRAY : _ARRAY + 12].reshape((3, 4)), state[_ROW : _ROW + 4]
    row[0], row[1], row[2], row[3] = 1.0, cos(angle), sin(angle), reading
    if state[_DISTINCT] < 3.0:
        _notice(state, row)
    rotate(array, row)
    state[_LEFT] += row[3] ** 2
    if state[_DISTINCT] < 3.0:  # until then rounding may hide residuals in a pivot that should be 0
        state[SQUARES] = state[_WITHIN]
        _shortest(state)
    else:
        state[SQUARES] = state[_LEFT]
        solve(array, state[RADIUS : CENTER_Y + 1])


@compiled
def _notice(state, row):
    """Add a reading to the statistics of its direction; three directions determine a circle."""
    known = int(state[_DISTINCT])
    for k in range(known):
        if abs(row[1] - state[_SEEN + 2 * k]) + abs(row[2] - state[_SEEN + 2 * k + 1]) < _SAME:
            times, off = state[_TIMES + k], row[3] - state[_MEAN + k]
            state[_WITHIN] += off * off * times / (times + 1.0)
            state[_MEAN + k] += off / (times + 1.0)
            state[_TIMES + k] = times + 1.0
            return
    state[_DISTINCT] += 1.0
    if known < 2:
        state[_SEEN + 2 * known], state[_SEEN + 2 * known + 1] = row[1], row[2]
        state[_MEAN + known], state[_TIMES + known] = row[3], 1.0


@compiled
def _shortest(state):
    """Solution of least norm through mean readings z of one or two directions h: H'(HH')^-1 z; h'h = 2."""
    c, s = state[_SEEN], state[_SEEN + 1]
    first = state[_MEAN]
    if state[_DISTINCT] < 2.0:
        state[RADIUS], state[CENTER_X], state[CENTER_Y] = first / 2.0, first * c / 2.0, first * s / 2.0
        return
    c2, s2 = state[_SEEN + 2], state[_SEEN + 3]
    second = state[_MEAN + 1]
    apart = 0.5 * ((c - c2) ** 2 + (s - s2) ** 2)  # 2 - h1'h2, without cancellation
    share = (second - first) / apart
    mean = (first + second) / (4.0 - apart)
    a, b = 0.5 * (mean - share), 0.5 * (mean + share)
    state[RADIUS], state[CENTER_X], state[CENTER_Y] = 2.0 * a + share, a * c + b * c2, a * s + b * s2


@compiled
def _kalman(state, settings, angle, reading):
    """(4.35)-(4.39) from the first reading on, and (4.48) on all outputs so far."""
    value, variance = state[_FILTERED : _FILTERED + 1], state[_VARIANCE : _VARIANCE + 1].reshape((1, 1))
    if state[COUNT] == 1.0:
        value[0], variance[0, 0] = reading, settings[1]
    else:
        variance[0, 0] += settings[0]
        measure(value, variance, state[_ONE : _ONE + 1], reading, settings[1], state[_GAIN : _GAIN + 1])
    if value[0] > state[_MOST]:
        state[_MOST], state[_AT] = value[0], angle
    state[_LEAST] = min(state[_LEAST], value[0])
    offset = 0.5 * (state[_MOST] - state[_LEAST])
    state[RADIUS] = 0.5 * (state[_MOST] + state[_LEAST])
    state[CENTER_X], state[CENTER_Y] = offset * cos(state[_AT]), offset * sin(state[_AT])


@compiled
def printed_extend(state, kind, settings, angle, reading, outputs):
    """Take many readings into a state; write the outputs after each to `outputs`, shape (m, `OUTPUTS`)."""
    for i in range(angle.shape[0]):
        printed_step(state, kind, settings, angle[i], reading[i])
        for k in range(OUTPUTS):
            outputs[i, k] = state[k]


@compiled
def printed_histories(kind, settings, angle, readings, outputs):
    """Run series of readings (runs, m), each from an empty state; `outputs`: shape (runs, m, `OUTPUTS`)."""
    state = np.empty(STATES)
    for run in range(readings.shape[0]):
        printed_start(state, kind, settings)
        printed_extend(state, kind, settings, angle, readings[run], outputs[run])
