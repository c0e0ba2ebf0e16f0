"""Kernels of the tests: each construct that is translated, with what Python makes of it."""

import math
from typing import NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.states import record

PLACE = record("angle rad, speed rad/s, gain[4] 1, load N m")
WHERE, COUNT = 2, 7
WEIGHTS = np.array([0.25, -1.5, 3.0])
POINTS = (1.5, -2.0, 0.1)


class Pair(NamedTuple):
    """Two numbers."""

    first: float
    second: float


class Table(NamedTuple):
    """An array and a number."""

    cells: np.ndarray
    scale: float


@compiled(error_model="numpy")
def arithmetic(state, x, y, out):
    """Operators in their order: a - (b - c) is not a - b - c."""
    out[0] = x - (y - 1.0) + 2.0 * (x + y) / (1.0 + x * x)
    out[1] = -(-1.0 * x) - -y
    out[2] = x / y
    out[3] = (x + y) ** 2 + x**3 - y**5
    out[4] = 1.0 / (1.0 + x * x) ** 3
    out[5] = float(COUNT) / 2 + WHERE
    out[6] = math.fabs(x) + np.abs(y) + abs(-3)
    return 0


@compiled(error_model="numpy")
def whole_numbers(state, x, y, out):
    """Rounded down, with the sign of the divisor; shifts, bits, casts."""
    a, b = int(x), int(y)
    out[0] = a // 3 + 10 * (a // -3)
    out[1] = a % 3 + 10 * (a % -3)
    out[2] = a // b if b != 0 else -1
    out[3] = (a << 2) + (a >> 1) + (a & 5) + (a | 2) + (a ^ 3)
    out[4] = np.int64(x + y)
    out[5] = abs(a) + min(a, b) - max(a, b, 1)
    out[6] = (a > b) + 2 * (a == b) + math.floor(x) * math.ceil(y) // 3 + math.trunc(x)
    return a % 4


@compiled(error_model="numpy")
def remainders(state, x, y, out):
    """Remainder of floats with the sign of the divisor."""
    out[0], out[1], out[2], out[3] = x % y, x % 3.0, x % -3.0, (x + 0.5) % 1.0
    return 0


@compiled(error_model="numpy")
def extremes(state, x, y, out):
    """Minima with NaN as Python has them."""
    out[0], out[1], out[2] = min(x, y), max(x, y), min(x, y, 0.25)
    out[3], out[4] = max(-0.0, x), min(1, y)
    return 0


@compiled(error_model="numpy")
def truths(state, x, y, out):
    """Chains, `and`, `or`, `not`, choices; numbers as truths."""
    out[0] = 1.0 if -1.0 < x <= y < 2.0 else 0.0
    out[1] = (x > 0.0 and y > 0.0) or not x < -1.0
    out[2] = 1.0 * np.isnan(x) + 2.0 * np.isfinite(y) + 4.0 * math.isinf(x)
    out[3] = x and y
    out[4] = x or 7.0
    number = int(y) if np.isfinite(y) and abs(y) < 9.0 else 0
    if number:
        out[5] = 1.0
    elif not number and x != x:
        out[5] = 2.0
    else:
        out[5] = 3.0
    return 0


@compiled
def _bumped(state, by):
    state[0] += by
    return state[0]


@compiled
def _pair(state, x):
    state[1] = x
    return Pair(x, state[0])


@compiled(error_model="numpy")
def calls(state, x, y, out):
    """Calls that change what others read, in the order of Python."""
    out[0] = state[0] + _bumped(state, x) * 2.0 + state[0]
    out[1] = _bumped(state, y) - _bumped(state, 1.0)
    out[2] = 5.0 if x > 0.0 and _bumped(state, 1.0) > 3.0 else _bumped(state, -1.0)
    pair = _pair(state, y)
    out[3], out[4] = pair.first, pair.second
    other = Pair(pair.second, 2.0 * pair.first)
    out[5] = _sum(other) + _sum(Pair(1.0, x))
    state[0] *= 0.5
    state[int(abs(_bumped(state, 0.0))) % 2] += _bumped(state, 0.25)
    out[6] = state[1]
    return 0


