"""
Koren (1989): the optimal locus
===============================

What the paper prints beside what its own inputs give and what this library computes. Its figures hold no
numbers; of its processes it prints the forms, not the coefficients.

*reproduced*
    computed here from inputs that the source prints.
*not reproduced*
    the printed claim does not follow from the printed inputs; what does.
*calibrated*
    inputs were chosen so that the published number comes out: it tests this program, not the source.
*ours*
    not in the source: a number of this library, checked in another way (closed form, or an independent
    program).
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
from scipy import optimize

import hwsim
from sdpgrind import locus, units

ROWS = []


def row(what, published, correct, ours, label):
    shown = [value if isinstance(value, str) else f"{value:.6g}" for value in (published, correct, ours)]
    ROWS.append((what, *shown, label))


# %%
# The example
# -----------
# Traced from the functions (14), (25), (26); nothing of its closed form is used.
example = locus.preset("koren-example")
curve = locus.plan(example, points=1000)
start = curve.events[0]
row("constraint becomes active at x", 0.5, 0.5, start.hidden, "reproduced")
row(
    "unconstrained point: u, v",
    "1, 4",
    "1, 4",
    f"{start.controls['u']:.9g}, {start.controls['v']:.9g}",
    "reproduced",
)
point = curve.at(x=1.0)
row("x = 1: v", 3, 3, point.controls["v"], "reproduced")
row("x = 1: u", 2, 2, point.controls["u"], "reproduced")
row("x = 1: P_b = P_c", 7, 7, point.response, "reproduced")
row("x = 1: multiplier", "-", 2, point.multipliers["response"], "ours")
circle = [piece.table.controls for piece in curve.best if piece.active][0]
row(
    "off the circle (18), at most",
    0,
    0,
    float(np.max(np.abs(circle[:, 0] ** 2 + (circle[:, 1] - 2) ** 2 - 5))),
    "reproduced",
)
end = curve.at(x=20.0).controls
row("lower end: v", 0.109, 0.1097257, end["v"], "reproduced")
row("lower end: u", 1.194, 1.1945137, end["u"], "reproduced")
usable = curve.stretch("v").calibrated().usable
row("retrieval by P_c converges up to x", "everywhere", 6.92738, usable[0][1], "not reproduced")

# %%
# Gains
# -----
# He found 0.6 by trial. By its loop slope it is stable up to x = 4.05 only, of his 0.2 to 20.
stretch = curve.stretch("v")


def too_steep(x, gain):
    """How much a gain is above the largest stable one, relative to it."""
    return gain * abs(stretch.at(stretch.coordinate_of(x)).loop_slope) / 2 - 1


for x, expected in ((0.52, 0.8436), (1.0, 1.3333), (4.0, 0.6078), (20.0, 0.1086)):
    row(
        f"largest stable gain at x = {x:g}",
        "-",
        expected,
        2 / abs(stretch.at(stretch.coordinate_of(x)).loop_slope),
        "ours",
    )
CASES = ((0.6, 2, 9, "up to", 4.05217), (0.9, 0.51, 1, "from", 0.54758), (0.9, 1.2, 9, "up to", 2.6189))
for gain, low, high, what, correct in CASES:
    end = optimize.brentq(too_steep, low, high, args=(gain,))
    claimed = gain == 0.6
    row(
        f"k = {gain:g} is stable {what} x",
        20 if claimed else "-",
        correct,
        end,
        "not reproduced" if claimed else "ours",
    )


def played(gain, states):
    """Controls v, u and slack of a run; the limit may be exceeded, which is what is looked at."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        controller = locus.LocusController(
            curve, along="v", gain=gain, x=(0.52, 1.5), start=float(stretch.low), hold="none"
        )
    command, path = controller.command, []
    for x in states:
        response = x * command["v"] + 16 - 4 * command["v"]
        path.append((command["v"], command["u"], 17 + command["u"] - 4 * command["v"] - response))
        command = controller.step(response=response)
    return np.array([*path, (command["v"], command["u"], np.nan)])


steady = played(0.6, np.ones(8))
for k, correct in enumerate((1.36060, 2.42986, 2.88856, 2.98659, 2.99863), start=1):
    row(f"x = 1, k = 0.6: v after step {k}", "-", correct, steady[k, 0], "ours")
limit = 17 + steady[:, 1] - 4 * steady[:, 0]
errors = {3: (3.715, 2.597, 7.110), 5: (0.046, 0.034, 0.088)}
for k, published in ((3, 4.0), (5, 0.5)):
    values = steady[k, 0] / 3, steady[k, 1] / 2, limit[k] / 7
    for name, value, correct in zip(("v", "u", "P_b"), values, errors[k], strict=True):
        error = 100 * abs(value - 1)
        label = "reproduced" if error < published else "not reproduced"
        row(f"error of {name} after {k} steps [%]", f"< {published:g}", correct, error, label)

