"""
Reading a policy
================

A policy is a table over the height of the bead and the time left. This page shows what can be read from it
besides the next pass: what a millimetre and a second are worth, how close the decision is, and why the table
looks as it does."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import weldbead

problem = weldbead.preset("P1")
policy = weldbead.plan(problem, tolerance=1e-4)

# %%
# Value: what is still to be paid
# -------------------------------
# ``value`` is the penalty to expect from here on, when every pass from now on follows the policy. Numbers go
# in, numbers come out; arrays go in, arrays come out. It is the price tag of a state, so prices follow from
# it.

print(f"1 mm left and 24 s: {policy.value(height=1.0, time_left=24.0):.4f} $")
print(f"the same with 12 s: {policy.value(height=1.0, time_left=12.0):.4f} $")
print(f"a mm of metal there costs {policy.gradient(height=1.0, time_left=12.0):.2f} $/mm")

# %%
# Against time, which runs out to the right, the value is a flight of steps. A step stands where one more pass
# fits in: the fastest pass takes 6 s, and half a pass is no use. Between two stages the answer is that of the stage below, the one
# that is sure to be reached. Do not interpolate over such a step.

time = np.arange(0.0, 60.0, 0.1)
figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
for height in (0.1, 0.2, 0.5, 1.0, 1.5):
    ax.semilogy(time, policy.value(height=height, time_left=time), label=f"{height:g} mm")
ax.set(xlabel="time left [s]", ylabel=r"expected penalty [\$]", xticks=range(0, 61, 6), xlim=(60, 0))
ax.legend(title="height", ncols=2, frameon=False)
ax.grid(alpha=0.3)

# %%
# Below 6 s nothing fits in: the policy stops and pays 2 $ for every mm that is left. With a minute left every
# one of these beads costs a cent or less: what remains to be paid for is the scatter of the last, light
# passes.
#
# Action: what to do
# ------------------
# ``action`` always gives the same type: ``stop``, ``duration``, ``feed_rate``, ``normal_force``,
# ``mean_cut``, ``gap``.

action = policy.action(height=0.2, time_left=12.0)
print(action)
print(f"It goes for {action.mean_cut / 0.2:.0%} of the height, on average.")

# %%
# How much of the height does the policy go for? Not all of it: grinding into the sheet costs five times what
# metal left over costs. And the less, the more passes can follow; close to the deadline it gets bolder.

height = np.linspace(0.005, 1.0, 400)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
for time_left in (6.0, 12.0, 24.0, 48.0):
    action = policy.action(height=height, time_left=time_left)
    left.plot(height, action.normal_force, label=f"{time_left:g} s")
    right.plot(height, action.mean_cut / height)
left.axhline(problem.model.threshold_force, color="k", lw=0.8, ls=":")
left.annotate(
    "the disc only rubs",
    (1.0, problem.model.threshold_force),
    (0, -4),
    textcoords="offset points",
    ha="right",
    va="top",
)
left.set(xlabel="height [mm]", ylabel="normal force [N]", ylim=(0, 55))
left.legend(title="time left", frameon=False)
right.set(xlabel="height [mm]", ylabel="mean cut over height", ylim=(0, 1))

# %%
# Where the curves on the right fall as 1/height, the force is at its limit. Where they jump, the policy
# changes to a slower pass, which removes more. Very near the target even the lightest useful pass is a
# gamble, and the share drops: see :doc:`/words_of_warning` on forces near the threshold.
#
# Gap: does it matter?
# --------------------
# ``gap`` is what the best *other* duration, or stopping, would cost more. A small gap is freedom: an operator
# who prefers another pass may have it. ``alternatives`` lists everything within a price.

for state in ({"height": 1.5, "time_left": 30.0}, {"height": 0.2, "time_left": 12.0}):
    print(state, f"gap {policy.action(**state).gap:.4f} $")
    for name, value in policy.alternatives(**state, within=0.1).items():
        print(f"    {name:>5}: {value:.4f} $")

# %%
# The map of the gap shows where the table has a firm opinion. Where it is light two passes are equally good,
# and a policy from a slightly different model may choose otherwise there, at no cost. The light blocks just
# above the target, and those high up with a lot of time, say that the order of passes, or a second more or
# less for the last one, makes no difference.

heights, times = policy.states()
grid = policy.action(height=heights[1:, None], time_left=times[None, 3:-1])
figure, ax = plt.subplots(figsize=(7, 3.8), layout="constrained")
# The answer at a stage holds until the next one: cells begin at their stage.
image = ax.pcolormesh(
    times[3:], heights, np.log10(np.clip(grid.gap, 1e-5, 1.0)), cmap="magma_r", rasterized=True
)
bar = figure.colorbar(image, ax=ax, label=r"gap [\$]", ticks=range(-5, 1))
bar.ax.set_yticklabels([f"$10^{{{k}}}$" for k in range(-5, 1)])
ax.set(xlabel="time left [s]", ylabel="height [mm]", xlim=(60, times[3]))

# %%
# Risk: more than the mean
# ------------------------
# The distribution of the final penalty follows from the table without any random numbers: the probability of
# grinding into the sheet, the mean of the worst 5 %, the number of passes.

for time_left in (12.0, 24.0, 48.0):
    print(f"{time_left:g} s:", policy.risk(height=1.0, time_left=time_left, confidence=0.95))

# %%
# The policy makes the *mean* as small as it can be, not the worst case. If the worst case matters more,
# charge more for it: a steeper or a quadratic charge on the over side moves the whole table.
#
# Error: how far from exact
# -------------------------
# ``error`` estimates the largest distance of any value at the table's nodes from the converged one. It is
# about the arithmetic alone. It knows nothing of a wrong specific energy: what that costs, ``simulate``
# tells.

print(f"arithmetic: {policy.error:.1e} $")
duller = problem.model.replace(specific_energy=12.0)
print("as planned:       ", policy.simulate(runs=20_000, height=1.5, time_left=30.0))
print("a disc 20 % duller:", policy.simulate(duller, runs=20_000, height=1.5, time_left=30.0))

# %%
# The second line is what :doc:`05_closing_the_loop` repairs.