@compiled
def _sum(pair):
    first, second = pair
    return first + second


@compiled(error_model="numpy")
def sequences(state, x, y, out):
    """All right sides before the left ones."""
    a = np.empty(3)
    a[0], a[1], a[2] = 1.0, 2.0, 3.0
    a[0], a[1], a[-1] = a[1], a[-1], a[0]
    x, y = y, x
    x, y = x + y, x - y
    out[0], out[1], out[2], out[3], out[4] = a[0], a[1], a[2], x, y
    first = second = x * 2.0
    out[5], out[6] = first, second
    return 0


@compiled(error_model="numpy")
def loops(state, x, y, out):
    """Ranges, their last value, `break`, `continue`, loops over tuples, `while` with a bound."""
    total, k = 0.0, -1
    for k in range(2, 9, 3):
        total += k * x
    out[0], out[1] = total, k
    for i in range(5, 0, -1):
        if i == 4:
            continue
        if i * y > 6.0:
            break
        total -= i
    out[2] = total
    for a, b in ((1, 2.5), (WHERE, x)):
        total += a * b
    for weight in POINTS:
        total *= weight
    out[3] = total
    rest, turns = abs(x), 0
    while rest > 0.5:  # at most 64
        rest *= 0.5
        turns += 1
    out[4], out[5] = rest, turns
    last = 0
    for _ in range(COUNT):
        last += 2
    out[6] = last
    return turns if turns < 3 else 3


@compiled(error_model="numpy")
def views(state, x, y, out):
    """Slices, shapes, transposed, fills, copies, arrays of constants."""
    grid = state[1:7].reshape(2, 3)
    grid[0, :] = x
    grid[1] = y
    grid[:, -1] += 1.0
    turned = grid.T
    out[0], out[1], out[2] = turned[2, 0], grid[1, 2], state[6]
    part = np.zeros(4)
    part[1:3] = state[2:4]
    part *= 2.0
    place = int(abs(x)) % 2
    out[3] = part[place + 1] + part[place : place + 2].size + len(part)
    total = 0.0
    for k in range(WEIGHTS.size):
        total += WEIGHTS[k] * POINTS[k] + grid[place, k]
    out[4] = total
    flags = np.zeros(3, dtype=np.bool_)
    counts = np.zeros((2, 2), dtype=np.int64)
    flags[place] = True
    counts[place, 1] = 5
    for k in range(3):
        if flags[k]:
            counts[0, 0] += k + 1
    out[5], out[6] = counts[0, 0], counts[place, 1]
    return 0


@compiled
def _row(state, gain):
    place = state.view(PLACE)[0]
    place.speed += gain * place.angle
    place.gain[2] = place.speed
    _loaded(place, gain)
    return place.gain[2] + place.load


@compiled
def _loaded(place, gain):
    place.load = gain
    for k in range(place.gain.size):
        place.gain[k] *= 2.0


@compiled(error_model="numpy")
def records(state, x, y, out):
    """Rows of floats with names."""
    state[0] = x
    out[0] = _row(state, y)
    out[1] = state[WHERE]
    return 0


@compiled
def _looked_up(table, index):
    return table.scale * table.cells[index] + table.cells.size


@compiled(error_model="numpy")
def constants(state, table, pairs, flags, halves, x, y, out):
    """Constants of the law: arrays and numbers in NamedTuples, small integers, four-byte floats."""
    k = int(abs(x)) % 3
    out[0] = _looked_up(table, k)
    out[1] = pairs.first - pairs.second * y
    out[2] = flags[k]
    out[3] = flags[k] * 3 + k
    out[4] = y * halves[k] + x
    out[5] = np.float64(halves[k])
    return 0


