"""
A robot that finishes: from a roughness experiment to a motion
==============================================================

A shop finished eighteen patches with three patterns, tools and forces, and measured the roughness of each. The table has
one row a patch, its pattern in words. How rough does the next specimen become, and how does the robot move over it?
"""

import hwsim
from sdpgrind import finishing

log = hwsim.Log.read(
    "tests/data/samples/finishing_runs.csv",
    period=1.0,  # s; a row is a patch, time has no meaning
    pattern="pattern",
    tool_diameter="tool",
    normal_force="F",
    roughness_ra="Ra",
)
print(log.source)

# %%
# What it says
# ------------
# The model that is believed is that of a published experiment with small tools and light forces; those of this shop are
# larger, and the page says so before a number is extrapolated. The exponent of the tool is known well. The intercept and
# the terms of the force are so only together: three forces far from the reference of the model, 1.1 N, tell the parabola
# where they were used. The plan is solved again with what goes together, and last with all of it, within the ranges of
# the readings. (Of free motion of the torque axis ``doubts`` tells the load torque; ``axis=`` is the axis that you have.)

believed = finishing.preset("specimen")
print(believed.doubts(log))

# %%
# The shop's own model
# --------------------
# The fitted model replaces the published one; the ranges in which it was fitted are said with it, so that it is not used
# beyond them. Asked again, it agrees with the data, and the roughness planned with the tool of 6 mm is a fraction of the
# published one. What its intervals leave open is a tenth of it.

fitted = believed.updated(finishing.identify(log, "roughness")).replace(
    tool_diameter=6.0, tool_diameter_range=(6.0, 20.0), normal_force_range=(5.0, 12.0)
)
print(fitted.doubts(log))

# %%
# The plan
# --------
# The motion of the robot over the specimen, with the time law of the source: rest at each corner. The feed had no
# significant effect on the roughness in the published experiment, and this table has none: the motion is the same with
# both models. Corners set its duration, not the limits of the joints.

plan = finishing.plan(fitted)
print(plan)
plan.plot()
