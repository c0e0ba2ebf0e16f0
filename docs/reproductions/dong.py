"""
Dong, Danai and Malkin (2004): plunge grinding
==============================================

What the paper prints (Part 2; Part 1, with the model of burning, is missing) beside what its own inputs give
and what this library computes.

*reproduced*
    computed here from inputs that the source prints.
*consistent*
    inputs are missing; with values that are named, the published number comes out. That proves nothing.
*calibrated*
    the published number was used to find a missing input: it tests this program, not the source.
*corrected*
    the printed formula is wrong; what it must be.
*ours*
    not in the source: a number of this library, checked in another way (closed form, a bound, or an
    independent program).
"""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import plunge, units

ROWS = []


def row(what, published, correct, ours, label):
    shown = [value if isinstance(value, str) else f"{value:.5g}" for value in (published, correct, ours)]
    ROWS.append((what, *shown, label))


simulation, experiment = plunge.preset("simulation"), plunge.preset("experiment")
model = simulation.model
wheel = {
    "work_diameter": 70.0,
    "wheel_speed": units.m_per_s(37.0),
    "infeed_rate": 0.0255,
    "dressing_depth": 0.01,
}
law = plunge.RoughnessLaw()
row("equivalent diameter [mm]", "-", 175.0, model.equivalent_diameter, "reproduced")
row("speed of the work [m/s]", 1.1, 1.0996, model.work_speed / 1000, "reproduced")
row("speed of the wheel from 14000 rpm [m/s]", 37, 36.652, units.rpm(14000.0) * 25.0 / 1000, "reproduced")
row("(10): dressing lead [mm]", "-", 0.0999, law.dressing_lead(units.um(0.7), **wheel), "corrected")
row(
    "(10) as printed [mm]",
    "-",
    1e-18,
    law.dressing_lead(units.um(0.7), **wheel, method="printed"),
    "corrected",
)

# %%
# The time constant
# -----------------
# Six seconds at full rate on a machine of 1.935 s, sampled each 0.04 s: (4) by least squares, as printed, and
# output error. (4) leaves out a term, takes noise of the size for a lag that is not there, and an unknown
# contact for a part of it.
true, rate, time = 1.935, simulation.command_rate_max, np.arange(161) * 0.04
size = rate * (time - true * (1 - np.exp(-time / true)))


def estimates(noise, offset, method, count=60):
    """Time constants (s) of parts that differ by their noise (mm)."""
    drawn = [np.random.default_rng(k).normal(0.0, noise, time.size) for k in range(count if noise else 1)]
    parts = [
        {"time": time, "command_rate": np.full(time.size, rate), "size": size + offset + each}
        for each in drawn
    ]
    found = [plunge.identify(part, "time_constant", method=method) for part in parts]
    return np.array([one["time_constant"] for one in found])


CASES = ((0.0, 0.0, 1.888), (0.5, 0.0, 1.801), (1.0, 0.0, 1.581), (0.5, 10.0, 1.373))
spread = {}
for noise, offset, wrong in CASES:
    what = f"time constant, {noise:g} µm of noise, {offset:g} µm off [s]"
    for method in ("printed", "output_error"):
        spread[noise, offset, method] = values = estimates(units.um(noise), units.um(offset), method)
        scatter = f"{values.mean():.4f}" + (f" ± {values.std(ddof=1):.4f}" if noise else "")
        correct = f"{wrong}" if method == "printed" else "1.935"
        row(f"{what}: {'(4)' if method == 'printed' else 'output error'}", "-", correct, scatter, "ours")
slope = -rate * (1 - np.exp(-time / true) * (1 + time / true))
bound = 5e-4 / np.sqrt(np.sum((slope - slope.mean()) ** 2))
row("bound of Cramer and Rao, 0.5 µm [s]", "-", 0.0032, bound, "ours")

# %%
# The two experiments
# -------------------
# They assumed 1.8 and 1.95 s and left 3.9 and 2.9 µm of out-of-roundness, which is in proportion to the final
# rate. Two equations for the lag and for the rate of 3 µm; the stock then follows from the time, 24.66 s less
# 38 %.
for assumed, full, left in ((1.8, 0.026, 3.9), (1.95, 0.0255, 2.9)):
    lag = experiment.model.linear_time_constant
    end = full - assumed / lag * (full - experiment.final_rate)
    row(
        f"roundness with {assumed:g} s [µm]",
        left,
        left,
        1000 * float(experiment.model.roundness(end)),
        "calibrated",
    )
