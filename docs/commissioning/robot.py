"""
A robot that finishes: from a roughness experiment to a motion
==============================================================

Eighteen patches were finished with three patterns, tools and forces, and the roughness of each was measured. The table
has one row a patch, its pattern in words."""

import sys
from pathlib import Path

import hwsim
from sdpgrind import finishing

SAMPLES = Path(sys.argv[0]).resolve().parents[2] / "tests" / "data" / "samples"
columns = {"pattern": "pattern", "tool_diameter": "tool", "normal_force": "F", "roughness_ra": "Ra"}
log = hwsim.Log.read(SAMPLES / "finishing_runs.csv", period=1.0, **columns)
print(log.source)

# %%
# What the data say
# -----------------
# The tools and forces of this shop are larger than those of the source's experiment: the page says so before a number is
# extrapolated.

problem = finishing.preset("specimen")
print(problem.doubts(log))

# %%
# The plan
# --------
# Roughness from the shop's own model, and the motion of the robot over the specimen.

found = finishing.identify(log, "roughness")
problem = problem.updated(found).replace(tool_diameter=6.0)
plan = finishing.plan(problem, method="trapezoid")
print(plan)
plan.plot()
