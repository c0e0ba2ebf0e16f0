"""
A bore: from a trace to a cycle
===============================

Three files of one internal grinder: a trace of its control, a German export of its test rig, and a TDMS with two parts.
What do they say about the machine, and what is the fastest cycle for *it*? The problem that is believed comes first: a
published bore with 0.28 mm of stock. It gives what no trace shows, such as the wheel's diameter and the burn limit.
"""

from types import SimpleNamespace

import hwsim
from sdpgrind import plunge

believed = plunge.preset("simulation")

# %%
# The trace of a control
# ----------------------
# Time, size, commanded infeed and power. The gauge writes micrometres, the control mm/min and kilowatts: the header says
# so, and the table below the call shows what was made of it.

log = hwsim.Log.read(
    "tests/data/samples/plunge_brackets.csv", time="t", size="X", command_rate="v", grinding_power="P"
)
print(log.source)

# %%
# What it says
# ------------
# Before a number is used, ask what the file can tell at all. ``doubts`` holds every value of the problem against the
# data and solves the plan again at both ends of each interval. The control does not say whether a commanded rate holds
# from its row on or led to it: the residuals tell. What no column shows stays as believed, and is listed.

print(believed.doubts(log))

# %%
# The plan
# --------
# The doubts say that a linear lag fits these sizes better than the deflection of the model, and how to plan with it: the
# time constant goes into the problem as the lag, as a deflection scaled to it would plan parts out of round. It follows
# the command faster than believed, so that its cycle is shorter than that of the plan as believed, by much more than
# the interval of the time constant leaves open. In the picture the depth of damage (red) reaches the remaining
# stock, but never exceeds it: what burns is ground away again.

found = plunge.identify(log, "time_constant")
plan = plunge.plan(believed.replace(linear_time_constant=found["time_constant"]))
print(found)  # ± is one standard deviation
print(plan)
plan.plot()

# %%
# A German file
# -------------
# The test rig writes decimal commas, names and units in two rows, and its gauge shows what is left on the *diameter*.
# Read as a size, it is refused: it falls while the wheel feeds.

try:
    hwsim.Log.read(
        "tests/data/samples/plunge_deutsch.csv",
        time="Zeit",
        size="Aufmaß Durchmesser",
        command_rate="Zustellung",
    )
except ValueError as refused:
    print(refused)

# %%
# With the factor of the message it is the size: the same machine, the same time constant, the same cycle.

log = hwsim.Log.read(
    "tests/data/samples/plunge_deutsch.csv",
    time="Zeit",
    size=("Aufmaß Durchmesser", "um", -0.5),
    command_rate="Zustellung",
)
found = plunge.identify(log, "time_constant")
print(found)
print(plunge.plan(believed.replace(linear_time_constant=found["time_constant"])))

# %%
# Two parts in one file
# ---------------------
# Groups of a TDMS file are parts, and waveforms bring their own time. Each part tells a time
# constant, with a gauge offset of its own; the estimate is their mean.

log = hwsim.Log.read("tests/data/samples/plunge_parts.tdms", size="size", command_rate="rate")
found = plunge.identify(log, "time_constant")
print(found)
print(plunge.plan(believed.replace(linear_time_constant=found["time_constant"])))

# %%
# A whole machine
# ---------------
# A trace with power can tell more than a time constant: record one part for it, with 0.1 mm of air, the greatest rate
# and two lower ones, 0.3 and 0.1 of it, held for three time constants each, and a spark-out: this bore needs
# some 0.4 mm of stock for it. A controller is any object with ``period``, ``reset`` and ``step``; this one commands
# such a part. Here a simulated machine grinds it, which touches some 0.08 mm late and has a duller wheel than believed.

shares = iter([1.0] * 200 + [0.3] * 150 + [0.1] * 150 + [0.0] * 100)  # of the greatest rate, a sample each
recorder = SimpleNamespace(
    period=believed.sample_time,
    reset=lambda: None,
    step=lambda **_: {"command_rate": believed.command_rate_max * next(shares)},
)
grinder = hwsim.PlungeGrinder(
    believed.replace(stock=0.45, wear_flat_area=0.03),
    drive=plunge.Drive(idle_power=300.0),
    contact_zero_sd=0.1,
    max_time=24.0,
)
print(plunge.identify(hwsim.run(grinder, recorder, rng=0), "machine", problem=believed))

# %%
# ``machine = plunge.identify(log, "machine", problem=believed)`` fits force ratio, wear flat area, specific energy,
# ploughing force, idle power, wheel wear, the lags of feed drive and power monitor, and the contact at once;
# ``believed.updated(machine)`` takes the values; what is declared not to be known stays, until ``replace(sharpness_sd=...,
# deflection_sd=...)`` declares the standard deviations that were found. Columns in another unit are refused with the call that reads them.
# ``machine.fit`` and ``machine.plot()`` show how well sizes and powers are met: a linear lag fitted to a machine whose
# deflection follows the force "does not fit", and is not taken. What the part does not tell stays as believed, and is named.
# The longer the holds, the better are chips told from sliding: with 6 s and a reading each 0.04 s the wear flat area is
# known to 4 %, with 12 s and 0.02 s to 1.7 %. No trace tells the burn threshold: it needs inspection.
