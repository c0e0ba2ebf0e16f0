"""
A machine that goes wrong
=========================

A controller that works on a good machine has shown little. What does it do when a reading is missing, when the gauge
sticks, when the cable is cut for two seconds? :doc:`/api/hwsim.faults` wraps a plant in such faults; what comes out is
a plant again. Here two controllers of a user's own grind the same parts under all ten of them.
"""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from hwsim import faults
from sdpgrind import plunge

problem = plunge.preset("simulation")
grinder = hwsim.PlungeGrinder(problem, max_time=60.0)  # s; then the operator stops it

# %%
# Two controllers
# ---------------
# The first one believes its gauge: rough until 60 µm are left, then fine, and away at size. The second one believes a
# reading only if it is near what it expects and not exactly the last one; without one for half a second it retracts.

WITHIN, PATIENCE = 0.01, 0.5  # mm, s


class Plain:
    period, commands = problem.sample_time, {"command_rate": "mm/s", "retract": ""}

    def reset(self):
        pass

    def step(self, *, size, **others):
        left = problem.stock - size
        if left <= 0.001:
            return {"retract": 1.0}
        return {"command_rate": 0.025 if left > 0.06 else 0.002}


class Careful(Plain):
    def reset(self):
        self.size = self.rate = self.blind = self.last = 0.0

    def step(self, *, size, **others):
        believed = abs(size - self.size) < WITHIN and size != self.last  # NaN is not
        self.last = size
        self.blind = 0.0 if believed else self.blind + self.period
        if self.blind > PATIENCE:
            return {"retract": 1.0}
        self.size = size if believed else self.size + self.rate * self.period
        command = super().step(size=self.size)
        self.rate += (command.get("command_rate", 0.0) - self.rate) * self.period / problem.time_constant
        return command


# %%
# All ten faults in one table
# ---------------------------
# Each fault strikes by chance (``share``), at numbers of samples or at times (``at``). They may be nested; here each
# stands alone, so that one sees which of them hurts. The parts are the same under every fault: the draws of a fault
# touch no others.

machines = {
    "no fault": grinder,
    "DeadTime": faults.DeadTime(grinder, samples=5),
    "Dropped": faults.Dropped(grinder, of="size", share=0.05),
    "Late": faults.Late(grinder, share=0.2),
    "Duplicated": faults.Duplicated(grinder, share=0.2),
    "Stuck": faults.Stuck(grinder, of="size", at=150),
    "Bias": faults.Bias(grinder, of="size", by=-0.006),
    "Spike": faults.Spike(grinder, of="size", size=0.0, sd=0.1, share=0.005),
    "LinkCut": faults.LinkCut(grinder, at=9.0, duration=4.0),
    "ClockJump": faults.ClockJump(grinder, at=3.0, by=60.0),
    "PowerLoss": faults.PowerLoss(grinder, at=6.0),
}
BAND = 0.003  # mm


def ended(outcome):
    """Shares of parts that are good, have stock left, have lost too much or are burned."""
    left = outcome.remaining.values
    scrap = (left < -BAND) | (outcome.burned.values > 0)
    rework = ~scrap & (left > BAND)
    return [np.mean(each) for each in (~scrap & ~rework, rework, scrap)]


results, worst = {"plain": {}, "careful": {}}, {}
print(f"{'':11}  struck   plain: good, rework, scrap   careful: good, rework, scrap")
for name, machine in machines.items():
    outcome = hwsim.compare(machine, {"plain": Plain(), "careful": Careful()}, parts=10, rng=0).outcome
    seen = [outcome[each].values.mean() for each in outcome if str(each).startswith("seen")]
    for controller in results:
        results[controller][name] = ended(outcome.sel(controller=controller))
    worst[name] = 1e3 * outcome.remaining.values.min(axis=1)
    cells = (f"{100 * share:6.0f} %" for controller in results for share in results[controller][name])
    print(f"{name:11} {sum(seen):7.1f}  ", *cells)

# %%
# The worst of them
# -----------------
# What is ground away does not come back. A gauge that sticks is the worst: the wheel follows it until somebody
# switches it off.

for k, controller in enumerate(results):
    name = min(worst, key=lambda each: worst[each][k])
    print(f"{controller:8} worst under {name}: {max(0.0, -worst[name][k]):.0f} µm too much ground away")

colours = {"good": "#4878a8", "rework: stock left": "0.75", "scrap: too much gone, or burned": "#b04a3a"}
figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), sharey=True, layout="constrained")
for axis, (controller, shares) in zip(axes, results.items(), strict=True):
    begin = np.zeros(len(machines))
    for (label, colour), part in zip(colours.items(), np.transpose(list(shares.values())), strict=True):
        axis.barh(list(machines), 100 * part, left=begin, color=colour, label=label)
        begin += 100 * part
    axis.set(xlabel="share of parts [%]", title=f"{controller} controller", xlim=(0, 100))
axes[0].invert_yaxis()
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)

# %%
# No care helps against a gauge that is wrong by a constant: that takes a second gauge. Nor against a cable that is cut
# while the wheel is fast: the command to retract does not arrive either, and the work burns. That takes a watchdog on the
# machine itself (:doc:`/machines`). ``ClockJump`` strikes no controller that
# reads no clock. ``Late`` and ``Duplicated`` read the same in simulated time; only a served machine tells them apart, by
# the number of its samples: ``with hwsim.serve(machines["Late"], "opc.tcp://127.0.0.1:4840") as server`` goes on from here,
# and there ``LinkCut`` closes the connections.

plt.show()