falling = np.maximum(1 - 0.01 * np.arange(49), 0.52)
ramp = played(0.6, falling)[4:-1]  # from its fourth step on
exact = [curve.at(x=x).controls for x in falling[4:]]
for k, name, correct in ((0, "v", 1.21), (1, "u", 2.09)):
    error = 100 * max(abs(ramp[i, k] / exact[i][name] - 1) for i in range(len(exact)))
    row(f"x from 1 to 0.52: error of {name} from step 4 on [%]", "< 3", correct, error, "reproduced")
for name, states, published in (("1 to 0.52", falling, "never"), ("0.52 to 1", falling[::-1], "-")):
    before = played(0.6, np.full(40, states[0]))
    run = played(0.6, np.concatenate([np.full(40, states[0]), states, np.full(20, states[-1])]))
    worst = -np.nanmin(run[38:, 2])
    correct = 0.0118 if name == "1 to 0.52" else 0.0397
    row(
        f"x from {name}: limit exceeded by",
        published,
        correct,
        worst,
        "not reproduced" if published == "never" else "ours",
    )

# %%
# Turning and grinding
# --------------------
# Koren prints no coefficients: these are the numbers of the presets, from the tracer beside closed forms.
turning = locus.plan(locus.preset("turning").replace(hidden={"flank_wear": (0.0, 0.65)}))
model = turning.problem.model
onset = next(event for event in turning.events if event.kind.endswith("active"))
row("turning: wear at which the force limits [mm]", "-", model.onset_wear(0.5), onset.hidden, "ours")
end = next(event for event in turning.events if event.kind == "infeasible")
row("turning: last feasible wear [mm]", "-", model.end_wear(units.m_per_s(350 / 60)), end.hidden, "ours")
row(
    "turning: wear 0.3 mm: speed [m/min]",
    "-",
    198.5496,
    turning.at(flank_wear=0.3).controls["cutting_speed"] * 0.06,
    "ours",
)
row("turning: wear 0.3 mm: feed [mm]", "-", 0.375368, turning.at(flank_wear=0.3).controls["feed"], "ours")
grinding = locus.plan(locus.preset("grinding"))
wheel = grinding.problem.model
for area, correct in ((0.005, 4.21736), (0.0075, 1.49137), (0.01, 0.218862)):
    infeed = grinding.at(wear_flat_area=area).controls["infeed_rate"]
    row(
        f"grinding: area {area:g}: removal rate [mm^2/s]",
        "Fig. 7",
        correct,
        float(wheel.specific_removal_rate(infeed)),
        "ours",
    )
row(
    "grinding: slowest work at [mm^2/s]",
    "duller is slower",
    1.2658,
    wheel.slowest_removal_rate,
    "not reproduced",
)

# %%
# Controller (36)
# ---------------
# His gains, 3.3 and 5.3 µm/(s kW), each 0.5 s, on a grinder whose lags, width and dulling are *calibrated* to
# his 28 s and 4 s.
gains = {"gain": 3.3e-6, "kp": 5.3e-6, "floor": units.um(0.8)}
printed = {"at": "command", "hold": 3.0, "start": {"infeed_rate": units.um(1.0)}}
controller = locus.LocusController(grinding, along="infeed_rate", **gains, **printed)
log = hwsim.run(
    hwsim.AdaptiveGrinder(grinding.problem), controller, parts=5, rng=0, adapt=locus.LearnedStart()
)
for k, (published, correct) in enumerate(((28, 27.5), (4, 4.0), (4, 3.5), (4, 3.5), (4, 3.5))):
    row(
        f"(36): cycle {k + 1} converged after [s]",
        published,
        correct,
        float(log.outcome.convergence_time[k]),
        "calibrated",
    )
for k, correct in ((0, "+4"), (1, "-3 to -6"), (4, "-3 to -6")):
    row(
        f"(36): cycle {k + 1}: least true slack [W]",
        "no burning",
        correct,
        float(log.outcome.slack[k]),
        "ours",
    )

width = [max(len(r[k]) for r in ROWS) for k in range(5)]
heads = ("", "published", "correct", "ours", "")
print("   ".join(h.ljust(w) for h, w in zip(heads, width, strict=True)))
for entry in ROWS:
    print("   ".join(text.ljust(w) for text, w in zip(entry, width, strict=True)))

# %%
# The five cycles
# ---------------
# The first begins at 1 µm/s; each later one where the one before ended. The small violation after the rise is
# real: the limit is computed from the commanded infeed, but the work feels the actual one.
log.plot()
plt.show()
