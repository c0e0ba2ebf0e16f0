"""
Three tiers
===========

The sequence asks for a depth; the pass planner turns it into a contour, a height and a force along the
scanned bead; a force loop at 60 Hz follows them on a table with play, a noisy sensor and coefficients that
nobody told the planner.

"""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes

# %%
# What goes where
# ---------------
# Each tier turns what it is asked for into something for the tier below, and sees only what it needs: the
# sequence a bead and a time, once a pass; the pass a scanned contour; the force loop a force, sixty times a
# second. What a pass really did comes back and improves the coefficients that all of it rests on.

BOXES = {
    "sequence": (0.02, "height, time left\n-> depth, feed"),
    "pass": (0.27, "scan, depth, feed\n-> contour, heights, forces"),
    "force": (0.52, "force, heights, forces\n-> platform, 60 Hz"),
    "stand": (0.77, "disc, bead, table,\nsensors, scanner"),
}
DOWN = ("mean_cut\nfeed_rate\ncoefficients", "fly_height\nnormal_force", "platform\ncommand")
figure, axis = plt.subplots(figsize=(10, 3), layout="constrained")
for name, (left, does) in BOXES.items():
    color = "#f0dfc4" if name == "stand" else "#d5e3f0"
    axis.add_patch(plt.Rectangle((left, 0.5), 0.17, 0.34, facecolor=color, edgecolor="0.3"))
    axis.text(left + 0.085, 0.75, name, ha="center", weight="bold")
    axis.text(left + 0.085, 0.53, does, ha="center", fontsize=7)
ARROW = {"arrowstyle": "-|>", "color": "0.25", "shrinkA": 0, "shrinkB": 0}
for (left, _), what in zip(BOXES.values(), DOWN, strict=False):
    axis.annotate("", (left + 0.25, 0.67), (left + 0.17, 0.67), arrowprops=ARROW)
    axis.text(left + 0.21, 0.7, what, ha="center", va="bottom", fontsize=7)
for name, depth, what in (
    ("force", 0.36, "force, place of the disc: each sample"),
    ("pass", 0.22, "scanned contour: after each pass"),
    (
        "sequence",
        0.08,
        "mean height, time left; power, forces, removal rate of the pass: coefficients re-estimated",
    ),
):
    left = BOXES[name][0] + 0.085
    axis.plot([0.81 + depth / 6, 0.81 + depth / 6, left], [0.5, depth, depth], color="0.25", lw=1)
    axis.annotate("", (left, 0.5), (left, depth), arrowprops=ARROW)
    axis.text(left + 0.01, depth + 0.015, what, fontsize=7)
axis.set(xlim=(0, 0.96), ylim=(0.02, 0.9))
axis.axis("off")

# %%
# A job
# -----
# A short bead, scanned; the disc and its process; the loop of the bottom tier.

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
loop = force.PI.design(crossover=units.hz(3.0), drive=force.table_drive())

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
both = hwsim.compare(
    stand, {"looks": weldbead.Hierarchy(policy, disc, loop), "trusts": blind}, parts=4, rng=0
)
for name, penalty in zip(both.outcome.controller.values, both.outcome.penalty.values, strict=True):
    print(f"{name}: {penalty.mean():.3f} $")

# %%
# A spring before the sensor
# --------------------------
# Where the grinder's own inertia counts, a wobbling disc makes it ring, and a sensor behind it reads the
# ringing. The source advises to put the compliance between grinder and sensor, so that the sensor reads the
# spring alone:

for first in (False, True):
    ringing = stand.replace(grinder_inertia=5.4, spring_first=first, runout=0.2)
    read = hwsim.run(ringing, weldbead.Hierarchy(policy, disc, loop), rng=1)["force"]
    off = (read.force - read.force_reference_planned).values[read.force_reference_planned.values > 10.0]
    print(
        f"spring {'before' if first else 'behind'} the sensor: reading {np.nanstd(off):.1f} N rms off what is foreseen"
    )
