"""Slow, obvious twins of the solver, written from the equations: loops over stages, modes, nodes, moves and
controls.

One float at a time goes into the user's callbacks. Expectations are sums over outcomes: the atoms of a
discrete law, or Gauss-Legendre points of a continuous density in pieces that no kink of the value-to-go
divides."""

from collections import namedtuple
from functools import cache
from itertools import product
from math import exp, inf, log, pi, sqrt
from unittest.mock import patch

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from sdpgrind import sdp

GAUSS = np.polynomial.legendre.leggauss(16)


def density(law):
    """Density, support and atoms [(value, probability)] of a law of shape (), from its textbook formula."""
    mean, sd = float(law.mean), float(law.sd)
    if isinstance(law, sdp.Rayleigh):
        q = sd / sqrt(2 - pi / 2)
        start = mean - q * sqrt(pi / 2)
        return (
            (lambda d: (d - start) / q**2 * np.exp(-((d - start) ** 2) / (2 * q * q))),
            start,
            start + 9 * q,
            [],
        )
    if isinstance(law, sdp.LogNormal):
        var = log(1 + (sd / mean) ** 2)
        mu = log(mean) - var / 2
        low, high = exp(mu - 9 * sqrt(var)), exp(mu + 9 * sqrt(var))
        return (
            (lambda d: np.exp(-((np.log(d) - mu) ** 2) / (2 * var)) / (d * sqrt(2 * pi * var))),
            low,
            high,
            [],
        )
    if isinstance(law, sdp.Normal):
        return (
            (lambda d: np.exp(-(((d - mean) / sd) ** 2) / 2) / (sd * sqrt(2 * pi))),
            mean - 9 * sd,
            mean + 9 * sd,
            [],
        )
    raise TypeError(f"no density for {law!r}")


def outcomes(law, cuts=()):
    """Values and probabilities of a law of shape (); `cuts` are values of D at which what is averaged has a
    kink.
    """
    if isinstance(law, sdp.Discrete | sdp.Point) or float(law.sd) == 0:
        values, weights = law.nodes(50)
        return np.ravel(values), np.ravel(weights)
    f, low, high, atoms = density(law)
    between = np.geomspace(low, high, 41) if isinstance(law, sdp.LogNormal) else np.linspace(low, high, 13)
    ends = np.unique(np.clip([low, *cuts, high, *between], low, high))
    half, middle = np.diff(ends)[:, None] / 2, (ends[1:] + ends[:-1])[:, None] / 2
    points = (middle + half * GAUSS[0]).ravel()
    weights = (half * GAUSS[1]).ravel() * f(points)
    return np.append(points, [a for a, _ in atoms]), np.append(weights, [p for _, p in atoms])


@cache
def named(kind, fields):
    return namedtuple(kind, fields)


