"""Pushes of a ring a second: ``python benchmarks/centering_push.py``.

Event-exact pushes of 0.4 s, 18.9 kg, on one core, energy check included, beside small steps of 2 us (numba)
and scipy's DOP853 with events on the same model. Medians of runs in turn, so that all see the same load.
"""

import time
from collections.abc import Callable

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from centering._problem.presets import preset
from centering.push._contact.reaction import simulate_pushes
from centering.push._profile.profile import TipProfile
from sdpgrind import units

MODEL = preset("printed").model
SPEEDS = [100, 200, 300, 400, 500, 600, 700, 800, 900, 1000, 1200, 1500, 2000, 3000, 4000, 5000]  # mm/min
LENGTH, STEP, MANY, TIMES = 0.4, 2e-6, 1000, 9  # s, s, pushes in a batch, runs


@njit
def stepped(parameters, speed, length, step):
    """Small steps: peak force (N) and position (mm) of a push at constant speed."""
    mass, k, b, static, coulomb, viscous = parameters
    x, u, peak = 0.0, 0.0, 0.0
    for i in range(int(length / step)):
        gap = speed * (i + 1) * step - x
        force = max(0.0, k * gap + b * (speed - u)) if gap > 0.0 else 0.0
        peak = max(peak, force)
        if u > 0.0 or force > static:
            u = max(0.0, u + step * (force - coulomb - viscous * u) / mass)
            x += step * u
    return peak, x


def integrated(parameters, speed: float, length: float) -> float:
    """Peak force (N) of a push at constant speed, phase by phase by DOP853 at 1e-9; its samples only."""
    mass, k, b, static, coulomb, viscous = parameters
    closed = max(static / k / speed - b / k, 0.0)
    t, state, sliding, peak = closed, np.array([0.0, 1e-12]), True, b * speed

    def force(t, s):
        return k * (speed * t - s[0]) + b * (speed - s[1])

    def touch(t, s):
        return speed * t - s[0]

    def stop(t, s):
        return s[1]

    def pushed(t, s):
        return s[1], (force(t, s) - coulomb - viscous * s[1]) / mass

    def flown(t, s):
        return s[1], -(coulomb + viscous * s[1]) / mass

    for event, way in ((force, -1), (touch, 1), (stop, -1)):
        event.terminal, event.direction = True, way
    while t < length:
        run = solve_ivp(
            pushed if sliding else flown,
            (t, length),
            state,
            "DOP853",
            rtol=1e-9,
            atol=1e-10,
            events=(force if sliding else touch, stop),
        )
        if sliding:
            peak = max(peak, float(np.max(force(run.t, run.y))))
        t, state = run.t[-1], run.y[:, -1]
        if run.t_events[1].size:
            t = max(t, (state[0] + static / k) / speed - b / k)
            state, sliding = np.array([state[0], 1e-12]), True
        else:
            sliding = not sliding
    return peak


def in_turn(runs: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median of each, s, taken in turns after one warm-up."""
    found: dict[str, list[float]] = {name: [] for name in runs}
    for run in runs.values():
        run()
    for _ in range(TIMES):
        for name, run in runs.items():
            begin = time.perf_counter()
            run()
            found[name].append(time.perf_counter() - begin)
    return {name: float(np.median(each)) for name, each in found.items()}


def main() -> None:
    law = MODEL.parameters
    speed = units.mm_per_min(600)
    alone = [TipProfile.constant_speed(speed, LENGTH)] * MANY
    mixed = [TipProfile.constant_speed(units.mm_per_min(v), LENGTH) for v in SPEEDS] * (MANY // len(SPEEDS))
    took = in_turn(
        {
            "exact, 600 mm/min": lambda: simulate_pushes(law, alone),
            "exact, 100-5000 mm/min": lambda: simulate_pushes(law, mixed),
            "steps of 2 us, 600 mm/min": lambda: stepped(law, speed, LENGTH, STEP),
            "DOP853 with events, 600 mm/min": lambda: integrated(law, speed, LENGTH),
        }
    )
    counts = dict(zip(took, (len(alone), len(mixed), 1, 1), strict=True))
    rates = {name: counts[name] / seconds for name, seconds in took.items()}
    exact = simulate_pushes(law, alone[:1])[0]
    best = rates["exact, 600 mm/min"]
    print(f"{'what':34s} {'pushes/s':>10s} {'slower by':>10s}")
    for name, rate in rates.items():
        print(f"{name:34s} {rate:10.0f} {best / rate:10.1f}")
    print(f"peak force: exact {exact[2]:.6f} N, steps {stepped(law, speed, LENGTH, STEP)[0]:.6f} N, ", end="")
    print(f"DOP853 {integrated(law, speed, LENGTH):.6f} N")
    print(f"energy residual: at most {simulate_pushes(law, mixed)[:, 5].max():.2g}")
    for name, bar in (("exact, 600 mm/min", 25_000), ("exact, 100-5000 mm/min", 8_000)):
        print(f"{name}: {rates[name]:.0f} pushes/s, bar {bar}: {'kept' if rates[name] >= bar else 'MISSED'}")


if __name__ == "__main__":
    main()
