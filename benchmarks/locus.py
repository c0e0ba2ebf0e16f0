"""An optimal locus: ``python benchmarks/locus.py [--times N] [--only PART]``. Medians and minima."""

import argparse
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from locus_peers import Scaled, batched_newton, peers, silence
from measure import clock, in_turn
from numba import njit
from scipy import interpolate

from sdpgrind import locus
from sdpgrind.locus import kernels
from sdpgrind.locus._curve.plan import marked
from sdpgrind.locus._trace.pieces import counts, tabulate
from sdpgrind.locus._trace.trace import Tracer
from sdpgrind.locus.kernels import look_up, retrieve

POINTS = 1000
NODES = 200
SOONER = 30.0


@dataclass
class Bars:
    """What was to be reached, and what was."""

    rows: list[tuple[str, str, str, bool]] = field(default_factory=list)

    def most(self, what: str, value: float, bar: float, unit: str = "") -> None:
        self.rows.append((what, f"{value:.3g} {unit}", f"<= {bar:g} {unit}", value <= bar))

    def least(self, what: str, value: float, bar: float) -> None:
        self.rows.append((what, f"{value:.3g} times", f">= {bar:g} times", value >= bar))

    def tell(self) -> None:
        print("\n## Bars\n| what | here | bar | holds |\n|---|---|---|---|")
        for what, value, bar, holds in self.rows:
            print(f"| {what} | {value} | {bar} | {'yes' if holds else 'NO'} |")


def timed(run: Callable[[], object], times: int) -> tuple[float, float]:
    """Median and least time, s, after one warm-up."""
    run()
    found = []
    for _ in range(times):
        begin = clock()
        run()
        found.append(clock() - begin)
    return float(np.median(found)), min(found)


def users() -> locus.Problem:
    """Koren's example as functions of one's own."""
    return locus.Problem(
        controls={"u": (0.0, 5.0), "v": (0.0, 10.0)},
        hidden={"x": (0.2, 20.0)},
        cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
        constraints=[
            locus.Varying(
                response=lambda s, c: s.x * c.v + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v
            )
        ],
    )


def users_of_powers() -> locus.Problem:
    """Time of a cut under a force that grows with wear, with powers that no closed form solves; cost depends
    on wear, too.
    """
    return locus.Problem(
        controls={"feed": (0.02, 0.5), "speed": (60.0, 350.0)},
        hidden={"wear": (0.05, 0.6)},
        cost=lambda s, c: (
            1e4
            / (c.feed * c.speed)
            * (1 + (c.speed / 180) ** 3.7 * (c.feed / 0.3) ** 1.6 * (0.2 + 0.1 * s.wear))
        ),
        constraints=[
            locus.Varying(
                response=lambda s, c: (
                    3400 * c.feed**0.77 * (1 + 0.4 * s.wear**1.3) - 1.2 * c.speed + 900 * s.wear
                ),
                limit=lambda s, c: 2700 * c.feed**0.45,
            )
        ],
    )


def tables(times: int, bars: Bars) -> None:
    print(
        f"\n## {POINTS} points of a locus, all searched for, traced and tabulated; peers solve at the same hidden states"
    )
    print(
        "Peers start at our first point, and from each point to the next. Error: from our points, part of a control's range."
    )
    print(
        "| problem | by | median [ms] | least [ms] | times ours | residual or error |\n|---|---|---|---|---|---|"
    )
    problems = {"a user's": (users(), 15.0), "a user's, powers": (users_of_powers(), 15.0)}
    problems |= {
        name: (locus.preset(name), 2.0)
        for name in ("koren-example", "turning", "grinding", "milling", "motor")
    }
    for name, (problem, bar) in problems.items():
        _tables_of(name, problem, bar, times, bars)