class Twin:
    """The equations of `sdpgrind.sdp`, by loops."""

    def __init__(self, problem):
        self.problem = problem
        self.axes, self.modes = problem.axes, len(problem.modes)
        self.nodes = [
            np.geomspace(a.low, a.high, a.nodes) if a.scale == "log" else np.linspace(a.low, a.high, a.nodes)
            for a in self.axes
        ]
        self.scaled = [
            np.log(x) if a.scale == "log" else x for x, a in zip(self.nodes, self.axes, strict=True)
        ]
        self.shape = tuple(a.nodes for a in self.axes)
        self.stages = problem.stages if isinstance(problem.stages, sdp.Stages) else None
        self._memory = {}

    def tuple_of(self, kind, fields):
        return named(kind, tuple(fields))(**fields)

    def state(self, point, mode, stage=None, without=None):
        fields = {a.name: float(x) for a, x in zip(self.axes, point, strict=True) if a.name != without}
        if stage is not None and self.stages is not None:
            fields[self.stages.name] = stage * self.stages.step
        if self.modes > 1:
            fields["mode"] = mode
        return self.tuple_of("S", fields)

    def rows(self, move):
        """All controls of a move: (entry of the lists, dict)."""
        lists = {k: np.ravel(v) for k, v in move.controls.items() if not isinstance(v, sdp.Levels)}
        entries = len(next(iter(lists.values()))) if lists else 1
        name = next((k for k, v in move.controls.items() if isinstance(v, sdp.Levels)), None)
        levels = [None] if name is None else plain_levels(move.controls[name])
        for entry, level in product(range(entries), levels):
            c = {k: v[entry] for k, v in lists.items()}
            yield entry, c | ({} if name is None else {name: float(level)})

    def leads_to(self, move, point, mode, stage, c):
        """Outcomes [K, axes], their probabilities and further charges [K]."""
        told = stage if move.timed else None
        c = self.tuple_of("C", c)
        if isinstance(move.to, sdp.Stay):
            return np.array([point], dtype=float).reshape(1, -1), np.ones(1), np.zeros(1)
        if isinstance(move.to, sdp.Shift):
            axis = [a.name for a in self.axes].index(move.to.axis)
            s = self.state(point, mode, told, without=move.to.axis)
            values, weights = outcomes(
                move.to.law(s, c), point[axis] - np.append(self.nodes[axis], self._kinks(point[axis]))
            )
            rest = move.to.others(s, c) if move.to.others else [x for k, x in enumerate(point) if k != axis]
            after = [np.full(values.shape, float(x)) for x in rest]
            after.insert(axis, point[axis] - values)
            return np.array(after).T, weights, np.zeros(values.size)
        s = self.state(point, mode, told)
        names = list(move.to.noise)
        pairs = [law.nodes(move.to.points) for law in move.to.noise.values()]
        after, weights, extra = [], [], []
        for picked in product(*(range(np.size(x)) for x, _ in pairs)):
            e = self.tuple_of(
                "E", {n: float(np.ravel(x)[k]) for n, (x, _), k in zip(names, pairs, picked, strict=True)}
            )
            nxt = move.to.step(s, c, e)
            after.append([float(x) for x in nxt])
            weights.append(np.prod([np.ravel(w)[k] for (_, w), k in zip(pairs, picked, strict=True)]))
            n = self.tuple_of("N", dict(zip([a.name for a in self.axes], nxt, strict=True)))
            extra.append(0.0 if move.to.charge is None else float(move.to.charge(s, c, n)))
        return np.array(after).reshape(len(weights), -1), np.array(weights), np.array(extra)

    def _kinks(self, x):
        """Places beyond the ends at which a stop charge has a kink or jump."""
        found = []
        for stop in self.problem.stops:
            if isinstance(stop.charge, sdp.Charge):
                found += [
                    side.tolerance * sign
                    for side, sign in ((stop.charge.under, 1), (stop.charge.over, -1))
                    if isinstance(side, sdp.OneSided)
                ]
        return found

    def landed(self, after, mode):
        """Value of outcomes outside the grid, NaN inside; where being late is charged there, too; and the
        outcomes clamped to the grid, on scales whose nodes are evenly spaced.
        """
        value, after, ended = np.full(len(after), np.nan), after.copy(), np.zeros(len(after), dtype=bool)
        for k, axis in enumerate(self.axes):
            for end, edge, sign in ((axis.low, axis.below, -1), (axis.high, axis.above, 1)):
                off = sign * (after[:, k] - end)
                if edge == "stop":
                    stop = self.problem.stops[0]
                    out = (off > 0) & np.isnan(value)
                    extra = (
                        0.0
                        if stop.extra is None
                        else float(stop.extra(self.state([], mode) if not self.axes else self._bare(mode)))
                    )
                    value[out] = stop.charge(after[out, k]) + extra
                    ended |= out
                elif not isinstance(edge, str):
                    out = (off >= 0) & np.isnan(value)
                    value[out] = edge
                elif edge == "refuse":
                    assert np.all(off[np.isnan(value)] < 1e-9), "left a refused end"
            after[:, k] = np.clip(after[:, k], axis.low, axis.high)
            if axis.scale == "log":
                after[:, k] = np.log(after[:, k])
            scaled = self.scaled[k]
            after[:, k] = np.clip(after[:, k], scaled[0], scaled[-1])
        return value, ended, after

    def _bare(self, mode):
        return self.tuple_of("S", {"mode": mode} if self.modes > 1 else {})

    def worth(self, table, landed, mode, late):
        """Value-to-go of outcomes, for table[mode, nodes...]."""
        value, ended, inside = landed
        if not self.axes:
            return np.full(len(value), float(table[mode]))
        inner = (
            np.interp(inside[:, 0], self.scaled[0], table[mode])
            if len(self.axes) == 1
            else RegularGridInterpolator(self.scaled, table[mode])(inside)
        )
        return np.where(np.isnan(value), inner, np.where(ended, value + late, value))

    def stop_cost(self, stop, point, mode, stage, late):
        s = self.state(point, mode, stage)
        if stop.allowed is not None and not stop.allowed(s):
            return inf
        axis = self.problem.stop_axis
        charge = stop.charge(point[axis]) if isinstance(stop.charge, sdp.Charge) else stop.charge(s)
        return float(charge) + (0.0 if stop.extra is None else float(stop.extra(s))) + late

    def remembered(self, move, index, point, mode, stage, entry, c):
        """What does not depend on the value-to-go: charge, mode of arrival, where outcomes land, and what
        `leads_to` tells of them; kept for moves that are not timed.
        """
        key = (move.name, index, mode, entry, tuple(c.items()), stage if move.timed else None)
        if key not in self._memory:
            s = self.state(point, mode, stage if move.timed else None)
            named = self.tuple_of("C", c)
            allowed = move.allowed is None or bool(move.allowed(s, named))
            charge = float(move.charge(s, named)) if callable(move.charge) else move.charge
            self._memory[key] = None
            if allowed:
                arrival = self.arrival(move, mode, entry)
                after, weights, extra = self.leads_to(move, point, mode, stage, c)
                self._memory[key] = charge, arrival, self.landed(after, arrival), weights, extra
        return self._memory[key]

    def arrival(self, move, mode, entry):
        """Mode in which a move arrives."""
        if move.into is None:
            return mode
        return self.problem.modes.index(move.into if isinstance(move.into, str) else move.into[entry])

    def move_cost(self, move, index, point, mode, stage, table, late):
        """Least cost of a move from one node into a table[mode, nodes...], and its controls."""
        best, chosen = inf, None
        for entry, c in self.rows(move):
            found = self.remembered(move, index, point, mode, stage, entry, c)
            if found is None:
                continue
            charge, arrival, landed, weights, extra = found
            q = charge + float(weights @ (self.worth(table, landed, arrival, late) + extra))
            if q < best - 1e-9 - 1e-7 * abs(q):
                best, chosen = q, c
            best = min(best, q)
        return best, chosen

    def sweep(self, stage, ahead, late_at):
        """J[mode, nodes...] and the names of what is best; `ahead(move)` gives the table it leads into, or
        None.
        """
        value, name = (
            np.full((self.modes, *self.shape), inf),
            np.empty((self.modes, *self.shape), dtype=object),
        )
        for mode in range(self.modes):
            for index in product(*(range(n) for n in self.shape)):
                point = [x[k] for x, k in zip(self.nodes, index, strict=True)]
                costs = [
                    (self.stop_cost(stop, point, mode, stage, late_at(stage)), stop.name)
                    for stop in self.problem.stops
                ]
                for move in self.problem.moves:
                    table = ahead(move)
                    if table is not None:
                        costs.append(
                            (
                                self.move_cost(
                                    move,
                                    index,
                                    point,
                                    mode,
                                    stage,
                                    table,
                                    late_at((stage or 0) - move.duration),
                                )[0],
                                move.name,
                            )
                        )
                low = min(q for q, _ in costs)
                value[(mode, *index)] = low
                name[(mode, *index)] = next(n for q, n in costs if q <= low + 1e-9 + 1e-7 * abs(low))
        return value, name

    def countdown(self, depth=0):
        """Tables by stage, from -depth to the start; before that one can only stop."""
        late = self.stages.late

        def late_at(stage):
            return float(late(-stage * self.stages.step)) if late is not None and stage < 0 else 0.0

        values, names = {}, {}
        for stage in range(
            -depth - max(m.duration for m in self.problem.moves), -depth if late is not None else -(10**9)
        ):
            values[stage], _ = self.sweep(stage, lambda move: None, late_at)
        for stage in range(-depth if late is not None else 0, self.stages.count + 1):
            values[stage], names[stage] = self.sweep(
                stage, lambda move, stage=stage: values.get(stage - move.duration), late_at
            )
        return values, names

    def forever(self, sweeps=3000):
        """Value iteration from nothing until it stands still."""
        value = np.zeros((self.modes, *self.shape))
        for _ in range(sweeps):
            new, names = self.sweep(None, lambda move, value=value: value, lambda stage: 0.0)
            if np.max(np.abs(new - value)) < 1e-13 * max(1.0, np.max(np.abs(new))):
                return new, names
            value = new
        raise AssertionError("does not settle")