row(
    "true time constant [s]",
    "1.8, 1.95",
    "1.927 to 1.942",
    experiment.model.linear_time_constant,
    "calibrated",
)
row("final rate [mm/s]", "-", 0.0049, experiment.final_rate, "calibrated")
row("gain of roundness", "-", 3.063, experiment.model.roundness_gain, "calibrated")
row(
    "power at 0.026 mm/s [W]",
    "below burning",
    1778,
    float(experiment.model.grinding_power(0.026)),
    "consistent",
)
row(
    "burning power at 0.026 mm/s [W]",
    "above",
    2412,
    float(experiment.model.burning_power(0.026)),
    "consistent",
)
row("second experiment; fastest cycle [s]", "17.87", "-", plunge.plan(experiment).time, "calibrated")

# %%
# The cycle, and what is learned between parts
# --------------------------------------------
# The times of the simulation were used to find what Part 1 would have told: they test this program. The
# optimum, the share of series with a burned part and the time without any damage were not.
row("fastest cycle [s]", "-", 12.0195, plunge.plan(simulation).time, "ours")
row(
    "fastest without any damage [s]",
    "longer",
    35.546,
    plunge.plan(simulation, safety_margin=0.2819).time,
    "ours",
)
printed = {"sparkout": "printed", "roundness_margin": 0.0}
believed = simulation.replace(wear_flat_area=0.9 * model.wear_flat_area)
quiet, noisy = hwsim.PlungeGrinder(simulation, noise=None), hwsim.PlungeGrinder(simulation)
first = plunge.CycleController(believed, 0.05, **printed, observer_gain=1.0)
exactly = plunge.learning.MarginBounding(0.25, 0.005, rule="printed", slack="true")
times = hwsim.run(quiet, first, parts=8, adapt=exactly).outcome.time.values
row("(9), 0.25: first part [s]", 15.7, 15.68, times[0], "calibrated")
row("(9), 0.25: seventh part [s]", 13.2, 13.24, times[6], "calibrated")
row("(9), 0.25: saving [s]", 2.4, 2.44, times[0] - times[6], "calibrated")
for step in (0.25, 0.8):
    series = {
        "series": 200,
        "parts": 8,
        "rng": 0,
        "adapt": plunge.learning.MarginBounding(step, 0.005, rule="printed"),
    }
    outcome = hwsim.repeat(noisy, plunge.CycleController(believed, 0.05, **printed), **series)
    share = 100 * float((outcome.burned.sum("part") > 0).mean())
    said = "none" if step < 0.8 else "burns"
    row(
        f"(9), {step:g}, noisy: series with a burned part [%]",
        said,
        "0 to 3" if step < 0.8 else "36 to 42",
        share,
        "consistent",
    )

# %%
# Sharpness from the power
# ------------------------
# (6) gives the wear flat area. An error of 1 % of the power is one of some 2.5 % of the area: nobody can
# measure it better from one reading, and 300 readings make it 0.15 %.
for where, v in (("full rate", rate), ("where burning begins", model.burn_rate)):
    bare = float(model.grinding_power(v) - model.replace(wear_flat_area=1e-9).grinding_power(v))
    row(
        f"area by 1 % of power, {where} [%]",
        "-",
        2.3 if v == rate else 2.9,
        float(model.grinding_power(v)) / bare,
        "ours",
    )

width = [max(len(r[k]) for r in ROWS) for k in range(5)]
heads = ("", "published", "correct", "ours", "")
print("   ".join(h.ljust(w) for h, w in zip(heads, width, strict=True)))
for entry in ROWS:
    print("   ".join(text.ljust(w) for text, w in zip(entry, width, strict=True)))

# %%
# Bias and spread
# ---------------
# Neither is small beside what a cycle stands: a time constant 10 % short leaves 0.3 µm more of
# out-of-roundness.
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
names = {"printed": "(4), as printed", "output_error": "output error"}
for (noise, offset, method), values in spread.items():
    place = [case[:2] for case in CASES].index((noise, offset)) + (0.15 if method == "printed" else -0.15)
    colour = "#b04a3a" if method == "printed" else "#4878a8"
    label = names[method] if noise == 0 else None
    axis.plot(values, np.full(values.size, place), "o", ms=4, alpha=0.4, color=colour, label=label)
axis.axvline(true, color="0.4", lw=1)
axis.set_yticks(range(4), [f"noise {noise:g} µm, offset {offset:g} µm" for noise, offset, _ in CASES])
axis.set(xlabel="time constant [s]")
axis.legend(frameon=False, fontsize=8)
plt.show()
