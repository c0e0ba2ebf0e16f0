"""
A weld bead: from passes to a policy
====================================

Thirty passes over weld beads: forces in kilopond, power in kilowatts, removal rate in cm\\ :sup:`3`/min, as the log of a
hydraulic stand has them; semicolons and decimal commas. One row is one pass, so that ``period`` stands for time."""

import sys
from pathlib import Path

import hwsim
from sdpgrind import weldbead

SAMPLES = Path(sys.argv[0]).resolve().parents[2] / "tests" / "data" / "samples"
columns = {"normal_force": "Fn", "tangential_force": "Ft", "grinding_power": "P", "removal_rate": "Q"}
log = hwsim.Log.read(SAMPLES / "bead_passes.csv", period=1.0, **columns)
print(log.source)

# %%
# What the data say
# -----------------
# Specific energy and idle power come from a regression of power on removal rate, the friction ratio from the forces.

problem = weldbead.preset("P1")
print(problem.doubts(log))

# %%
# The plan
# --------
# The three coefficients go into the problem, and the plan says what to do with a bead of 1 mm when 24 s are left.

for what in "power", "friction":
    problem = problem.updated(weldbead.identify(log, what))
policy = weldbead.plan(problem, tolerance=1e-2)
print(policy.action(height=1.0, time_left=24.0))
policy.plot()