def _tables_of(name: str, problem: locus.Problem, bar: float, times: int, bars: Bars) -> None:
    curve = locus.plan(problem, points=POINTS)
    ours, least = timed(lambda: locus.plan(problem, points=POINTS), 20 * times)
    print(f"| {name} | locus.plan | {1e3 * ours:.2f} | {1e3 * least:.2f} | 1 | {curve.error:.0e} |")
    tracer = Tracer(problem.system, np.zeros(1))
    runs = [run for run, _ in marked(tracer, tracer.branches())]
    table, fastest = timed(lambda: tabulate(tracer, runs, counts(runs, POINTS)), 20 * times)
    print(f"| {name} | its table alone | {1e3 * table:.2f} | {1e3 * fastest:.2f} | {table / ours:.2f} | |")
    bars.most(f"{name}: {POINTS} points", 1e3 * ours, bar, "ms")
    bars.most(f"{name}: residual", curve.error, 1e-10)
    scaled = Scaled(problem, curve)
    for who, sweep in peers(scaled, convex=name in ("a user's", "koren-example")):
        took, soonest, error = _peer(scaled, sweep, times)
        told = f"{error:.0e}" if error < 0.01 else f"fails ({error:.0e})"
        print(f"| {name} | {who} | {1e3 * took:.0f} | {1e3 * soonest:.0f} | {took / ours:.0f} | {told} |")
        if who.startswith(("scipy", "IPOPT")):
            bars.least(f"{name}: sooner than {who}", took / ours, SOONER)


def batches(times: int, bars: Bars) -> None:
    print(f"\n## {POINTS} points at once, beside Newton's method for all (casadi.Function.map), in turns")
    print(
        "Ours finds where the locus begins and bends, and tabulates it; the rival is given point and places."
    )
    print("| problem | locus.plan [ms] | batched Newton [ms] | times ours | largest difference |")
    print("|---|---|---|---|---|")
    problems = {"a user's": users(), "a user's, powers": users_of_powers()}
    presets = ("koren-example", "turning", "grinding", "milling", "motor")
    problems |= {name: locus.preset(name) for name in presets}
    for name, problem in problems.items():
        scaled = Scaled(problem, locus.plan(problem, points=POINTS))
        runs = {"ours": lambda p=problem: locus.plan(p, points=POINTS), "newton": batched_newton(scaled)}
        took, error = in_turn(runs, 10 * times), scaled.error(runs["newton"]())
        ours, theirs = 1e3 * took["ours"], 1e3 * took["newton"]
        print(f"| {name} | {ours:.2f} | {theirs:.2f} | {theirs / ours:.1f} | {error:.0e} |")


def _peer(scaled: Scaled, sweep: Callable[[], np.ndarray], times: int) -> tuple[float, float, float]:
    with silence():
        try:
            error = scaled.error(sweep())
            return *timed(sweep, times), error
        except RuntimeError:
            return np.nan, np.nan, np.inf


@njit
def _look_ups(packed, keys, out):
    total = 0.0
    for key in keys:
        look_up(packed, key, out)
        total += out[0]
    return total


@njit
def _retrieved(packed, controls, measured, out):
    total = 0.0
    for value in measured:
        retrieve(packed, controls, value, out)
        total += out[0]
    return total


def per_call(call: Callable[[float], object], values: np.ndarray, times: int) -> float:
    """Time of one call from Python with one float, s: median of rounds over all values, without that of the
    loop.
    """
    floats = values.tolist()

    def rounds(one: Callable[[float], object]) -> float:
        return timed(lambda: [one(value) for value in floats], 5 * times)[0] / len(floats)

    return rounds(call) - rounds(lambda value: value)


