"""
What can burn
=============

A plan for which the burn threshold is exactly known ends on the threshold: half of all errors burn the part.
Who says what is not known gets the fastest cycle whose chance of a burned layer stays below what is allowed,
and what each doubt costs."""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import plunge

problem = plunge.preset("simulation").replace(
    burning_sd=0.03, diffusivity_sd=0.05, drive=plunge.Drive(feed_lag=0.05, feed_delay=0.04)
)
safe = plunge.plan(problem, confidence=0.999)
print(
    f"{plunge.plan(problem).time:.2f} s with all values exact, {safe.time:.2f} s with their doubts; of these:"
)
for name, seconds in safe.price.items():
    print(f"{name:15s} {seconds:5.2f} s")

# %%
# The doubt of the wheel's sharpness costs most in a plan, which reads no power. The controller learns it while it
# grinds, and knows lag and dead time of its machine. What it cannot see is the threshold: power, size and
# force do not contain it.

few = 60
truth = problem.replace(sharpness_sd=0.1, deflection_sd=0.1).draw  # another steel and wheel for each part
grinder = hwsim.PlungeGrinder(problem, truth=truth, contact_zero_sd=0.01)
log = hwsim.run(grinder, plunge.CycleController(problem), parts=few, rng=1)
out = log.outcome
print(f"{int(out.burned.sum())} of {few} burned, {float(out.time.mean()):.2f} s,", end=" ")
print(f"{1e3 * float(out.roundness.max()):.3f} µm out of round at worst")

# %%
# How to learn your threshold
# ---------------------------
# Inspect parts. A part found good teaches little, since it was expected to be good; a severity, such as by
# Barkhausen noise, teaches much. Here is one machine and steel whose threshold is 2.5 % lower than believed.

burning = problem.model.burning
steel = problem.model.replace(burning=burning.replace(B=0.975 * burning.B))
grinder = hwsim.PlungeGrinder(problem, truth=steel, inspection=hwsim.Inspection(severity_sd=0.03))
log = hwsim.run(
    grinder, plunge.CycleController(problem), parts=5, rng=2, adapt=plunge.learning.ThresholdUpdate(problem)
)
print("times:", ", ".join(f"{time:.2f}" for time in log.outcome.time.values), "s")

# %%
# `ThresholdUpdate` does that between parts. By hand, from a log and what an inspection found:

threshold, margins = plunge.BurnThreshold(problem), []
for part in range(5):
    margins.append((threshold.mean, threshold.sd, threshold.margin))
    reading = float(log.outcome.severity_reading[part])
    threshold.update(log, part=part, severity=reading, severity_sd=0.03)
believed = problem.updated(threshold.estimate)
test = threshold.next_test()
print(f"B = {believed.model.burning.B:.3f} of {problem.model.burning.B:.3f}, known to", end=" ")
print(
    f"{100 * believed.uncertainty.burning_sd:.1f} %; a sacrificial part would save {test.saving:.2f} s a part"
)

mean, sd, margin = 100 * np.array(margins).T
figure, axis = plt.subplots(figsize=(6, 3.2), layout="constrained")
axis.errorbar(range(1, 6), mean, sd, fmt="o-", label="believed, with its standard deviation")
axis.plot(range(1, 6), margin, "s--", label="margin of the next part")
axis.axhline(-100 * np.log(0.975), color="0.3", lw=1, label="truth")
axis.set(xlabel="part", ylabel="threshold is lower by [%]", xticks=range(1, 6))
axis.legend(frameon=False)
plt.show()

# %%
# Without any inspection a doubt of 5 % of the threshold costs 8 to 9 % of the time, and no controller can
# save it: one that claims to has taken the threshold as known.
