"""
A controller against the clock
==============================

Before a controller commands a machine it can be tried against a real clock on a simulated one: is it fast enough,
what happens when it hangs, what is in the log afterwards? ``live=`` makes a run of it. The numbers are those of the
simulation; only the waiting is new.

This is no safety function: it replaces no interlock, limit switch or emergency stop of a machine.
"""

import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt

import hwsim
from sdpgrind import plunge

problem = plunge.preset("simulation").replace(stock=0.02)  # mm; a short part
grinder, controller = hwsim.PlungeGrinder(problem), plunge.CycleController(problem)

live = hwsim.Live(safe={"retract": 1.0}, deadline=0.5)
log = hwsim.run(grinder, controller, live=live)
simulated = hwsim.run(grinder, controller)
print("the same part as simulated:", float(log.outcome.time[0]) == float(simulated.outcome.time[0]))

# %%
# How late the steps were
# -----------------------
# Releases stand on an absolute grid. A release that falls inside a late step is missed and counted; it is never made
# up for in a burst.

table = log["controller"]
steps = 1e3 * table.step_time.values[:-1]  # ms; the last row has the final measurement
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(table.time[:-1], 1e3 * table.release_delay[:-1], ".", label="start after its release")
axes.plot(table.time[:-1], steps, ".", label="the step itself")
axes.set(xlabel="time in the part, s", ylabel="ms", yscale="log", title="Delays of the steps of one part")
axes.set_ylim(0.01, 100.0)
axes.legend(loc="upper right")
worst = 1e3 * float(log.outcome.longest_step[0])
print(
    f"{steps.size} steps, {int(log.outcome.overruns[0])} releases missed; the longest step was under 500 ms: {worst < 500}"
)

# %%
# A controller that hangs
# -----------------------
# The deadline bounds a step. When it is over, another thread makes the machine safe, and nothing that the controller
# commands afterwards reaches it. The rows up to then are in the log and in the journal, and the error says why.


class Hanging(plunge.CycleController):
    """Sleeps in its 30th step."""

    def reset(self):
        super().reset()
        self.count = 0

    def step(self, **measured):
        self.count += 1
        if self.count == 30:
            time.sleep(1.0)
        return super().step(**measured)


with tempfile.TemporaryDirectory() as folder:
    path = Path(folder, "shift.db")
    try:
        hwsim.run(
            grinder, Hanging(problem), live=hwsim.Live(safe={"retract": 1.0}, deadline=0.5), journal=path
        )
    except hwsim.Aborted as error:
        print(error)
        last = error.log.outcome.isel(part=-1)
        print("made safe by:", str(last.safe_by.values), "| rows kept:", error.log["controller"].sizes["row"])
    with hwsim.Journal(path) as journal:
        print(f"parts in the journal: {journal.parts}, aborted: {int(journal.log().outcome.aborted[0])}")

# %%
# A replay
# --------
# The log of a part, aborted or not, replays: the controller gives the same commands for the same measurements, to the
# last bit.

print("the same commands:", bool(hwsim.run(hwsim.Recording(log), controller).outcome.same[0]))

plt.show()
