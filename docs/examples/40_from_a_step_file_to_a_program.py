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
# Several faces in sequence
# -------------------------
# A block has a flat top and two rounded edges. Each face gets its path; ``sequence`` chooses the order of the pieces and
# their directions for the shortest way between them. Up to 12 pieces no sequence is shorter. With a robot the times count
# that it needs at least: here a turn of its wrist between the edges costs more than the way, and another sequence is best.
block = {face.name: face for face in finishing.read_surfaces("tests/data/step/fillets.step")}
faces = [("#423", "u"), ("#242", "v"), ("#584", "v")]  # passes along the edges
paths = [finishing.zigzag(block[name], pitch=1.0, along=along, lift=lift) for name, along in faces]
place = (650.0, -25.0, 100.0)  # mm
for path in (finishing.sequence(paths), finishing.sequence(paths, robot=robot, placement=place)):
    print(path)
    print(
        f"order {path.order}, backwards {path.backwards}; {path.least_clearance:.1f} mm from the work in the air"
    )
motion = finishing.plan(finishing.FinishingProblem(path, robot=robot, placement=place))
print(motion)
path.plot()
plt.show()

# %%
# A curve that a hole cuts into many pieces gains most: Hilbert's curve on the die has ten.
print(finishing.sequence(finishing.hilbert(face, 5, lift=lift)))

# %%
# What is not read
# ----------------
# Offset, swept and revolved surfaces are refused by their numbers: export them as B-splines. Meshes of a machine, clamps
# and the part itself are not checked for collisions, neither on the work nor in the air.
