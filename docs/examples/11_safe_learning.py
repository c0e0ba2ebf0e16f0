"""
Safe learning
=============

How small may a safety margin be? Too large costs time in every part, too small burns one. The margin can be
learned from part to part, and each trial is a part that somebody wants. Two ways to do it come with the
library; a third is written here: a Gaussian process that tries only what it holds to be safe."""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import plunge

# %%
# The task
# --------
# A bore is ground as in the simulation of Dong, Danai and Malkin (2004). The controller believes in a wheel
# that is sharper by a tenth than it is, and plans with it: it keeps the depth of damage of *its* wheel
# below the stock that is left, by a margin. The noise is that of a common size gauge and power monitor.

problem = plunge.preset("simulation")
sharper = problem.replace(wear_flat_area=0.9 * problem.model.wear_flat_area)
first = plunge.CycleController(sharper, safety_margin=0.05, sparkout="printed")
grinder = hwsim.PlungeGrinder(problem)
log = hwsim.run(grinder, first)
print(
    f"margin {first.safety_margin:.3f} mm: {log.outcome.time.item():.2f} s, slack {log.outcome.slack.item():.4f} mm"
)
none = hwsim.run(grinder, first.replace(safety_margin=0.0))
print(f"margin 0: {none.outcome.time.item():.2f} s, burned: {bool(none.outcome.burned.item())}")

# %%
# What a workshop sees is not the true slack. It has the readings: the least stock that was left beyond the
# damage, as the power tells it, while the controller balanced the two. The least of many noisy values is too
# small, by about two thousandths of a millimetre here: what is learned from it stays on the safe side.


def measured_slack(log, controller):
    table = log["controller"]
    used = table.balancing_command.values > 0
    size, power, rate = (
        table[name].values[used] for name in ("size", "grinding_power", "infeed_rate_planned")
    )
    damage = np.maximum(controller.problem.model.burn_depth(rate, power), 0.0)
    return np.min(controller.problem.stock - size - damage)


print(f"measured: {measured_slack(log, first):.4f} mm")

# %%
# A Gaussian process
# ------------------
# Slack is a function of the margin, not known. What is known beforehand: a margin that is smaller by 1 µm
# leaves about 1 µm less slack. So the process has the mean m - β, with the shortfall β of the first part, and
# says how far from that line slack may be elsewhere: the farther from what was tried, the farther. Given
# slacks y of margins m, mean and spread of the slack at other margins are a few lines:


class GaussianProcess:
    def __init__(self, margins, slacks, shortfall, sd=0.003, length=0.015, noise=0.001):
        self.margins, self.shortfall = np.array(margins), shortfall
        self.kernel = lambda a, b: sd**2 * np.exp(-0.5 * ((a[:, None] - b) / length) ** 2)
        self.variance = sd**2
        self.factor = np.linalg.cholesky(
            self.kernel(self.margins, self.margins) + noise**2 * np.eye(len(margins))
        )
        self.weights = np.linalg.solve(self.factor, np.array(slacks) - (self.margins - shortfall))

    def __call__(self, margins):
        across = np.linalg.solve(self.factor, self.kernel(self.margins, margins))
        mean = margins - self.shortfall + across.T @ self.weights
        return mean, np.sqrt(np.maximum(self.variance - np.sum(across**2, axis=0), 0.0))


# %%
# The next margin is the smallest that can be reached from one that was tried without leaving what is safe:
# everywhere on the way the slack stays positive with a probability of 99 %, 2.33 standard deviations. An
# adaptation is an object with ``next``, which sees the controller and the log of the last part. It draws
# nothing and reads no clock, so that a series that was killed resumes from its journal as if nothing had
# been.


class SafeMargin:
    def __init__(self, sigmas=2.33):
        self.sigmas, self.margins, self.slacks = sigmas, [], []

    def next(self, controller, part_log):
        self.margins.append(controller.safety_margin)
        self.slacks.append(measured_slack(part_log, controller))
        candidates = np.arange(self.margins[0], 0.0, -1e-4)
        mean, sd = self.process()(candidates)
        unsafe = np.flatnonzero(mean - self.sigmas * sd < 0)
        last = unsafe[0] - 1 if unsafe.size else candidates.size - 1
        return controller.replace(safety_margin=float(candidates[max(last, 0)]))

    def process(self):
        return GaussianProcess(self.margins, self.slacks, self.margins[0] - self.slacks[0])


# %%
# Four parts, and what the process knows after each. The white circles are the true slacks, which it is not
# told.

