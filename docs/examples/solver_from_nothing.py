"""
The solver from nothing
=======================

What :func:`sdpgrind.sdp.plan` does for a weld bead, in forty lines of numpy. The problem is P1: a bead of
some height, passes of 6 to 20 s at any force up to 50 N, a fixed deadline; 2 $ for every millimetre left at
the end and 10 $ for every one ground too deep."""

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import erf

from sdpgrind import sdp, weldbead
from sdpgrind.weldbead.sequence import sdp_problem

problem = weldbead.preset("P1")

# %%
# The state
# ---------
# Heights on a grid of 0.02 mm, times on the lattice of 2 s. A bead below zero needs no grid: nothing but
# stopping makes sense there, and its charge is known.
h, stage = 0.02, 2.0
height = np.arange(0.0, 2.0 + h / 2, h)
nodes, stages = height.size, 30


# %%
# One pass
# --------
# A force gives the cut a mean and a standard deviation; its law is Rayleigh's, moved to that mean and
# stretched to that deviation, or only stretched where it would begin below zero. All that is needed of it is
# ``G(y) = E (y - D)+``.
def g(y, mean, sd):
    q = sd / np.sqrt(2 - np.pi / 2)
    start = mean - q * np.sqrt(np.pi / 2)
    q, start = np.where(start < 0, mean / np.sqrt(np.pi / 2), q), np.maximum(start, 0.0)
    u = np.maximum(y - start, 0.0)
    return u - q * np.sqrt(np.pi / 2) * erf(u / (np.sqrt(2) * q))


# %%
# Between nodes the value-to-go J is taken as linear. A function that is linear between nodes is a sum of
# hats, so E J(x - D) is a sum of E hat: second differences of G. They are probabilities (none is negative,
# they add up to 1), they are exact, and the weight of falling k cells does not depend on where one is. What
# falls below zero is charged 10 $/mm, in closed form: E (D - x)+ = G(x) - x + mean.
def weights(mean, sd):
    lag = h * np.arange(-1, nodes + 1)[:, None]
    curve = g(lag, mean, sd)
    fall = (curve[2:] - 2 * curve[1:-1] + curve[:-2]) / h  # [cells fallen, force]
    over = 10.0 * (curve[1:-1] - lag[1:-1] + mean)
    return fall, over


passes = []
for duration in problem.durations:
    low, high = problem.force_interval(duration)
    force = low + (high - low) * (1 - np.cos(np.pi * np.arange(1, 201) / 200)) / 2
    power = 1e-3 * 0.3 * 85.0 * 500.0 * force  # W: friction ratio, radius, speed
    # W for every mm of cut: specific energy, bead width, feed rate
    rate = 10.0 * 12.5 * problem.feed_rate(duration)
    mean, sd = (power - 100.0) / rate, 0.15 * power / rate
    passes.append((round(duration / stage), force, *weights(mean, sd)))

# %%
# Backward in time
# ----------------
# With no time left one stops. With t left one stops too, or takes the pass whose expected value-to-go, t less
# its duration from the end, is least.
stop = 2.0 * height
J = np.empty((stages + 1, nodes))
best = np.zeros((stages + 1, nodes))
for t in range(stages + 1):
    J[t] = stop
    for duration, force, fall, over in passes:
        if duration > t:
            continue
        after = J[t - duration]
        expected = over.copy()  # [node, force]
        for node in range(1, nodes):
            expected[node] += after[node:0:-1] @ fall[:node]
        pick = expected.argmin(axis=1)
        least = expected[np.arange(nodes), pick]
        best[t] = np.where(least < J[t], force[pick], best[t])
        J[t] = np.minimum(J[t], least)

# %%
# The sum leaves out the node at zero: stopping there is free, so its weight does not matter.
#
# The library's answer on the same grid differs by its search between force levels only.
policy = sdp.plan(sdp_problem(problem, nodes=nodes))
difference = J - policy.table.value[:, 0]
print(f"J(1 mm, 24 s) = {J[12, 50]:.5f} $; the library says {policy.value(height=1.0, time_left=24.0):.5f} $")
print(
    f"largest difference over all {J.size} states: {difference.max():.1e} $, least {difference.min():.0e} $"
)

# %%
# Finer grids
# -----------
# The rest of the library's work is: choosing the grid so that the error is known, finding the best force
# without trying hundreds, doing a stage in one matrix product, late sides, modes, several coordinates, and
# keeping the result.
exact = weldbead.plan(problem, tolerance=1e-4)
print(f"converged: {exact.value(1.0, 24.0):.5f} $, within {exact.error:.0e} $")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for t in (0, 3, 6, 12, 30):
    left.plot(height, J[t], label=f"{t * stage:g} s")
    right.plot(height, np.where(J[t] < stop, best[t], np.nan), ".", ms=3)
left.set(xlabel="height [mm]", ylabel="expected penalty-to-go [$]")
left.legend(title="time left", frameon=False)
right.set(xlabel="height [mm]", ylabel="normal force [N]")
plt.show()
