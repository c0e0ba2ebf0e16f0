"""Certain, cautious and belief-state planning of a bead with one unknown coefficient:
``python benchmarks/bead_belief.py [--case SIGMA TAU DEPTH_SD HEIGHT TIME]... [--beads N] [--nodes HEIGHTS GAINS]
[--problems N]``.

A gain multiplies the friction: log-normal, of standard deviation TAU (of its logarithm) between beads and SIGMA
between passes. The depth of a pass is measured with an error of its own, DEPTH_SD, mm. This is a program of its
own, without the library's solver: nodes of height, believed log gain and its standard deviation, which are exact
where the depth is; expectations by Gauss-Legendre between no cut and the end of the bead, closed forms beyond it;
forces searched between levels. Every planner is evaluated twice: in the same program, and on simulated beads, the
same for all, where it decides by one step from where it is. `--problems` draws problems without an error of the
depth, and asks of each: known <= belief <= all others, on beads; and whether the belief-state program of the library
keeps its promise on beads, within its `error` and two standard errors.
"""

import argparse
import time
from collections.abc import Iterator
from math import erfc, exp, log, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from sdpgrind import sdp

UNDER, OVER = 2.0, 10.0  # $/mm
IDLE, PER_DEPTH, LENGTH, RESET = 100.0, 10.0 * 12.5, 50.0, 2.0  # BASE: W; J/mm^2; mm; s
POWER = 1e-3 * 0.3 * 85.0 * 500.0  # W/N
SECONDS, STAGE = np.array([6.0, 10.0, 14.0, 20.0]), 2.0
RATE = PER_DEPTH * LENGTH / (SECONDS - RESET)  # W/mm
STAGES = np.round(SECONDS / STAGE).astype(np.int64)
FORCES = np.linspace(3.5, 50.0, 32)  # N; finer ones are searched about the best
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)
ERRORS, SHARES = np.array([-sqrt(3.0), 0.0, sqrt(3.0)]), np.array([1.0, 4.0, 1.0]) / 6.0
REACH = 7.0  # standard deviations
NEVER, CERTAIN, CAUTIOUS, BELIEF, KNOWN = "never learns", "certain", "cautious", "belief", "known"
CASES = ((0.05, 0.25, 0.0, 0.5, 24.0),)


class Nodes(NamedTuple):
    """Nodes of the height left, mm, of the believed log gain and of its standard deviation."""

    height: Any
    gain: Any
    sd: Any


class Law(NamedTuple):
    """What a planner believes of the next pass: scatter of the gain, of the depth; whether the belief moves."""

    sigma: float
    depth_sd: float
    learns: bool


@njit
def normal(z):
    return 0.5 * erfc(-z / sqrt(2.0))


@njit
def looked_up(table, height, gain, where, part, nodes):
    """Table [height, gain, sd] between nodes, at the sd node `where` and `part` of the way to the next."""
    heights, gains = table.shape[0], table.shape[1]
    i = height / nodes.height[1]
    j = (gain - nodes.gain[0]) / (nodes.gain[1] - nodes.gain[0])
    i, j = min(max(i, 0.0), heights - 1.0), min(max(j, 0.0), gains - 1.0)
    a, b = min(int(i), heights - 2), min(int(j), gains - 2)
    p, q = i - a, j - b
    found = 0.0
    for k in range(2):
        share = part if k else 1.0 - part
        if share > 0.0:
            low = (1.0 - q) * table[a, b, where + k] + q * table[a, b + 1, where + k]
            high = (1.0 - q) * table[a + 1, b, where + k] + q * table[a + 1, b + 1, where + k]
            found += share * ((1.0 - p) * low + p * high)
    return found


