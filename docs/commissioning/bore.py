"""
A bore: from a trace to a cycle
===============================

The control of an internal grinder recorded one cycle: time, size, commanded infeed and power. What does it say about
the machine, and what is the fastest cycle for *it*? The gauge writes micrometres, the control mm/min and kilowatts:
the header says so, and the table below the call shows what was made of it."""

import sys
from pathlib import Path

import hwsim
from sdpgrind import plunge

SAMPLES = Path(sys.argv[0]).resolve().parents[2] / "tests" / "data" / "samples"
log = hwsim.Log.read(
    SAMPLES / "plunge_brackets.csv", time="t", size="X", command_rate="v", grinding_power="P"
)
print(log.source)

# %%
# What the data say
# -----------------
# Before a number is used, ask what the file can tell at all. ``doubts`` holds every value of the problem against the
# data and solves the plan again at both ends of each interval. The control does not say whether a commanded rate holds
# from its row on or led to it: the residuals tell.

problem = plunge.preset("simulation")
print(problem.doubts(log))

# %%
# The plan
# --------
# The time constant goes into the problem: the stiffness is scaled so that the deflection of the machine has it. The
# problem goes into the plan.

found = plunge.identify(log, "time_constant")
plan = plunge.plan(problem.updated(found))
print(found)
print(plan)
plan.plot()

# %%
# Other files of the same machine
# -------------------------------
# A test rig writes German numbers, and its gauge shows what is left on the *diameter*: the factor -0.5 makes it the size.
# Without it the file is refused, as its size falls while the commanded rate says it should rise.

other = hwsim.Log.read(
    SAMPLES / "plunge_deutsch.csv",
    time="Zeit",
    size=("Aufmaß Durchmesser", "um", -0.5),
    command_rate="Zustellung",
)
print(plunge.identify(other, "time_constant"))
try:
    hwsim.Log.read(
        SAMPLES / "plunge_deutsch.csv", time="Zeit", size="Aufmaß Durchmesser", command_rate="Zustellung"
    )
except ValueError as refused:
    print(refused)

# %%
# Two parts in one TDMS file: groups are parts, waveforms bring their own time.

parts = hwsim.Log.read(SAMPLES / "plunge_parts.tdms", size="size", command_rate="rate")
print(plunge.identify(parts, "time_constant"))
