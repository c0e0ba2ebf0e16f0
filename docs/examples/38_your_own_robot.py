"""
Your own robot
==============

The planner asks little of a robot: names and limits of its joints, where the tool is at given joints, and all joints that
bring it to a pose. For robots of six joints the makers' files are enough."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sdpgrind import finishing

# %%
# From the file of its maker
# --------------------------
# A URDF tells links and joints. Read is the chain between two links: origins, axes and limits, metres become mm. It has no
# limit of acceleration, so that one has to be given. This cell holds a robot with a spherical wrist, on a pedestal.
JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
    '<axis xyz="{axis}"/><limit lower="-{turn}" upper="{turn}" velocity="{speed}"/></joint>'
)
joints = (
    ("base", "one", "0 0 0.9", "0 0 1", 3.1, 2.6), ("one", "two", "0.1 0 0.45", "0 1 0", 2.0, 2.6),
    ("two", "three", "0 0 0.6", "0 1 0", 2.4, 2.6), ("three", "four", "0.2 0 0.1", "1 0 0", 3.4, 6.2),
    ("four", "five", "0.42 0 0", "0 1 0", 2.0, 6.2), ("five", "tool0", "0.08 0 0", "1 0 0", 6.2, 7.8),
)  # fmt: skip
keys = ("parent", "child", "xyz", "axis", "turn", "speed")
links = "".join(f'<link name="{name}"/>' for name in ("base", *(joint[1] for joint in joints)))
told = "".join(
    JOINT.format(name=f"j{k}", **dict(zip(keys, joint, strict=True)))
    for k, joint in enumerate(joints, start=1)
)
with TemporaryDirectory() as folder:
    path = Path(folder) / "cell.urdf"
    path.write_text(f'<robot name="cell">{links}{told}</robot>')
    cell = finishing.SerialRobot.from_urdf(
        path, base="base", tip="tool0", acceleration_max=10.0, jerk_max=100.0
    )
print(f"{', '.join(cell.names)}: {cell.closed_form}")

# %%
# What the axes tell
# ------------------
# Nobody had to say what kind of robot it is. The axes tell: three meet in the wrist, two are parallel in the arm. A pose
# then has up to eight solutions, in microseconds each. Near singular poses a joint has to turn fast for little motion of
# the tool; three factors tell how near, each of them 0 there.
pose = cell.forward([0.3, 0.4, -0.6, 0.2, 0.9, 0.1])
found = cell.solutions([pose])[0]
found = found[~np.isnan(found[:, 0])]
print(np.round(found, 3))
print({name: round(float(share), 3) for name, share in cell.singularities(found[0]).items()})

# %%
# A calibration breaks that: axes off by a thousandth of a radian are no longer parallel. The robot nearby that has a closed
# form, ``nearest_closed_form``, then gives a start for each branch, and the calibrated chain itself is solved from there, to
# 1e-9 mm. A robot that is off by more than 5 mrad or 5 mm is refused with the axes at fault.
rows = [(0, 127.3, 0, np.pi / 2), (0, 0, -612, 0.001), (0, 0, -572.3, 0), (0, 163.9, 0, np.pi / 2),
        (0, 115.7, 0.4, -np.pi / 2), (0, 92.2, 0, 0)]  # fmt: skip
calibrated = finishing.SerialRobot.from_dh(
    rows,
    position_min=[-6.2] * 6,
    position_max=[6.2] * 6,
    speed_max=[2.0] * 6,
    acceleration_max=[10.0] * 6,
)
print(calibrated.closed_form)
pose = calibrated.forward([0.3, -1.5, 1.8, -1.8, -1.5, 0.1])
print(np.round(calibrated.solutions([pose])[0], 4))
off = calibrated.nearest_closed_form.forward([0.3, -1.5, 1.8, -1.8, -1.5, 0.1]) - pose
print(f"the robot nearby would be {np.linalg.norm(off[:3, 3]):.2f} mm off")

# %%
# A motion
# --------
# Robots ready to use are listed by ``robots``; limits and tool are replaced as those of any other object. A robot without
# a table has to be told where the work lies; else ``place`` searches, and a warning says where.
for info in finishing.robots():
    print(f"{info.name}: {info.about}")
robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
problem = finishing.FinishingProblem(
    finishing.zigzag(finishing.surface.nominal_surface(), pitch=5.0),
    robot=robot,
    feed_rate=25.0,
    placement=(650.0, -25.0, 100.0),
)
motion = finishing.plan(problem, method="min_time")
print(motion)
print(f"branch {motion.posture.branch}; {motion.worst_singularity}")
motion.plot()

# %%
# The work may be turned below the tool, here by 30 deg: other joints, and about the same time.
turned = finishing.plan(problem.replace(placement=(650.0, -25.0, 100.0, np.pi / 6)), method="min_time")
print(f"{motion.duration:.1f} s, and {turned.duration:.1f} s turned; {turned.worst_singularity}")

# %%
# A tool that may turn
# --------------------
# A spindle or a ball that is face-on does not mind how it is turned about its own axis. ``spin=24`` lets the planner choose
# from 24 turns and eight branches at every millimetre; then the turn becomes smooth, with as little motion of the joints as
# it can, 0.1 away from singular poses. It may bend where the tool rests anyway, at sharp corners. This tool is tilted in the
# flange, so that its turn moves all joints. What holds its turn where that is faster is the planner.
ball = problem.replace(
    path=finishing.zigzag(finishing.surface.sphere_surface(25.0), pitch=5.0),
    robot=robot.replace(tool=finishing.tool(length=150.0, tilt=0.5)),
    contact_angle=np.pi / 2,
)
held = finishing.plan(ball, method="min_time")
turning = finishing.plan(ball.replace(spin=24), method="min_time")
print(f"held: {held.duration:.1f} s; turning by {np.ptp(turning.spin):.2f} rad: {turning.duration:.1f} s")
turning.plot()

# %%
# No torque of an axis presses a tool that turns, so controllers of the torque refuse it; programs of all targets take it.
print(f"program: {turning.program('urscript', name='ball').check()}")

# %%
# Axes that carry the work
# ------------------------
# The work may lie on a turntable or on a table that slides. ``mounted`` makes them the last joints of a robot. The planner
# chooses their positions along the path from candidates, 24 angles of a turntable, together with the branch; then they become
# smooth as the turn of a tool does, or are held where that is faster. Here the tool goes twice around a shaft, which lies along y
# at 1050 mm ahead: its far side is out of reach. Placement and azimuth are those with the turntable at zero.
s = 0.5**0.5
around = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
shaft = finishing.Surface.nurbs(
    [[(40.0 * x, y, 40.0 * z) for y in (0.0, 12.0)] for x, z in around],
    np.tile([[1.0], [s], [1.0], [s], [1.0], [s], [1.0], [s], [1.0]], 2),
    degree=(2, 1),
    knots=([0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1], [0, 0, 1, 1]),
    outward=-1,
)
rests = problem.replace(
    path=finishing.zigzag(shaft, pitch=11.9), azimuth=np.pi / 2, placement=(1050.0, -6.0, 300.0)
)
try:
    finishing.plan(rests)
except ValueError as error:
    print(error)
turntable = finishing.arm.Turntable(
    (1050.0, 0.0, 300.0), (0, 1, 0), speed_max=1.0, acceleration_max=5.0, jerk_max=50.0
)
carried = finishing.plan(
    rests.replace(robot=finishing.arm.mounted(robot, turntable=turntable)), method="min_time"
)
print(carried)
print(dict(zip(carried.problem.robot.names, np.ptp(carried.joints, axis=0).round(2).tolist(), strict=True)))
carried.plot()

# %%
# Programs that keep the time, ``"csv"`` and ``"ros"``, tell all joints. In ``"rapid"`` and ``"krl"`` the turntable is an external
# axis that moves the work object (:doc:`39_to_your_controller`). So that a path once more in the same
# direction is possible, a turntable has limits of a turn either way unless you give others.
check = carried.program("ros", name="shaft").check()
print(
    f"program: {check.deviation:.1g} mm off, joint speeds {100 * check.joint_speed_excess:+.0f} % of their limits"
)

# %%
# How the work should lie on the turntable ``place`` searches in a box that the turntable offers: origin, turn about z and azimuth,
# with the axes at zero, while at each pose they take the best of their candidates. Where the turntable stands is yours to say.
offered = [(1040.0, -10.0, 290.0), (1060.0, 0.0, 310.0)]
print(finishing.place(carried.problem.replace(placement=None), box=offered))

# %%
# A robot of any other kind is a class that derives from :py:obj:`sdpgrind.finishing.Robot` and has its members: names,
# units and limits of the joints, ``forward``, ``forward_work`` and ``solutions``. It is planned as these are.