def look_ups(times: int, bars: Bars) -> None:
    print(f"\n## Koren's example by what is measured: {NODES} nodes, one number at a time")
    table = locus.plan(locus.preset("koren-example")).table("response", points=NODES)
    rng = np.random.default_rng(0)
    x = rng.uniform(0.5, 20.0, 5000)
    v, u = (4 + 2 * x) / (1 + x**2), (x**2 + 4 * x - 1) / (1 + x**2)
    keys, exact, out = 17 + u - 4 * v, np.column_stack([u, v]), np.empty(table.width)
    key, columns = table.key, table.columns
    rising = slice(None, None, 1 if key[-1] > key[0] else -1)
    node, slopes = (key[rising], columns[rising]), table.slopes[rising]
    pchip, hermite = interpolate.PchipInterpolator(*node), interpolate.CubicHermiteSpline(*node, slopes)
    linear = np.column_stack([np.interp(keys, node[0], column) for column in node[1].T])
    own, first = np.max(np.abs(table.at(keys) - exact)), node[1][:, 0].copy()
    inside, _ = timed(lambda: _look_ups(table.packed, keys, out), 20 * times)
    worst = [float(np.max(np.abs(found - exact))) for found in (linear, pchip(keys), hermite(keys))]
    rows = [
        (
            "kernels.look_up, from Python",
            per_call(lambda one, p=table.packed: kernels.look_up(p, one, out), keys, times),
            own,
        ),
        ("table.at, from Python", per_call(table.at, keys, times), own),
        ("table.at with out, from Python", per_call(lambda one: table.at(one, out=out), keys, times), own),
        ("look_up, compiled loop", inside / keys.size, own),
        (
            "np.interp, one column",
            per_call(lambda one: np.interp(one, node[0], first), keys, times),
            np.max(np.abs(linear - exact)),
        ),
        ("scipy PchipInterpolator", per_call(pchip, keys, times), worst[1]),
        ("scipy CubicHermiteSpline", per_call(hermite, keys, times), worst[2]),
    ]
    print("| by | one look-up [us] | largest error |\n|---|---|---|")
    for who, took, error in rows:
        print(f"| {who} | {1e6 * took:.3f} | {error:.1e} |")
    bars.most("look-up of one float from Python", 1e6 * rows[0][1], 0.5, "us")
    bars.most("look-up, compiled", 1e6 * inside / keys.size, 0.1, "us")
    bars.most(f"interpolation with {NODES} points", own, 1e-7)


def _long_response(s: object, c: object) -> object:
    """What a user may bring: some 200 operations, rising with x."""
    total = s.x * c.v + 16 - 4 * c.v
    for k in range(1, 14):
        total = total + 1e-3 * np.exp(-((c.u - 0.3 * k) ** 2)) * s.x ** (0.1 * k) * np.sin(
            0.1 * k * c.v
        ) ** 2 / (1 + k * c.u**2)
    return total


def inversions(times: int, bars: Bars) -> None:
    print("\n## From a measurement at any point to the hidden state and the best controls")
    print(
        "| response | operations | Inversion.at [us] | kernels.retrieve [us] | compiled loop [us] | error of the range |\n"
        "|---|---|---|---|---|---|"
    )
    long = users().replace(
        constraints=[locus.Varying(response=_long_response, limit=lambda s, c: 17 + c.u - 4 * c.v)]
    )
    cases = [(name, locus.preset(name), 1.0) for name in ("koren-example", "turning", "grinding", "motor")]
    for name, problem, bar in [*cases, ("a user's", users(), 20.0), ("a user's, long", long, 20.0)]:
        inversion, system = locus.plan(problem).inversion(), problem.system
        low, high = next(iter(problem.hidden.values()))
        controls = np.array([a + 0.4 * (b - a) for a, b in problem.controls.values()])
        states = np.random.default_rng(1).uniform(low, high, 2000)
        measured = system.values(controls, states[:, None])[1][:, 0]
        found = np.array([inversion.at(value, *controls.tolist())[0][0] for value in measured.tolist()])
        error, out = np.max(np.abs(found - states)) / (high - low), np.empty(inversion.places)
        where = controls.tolist()
        took = per_call(lambda value, at=inversion.at, where=where: at(value, *where), measured, times)
        where, put = tuple(where), out
        called = per_call(
            lambda value, k=inversion.packed, z=where, o=put: kernels.retrieve(k, z, value, o),
            measured,
            times,
        )
        inside = (
            timed(
                lambda k=inversion.packed, c=controls, y=measured, o=out: _retrieved(k, c, y, o), 5 * times
            )[0]
            / 2000
        )
        operations = int(system.response_tape[:4].view(np.int64)[3])
        print(
            f"| {name} | {operations} | {1e6 * took:.2f} | {1e6 * called:.2f} | {1e6 * inside:.2f} | {error:.0e} |"
        )
        bars.most(f"inversion, {name}", 1e6 * called, bar, "us")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--times",
        type=int,
        default=5,
        help="runs of which median and least are told; ours many times as often",
    )
    parser.add_argument("--only", default="", help="name of one benchmark")
    given, bars = parser.parse_args(), Bars()
    warnings.simplefilter("ignore")
    for run in (tables, batches, look_ups, inversions):
        if given.only in ("", run.__name__):
            run(given.times, bars)
    bars.tell()


if __name__ == "__main__":
    main()
