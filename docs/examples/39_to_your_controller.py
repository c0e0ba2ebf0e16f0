"""
To your controller
==================

A planned motion becomes a program of the robot's controller: URScript, RAPID, KRL, a table of joints, or a trajectory of
ROS. It is read back and followed before it is written, and says what it keeps of the plan."""

import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import finishing

robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
path = finishing.zigzag(finishing.surface.nominal_surface(), pitch=8.0).blended(0.2)
problem = finishing.FinishingProblem(path, robot=robot, placement=(650.0, -25.0, 100.0))
motion = finishing.plan(problem)
program = motion.program("urscript", deviation=0.02, name="face1")
print("\n".join(line[:110] for line in program.text.splitlines()[:15]))

# %%
# What is kept
# ------------
# The contact stays within the deviation of the plan, and so does a turn of the tool times the lever arm. Half of it is for
# chords: each move goes as far as its chord allows, so that no point can be left out. The other half is for blends. A
# reader without knowledge of the writer follows the text, corners as circles, and compares it with the plan all along.
found = program.check()
print(f"{1e3 * found.deviation:.1f} µm and {1e3 * found.angle_deviation:.2f} mrad from the plan")
print(f"feeds beyond the planned ones: {max(found.feed_excess, 0.0):.2g} mm/s")
deviations = np.array([0.005, 0.01, 0.02, 0.05, 0.1])
warnings.filterwarnings("ignore", ".* is not the language of")  # it names that of a UR10, URScript
moves = [motion.program("krl", deviation=each).text.count("LIN ") for each in deviations]
figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
axes.loglog(deviations, moves, "o-")
axes.set(xlabel="deviation [mm]", ylabel="moves")
plt.show()

# %%
# What is not kept
# ----------------
# Straight moves have the planned mean feed each; the controller's own law of time applies between them. Times are kept by
# the table, by the trajectory of ROS, and by URScript that streams joints every 8 ms.
for text in (
    motion.program("rapid"),
    motion.program("krl"),
    motion.program("csv"),
    motion.program("ros"),
    motion.program("urscript", timing=True),
):
    print(f"{text.target:9s} {text.text.count(chr(10)):5d} lines, {1e3 * text.check().deviation:5.1f} µm")

# %%
# .. list-table::
#    :header-rows: 1
#
#    * - target
#      - moves
#      - time
#      - frames
#    * - ``"urscript"``
#      - ``movel`` with ``r``; m, rotation vector
#      - of the controller
#      - ``set_tcp``; ``work`` in the base, by ``pose_trans``
#    * - ``"urscript"``, ``timing=True``
#      - ``servoj`` every 8 ms; rad
#      - kept
#      - joints
#    * - ``"rapid"``
#      - ``MoveL`` with zones; mm, quaternion, confdata
#      - of the controller
#      - ``tooldata``, ``wobjdata``; external axes in ``extax``
#    * - ``"krl"``
#      - ``LIN ... C_DIS``; mm, deg, S and T
#      - of the controller
#      - ``$TOOL``, ``$BASE``; external axes ``E1``, ``E2``
#    * - ``"csv"``
#      - joints over time; s, rad, mm
#      - kept
#      - joints
#    * - ``"ros"``
#      - places and speeds of joints; s, rad, m; ``json.load(file)["trajectory"]`` is a ``JointTrajectory``
#      - kept
#      - joints, by the names of the robot
#
# For the presets ``ur10`` and ``irb2400`` a warning names the language that the controller of their maker takes, where another is
# asked for. None has been run on a controller. A controller's blends differ from circles, and may end a move early; the joints of its
# model may count from other zeros. Mass and centre of gravity of your tool are not in the plan. Try a program slowly,
# above the work: a work frame that is raised by 50 mm is enough.

# %%
# Axes that carry the work
# ------------------------
# A turntable or a rail under the work is an external axis of the controller. The moves are then in a work object that it
# moves (RAPID: a mechanical unit in ``wobjdata``; KRL: ``$BASE`` coupled by ``EK``), and each tells the position of the axis
# at its end. The controller moves the axis in step with the contact and takes the robot along, so that the contact stays
# on the plan over the work wherever the axis is; the feed is that over the work. The head says what has to be configured.
table = finishing.arm.Turntable((650.0, 0.0, 80.0), speed_max=1.0, acceleration_max=5.0, jerk_max=50.0)
turned = finishing.plan(problem.replace(robot=finishing.arm.mounted(robot, STN_1=table)))
program_there = turned.program("rapid", name="face2")
lines = program_there.text.splitlines()
print("\n".join(line[:110] for line in [*lines[6:16], lines[17], lines[19], lines[22]]))
told = program_there.check()
print(f"{1e3 * told.deviation:.1f} µm from the plan, of which the axis {1e3 * told.axis_deviation:.1f} µm")

# %%
# Between two points the axis moves evenly; how far it is then from the plan, times the distance of the contact from it,
# counts as a deviation, too, so that the joints of the robot are those of the plan as near. The unit's frame with all axes
# at zero, on which the work lies, is in the head: the controller has to know it, and turn it the same way round. In RAPID
# the unit is called like the axis (here ``STN_1``); in KRL it is ``MACHINE_DEF[2]``. A UR controller has no external axes.

# %%
# A file, and a changed one
# -------------------------
# What was changed by hand is read like any other program. Here somebody moved a point by 0.05 mm.
with TemporaryDirectory() as folder:
    file = Path(folder) / "face1.script"
    program.save(file)
    lines = file.read_text().splitlines()
    middle = len(lines) // 2
    x = lines[middle].split("p[")[1].split(",")[0]
    lines[middle] = lines[middle].replace(x, f"{float(x) + 0.00005:.7f}", 1)
    file.write_text("\n".join(lines))
    changed = finishing.read_program(file)
    print(f"{changed}: {changed.check(motion).deviation:.3f} mm from the plan")

# %%
# On the command line ``hwsim finishing job.toml --program urscript --out runs/face1`` does the same. The job
# has a [surface] and a [path], as ``examples/finishing.toml``, and names its robot:
#
# .. code-block:: toml
#
#    [robot]
#    preset = "ur10"              # or urdf = "cell.urdf", base, tip, acceleration_max
#    tool_length = "150 mm"
#    [robot.turntable]            # likewise [robot.rail]; of both the first in the file stands in the base
#    name = "STN_1"
#    origin = [650, 0, 80]
#    speed_max = "10 rpm"
#    acceleration_max = 5         # rad/s^2
#    jerk_max = 50                # rad/s^3
#    [tool]
#    placement = [650, -25, 100]         # or "search", in a placement_box = [[x, y, z], [x, y, z]] or anywhere
#    [program]
#    deviation = "20 um"
#    name = "face1"
