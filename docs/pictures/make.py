"""Draw the picture of the README: ``python docs/pictures/make.py [FOLDER]`` (by default the folder of this
script).
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import weldbead

HEIGHT, TIME = 1.5, 30.0  # start of every bead: mm, s to the deadline

problem = weldbead.preset("P1")
policy = weldbead.plan(problem, tolerance=1e-4)
stand = hwsim.WeldBeadStand(problem, height=HEIGHT, time=TIME)
log = hwsim.run(stand, weldbead.SequenceController(policy), parts=400, rng=3)

figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.0), width_ratios=(3, 2), layout="constrained")

# The plan: between two stages the answer is that of the stage below, so cells begin at their stage.
height = np.linspace(0.0, 1.7, 341)
time = np.arange(0.0, TIME + problem.stage, problem.stage)
action = policy.action(height=height[1:, None], time_left=time[None, :-1])
force = np.where(action.stop, np.nan, action.normal_force)
colours = plt.get_cmap("Blues").with_extremes(bad="0.9")
image = left.pcolormesh(time, height, force, cmap=colours, vmin=0, vmax=problem.force_max, rasterized=True)
figure.colorbar(image, ax=left, label="planned normal force of the next pass [N]", pad=0.02)

# What the stand did with it: one line a bead, measured before each pass.
table = log["sequence"]
for part in range(12):
    rows = table.part.values == part
    left.plot(
        table.time_left.values[rows], table.height.values[rows], "o-", color="#d95f02", ms=3, lw=1, alpha=0.8
    )
left.axhline(0, color="k", lw=1)
left.text(3, 1.6, "stop", ha="center", va="top", color="0.4")
left.set(xlim=(TIME + 0.5, -0.5), ylim=(-0.09, 1.7), xlabel="time left [s]", ylabel="height of the bead [mm]")
left.set_title("A plan, and twelve beads ground by it", loc="left", fontsize=11)

penalty, planned = log.outcome.penalty.values, policy.value(height=HEIGHT, time_left=TIME)
right.hist(penalty, bins=np.linspace(0, 0.4, 33), color="#d95f02", alpha=0.5)
right.axvline(planned, color="k", ls="--", label=rf"planned {planned:.3f} \$")
error = penalty.std(ddof=1) / np.sqrt(penalty.size)
right.axvline(penalty.mean(), color="#d95f02", label=rf"realised {penalty.mean():.3f} $\pm$ {error:.3f} \$")
right.legend(frameon=False)
right.set(xlim=(0, 0.4), xlabel=r"penalty of a bead [\$]", ylabel="beads of 400")
right.set_title("What they cost", loc="left", fontsize=11)
for ax in (left, right):
    ax.spines[["top", "right"]].set_visible(False)

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
figure.savefig(folder / "plan_and_run.png", dpi=110)
