"""
Brown (1988): the grinding sequence
===================================

M. L. Brown's thesis plans a sequence of grinding passes over a weld bead by stochastic dynamic programming.
This script prints what it publishes beside what is correct and what this library computes, and says of the
rest why nobody can reproduce it.

*reproduced*
    computed here from inputs that the source prints.
*consistent*
    inputs are missing; with a plain guess, named on the line, the published number comes out. That proves
    nothing.
*near*
    inputs are missing; a problem of ours comes close. That proves less.
*corrected*
    the printed number is wrong; what its own inputs give.
*ours*
    not in the source: a problem of this library, checked in another way (closed form or an independent
    program).
"""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import physics, sdp, weldbead

ROWS = []


def row(what, published, correct, ours, label, digits=6):
    shown = [
        value if isinstance(value, str) else f"{value:.{digits}g}" for value in (published, correct, ours)
    ]
    ROWS.append((what, *shown, label))


# %%
# Coefficients of section 5.5
# ---------------------------
# Specific energy 10 J/mm^3, idle power 100 W, force ratio 0.3, disc of 85 mm at 500 rad/s, bead 12.5 mm wide.
process = weldbead.GrindingProcess(
    specific_energy=10.0, idle_power=100.0, friction_ratio=0.3,
    disk_radius=85.0, free_speed=500.0, speed_droop=0.0, bead_width=12.5,
)  # fmt: skip
found = process.coefficients
row("C1 [mm^2/N]", 1e-4, 1e-4, found.C1, "reproduced")
row("C2 [mm^2/s]", -0.8, -0.8, found.C2, "reproduced")
row("C3 [1/s]", 1e-3, 1020.0, found.C3, "corrected: the exponent lost its sign, and mu is missing in (4.6)")

# %%
# Slopes of section 5.5
# ---------------------
# The time that a mm takes at the greatest force: the source prints neither length nor force, and several
# pairs of them give the same.
rounded = process.replace(friction_ratio=1000 * 12.5 / (85 * 500))  # C1 C3 = 0.1 mm/(N s)
slope = 1000.0 / float(rounded.mean_cut(normal_force=40.0, feed_rate=1.0))
row("slope of the greatest force [s/mm]", 313.0, 312.5, slope, "consistent: 1000 mm, 40 N are guessed")
charge = sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(1.0))
equal = float(charge.slope(1.0)) / float(sdp.Linear(1.0).slope(1.0))
row("slope of equal charges (5.10) [s/mm]", 1.0, 1.0, equal, "reproduced")

# %%
# Burning (4.3)
# -------------
u0, B = physics.malkin_burn_coefficients()
row("burn limit: u0 [J/mm^3]", "9.0e5 in-lb", 6.2053, u0, "reproduced: units only", 5)
row("burn limit: B [J/(mm^2 s^0.5)]", "4.1e4 in-lb", 7.1802, B, "reproduced: units only", 5)

# %%
# Cut fractions of section 5.4
# ----------------------------
# How much of what is left the next pass should take, one and two passes before the deadline. The source says
# 57 % and 49 %, hypothetically. Where scatter is proportional to depth the fractions are constants: no idle
# power, 60 % scatter, and overgrinding five times as dear as undergrinding (the ratio of Fig. 5-4). The
# closeness suggests, and does not prove, that this was his regime.
scaled = weldbead.plan(weldbead.preset("C0"), tolerance=2e-5)
for band, published, correct in ((1, 57.0, 55.656), (2, 49.0, 49.662)):
    fraction = 100 * scaled.action(1.0, 6.0 * band).mean_cut
    row(f"cut fraction, band {band} [%]", published, correct, fraction, "near: problem C0, closed form", 4)
slopes = (1.049366, 0.591955, 0.350939, 0.215815, 0.136543)
for band, correct in enumerate(slopes, start=1):
    row(f"C0: J(1 mm, {6 * band} s) [$]", "-", correct, scaled.value(1.0, 6.0 * band), "ours: closed form")

