"""
A pass
======

The middle tier. The sequence asks for a depth on average; the pass planner turns it into a contour by exact
volume, and into the height and the force of a disc that cuts it, within what the grinder and the bead can
take."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

process = weldbead.GrindingProcess(
    specific_energy=12.8,
    idle_power=114.0,
    friction_ratio=0.33,
    disk_radius=88.9,
    free_speed=500.0,
    speed_droop=0.0,
    bead_width=12.7,
)
disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)

# %%
# A depth becomes a contour
# -------------------------
# The target is a level line (or any `target_shape`), lowered until what lies above it is the volume that was
# asked for. Over a dip the tip of the disc passes above the metal: the contour that is left is the lower of
# the two.

x = np.linspace(0, 150, 1501)
bead = passes.Contour(x, 1.0 + 0.15 * np.sin(2 * np.pi * x / 60) + 0.03 * np.sin(2 * np.pi * x / 17))
problem = passes.PassProblem(disc, bead, mean_cut=0.2, feed_rate=20.0)
plan = passes.plan(problem)
print(plan)
plan.plot()

# %%
# A disc cuts
# -----------
# Four moments: the disc is held by a rotational spring, so its face (red) leans back where there is more
# metal ahead of the tip. Ahead of the tip the bead is as it was, behind it is what the tip has left. The
# vertical scale is stretched.

figure, axes = plt.subplots(4, 1, figsize=(8, 6.5), sharex=True, sharey=True, layout="constrained")
for axis, place in zip(axes, (2.0, 30.0, 76.0, 120.0), strict=True):
    k = int(np.argmax(plan.tip_x >= place))
    face = plan.tip_z[k] + np.clip(x - plan.tip_x[k], 0, None) * np.tan(plan.disk_angle[k])
    left = np.where(x < plan.tip_x[k], plan.contour.at(x), np.minimum(bead.at(x), face))
    axis.fill_between(x, 0.0, bead.at(x), color="#e8c9a0", lw=0)
    axis.fill_between(x, 0.0, left, color="0.75", lw=0)
    reach = np.array([0.0, 4.0])
    axis.plot(
        plan.tip_x[k] + reach, plan.tip_z[k] + reach * np.tan(plan.disk_angle[k]), color="#b04a3a", lw=2.5
    )
    said = f"{plan.time[k]:.1f} s   {plan.normal_force[k]:.0f} N   {plan.grinding_power[k]:.0f} W"
    axis.text(0.99, 0.06, said, fontsize=9, ha="right", transform=axis.transAxes)
    axis.set(ylim=(0.5, 1.4), ylabel="height [mm]")
axes[-1].set_xlabel("position along the bead [mm]")

# %%
# Five ways to plan
# -----------------
# `inverse` (the default) holds the tip on the target and asks in each step which height that takes; where the
# force or the power would be too much it tracks the limit, and says what is left standing. `static` is the
# closed form of a flat cut, `quasistatic` the same at the front of the patch. `pi` is the source's servo on
# the error of the tip. `collocation` states an optimal control problem, and replays what it found.

for method in ("inverse", "static", "quasistatic", "pi", "collocation"):
    way = passes.plan(problem, method=method)
    off = np.interp(x, way.contour.x, way.contour.z) - np.interp(x, plan.contour.x, plan.contour.z)
    rms = 1e3 * np.sqrt(np.mean(off[100:1400] ** 2))
    print(f"{method:12s} {way.volume:6.1f} mm^3, contour {rms:5.2f} µm rms from the inverse plan")

# %%
# The same plan, another truth
# ----------------------------
# Heights are played back on a disc that grinds harder than it was planned for; the plan does not change, the
# pass does.

for energy in (10.0, 12.8, 16.0):
    record = plan.simulate(model=disc.replace(specific_energy=energy))
    print(f"{energy:5.1f} J/mm^3: {record.volume:5.0f} mm^3, force up to {record.normal_force.max():5.1f} N")

# %%
# A grinder that droops
# ---------------------
# An air motor slows down under load: its power has a peak, and past the peak more force cuts less. The
# planner stays at 80 % of the peak, and what it could not take off is said.

air = passes.TiltedDisc(
    process.replace(free_speed=units.hz(50.0), speed_droop=0.0821),
    relaxed_angle=units.deg(20),
    rotational_stiffness=6e5,
)
print(
    f"peak {air.peak_power:.0f} W; guarded at {air.power_max:.0f} W, {air.guarded_force:.1f} N, {air.guarded_speed:.0f} rad/s"
)
for feed in (5.0, 20.0):
    print(f"{feed:4.0f} mm/s:", passes.plan(passes.PassProblem(air, bead, mean_cut=0.2, feed_rate=feed)))

# %%
# Where power is short the feed need not be the same all along. With `Freedom` the optimal control chooses it
# too: the disc goes slowly where much is to be taken off, at the power that it may use.

freedom = passes.Freedom(feed_rate_min=2.0, feed_rate_max=40.0, time_weight=1e-4)
paced = passes.plan(
    passes.PassProblem(air, bead, mean_cut=0.2, feed_rate=5.0), method="collocation", freedom=freedom
)
print(paced)
figure, (top, low) = plt.subplots(2, 1, figsize=(8, 4), sharex=True, layout="constrained")
top.plot(paced.tip_x[1:], paced.feed_rate, color="#4878a8")
top.set(ylabel="feed [mm/s]")
low.plot(paced.tip_x, paced.grinding_power, color="#6a8f4e")
low.axhline(air.power_max, color="#b04a3a", lw=0.8, ls=":")
low.set(ylabel="power [W]", xlabel="tip along the bead [mm]")

# %%
# Many candidates
# ---------------
# Before one pass is planned, many can be looked through: without the dynamics of the disc the cut that comes
# nearest to the target is a small quadratic program. Which feed is the fastest that leaves no more than 10 µm
# rms?

feeds = np.arange(10.0, 41.0, 2.0)
found = passes.relax(problem, candidates=[(0.2, feed) for feed in feeds])
good = [feed for feed, cut in zip(feeds, found, strict=True) if cut.deviation < 0.01]
print(f"{len(feeds)} feeds: up to {max(good):.0f} mm/s")

# %%
# What the force loop will feel
# -----------------------------
# Contact is not a spring of constant stiffness: the bead is removed under it. At slow feed it is much
# softer.

for feed in (4.0, 20.0):
    felt = disc.linearize(mean_cut=0.25, feed_rate=feed)
    print(
        f"{feed:4.0f} mm/s: {felt.static_stiffness:.0f} N/mm slow, {felt.contact_stiffness:.0f} fast, pole {felt.pole:.1f} rad/s"
    )
plt.show()
