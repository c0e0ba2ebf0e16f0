"""
Closing the loop
================

A plan is as good as the model behind it. Here the workshop differs from the model: a duller disc, more
friction. The plan is run on the stand all the same, the log says what the process really is, and the job is
planned again. Both plans then grind the same beads."""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import weldbead

# %%
# The model and the truth
# -----------------------
# The planner believes in the process of P1. The stand is told otherwise with ``truth``, the one way in which
# a plant may differ from what the planner knows.

problem = weldbead.preset("P1")
truth = problem.model.replace(specific_energy=12.5, idle_power=130.0, friction_ratio=0.33)
stand = hwsim.WeldBeadStand(problem, truth=truth, height=1.5, time=36.0)
print(f"planned: {problem.model.mean_cut(50.0, 12.5):.3f} mm in the strongest fast pass")
print(f"true:    {truth.mean_cut(50.0, 12.5):.3f} mm")


# %%
# Plan, run
# ---------
# Forty beads by the first plan. It does not do badly: it looks at what each pass has left and corrects
# itself. Feedback forgives much. But it trusts the last pass too much, and that pass cannot be corrected any
# more.

first = weldbead.plan(problem, tolerance=1e-3)
log = hwsim.run(stand, weldbead.SequenceController(first), parts=40, rng=1)
left = log.outcome.height.values
print(f"left on average: {left.mean():.3f} mm, ground too deep: {np.mean(left < 0):.0%}")

# %%
# Identify
# --------
# Every pass has told its power, its forces and what it removed. That is enough for the coefficients and their
# uncertainty. The rows of the log that hold no pass (a bead's first scan) are left out.

power = weldbead.identify(log, "power")
friction = weldbead.identify(log, "friction")
print(power)
print(friction)
print("95 % intervals:", power.interval(0.95).round(2).tolist())

# %%
# The estimate of the friction ratio is good. Specific energy and idle power are known less well, and not
# independently: most passes of a plan are strong ones, and a line is hard to place by points at one end. That
# harms little, since the combination that matters, the depth of the passes that are used, is known better
# than either.

print("correlation of the two:", power.correlation[0, 1].round(2))
table = log["sequence"]
figure, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
ax.plot(table.grinding_power, table.removal_rate, ".", color="0.4", label="passes")
x = np.linspace(80.0, 750.0, 200)
for name, energy, idle, colour, style in (
    ("believed", problem.model.specific_energy, problem.model.idle_power, "#7570b3", "-"),
    ("identified", power["specific_energy"], power["idle_power"], "#d95f02", "-"),
    ("true", truth.specific_energy, truth.idle_power, "k", "--"),
):
    ax.plot(
        x,
        np.maximum(0, (x - idle) / energy),
        style,
        color=colour,
        label=f"{name}: {energy:.1f} J/mm³, {idle:.0f} W",
    )
ax.set(xlabel="grinding power [W]", ylabel="removal rate [mm³/s]")
ax.legend(frameon=False)

# %%
# Plan again
# ----------
# ``updated`` puts the estimates into the problem. The rest is as before.

second = weldbead.plan(problem.updated(power).updated(friction), tolerance=1e-3)
print(first.action(height=0.2, time_left=6.0))
print(second.action(height=0.2, time_left=6.0))

# %%
# Does it pay? ``compare`` gives both controllers the same beads: bead number k draws the same random numbers
# for each, so that the difference between the two is known much better than either cost. A third controller
# knows the truth: nobody can do better than that by planning.

perfect = weldbead.plan(problem.replace(model=truth), tolerance=1e-3)
controllers = {
    "first": weldbead.SequenceController(first),
    "second": weldbead.SequenceController(second),
    "truth known": weldbead.SequenceController(perfect),
}
versus = hwsim.compare(stand, controllers, parts=300, rng=2)
penalty = versus.outcome.penalty
for name in controllers:
    saved = (penalty.sel(controller="first") - penalty.sel(controller=name)).values
    cost = penalty.sel(controller=name).values
    print(
        f"{name:<12}{cost.mean():.4f} $ a bead, saves {saved.mean():.4f} +- {saved.std() / saved.size**0.5:.4f} $"
    )

# %%
figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for name, colour, style in zip(controllers, ("#7570b3", "#d95f02", "k"), ("-", "-", ":"), strict=True):
    heights = np.sort(versus.outcome.height.sel(controller=name).values)
    ax.step(heights, np.arange(1, heights.size + 1) / heights.size, style, color=colour, label=name)
ax.axvline(0, color="0.6", lw=0.8)
ax.set(xlabel="height left at the end [mm]", ylabel="share of beads below", xlim=(-0.05, 0.12), ylim=(0, 1))
ax.legend(frameon=False)

# %%
# What this does not do: the plan knows the estimates, not their uncertainty, and it does not make a pass
# stronger or weaker in order to learn. For a job that drifts, identify with forgetting
# (``method="recursive"``) and plan again from time to time; ``hwsim.run(..., adapt=...)`` is the place for it
# in a simulated series.