@njit
def expected(table, height, gain, sd, power, rate, law, nodes):
    """Expected penalty, $, of a pass of a power (W) and a rate (W/mm) before `table`."""
    spread = sqrt(sd * sd + law.sigma * law.sigma)
    error = law.depth_sd * rate / power
    k = sd * sd / (spread * spread + error * error) if law.learns else 0.0
    after = sd * sqrt(1.0 - k)
    where = min(max(np.searchsorted(nodes.sd, after * (1 - 1e-12)) - 1, 0), nodes.sd.size - 2)
    part = min(max((after - nodes.sd[where]) / (nodes.sd[where + 1] - nodes.sd[where]), 0.0), 1.0)
    end = (log((rate * height + IDLE) / power) - gain) / spread  # no metal left beyond
    none = (log(IDLE / power) - gain) / spread  # no metal removed below
    beyond = power * exp(gain + 0.5 * spread * spread) * normal(spread - end)
    total = OVER * (beyond - (rate * height + IDLE) * normal(-end)) / rate
    for piece in range(2):
        low, high = (-REACH, min(none, REACH)) if piece == 0 else (max(none, -REACH), min(end, REACH))
        if high <= low:
            continue
        for n in range(POINTS.size):
            z = 0.5 * (low + high) + 0.5 * (high - low) * POINTS[n]
            weight = 0.5 * (high - low) * WEIGHTS[n] * exp(-0.5 * z * z) / sqrt(2.0 * pi)
            left = height if piece == 0 else height - (power * exp(gain + spread * z) - IDLE) / rate
            if k * error == 0.0:
                total += weight * looked_up(table, left, gain + k * spread * z, where, part, nodes)
                continue
            for v in range(3):
                moved = gain + k * (spread * z + error * ERRORS[v])
                total += weight * SHARES[v] * looked_up(table, left, moved, where, part, nodes)
    return total


@njit
def best(tables, row, height, gain, sd, law, nodes):
    """Least expected penalty, $, with `row` stages left; its duration (-1: stop) and force, N."""
    least, chosen, force = UNDER * height, -1, 0.0
    for d in range(STAGES.size):
        if row < STAGES[d]:
            continue
        lowest, at = np.inf, 0.0
        low, step = FORCES[0], FORCES[1] - FORCES[0]
        count = FORCES.size
        for _ in range(3):
            for n in range(count):
                f = min(max(low + n * step, FORCES[0]), FORCES[-1])
                q = expected(tables[row - STAGES[d]], height, gain, sd, POWER * f, RATE[d], law, nodes)
                if q < lowest:
                    lowest, at = q, f
            low, step, count = at - step, step / 4.0, 9
        if lowest < least - 1e-9:
            least, chosen, force = lowest, d, at
    return least, chosen, force


@njit
def solved(tables, row, law, nodes, chosen, force):
    """Best passes of all nodes with `row` stages left; their values go into the tables."""
    for i in range(nodes.height.size):
        for j in range(nodes.gain.size):
            for k in range(nodes.sd.size):
                found = best(tables, row, nodes.height[i], nodes.gain[j], nodes.sd[k], law, nodes)
                tables[row, i, j, k], chosen[row, i, j, k], force[row, i, j, k] = found


@njit
def followed(tables, row, law, nodes, chosen, force):
    """Values of given passes of all nodes with `row` stages left."""
    for i in range(nodes.height.size):
        for j in range(nodes.gain.size):
            for k in range(nodes.sd.size):
                d, tables[row, i, j, k] = chosen[row, i, j, k], UNDER * nodes.height[i]
                if d >= 0:
                    tables[row, i, j, k] = expected(
                        tables[row - STAGES[d]], nodes.height[i], nodes.gain[j], nodes.sd[k],
                        POWER * force[row, i, j, k], RATE[d], law, nodes,
                    )  # fmt: skip


@njit
def decided(tables, row, height, gain, sd, law, nodes, duration, force):
    """Passes of many beads, each with its own stages left."""
    for n in range(height.size):
        duration[n], force[n] = -1, 0.0
        if height[n] > 0.0:
            _, duration[n], force[n] = best(tables, row[n], height[n], gain[n], sd[n], law, nodes)


def rows_of(stages: int) -> list[int]:
    """Stages left that can be met, from the last up."""
    met = {stages}
    for row in range(stages, 0, -1):
        met |= {row - d for d in STAGES.tolist() if row in met and d <= row}
    return sorted(met)


