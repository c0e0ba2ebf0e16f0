"""
Place the work
==============

A robot that reaches each pose of a path need not reach all of them from one place, within its limits and away from singular
poses. ``place`` searches where the work may lie, or proves that it may lie nowhere."""

import numpy as np

from sdpgrind import finishing

# %%
# A place that works
# ------------------
# The work is a quarter of a cylinder. At the azimuth of 0 the tool of the arm passes through the vertical on it, where the
# first joint would have to turn by half a turn at once: no origin helps, another azimuth does. Compared are origins, turns of
# the work about z, and azimuths of the tool, by their worth: the least share of the joints' ranges that is left, and the least
# distance from singular poses. The best that takes the robot along the whole path is the placement.
path = finishing.zigzag(finishing.surface.cylinder_surface(40.0, 60.0), pitch=10.0)
problem = finishing.FinishingProblem(path)
try:
    finishing.plan(problem)
except ValueError as refused:
    print(refused)
placement = finishing.place(problem)
print(placement)
motion = finishing.plan(placement.problem)
print(motion)
placement.plot()

# %%
# In a box
# --------
# Most cells leave little choice. The corners of a box hold the origin of the work; equal coordinates fix it, here the height
# of a bench. **Collisions are not looked at**: not of the tool with the work, nor of the robot with bench or fixtures.
robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
bench = [(450.0, -200.0, 50.0), (750.0, 200.0, 50.0)]
on_bench = finishing.place(problem.replace(robot=robot), box=bench)
print(on_bench)
on_bench.plot()

# %%
# No place
# --------
# A flat of 500 mm with passes 50 mm apart needs 450 mm of the table both ways, as the arm has no wrist yaw and its first joint
# stands still. The table has 400. Turned, the flat needs more. The proof tells these numbers; it is a condition that no
# origin, turn or azimuth fulfils.
wide = finishing.FinishingProblem(finishing.zigzag(finishing.surface.flat_surface(500.0), pitch=50.0))
proof = finishing.place(wide).proof
print(proof)
print(
    f"{proof.condition}: {proof.needed:.4g} {proof.unit} needed, {proof.available:.4g} {proof.unit} available"
)

# %%
# Other proofs compare the heights of the wrist with its travel, and the smallest ball around the wrist along the path with
# the length of the links. A proof is short of what can be known: where there is neither proof nor placement the answer is
# "not found", with the best try and what stops it.
low, high = (np.array(robot.position_min), np.array(robot.position_max))
low[0], high[0] = 3.1, 3.101
stiff = robot.replace(position_min=tuple(low), position_max=tuple(high))
print(finishing.place(problem.replace(robot=stiff), box=bench))
