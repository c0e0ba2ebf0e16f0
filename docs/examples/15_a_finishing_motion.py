"""
A finishing motion
==================

A path says where the tool touches. The robot needs more: how it is held, what each joint does, and when. And
no joint may be asked for more than it can. Here a path becomes a motion."""

import matplotlib.pyplot as plt

from sdpgrind import finishing, units

# %%
# The job
# -------
# The robot is an arm of five joints that holds the tool, and a table of two axes that carries the work. Its
# lengths and limits are *assumptions* (the source does not print those of its A530): put those of yours in
# ``Arm``.
path = finishing.hilbert(finishing.surface.nominal_surface(), order=4)
problem = finishing.FinishingProblem(
    path,
    robot=finishing.Arm.generic(),
    contact_angle=units.deg(30),
    lever_arm=95.0,
    feed_rate=25.0,
    heading="fixed",
)
motion = finishing.plan(problem)
print(motion)
print(
    f"the tip is on the path to {motion.error * 1e6:.0f} nm;"
    f" cosine of the tool's pitch at least {motion.least_cos_pitch:.2f}"
)
motion.plot()

# %%
# 25 mm/s were commanded. The mean is less, as the robot stops at each of 204 corners. Every limit is checked
# between the points as well, and what comes nearest to one is named. Where the tool comes near to the
# vertical (a cosine of 0) the first joint would have to spin.
#
# Three ways to share out the time
# --------------------------------
# "trapezoid" is what most robots do: speed up, cruise, slow down. "toppra" is the fastest that speeds and
# accelerations of the joints allow. "min_time" holds their jerk, too: it is slower, and what a real drive can
# follow. All three stop at a sharp corner. Rounded corners are gone through; ``blended`` says by how much the
# path may be left. A coarse path will do to compare.
coarse = finishing.hilbert(finishing.surface.nominal_surface(), order=2)
print(f"{'corners':22}{'method':12}{'time':>8}{'none below':>12}{'mean feed':>12}   nearest limit")
for name, laid in (("sharp", coarse), ("rounded within 0.6 mm", coarse.blended(0.6))):
    for method in ("trapezoid", "toppra", "min_time"):
        found = finishing.plan(problem.replace(path=laid), method=method)
        nearest = f"{found.worst_violation.quantity} of {found.worst_violation.joint}"
        times = f"{found.duration:6.2f} s{found.lower_bound:10.2f} s"
        print(f"{name:22}{method:12}{times}{found.mean_feed_rate:7.1f} mm/s   {nearest}")

# %%
# A trapezoid knows one speed for each run from rest to rest. Through rounded corners all of the path is one
# run, and the sharpest bend slows down the whole, so that rounding gains nothing; the other two slow down
# where they must. How fast can it be? No law on the path with these limits of speed and acceleration is below
# ``motion.lower_bound``: that is proved. "toppra" comes close to it, and what "min_time" takes longer is the
# price of its jerk, or of a local optimum: no proof tells these two apart. Rounding takes the tool off the path. What is left out is seen by measuring again:
for name, laid in (("sharp", path), ("rounded", path.blended()), ("rounded more", path.blended(0.6))):
    found = laid.metrics(footprint_radius=2.0, surface_step=0.4, path_step=0.2)
    told = f"coverage {100 * found.coverage:.2f} %, largest gap {found.largest_gap:.2f} mm"
    print(f"{name:14} length {found.length:5.0f} mm, {told}")

# %%
# Why the tool does not turn into the feed
# ----------------------------------------
# The contact angle is defined in the direction of feed, so the tool would have to turn at each corner. This
# arm cannot yaw its wrist: the whole arm turns, and the table has to carry the work after it. That is found
# out before anything moves:
try:
    finishing.plan(problem.replace(heading="feed_aligned"))
except ValueError as error:
    print(error)

# %%
# So one heading is kept, and the tool is dragged here and pushed there. Friction then helps to press, or
# hinders. The same force takes different torques, which the motion brings along for the controller:
low, high = motion.torque_per_force.min(), motion.torque_per_force.max()
print(f"torque for 1.111 N: {1.111 * low:.4f} to {1.111 * high:.4f} N m; F = T/R says {1.111 * 0.095:.4f}")

# %%
# What is refused
# ---------------
# A tool that stands too steep locks itself: no torque holds a force. A feed that the joints do not reach is
# slowed down, not refused; a place that they do not reach is, with its joint and by how much.
try:
    problem.replace(contact_angle=units.deg(75))
except ValueError as error:
    print(error)
try:
    finishing.plan(problem.replace(placement=(350.0, 0.0, 700.0)))
except ValueError as error:
    print(error)
fast = finishing.plan(problem.replace(feed_rate=500.0))
print(f"at 500 mm/s commanded: {fast.mean_feed_rate:.0f} mm/s on average, {fast.feed_rate.max():.0f} at most")

# %%
# Another robot
# -------------
# Two pieces serve any robot. How far out the wrist is best held on a path, or on several with lifts between
# them, is chosen from poses; the planner does that when ``wrist_radius`` lists several.
poses = problem.tool_poses(path.sample(per_leg=1))
poses[:, :3, 3] += motion.posture.placement
(choice,) = finishing.arm.choose_branches(problem.robot, [poses], wrist_radii=[300.0, 350.0, 400.0])
print(f"branch {choice.branch} with the wrist at {choice.wrist_radius:.0f} mm lets the joints travel least")

# %%
# And time laws take the joints of any machine, run by run. The three axes of a gantry are the path itself.
samples = coarse.sample(per_leg=8)
timing = finishing.timing
runs = [
    timing.JointPath(samples.length[here], samples.point[here])
    for here in (samples.run == k for k in range(len(coarse.runs)))
]
gantry = timing.JointLimits("XYZ", speed_max=[200.0] * 3, acceleration_max=[1000.0] * 3)
laws = timing.time_laws(runs, gantry, feed_rate=25.0, method="min_time")
print(f"a gantry takes {sum(law.duration for law in laws):.2f} s for the coarse path; nearest to its limit:")
print(timing.worst_violation(runs, laws, limits=gantry, feed_rate=25.0))

# %%
# What the robot plays
# --------------------
# Times and joints as a table; or at any time. ``motion.save`` keeps it with the problem that it was made for.
print(motion.profile.shape, motion.profile[1].round(4))
print(motion.at(10.0).feed_rate.round(2), "mm/s after 10 s")
plt.show()
