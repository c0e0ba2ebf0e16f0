"""Successors of many states under a push: offset, belief and waiting time move on the same draw."""

import numpy as np

from centering.cycle._strategy.outcome_kernels import scale_cell, stroke_for, travel_in_cell
from centering.cycle._strategy.turning_kernels import RESTING, measured_at, push_to_push
from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _between(values, i):
    """Linear interpolation at a fractional index."""
    a = min(int(i), values.size - 2)
    return _inside(values, a, i - a)


@compiled(error_model="numpy")
def _inside(values, a, x):
    """Linear interpolation at a share `x` of the cell that begins at index `a`."""
    return values[a] + x * (values[a + 1] - values[a])


@compiled(error_model="numpy")
def table_speed(speeds, axis, offset):
    """Table speed (rad/s) at an offset (mm), linear in its log; `axis` = (log low, step) of the offset."""
    return _between(speeds, min(max((np.log(offset) - axis[0]) / axis[1], 0.0), speeds.size - 1.0))


@compiled(error_model="numpy")
def _learning_rate(travel, friction, weight, noise):
    """Mean travel (mm), and change of a push's friction (in its sd) per mm of it: best linear estimate."""
    mean, square, product = 0.0, 0.0, 0.0
    for q in range(travel.size):
        mean += weight[q] * travel[q]
    for q in range(travel.size):
        square += weight[q] * (travel[q] - mean) ** 2
        product += weight[q] * (travel[q] - mean) * friction[q]
    variance = square + noise * noise
    return mean, product / variance if variance > 0.0 else 0.0


@compiled(error_model="numpy")
def _cells_of(known, slot, friction, spread, luck, grid, scales):
    """Cells of the friction scales of all draws, and positions in them; found anew for another friction.

    `known`: friction scale, cells and positions of each slot; the states of a plan share few friction scales.
    """
    kept, cells, places = known
    if kept[slot] != friction:
        kept[slot] = friction
        for q in range(luck.size):
            cells[slot, q], places[slot, q] = scale_cell(grid, friction + spread * luck[q], scales)
    return cells[slot], places[slot]


@compiled(error_model="numpy")
def _turn_to(along, across):
    """Rotation (rad) that brings the high point of a ring under the tip again, in (0, 2 pi]."""
    phase = -np.arctan2(across, along)
    return phase if phase > 0.0 else phase + 2.0 * np.pi


@compiled(error_model="numpy")
def push_once(offset, travel, angle):
    """Offset (mm) after a push, and the rotation (rad) that brings its high point under the tip again."""
    along, across = offset - travel * np.cos(angle), -travel * np.sin(angle)
    return np.hypot(along, across), _turn_to(along, across)


@compiled(error_model="numpy")
def all_draws(offset, friction, fraction, kind, tables, belief, timing, axes, draws, out):
    """Simulate pushes from P states; return row starts (P + 1,), columns and weights of the transitions.

    Parameters
    ----------
    offset, friction, fraction : array, (P,)
        State (mm, 1) and intended mean travel over offset.
    kind : tuple
        (travel [stroke, friction scale], mean travel, contact time [stroke], grid, last) of the kind of push.
    tables : tuple
        (table speeds at the nodes of the offset, measured offset of a centred part (mm)).
    belief : tuple
        (sd, push_sd, noise of the travel) before the push.
    timing : tuple
        `CycleTiming.of_kind`, s, rad, rad/s, rad/s^2.
    axes : tuple
        (log low, log step, nodes) of the offset and (low, step, nodes) of the friction scale.
    draws : tuple
        (friction, cosine and sine of the direction, place (mm), unmeasured share of it, weight), each (Q,).
    out : array, (P,)
        Expected time (s) to the next push or the end; infinite if no stroke is long enough.
    """
    travel, mean, contact, grid, last = kind
    speeds, finish = tables
    sd, push_sd, noise = belief
    after, launch, lead, arc, final_arc, before, rate = timing
    inward, firsts = (final_arc.shape[1] - 1) / finish, arc.shape[0]
    log_low, log_step, n_offset, low, step, n_friction = axes
    spread = np.sqrt(sd * sd + push_sd * push_sd)
    share = sd * sd / spread if spread > 0.0 else 0.0  # share of the part in the deviation of a push
    high = low + step * (n_friction - 1)
    luck, cosine, sine, place, hidden, weight = draws
    moved, begun = np.empty(luck.size), np.empty(arc.shape[0])
    known = (
        np.full(n_friction, np.nan),
        np.empty((n_friction, luck.size), np.int64),
        np.empty((n_friction, luck.size)),
    )
    points, count, room = offset.size, luck.size, 4 * luck.size
    starts = np.zeros(points + 1, dtype=np.int64)
    columns = np.empty(points * room, dtype=np.int32)
    weights = np.empty(columns.size)
    here, touched = np.zeros(n_offset * n_friction), np.empty(room, dtype=np.int32)
    axis = (log_low, log_step)
    at = 0
    for p in range(points):
        d, m = offset[p], friction[p]
        s = stroke_for(mean, grid, last, m, fraction[p] * d)
        if s == np.inf:
            out[p] = np.inf
            starts[p + 1] = at
            continue
        pressed = RESTING * _between(
            contact, min(max((np.log(s) - grid[0]) / grid[1], 0.0), contact.size - 1.0)
        )
        for row in range(firsts):
            begun[row] = table_speed(before[row], axis, d)
        node = min(max(int((m - low) / step + 0.5), 0), n_friction - 1)
        cells, places = _cells_of(known, node, m, spread, luck, grid, travel.shape[1])
        for q in range(count):
            moved[q] = travel_in_cell(travel, grid, s + place[q], cells[q], places[q])
        expected, learns = _learning_rate(moved, luck, weight, noise)
        time, many, first = 0.0, 0, -1
        for q in range(count):
            x, w = moved[q], weight[q]
            first = first + 1 if first < firsts - 1 else 0
            along, across = d + hidden[q] - x * cosine[q], -x * sine[q]
            square = along * along + across * across
            if square <= finish * finish:
                turned = _between(final_arc[first], inward * np.sqrt(square))
                time += w * measured_at(pressed, after, begun[first], speeds[0], rate[0], turned)
                continue
            i = min(max((0.5 * np.log(square) - log_low) / log_step, 0.0), n_offset - 1.0)
            a = min(int(i), n_offset - 2)
            turn, speed, gains = _turn_to(along, across), _inside(speeds, a, i - a), _inside(rate, a, i - a)
            others = _inside(arc[first], a, i - a), _inside(launch, a, i - a), _inside(lead, a, i - a)
            time += w * push_to_push(turn, pressed, after, begun[first], speed, gains, *others)[0]
            learned = min(max(m + share * learns * (x - expected), low), high)
            j = min((learned - low) / step, n_friction - 1.0)
            b = min(int(j), n_friction - 2)
            for corner in range(4):
                up, right = corner >> 1, corner & 1
                part = w * ((i - a) if up else (1.0 - i + a)) * ((j - b) if right else (1.0 - j + b))
                node = (a + up) * n_friction + b + right
                if part > 0.0:
                    if here[node] == 0.0:
                        touched[many] = node
                        many += 1
                    here[node] += part
        out[p] = time
        for k in range(many):
            columns[at], weights[at] = touched[k], here[touched[k]]
            here[touched[k]] = 0.0
            at += 1
        starts[p + 1] = at
    return starts, columns[:at].copy(), weights[:at].copy()
