"""Slow, obvious twins of the strategy's kernels, and a strategy that is quick to plan."""

from math import atan2, cos, exp, hypot, log, pi, sin, sqrt

import numpy as np
from push_inside import (
    FINE,
    FRICTION_SCALES,
    RESTING,
    Size,
    prepared,
    solved,
    speed_after,
    turn_time,
)

from centering.cycle import OutcomeTable, PushKind
from sdpgrind.base.progress import silent

QUICK = (
    PushKind("trapezoid", 5.0, True),
    PushKind("trapezoid", 20.0, True),
    PushKind("trapezoid", 83.0, True),
    PushKind("gentle", 10.0, True),
    PushKind("gentle", 40.0, True),
)
COARSE = Size(40, 3)


def quick_strategy(problem, *, kinds=QUICK, size=COARSE, executor=None, spindle_speed="scheduled"):
    """A strategy on a coarse grid with few kinds of push."""
    return solved(prepared(problem, spindle_speed, kinds, size, executor, silent), executor, silent)


def made_up_table():
    """Outcomes by a formula: travel = max(0, stroke - 0.03 scale) + 0.1 stroke (1 - scale)."""
    strokes = 0.01 * 1.1 ** np.arange(80)
    travel = np.maximum(0.0, strokes[:, None] - 0.03 * FRICTION_SCALES) + 0.1 * strokes[:, None] * (
        1.0 - FRICTION_SCALES
    )
    travel = np.maximum(travel, 0.0)
    return OutcomeTable(
        (PushKind("trapezoid", 10.0, True),), 0.01, 1.1, travel[None], (strokes / 10.0)[None], np.array([75])
    )


def even(scale):
    """What the friction scales of the tables are even in."""
    return np.arcsinh((scale - 1.0) / FINE)


def travel_twin(table, kind, stroke, scale):
    """Bilinear in log stroke and scale, by two plain interpolations."""
    if stroke <= 0:
        return 0.0
    at, nodes = even(scale), even(FRICTION_SCALES)
    above = min(max(int(np.searchsorted(table.strokes, stroke)), 1), table.strokes.size - 1)
    near = slice(above - 1, above + 1)
    at_scale = [np.interp(at, nodes, row) for row in table.travel[kind][near]]
    return float(np.interp(log(stroke), np.log(table.strokes[near]), at_scale))


def stroke_twin(table, kind, scale, travel):
    """Least stroke whose mean travel reaches what is wanted, by a fine search."""
    at, nodes = even(scale), even(FRICTION_SCALES)
    mean = np.array([np.interp(at, nodes, row) for row in table.mean_travel[kind]])
    if mean[table.last[kind]] < travel:
        return np.inf
    first = int(np.argmax(mean >= travel))  # it grows with the stroke
    fine = np.linspace(max(first - 1, 0), first, 5001)
    reached = np.interp(fine, np.arange(mean.size), mean) >= travel
    return table.first_stroke * table.stroke_ratio ** fine[np.argmax(reached)]


def turned_twin(time, before, speed, rate, held, steady):
    """Rotation (rad) of a table in a time, in small steps of its speed."""
    steps = 4000
    middle = (np.arange(steps) + 0.5) * (time / steps)
    change = rate * np.clip(middle - held, 0.0, max(time - held - steady, 0.0))
    speeds = np.minimum(before + change, speed) if speed > before else np.maximum(before - change, speed)
    return float(speeds.mean() * time)


def between_twin(phase, pressed, times, before, speed, rate):
    """Time from push to push, turn by turn; `times` of the push, its measurement and the next approach."""
    tip, arc, launch, lead = times
    first, held = pressed + tip[1], pressed + tip[0]
    begun = speed_after(first, before, speed, rate, held, 0.0)
    measured = turn_time(arc, begun, speed, rate, max(held - first, 0.0), 0.0)
    soonest = max(first + max(measured, tip[3]), pressed + tip[2]) + launch
    while (time := turn_time(phase, before, speed, rate, held, lead)) < soonest:
        phase += 2 * pi
    return time, soonest


