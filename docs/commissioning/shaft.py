"""
A shaft: from a trace to an optimal locus
=========================================

A cylindrical grinder recorded power, infeed, rotation and removed depth in an HDF5 file, with units as attributes. The
wheel dulls while it grinds, and no column shows it: its wear flats were measured under the microscope before and after
the part, 0.6 % and 0.98 % of the surface. In between they are taken to grow with the removed depth."""

import sys
from pathlib import Path

import hwsim
from sdpgrind import locus

SAMPLES = Path(sys.argv[0]).resolve().parents[2] / "tests" / "data" / "samples"
columns = {"grinding_power": "P", "infeed_rate": "v", "work_rotation": "n", "removed": "removed"}
log = hwsim.Log.read(SAMPLES / "shaft.h5", group="shaft 1", time="t", **columns)
print(log.source)

# %%
# What the data say
# -----------------
# The hidden state is a column like any other. Power at one infeed and a dulling wheel tells two values: the specific
# energy from its level, the pressure on the wear flats from its rise.

rows = log["data"]
rows = rows.assign(wear_flat_area=0.006 + 0.0038 * rows.removed / rows.removed.max())
problem = locus.preset("grinding").replace(width=4.0)
found = locus.identify(rows, ("specific_energy", "pressure"), problem=problem)
print(found)

# %%
# The plan
# --------
# The best infeed and rotation for every state of the wheel. A controller follows it by the measured power.

plan = locus.plan(problem.updated(found))
print(plan)
plan.plot()
