"""
Numbers with an uncertainty
===========================

Before there is a log there are a few tests and a calculator: a specific energy from one pass, the force on a
coarser disc, the scatter of thirty depths. This page carries the uncertainty of such numbers along, first
through a formula, then into a law to plan with. The formulas are Brown's (1988), sections 2.5 and 8.3."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import identify, sdp

# %%
# Through a formula
# -----------------
# One pass removed a mean depth *m* over the width *w* at the feed *V*, with the power *P* at the contact; the
# power :math:`K_2` removes nothing. Its specific energy is
#
# .. math:: K_1 = \\frac{P - K_2}{m w V}
#
# Each reading comes with its standard deviation, and each step of the formula with that of its result.

power = identify.sample_moments([1490.0, 1535.0, 1462.0, 1518.0])  # W, of four strips of the record
idle = identify.Moments(140.0, 30.0)  # W
depth, section = identify.Moments(0.21, 0.01), 6.4 * 80.0  # mm; w V in mm^2/s, known well

removing = identify.difference_moments(power, idle)
removed = identify.product_moments(depth, (section, 0.0))
energy = identify.ratio_moments(removing, removed)
print(f"K1 = {energy.mean:.2f} +- {energy.sd:.2f} J/mm^3")

# %%
# The whole formula at once, by its derivatives at the means, says the same:

whole = identify.delta_method(
    lambda q: (q[0] - q[1]) / (q[2] * section),
    mean=[power.mean, idle.mean, depth.mean],
    covariance=[power.sd, idle.sd, depth.sd],
)
print(f"K1 = {whole.mean:.2f} +- {whole.sd:.2f} J/mm^3, at once")

# %%
# Where quantities belong together, the correlation counts. Force and friction of one disc, fitted to the same
# readings, err in opposite directions, and their product, the tangential force, is surer than either. The
# source's table as it is printed does not know the sign, and makes it less sure:

force, friction = (42.0, 2.0), (0.36, 0.02)  # N, unit 1
for name in ("corrected", "printed"):
    tangential = identify.product_moments(force, friction, correlation=-0.8, method=name)
    print(f"{name:<9}: {tangential.mean:.2f} +- {tangential.sd:.2f} N")
both = identify.sum_moments((15.1, 0.6), (14.8, 0.6), correlation=0.5)
print(f"two discs on one spindle: {both.mean:.1f} +- {both.sd:.1f} N")

# %%
# A line through two noisy quantities
# -----------------------------------
# Power against removal rate gives both coefficients. With noise on the rate alone counted, or on the power
# alone, the slope is biased one way or the other; ``total_least_squares`` takes the ratio of both noises.

rng = np.random.default_rng(3)
true_rate = np.linspace(20.0, 130.0, 24)  # mm^3/s
rate = true_rate + rng.normal(0.0, 15.0, 24)
drawn = 140.0 + 12.8 * true_rate + rng.normal(0.0, 60.0, 24)  # W
line = identify.total_least_squares(
    rate, drawn, noise_ratio=60.0 / 15.0, names=("idle_power", "specific_energy"), units=("W", "J/mm^3")
)
plain = identify.least_squares(
    np.column_stack([np.ones(24), rate]), drawn, names=line.names, units=line.units
)
print("both noisy: ", line)
print("rate exact: ", plain)

# %%
# From a sample to a law
# ----------------------
# Thirty depths of one setting. Brown draws a smooth curve through the cumulative plot and differentiates it;
# a curve through a few quantiles does that, a kernel is the better density.

truth = sdp.LogNormal(0.2, 0.06)
depths = np.asarray(truth.sample(11, (30,)))
kernel = identify.kernel_density(depths)
curve = identify.quantile_density(depths, bins=6)
print(f"{identify.sample_moments(depths).sd:.3f} mm; the kernels would put {kernel.leak:.1%} below 0")

amount = np.linspace(0.0, 0.45, 400)
figure, axis = plt.subplots(figsize=(7, 3.4), layout="constrained")
axis.plot(amount, np.gradient(truth.under(amount, power=0), amount), "k:", label="true law")
axis.plot(amount, kernel.pdf(amount), label="kernels")
axis.plot(amount, curve.pdf(amount), label="curve through 6 quantiles")
axis.plot(depths, np.zeros(30), "|", color="0.4", label="the 30 depths")
axis.set(xlabel="depth of the pass [mm]", ylabel="density [1/mm]", ylim=(0, None))
axis.legend(frameon=False)

# %%
# The kernel density becomes the law of a plan: the standardised sample gives the shape, mean and standard
# deviation go with the setting.

shape, bandwidth = kernel.standardised()
law = sdp.Empirical([0.1, 0.2], [0.03, 0.06], shape, bandwidth, rectified=True)
for mean, deep in zip((0.1, 0.2), law.over([0.15, 0.3], power=0), strict=True):
    print(f"{mean:.1f} mm wanted: P(half as much again) = {deep:.3f}")