def push_twin(ground, kind, offset, friction, share, seen, evidence, draws):
    """Expected time and the weights on the nodes (a dict), draw by draw; as `all_draws` from one state."""
    table, problem, belief = ground.outcomes, ground.problem, ground.belief
    where, scale = ground.axes
    stroke = table.stroke_for(kind, share * offset, friction)
    if not np.isfinite(stroke):
        return np.inf, {}
    sd = belief.sd(evidence)
    spread = sqrt(sd**2 + belief.push_sd**2)
    pressed = float(np.interp(log(stroke), np.log(table.strokes), table.contact_time[kind]))
    nodes = np.log(np.geomspace(where.low, where.high, where.nodes))

    def speed(d):
        return float(np.interp(log(max(d, where.low)), nodes, ground.speeds))

    travels = np.array(
        [
            travel_twin(table, kind, stroke + p, friction + spread * f)
            for f, p in zip(draws[0], draws[2], strict=True)
        ]
    )
    noise2 = problem.scatter.stop_sd**2 + 2 * problem.scatter.measuring_sd**2
    gain = np.cov(travels, draws[0], bias=True)[0, 1] / (np.var(travels) + noise2)
    time, weights = 0.0, {}
    for q, (x, angle, hidden, w) in enumerate(zip(travels, draws[1], draws[3], draws[4], strict=True)):
        along, across = offset + hidden - x * cos(angle), -x * sin(angle)
        after, phase = hypot(along, across), (-atan2(across, along)) % (2 * pi) or 2 * pi
        tip, launch, lead, arcs, ends, before, rate = ground.timing.of_kind(kind, seen)
        row = q % len(arcs)
        begun = float(np.interp(log(offset), nodes, before[row]))
        if after <= ground.finish:
            end = float(np.interp(after, np.linspace(0.0, ground.finish, ends.shape[1]), ends[row]))
            time += (
                w * between_twin(1e9, RESTING * pressed, (tip, end, 0.0, 0.0), begun, speed(0.0), rate[0])[1]
            )
            continue
        arc, launch, lead, gains = (
            float(np.interp(log(after), nodes, column)) for column in (arcs[row], launch, lead, rate)
        )
        times = tip, arc, launch, lead
        time += w * between_twin(phase, RESTING * pressed, times, begun, speed(after), gains)[0]
        mean = friction + (sd**2 / spread if spread else 0.0) * gain * (x - travels.mean())
        mean = min(max(mean, scale.low), scale.high)
        i = min(log(after / where.low) / (log(where.high / where.low) / (where.nodes - 1)), where.nodes - 1)
        j = (mean - scale.low) / ((scale.high - scale.low) / (scale.nodes - 1))
        a, b = min(int(i), where.nodes - 2), min(int(j), scale.nodes - 2)
        for up in (0, 1):
            for right in (0, 1):
                part = w * (i - a if up else 1 - i + a) * (j - b if right else 1 - j + b)
                node = (a + up) * scale.nodes + b + right
                weights[node] = weights.get(node, 0.0) + part
    return time, weights


def posterior_twin(travel_of, friction, sd, push_sd, noise, travelled):
    """Bayes' rule on a very fine grid of part and push."""
    z, e = np.linspace(-5, 5, 201), np.linspace(-5, 5, 1001)
    weight = np.array(
        [
            exp(-0.5 * a * a)
            * np.sum(
                np.exp(
                    -0.5 * e**2
                    - 0.5 * ((travelled - travel_of((friction + sd * a) * (1 + push_sd * e))) / noise) ** 2
                )
            )
            for a in z
        ]
    )
    mean = np.sum(weight * z) / weight.sum()
    return friction + sd * mean, sd * sqrt(np.sum(weight * z**2) / weight.sum() - mean**2)