def plain_levels(levels):
    """Levels without search: equally spaced, breaks added."""
    assert not levels.search, "the twin knows only what is tried"
    return sorted({*np.linspace(levels.low, levels.high, levels.count), *levels.breaks})


def compare(problem, depth=0, tolerance=1e-10):
    """Assert that `plan` and the twin agree at every stage, mode and node; return both."""
    twin, policy = Twin(problem), sdp.plan(problem)
    # small problems in one axis go another way than large ones
    with patch("sdpgrind.sdp._solve.stages.SMALL", 0):
        large = sdp.plan(problem)
    np.testing.assert_allclose(large.table.value, policy.table.value, rtol=1e-12, atol=1e-13)
    assert np.array_equal(large.table.best, policy.table.best)
    values, names = twin.countdown(depth)
    labels = [*(s.name for s in problem.stops), *(m.name for m in problem.moves)]
    for stage in range(0, problem.stages.count + 1):
        row = stage - policy.countdown.first
        got = policy.table.value[row].reshape(values[stage].shape)
        np.testing.assert_allclose(
            got, values[stage], rtol=tolerance, atol=tolerance, err_msg=f"stage {stage}"
        )
        best = policy.table.best[row].reshape(values[stage].shape)
        which = np.where(best < 0, -1 - best, best + len(problem.stops))
        clear = policy.table.gap[row].reshape(values[stage].shape) > 1e-6
        assert np.all(np.array(labels, dtype=object)[which][clear] == names[stage][clear]), (
            f"stage {stage}: {which} {names[stage]}"
        )
    return policy, values


def compare_forever(problem, tolerance=1e-9):
    """The same for a process without deadline."""
    policy = sdp.plan(problem)
    value, _ = Twin(problem).forever()
    np.testing.assert_allclose(
        policy.table.value[0].reshape(value.shape), value, rtol=tolerance, atol=tolerance
    )
    return policy, value