class Case:
    """One coefficient of a scatter, a doubt and an error of the depth; all planners of it."""

    def __init__(
        self, sigma: float, tau: float, depth_sd: float, height: float, left: float, nodes: tuple[int, int]
    ) -> None:
        self.sigma, self.tau, self.height = sigma, tau, height
        self.stages = round(left / STAGE)
        self.prior = -0.5 * (sigma**2 + tau**2)
        most = int(left / SECONDS[0])
        sd = [tau / sqrt(1 + n * tau**2 / sigma**2) for n in range(most + 1)]
        if depth_sd > 0:
            sd += np.linspace(sd[1], tau, 5)[1:-1].tolist()
        wide = 4.0 * tau + 0.05
        gain = np.linspace(self.prior - wide, self.prior + wide, nodes[1])
        self.nodes = Nodes(np.linspace(0.0, height, nodes[0]), gain, np.array(sorted({0.0, *sd})))
        self.true, self.drawn = Law(sigma, depth_sd, True), Law(sigma, depth_sd, False)
        self.afresh, self.passes = self.solve(self.drawn)
        self.tables = {BELIEF: self.solve(self.true)[0], CAUTIOUS: self.afresh}

    def empty(self) -> tuple[Any, Any, Any]:
        shape = (self.stages + 1, *(len(x) for x in self.nodes))
        stop = np.broadcast_to(UNDER * self.nodes.height[None, :, None, None], shape).copy()
        return stop, np.full(shape, -1), np.zeros(shape)

    def solve(self, law: Law) -> tuple[Any, tuple[Any, Any]]:
        tables, chosen, force = self.empty()
        for row in rows_of(self.stages):
            solved(tables, row, law, self.nodes, chosen, force)
        return tables, (chosen, force)

    def start(self, table: Any) -> float:
        """Value of the bead before its first pass, $."""
        gain = (len(self.nodes.gain) - 1) // 2
        return float(table[self.stages, -1, gain, -1])

    def realised(self, which: str) -> float:
        """Expected penalty, $, of a planner; each looks its passes up in those of the plan drawn afresh."""
        gain, sd = np.arange(len(self.nodes.gain)), np.arange(len(self.nodes.sd))
        if which == NEVER:
            gain, sd = np.full_like(gain, (len(gain) - 1) // 2), np.full_like(sd, len(sd) - 1)
        if which == CERTAIN:
            sd = np.zeros_like(sd)
        chosen, force = (x[:, :, gain][:, :, :, sd].copy() for x in self.passes)
        tables, _, _ = self.empty()
        for row in rows_of(self.stages):
            followed(tables, row, self.true, self.nodes, chosen, force)
        return self.start(tables)

    def known(self) -> float:
        """Expected penalty, $, if each bead's gain were known."""
        points, weights = np.polynomial.hermite_e.hermegauss(41)
        value = np.interp(self.prior + self.tau * points, self.nodes.gain, self.afresh[self.stages, -1, :, 0])
        return float(value @ weights / weights.sum())

    def exact(self) -> dict[str, float]:
        found = {name: self.realised(name) for name in (NEVER, CERTAIN, CAUTIOUS)}
        return found | {BELIEF: self.start(self.tables[BELIEF]), KNOWN: self.known()}

    def simulated(self, name: str, beads: int, seed: int = 1) -> Any:
        """Penalties, $, of a planner on simulated beads."""
        rng = np.random.default_rng(seed)
        true = self.prior + self.tau * rng.standard_normal(beads)
        height, gain, sd = (np.full(beads, x) for x in (self.height, self.prior, self.tau))
        row, duration, force = np.full(beads, self.stages), np.empty(beads, np.int64), np.empty(beads)
        table, law = self.tables.get(name, self.afresh), self.true if name == BELIEF else self.drawn
        for _ in range(self.stages // int(STAGES[0])):
            looked = {NEVER: (0 * gain + self.prior, 0 * sd + self.tau), CERTAIN: (gain, 0 * sd),
                      KNOWN: (true, 0 * sd)}.get(name, (gain, sd))  # fmt: skip
            decided(table, row, height, *looked, law, self.nodes, duration, force)
            shown = true + self.sigma * rng.standard_normal(beads)
            going, rate = duration >= 0, RATE[duration]
            power = np.where(going, POWER * force, 1.0)
            cut = np.maximum(power * np.exp(shown) - IDLE, 0.0) / rate
            height = np.where(going, height - cut, height)
            error = self.true.depth_sd * rate / power
            k = np.where(going, sd**2 / (sd**2 + self.sigma**2 + error**2), 0.0)
            gain = gain + k * (shown + error * rng.standard_normal(beads) - gain)
            sd, row = sd * np.sqrt(1.0 - k), row - np.where(going, STAGES[duration], 0)
        return np.where(height > 0, UNDER * height, -OVER * height)


def lines(case: Case, beads: int) -> Iterator[str]:
    exact = case.exact()
    paid = {name: case.simulated(name, beads) for name in exact}
    for name, penalty in paid.items():
        less = penalty - paid[BELIEF]
        half = 1.0 / sqrt(beads)
        yield (
            f"| {name} | {exact[name]:.4f} | {exact[name] - exact[BELIEF]:+.4f} "
            f"| {penalty.mean():.4f} +- {half * penalty.std():.4f} | {less.mean():+.4f} +- {half * less.std():.4f} |"
        )
    yield f"cautious promises {case.start(case.afresh):.4f} $, belief {exact[BELIEF]:.4f} $"


def first_forces(case: Case) -> Iterator[str]:
    """What the force of a first pass of 6 s leads to, with belief after it, and by the cautious promise."""
    yield "| first force [N] | belief after it [$] | promise of cautious [$] |\n|---|---|---|"
    row = case.stages - int(STAGES[0])
    for force in (25.0, 30.0, 33.0, 36.0, 39.0, 42.0, 45.0):
        here = (case.height, case.prior, case.tau, POWER * force, RATE[0])
        after = expected(case.tables[BELIEF][row], *here, case.true, case.nodes)
        yield f"| {force:g} | {after:.4f} | {expected(case.afresh[row], *here, case.drawn, case.nodes):.4f} |"


def grind(s, c, e):
    off = np.sqrt(s.sd**2 + c.sigma**2) * e.draw
    depth = np.maximum(POWER * c.force * np.exp(s.gain + off) - IDLE, 0.0) / c.rate
    k = s.sd**2 / (s.sd**2 + c.sigma**2)
    return s.height - depth, s.gain + k * off, s.sd * np.sqrt(1.0 - k)


def promised(case: Case) -> sdp.Policy:
    """The belief-state program of the library, its error told; 12 forces."""
    force, every = np.linspace(8.0, 50.0, 12), np.ones(12)
    step = sdp.Sampled(grind, {"draw": sdp.Normal(0.0, 1.0)})
    moves = [
        sdp.Move(
            f"{seconds:g} s",
            {"force": force, "rate": rate * every, "sigma": case.sigma * every},
            step,
            duration=int(stages),
        )
        for seconds, rate, stages in zip(SECONDS, RATE, STAGES, strict=True)
        if stages <= case.stages
    ]
    low, high = case.prior - 3 * case.tau, case.prior + 3 * case.tau
    axes = [
        sdp.Axis("height", 0.0, case.height, 9, "mm", below="stop"),
        sdp.Axis("gain", low, high, 7, below="hold", above="hold"),
        sdp.Axis("sd", 0.0, case.tau, 3),
    ]
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Linear(UNDER), over=sdp.Linear(OVER)))
    # any error will do: two halvings
    return sdp.plan(sdp.Problem(axes, moves, [stop], sdp.Stages(case.stages, STAGE)), tolerance=1.0)


