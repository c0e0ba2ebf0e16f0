"""
Three tiers
===========

The sequence asks for a depth; the pass planner turns it into a contour, a height and a force along the scanned bead; a
force loop at 60 Hz follows them on a table with play, a noisy sensor and coefficients that nobody told the planner.

.. code-block:: text

    scan --> sequence --(depth, feed, coefficients)--> pass --(heights, forces)--> force --(platform)--> stand
      ^                                                                                                   |
      +------------------ scanned bead, power, forces, removal rate of the pass <-------------------------+
"""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes

# %%
# A pass
# ------
# A tilted disc on a spring cuts a wavy bead. The target takes a quarter of a millimetre off on average, by exact volume;
# the plan holds the tip of the disc on it, and says where the force limit leaves something standing.

x = np.linspace(0, 60, 601)
bead = passes.Contour(x, 0.6 + 0.08 * np.sin(2 * np.pi * x / 40))
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
problem = passes.PassProblem(disc, bead, mean_cut=0.25, feed_rate=20.0)
plan = passes.plan(problem)
print(plan)
plan.plot()

# %%
# The same heights on a duller disc cut less, and press harder:

dull = plan.simulate(model=disc.replace(specific_energy=14.0))
print(f"volume {dull.volume:.0f} of {plan.volume:.0f} mm^3, force up to {dull.normal_force.max():.0f} N")

# %%
# A disc cuts
# -----------
# Four moments of the pass: the face (line) ahead of the tip, and what it has left behind.

figure, axes = plt.subplots(4, 1, figsize=(8, 6), sharex=True, sharey=True, layout="constrained")
for axis, place in zip(axes, (2.0, 15.0, 30.0, 50.0), strict=True):
    k = int(np.argmax(plan.tip_x >= place))
    ahead = np.where(x < plan.tip_x[k], plan.contour.at(x), bead.at(x))
    axis.fill_between(x, 0.0, ahead, color="0.8", lw=0)
    face = np.array([0.0, 3.0])
    axis.plot(plan.tip_x[k] + face, plan.tip_z[k] + face * np.tan(plan.disk_angle[k]), color="#b04a3a", lw=2)
    axis.text(0.5, 0.8, f"{plan.time[k]:.1f} s, {plan.normal_force[k]:.0f} N", fontsize=8)
    axis.set(ylim=(0, 1), ylabel="mm")
axes[-1].set_xlabel("position along the bead [mm]")

# %%
# The force loop
# --------------
# A proportional-integral law on a table of 9 and 40 Hz, one sample of delay. What it may claim is said by its margins.

loop = force.PI.design(crossover=units.hz(3.0), drive=force.table_drive())
print(force.margins(loop, delay_samples=1))

# %%
# All three
# ---------
# One controller of three tiers. Each tier has its table in the log.

job = weldbead.preset("P4").replace(
    model=process, bead_length=60.0, durations=range(6, 21, 2), stage=2.0, horizon=60.0, force_max=50.0
)
policy = weldbead.plan(job, tolerance=1e-3)
stand = hwsim.ForceTableStand(problem, time=40.0)
log = hwsim.run(stand, weldbead.Hierarchy(policy, disc, loop), rng=1)
asked = log["sequence"]["mean_cut_command"].values
for wanted, got in zip(asked, log.outcome.true_cut_depth.values[0], strict=False):
    print(f"asked for {wanted:.3f} mm, cut {got:.3f} mm")
print(f"left {log.outcome.height.item():.3f} mm, penalty {log.outcome.penalty.item():.3f} $")
log.plot()

# %%
# Does it pay to look? The same beads, one controller that scans and re-estimates, one that trusts its plan.

blind = weldbead.Hierarchy(policy, disc, loop, reestimate=False, replan=False)
both = hwsim.compare(stand, {"looks": weldbead.Hierarchy(policy, disc, loop), "trusts": blind}, parts=4, rng=0)
for name, penalty in zip(both.outcome.controller.values, both.outcome.penalty.values, strict=True):
    print(f"{name}: {penalty.mean():.3f} $")