learner, controller = SafeMargin(), first
figure, axes = plt.subplots(1, 4, figsize=(10, 3), sharey=True, layout="constrained")
margins = np.linspace(0.0, 0.055, 200)
for part, axis in enumerate(axes):
    log = hwsim.run(grinder, controller, rng=part)
    tried, controller = controller.safety_margin, learner.next(controller, log)
    mean, sd = learner.process()(margins)
    axis.fill_between(1e3 * margins, 1e3 * (mean - 2.33 * sd), 1e3 * (mean + 2.33 * sd), color="#d5e3f0")
    axis.plot(1e3 * margins, 1e3 * mean, color="#7570b3")
    axis.plot(1e3 * np.array(learner.margins), 1e3 * np.array(learner.slacks), "k.")
    axis.plot(1e3 * tried, 1e3 * log.outcome.slack.item(), "o", mfc="white", mec="#d95f02")
    axis.axvline(1e3 * controller.safety_margin, color="#1b9e77", ls="--", lw=1)
    axis.axhline(0, color="0.5", lw=0.8)
    axis.set(title=f"part {part + 1}", xlabel="margin [µm]", ylim=(-15, 50))
    following = 1e3 * controller.safety_margin
    print(
        f"part {part + 1}: {log.outcome.time.item():.2f} s with {1e3 * tried:.1f} µm; next {following:.1f} µm"
    )
axes[0].set_ylabel("slack [µm]")

# %%
# Against what is in the library
# ------------------------------
# `MarginBounding` is the rule of the source, with a fixed share of the slack for each part. `ChanceMargin`
# estimates one number, the shortfall, knows how much of what it measures is noise, and keeps as much as a
# given probability needs. The Gaussian process assumes less: the shortfall may change with the margin. It
# pays for that with parts, and with the bias of what it measures.

SERIES, PARTS = 8, 10
rules = {
    "bounding, printed, c = 0.8": lambda: plunge.learning.MarginBounding(
        step=0.8, noise_buffer=0.005, rule="printed"
    ),
    "bounding, contracting, c = 0.4": lambda: plunge.learning.MarginBounding(step=0.4, noise_buffer=0.005),
    "Gaussian process": SafeMargin,
    "chance, 99 %": lambda: plunge.learning.ChanceMargin(0.99),
}
figure, axis = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for (name, rule), style in zip(rules.items(), ("C3:", "C0-.", "C2--", "k-"), strict=True):
    outcomes = [
        hwsim.run(grinder, first, parts=PARTS, rng=100 + seed, adapt=rule()).outcome for seed in range(SERIES)
    ]
    time = np.mean([outcome.time.values for outcome in outcomes], axis=0)
    burned = sum(bool(outcome.burned.any()) for outcome in outcomes)
    print(
        f"{name:<32}{time.mean():.2f} s a part, the third {time[2]:.2f} s; {burned} of {SERIES} series burned a part"
    )
    axis.plot(range(1, PARTS + 1), time, style, label=name)
axis.set(xlabel="part", ylabel="mean time [s]")
axis.legend(frameon=False)

# %%
# A step of 0.8 as printed believes each single reading, and burns. A smaller one is safe and slow: it takes
# the same share of the slack however well the slack is known. The other two take what they know, and are
# there after two or three parts. Where the model is wrong by little more than a constant, `ChanceMargin` is
# the one to take. The Gaussian process is for what nobody knows the form of, such as another rule or another
# limit: nothing in it says that it is about damage.
#
# Several limits at once
# ----------------------
# On a machine that has stages only, three or four settings are to be learned together, against burning,
# out-of-roundness and perhaps the power of the spindle. `ConstraintBounding` takes the model's fastest cycle
# within bounds, and moves the bounds by what each part has left.

stages = plunge.StagedController(sharper, stage_remaining=0.12, stage_rate=0.005)
log = hwsim.run(
    grinder, stages, parts=PARTS, rng=1, adapt=plunge.learning.ConstraintBounding(step=0.4, power_max=2500.0)
)
print("time [s]:      ", log.outcome.time.values)
print("slack [µm]:    ", 1e3 * log.outcome.part_slack.values.round(4))
print("roundness [µm]:", 1e3 * log.outcome.roundness.values.round(5))

# %%
# What is left tends to the buffers that were asked for. That does not make it the fastest cycle of the *real*
# machine: with three limits that are met, one of four settings is chosen by the slopes of a model that is
# known to be wrong. Here that costs little. Where it does not, those slopes have to be measured, too, by
# trials about what is set: modifier adaptation.
