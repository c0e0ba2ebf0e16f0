"""
A weld bead: from passes to a policy
====================================

Thirty passes over weld beads: forces in kilopond, power in kilowatts, removal rate in cm\\ :sup:`3`/min, as the log of a
hydraulic stand has them; semicolons and decimal commas. What is the best next pass of *this* disk?
"""

import hwsim
from sdpgrind import weldbead

log = hwsim.Log.read(
    "tests/data/samples/bead_passes.csv",
    period=1.0,  # s; a row is a pass, time has no meaning
    normal_force="Fn",
    tangential_force="Ft",
    grinding_power="P",
    removal_rate="Q",
)
print(log.source)

# %%
# What it says
# ------------
# Specific energy and idle power come from a regression of power on removal rate, the friction ratio from the forces. Disk
# and bead stay as believed, and the scatter of a pass too: the table has no depth of cut.

believed = weldbead.preset("P1")
print(believed.doubts(log))

# %%
# The plan
# --------
# The three values go into the problem, the problem into the plan. This disk needs more energy for each cubic millimetre
# than believed, but grips better: together the expected penalty of a bead of 2 mm in 60 s (in $, the first number) is
# higher than that of the plan as believed, and no plan can change that. What to do about it can: the next pass of a bead of
# 1 mm with 24 s left, and of all others in the picture.

fitted = believed.updated(weldbead.identify(log, "power")).updated(weldbead.identify(log, "friction"))
policy = weldbead.plan(fitted, tolerance=1e-2)
print(policy.value(height=2.0, time_left=60.0))
print(policy.action(height=1.0, time_left=24.0))
policy.plot()