@compiled(error_model="numpy")
def functions(state, x, y, out):
    """Elementary functions."""
    out[0] = np.exp(x) + math.sin(y) + np.cos(x) * math.tan(y)
    out[1] = np.log(abs(x)) + np.log1p(abs(y)) + np.expm1(x) + np.hypot(x, y)
    out[2] = np.arctan2(x, y) + math.asin(x / (1.0 + abs(x))) + np.arccos(0.1) + math.atan(y)
    out[3] = abs(x) ** y + abs(y) ** 0.25
    out[4] = np.floor(x) + np.ceil(y) + np.rint(x) + math.copysign(1.0, y) + np.sqrt(abs(x)) + np.trunc(y)
    return 0


@compiled(error_model="numpy")
def seldom(state, x, y, out):
    """Arrays unpacked, slices to ends that are computed, conditions that need statements before them."""
    row = np.zeros(2)
    row[0], row[1] = x, -y
    a, b = row
    width: float = +a - (+b)
    place = int(abs(x)) % 3
    behind = WEIGHTS[place:]
    out[0], out[1] = width, behind[0] + 10.0 * behind.ndim
    state[0], turns = min(abs(x), 9.0), 0
    while _bumped(state, -0.75) > 0.5:  # at most 16
        turns += 1
    out[2] = state[0] + turns
    short = np.zeros(3, dtype=np.int16)
    for k in range(3):
        short[k] = place * k - 1
    out[3] = short[place] + 2**COUNT + min(COUNT, WHERE, 5) + 10 * max(WHERE, COUNT)
    out[4] = 1.0 if bool(place) and bool(y) else 0.0
    return place


ALL = (
    arithmetic, whole_numbers, remainders, extremes, truths, calls, sequences, loops, views, seldom, records,
    functions,
)  # fmt: skip


@compiled(error_model="numpy")
def counted(state, x, out):
    """A size in the state: constant where it is a setting."""
    room = np.empty(int(state[0]))
    for k in range(room.size):
        room[k] = x
    state[1] = 0.0
    for k in range(int(state[0])):
        state[1] += room[k]
    out[0] = state[1]
    return 0


class Rule(NamedTuple):
    """Numbers of a rule of which one is made in a kernel."""

    limit: float
    gain: float
    on: bool


@compiled(error_model="numpy")
def _limited(rule, x, lag):
    """Within a limit, where there is one; late, where there is a lag."""
    late = x * lag if lag > 0.0 else x
    if rule.on and rule.limit > 0.0:
        return min(max(late, -rule.limit), rule.limit) * rule.gain
    return late * rule.gain


@compiled(error_model="numpy")
def _allowed(rule):
    return rule.on and rule.limit > 1.0


@compiled(error_model="numpy")
def known(state, rule, lag, flags, x, y, out):
    """Branches that a law decides, through variables, tuples, calls, tables and loops of one turn."""
    made = Rule(2.0 * rule.limit, y, rule.on)
    zero = 0.0
    out[0] = _limited(rule, x, lag) + _limited(made, x, zero)
    if _allowed(rule):
        out[1] = 1.0
    sign = -0.0
    for k in range(1, 2):
        out[2] = x if k == 0 else y * sign
        sign = min(sign, np.inf)
        x = max(x, -np.inf)
    out[3] = flags[int(abs(x)) % 3] + (1 if zero <= y < 0.0 else 2)
    if not rule.on:
        return 1
    if x > 1e300:  # guard: beyond what is handed over
        return -1
    out[4] = 1.0 if rule.on and not lag > 0.0 else np.exp(x)
    return 0


@compiled(error_model="numpy")
def weights(x):
    """A name that `doubled` has for a table."""
    return x + x


@compiled(error_model="numpy")
def doubled(state, weights_, x, out):
    """A table named as a kernel is, but for an underscore that C does not see."""
    out[0] = weights(x)
    for k in range(weights_.size):
        out[0] += weights_[k]
    return 0


@compiled(error_model="numpy")
def counted_on(state, x, out):
    """A state of which a reset leaves two numbers open."""
    state[2] += x
    out[0], out[1] = state[0], state[2]
    return 0