# %%
# The canonical problems
# ----------------------
# The figures of chapter 5 cannot be computed: see below. These problems stand in for them, P1 with a fixed
# deadline, P2 with expensive and P3 with cheap lateness, P4 with a burn limit, P5 with quadratic charges.
NAMED = {
    (0.2, 10.0): (0.112393, 0.112393, 0.112393, 0.112393, 0.007297),
    (1.0, 4.0): (2.000000, 1.812000, 1.219047, 2.000000, 0.881656),
    (1.0, 10.0): (0.633733, 0.633733, 0.619047, 0.950421, 0.364674),
    (1.0, 24.0): (0.070643, 0.070643, 0.070643, 0.070643, 0.005629),
    (2.0, 20.0): (1.029703, 1.029703, 0.929477, 1.685317, 1.401729),
    (2.0, 40.0): (0.054439, 0.054439, 0.054439, 0.083090, 0.029656),
}
names = ("P1", "P2", "P3", "P4", "P5")
plans = {name: weldbead.plan(weldbead.preset(name), tolerance=None, nodes=641) for name in names}
for (height, time), values in NAMED.items():
    for (name, policy), correct in zip(plans.items(), values, strict=True):
        ours = policy.value(height, time)
        row(f"{name}: J({height:g} mm, {time:g} s) [$]", "-", correct, ours, "ours: independent program")

# %%
# Rules of section 5.5
# --------------------
# "Else the slowest feed" fails where the slowest pass leaves time unused: with 2 mm and 24 s left, 16 s is
# best.
costs = plans["P1"].alternatives(2.0, 24.0, within=1.0)
best = next(iter(costs))
row(
    "P1: best pass at (2 mm, 24 s)",
    "slowest",
    "16 s",
    best,
    "corrected: the fewest passes that fill the time",
)
row("P1: J of the 20 s pass there [$]", "-", 1.0297, costs["20 s"], "ours: independent program", 5)
late = weldbead.plan(weldbead.preset("P2").replace(stage=0.5, horizon=6.0), tolerance=None, nodes=101)
gain = [late.alternatives(2.0, t, within=10.0) for t in (3.0, 3.5)]
gain = [costs["stop"] - costs["6 s"] for costs in gain]
row(
    "P2: latest start at 2 mm [s]", "-", 3.248, 3.0 - 0.5 * gain[0] / (gain[1] - gain[0]), "ours: closed form"
)

# %%
# The table
# ---------
head = ("quantity", "published", "correct", "ours")
print(f"{head[0]:38s}{head[1]:>13s}{head[2]:>12s}{head[3]:>12s}   label")
for what, published, correct, ours, label in ROWS:
    print(f"{what:38s}{published:>13s}{correct:>12s}{ours:>12s}   {label}")

# %%
# What cannot be reproduced
# -------------------------
NOT = {
    "Fig. 5-4 (table of J)": "a sample of the stored form; rows 6 to 12 s are not convex, time steps of a toy problem",
    "Fig. 5-23, 5-32, 5-35, 5-36": "length, reset, force limit, scatter and charges of the planned beads are not printed",
    "section 5.4 (57 %, 49 %)": "hypothetical in the text; the parameters behind them are not given",
    "section 5.5 (313 s/mm)": "length and force are not printed, and Fig. 5-23 contradicts it (2 mm in about a minute)",
    "section 5.5 (cheap time)": "his late side depended on the end of his late window; here it has none",
    "section 5.4 (surface finish)": "the finish model (Ivers) is not given; its sign as printed favours fast last passes",
    "Appendix A (ski trails)": "the map is lost; the numbers in the text are met by an example of this gallery",
}
print("\nnot reproducible")
for what, why in NOT.items():
    print(f"  {what}: {why}")

# %%
# The policy map of P1
# --------------------
# Penalty, duration of the next pass, its force. Compare the regions of chapter 5: no grinding in the last 6
# s, bands of 6 s, the fastest feed below the threshold of the greatest force, fewer and slower passes above
# it.
figure = plans["P1"].plot()

# %%
# Slices of J
# -----------
# Steps in time, one for each fastest pass; the slices are not convex everywhere, as the source has it.
height = plans["P1"].states()[0]
figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.6), layout="constrained")
for time in (4.0, 6.0, 12.0, 24.0, 48.0):
    axes[0].plot(height, plans["P1"].value(height, time), label=f"{time:g} s")
axes[0].set(xlabel="height [mm]", ylabel="expected penalty [$]", title="P1: fixed deadline")
axes[0].legend(frameon=False)
for time in (-20.0, -10.0, -4.0, 0.0, 4.0, 10.0):
    axes[1].plot(height, plans["P5"].value(height, time), label=f"{time:g} s")
axes[1].set(xlabel="height [mm]", title="P5: quadratic charges, late too")
axes[1].legend(frameon=False)
for ax in axes:
    ax.set_xlim(0, np.max(height))

plt.show()