def kept(case: Case, policy: sdp.Policy, beads: int) -> Any:
    """Penalties, $, of the library's program followed on beads."""
    rng = np.random.default_rng(2)
    true = case.prior + case.tau * rng.standard_normal(beads)
    height, gain, sd = (np.full(beads, x) for x in (case.height, case.prior, case.tau))
    left = np.full(beads, STAGE * case.stages)
    for _ in range(case.stages // int(STAGES[0])):
        seen = np.clip(gain, case.prior - 3 * case.tau, case.prior + 3 * case.tau)
        action = policy.action(height=np.maximum(height, 0.0), gain=seen, sd=sd, time_left=left)
        going = ~action.stop
        shown = true + case.sigma * rng.standard_normal(beads)
        power, rate = np.where(going, POWER * action.force, 0.0), np.where(going, action.rate, 1.0)
        height = height - np.maximum(power * np.exp(shown) - IDLE, 0.0) / rate
        k = np.where(going, sd**2 / (sd**2 + case.sigma**2), 0.0)
        gain, sd = gain + k * (shown - gain), sd * np.sqrt(1.0 - k)
        left = left - np.where(going, PER_DEPTH * LENGTH / rate + RESET, 0.0)
    return np.where(height > 0, UNDER * height, -OVER * height)


def problems(count: int, beads: int, nodes: tuple[int, int]) -> Iterator[str]:
    yield "| sigma | tau | height | time | known | belief | cautious | certain | never learns | holds "
    yield "| promise | error | realised | kept |\n|" + 14 * "---|"
    for seed in range(count):
        rng = np.random.default_rng([seed, 4])
        told = rng.uniform(0.05, 0.15), rng.uniform(0.1, 0.3), 0.0, rng.uniform(0.3, 0.9)
        case = Case(*told, float(rng.choice([12.0, 18.0])), nodes)
        paid = {name: case.simulated(name, beads) for name in (KNOWN, BELIEF, CAUTIOUS, CERTAIN, NEVER)}
        less = {name: penalty - paid[BELIEF] for name, penalty in paid.items() if name != BELIEF}
        worst = {name: 3 * x.std() / sqrt(beads) for name, x in less.items()}
        holds = less[KNOWN].mean() <= worst[KNOWN] and all(
            less[name].mean() >= -worst[name] for name in (CAUTIOUS, CERTAIN, NEVER)
        )
        policy = promised(case)
        promise = float(
            policy.value(height=case.height, gain=case.prior, sd=case.tau, time_left=STAGE * case.stages)
        )
        penalty = kept(case, policy, beads)
        assert policy.error is not None
        good = abs(promise - penalty.mean()) <= policy.error + 2 * penalty.std() / sqrt(beads)
        each = " | ".join(f"{x.mean():.4f}" for x in paid.values())
        yield (
            f"| {case.sigma:.3f} | {case.tau:.3f} | {case.height:.2f} | {STAGE * case.stages:g} | {each} | {holds} "
            f"| {promise:.4f} | {policy.error:.4f} | {penalty.mean():.4f} | {good} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", type=float, nargs=5, action="append", help="sigma tau depth_sd height time")
    parser.add_argument("--beads", type=int, default=6000)
    parser.add_argument("--nodes", type=int, nargs=2, default=(81, 41), help="of height and gain")
    parser.add_argument("--problems", type=int, default=0, help="this many, drawn, in place of the case")
    given = parser.parse_args()
    if given.problems:
        for line in problems(given.problems, given.beads, tuple(given.nodes)):
            print(line, flush=True)
        return
    for told in given.case or CASES:
        begin = time.process_time()
        case = Case(*told, tuple(given.nodes))
        print("\nsigma {:g}, tau {:g}, depth sd {:g} mm, {:g} mm, {:g} s".format(*told))
        print(
            "| planner | exact [$] | less belief [$] | beads [$] | less belief [$] |\n|---|---|---|---|---|"
        )
        for line in (*lines(case, given.beads), *first_forces(case)):
            print(line)
        print(
            f"{given.beads} beads, one standard error; {time.process_time() - begin:.0f} s of CPU", flush=True
        )


if __name__ == "__main__":
    main()
