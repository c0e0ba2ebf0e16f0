"""
From a STEP file to a program
=============================

A die with a bored hole comes from CAD. Its face becomes a patch with trimming loops, the path leaves the hole out and is
joined by lifts, a robot's motion keeps its limits in the air, too, and the program is checked before it is written."""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import finishing

part = finishing.read_surfaces("tests/data/step/nominal_hole.step")
face = part[0]
print(part)
print(face)

# %%
# What is read
# ------------
# B-spline surfaces keep their control nets. Planes, cylinders, cones, spheres and tori become exact rational patches over
# the box of their loops. Loops are the edges of the file, projected onto the surface; units and placements are applied. The
# area is that of the part: 2604.076 mm² of the whole surface, less the hole.
print(f"{face.area:.3f} mm² of {face.surface.area:.3f} mm², in {len(face.trim)} loops")
print(face.contains([0.5, 0.2], [0.5, 0.2]))  # the middle of the hole, a place beside it

# %%
# A path with lifts
# -----------------
# Passes are cut at the loops and pulled in by half a pitch. A pass goes on to the next one on the work where it can; else
# the tool leaves along an arc with the curvature of the path, rises, crosses over, and comes down the same way.
lift = finishing.Lift(height=20.0, air_feed=100.0)  # mm, mm/s
path = finishing.zigzag(face, pitch=4.0, lift=lift).blended()
print(path)
print(path.metrics(footprint_radius=2.5))
path.plot()
plt.show()

# %%
# The motion
# ----------
# Lifts are a part of the motion, with its limits; straight lines run at the feed of the air. The torque controller does not
# press there.
robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
problem = finishing.FinishingProblem(path, robot=robot, feed_rate=25.0, placement=(650.0, -25.0, 100.0))
motion = finishing.plan(problem, method="min_time")
print(motion)
controller = finishing.TorqueController(finishing.TorqueAxis(), motion, normal_force=1.1)
print(np.unique(controller.reference.torque[~motion.contact]), "N m in the air")

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
height = motion.problem.path.at(motion.length).clearance
axes.plot(motion.time, height, label="clearance [mm]")
axes.plot(motion.time, motion.feed_rate, lw=0.8, label="feed [mm/s]")
axes.set(xlabel="time [s]")
axes.legend()
plt.show()

# %%
# The program
# -----------
program = motion.program("urscript", deviation=0.02, name="face1")  # mm
print(f"{1e3 * program.check().deviation:.1f} µm from the plan")
with TemporaryDirectory() as folder:
    program.save(Path(folder) / "face1.script")
print("\n".join(program.text.splitlines()[:6]))

# %%
# What is not read
# ----------------
# Offset, swept and revolved surfaces are refused by their numbers: export them as B-splines. Meshes of a machine, clamps
# and the part itself are not checked for collisions, neither on the work nor in the air.
