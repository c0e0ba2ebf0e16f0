"""
Paths over a surface
====================

A small tool finishes a curved die. Which way is it to go, so that no spot is left out and none is worked
twice? A path is laid over the surface, and then measured: how long it is, how far its passes are from each
other, what the tool does not reach."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import finishing, units

# %%
# A surface
# ---------
# B-splines and NURBS are given by control points, as a CAD program knows them. The nominal die has one ridge
# that dies away.
die = finishing.surface.nominal_surface()
print(f"area {die.area:.1f} mm², normal in the middle {die.normal(0.5, 0.5).round(3)}")
high, low = die.principal_curvatures(0.5, 0.5)
print(f"radii in the middle: {1 / high:.0f} mm and {1 / low:.0f} mm (negative: a ridge, away from the tool)")

# %%
# A surface from points
# ---------------------
# Where there is no CAD, there may be a scan: 20 000 points here, each with 10 µm of noise. The net is as fine as the points
# tell, no finer: what is left is the noise, and neighbours know nothing of each other. The area is a little greater: the
# surface ends at the least rectangle around the points in their plane, which is tilted here; the triangles of a scan tell the
# true edge.
rng = np.random.default_rng(1)
u, v = rng.uniform(0.0, 1.0, (2, 20_000))
points = die.point(u, v) + units.um(10) * rng.normal(size=(20_000, 1)) * die.normal(u, v)
scanned = finishing.Surface.fit(points, tolerance=units.um(10))
print(
    f"rms {1e3 * scanned.fit.rms:.1f} µm, greatest distance {1e3 * scanned.fit.error:.0f} µm: {scanned.fit.status}"
)
print(
    f"net {scanned.fit.net}, area {scanned.area:.1f} mm², correlation of neighbours {scanned.fit.neighbours:.2f}"
)

# %%
# A Hilbert path
# --------------
# It goes through all cells of a board of 2, 4, 8 ... to a side, one after the other, and never far at a time:
# so no direction is preferred, which a polisher likes. Four nodes in five are corners, which a robot
# dislikes.
path = finishing.hilbert(die, order=5)
print(
    f"{len(path.nodes)} nodes, {len(path.runs) - 1} corners, {path.length:.0f} mm long,"
    f" passes {path.pitch:.2f} mm apart"
)
path.plot()

# %%
# Equal parameters are not equal areas
# ------------------------------------
# A board of equal steps in the parameters is what Wang and Jan lay on the surface. Where control points
# crowd, so do the passes. This die is nearly the same, but its control points are drawn together in one
# corner.
crowded = finishing.surface.uneven_surfaces()["crowded"]
figure = plt.figure(figsize=(12, 4.2), layout="constrained")
for k, mapping in enumerate(("parametric", "equal_area")):
    laid = finishing.hilbert(crowded, order=5, mapping=mapping)
    ax = figure.add_subplot(1, 2, k + 1, projection="3d")
    laid.plot(ax)
    ax.set_title(mapping)
    print(f"{mapping}:\n{laid.metrics(footprint_radius=1.2)}")

# %%
# With equal areas each cell gets the same share of the work. The cells need not be square: steps still differ
# a little.
#
# Zigzags
# -------
# A zigzag is told how far apart its passes may be *on the surface*. There are four ways to place them, and
# none leaves more between two passes; where passes turn back and at the corners of the surface the largest
# gap may be sqrt(2) times as wide. This die is nearly the nominal one again, with weights that draw its
# parameters to the middle. Lines of the parameters bend there: near enough in one place, they are too near in
# another. "geodesic" keeps the gap along the whole of each pass.
weighted = finishing.surface.uneven_surfaces()["weighted"]
zigzags = {}
for mapping in ("parametric", "equal_spacing", "equal_area", "geodesic"):
    zigzags[mapping] = laid = finishing.zigzag(weighted, pitch=2.0, mapping=mapping)
    shortest = weighted.area / 2.0
    found = laid.metrics(footprint_radius=1.0)
    print(
        f"{mapping:14} length {laid.length:5.0f} mm ({laid.length / shortest:.2f} of area over pitch), "
        f"largest gap {found.largest_gap:.2f} mm, coverage {100 * found.coverage:.1f} %"
    )

figure = plt.figure(figsize=(12, 4.2), layout="constrained")
for k, mapping in enumerate(("equal_spacing", "geodesic")):
    ax = figure.add_subplot(1, 2, k + 1, projection="3d")
    zigzags[mapping].plot(ax)
    ax.set_title(mapping)

# %%
# What the tool reaches
# ---------------------
# The footprint is not the tool. A ball of 4 mm that sinks in by 10 µm touches a spot of 0.2 mm radius; that
# spot has to cover the surface. A Hilbert path needs more of it than a zigzag of the same pitch: at some cell
# corners no pass comes near.
print(f"a ball of 4 mm, 10 µm deep: radius {finishing.path.ball_footprint(2.0, units.um(10)):.2f} mm")
plate = finishing.surface.flat_surface(16.0)
radius = np.linspace(0.5, 0.75, 6)  # mm, and over the pitch: that is 1 mm
fractal, straight = finishing.hilbert(plate, order=4), finishing.zigzag(plate, pitch=1.0)
figure, ax = plt.subplots(figsize=(7, 3), layout="constrained")
for name, laid in (("Hilbert", fractal), ("zigzag", straight)):
    ax.plot(radius, [100 * laid.metrics(each).coverage for each in radius], "o-", ms=3, label=name)
ax.set(xlabel="radius of the footprint over the pitch", ylabel="covered [%]")
ax.legend(frameon=False)

# %%
# What is left standing
# ---------------------
# Between two passes of a ball a scallop remains. Its height grows with the square of the pitch; it is greater
# on a ridge than on a flat, and smaller in a hollow, until the ball no longer fits, which is refused. The
# surface knows its curvature across the passes: here a cylinder, worked on from outside along its axis, and a
# sphere, worked on from inside.
ridge = finishing.surface.cylinder_surface(20.0, 50.0)
hollow = finishing.surface.sphere_surface(20.0, inside=True)
for name, shape in (("flat", plate), ("ridge of 20 mm", ridge), ("hollow of 20 mm", hollow)):
    curvature = float(shape.normal_curvature(0.5, 0.5, 0.0, 1.0))
    height = finishing.path.scallop_height(2.0, 0.2, curvature)
    roughness = finishing.path.cusp_roughness(2.0, 0.2, curvature)
    print(f"{name:15} scallops {1e3 * height:.2f} µm, R_a {1e3 * roughness:.2f} µm")
try:
    finishing.path.scallop_height(2.0, 0.2, normal_curvature=0.6)
except ValueError as error:
    print(error)

# %%
# In practice
# -----------
# Begin with "equal_area" for a Hilbert path, with "equal_spacing" for a zigzag or "geodesic" where lines of
# the parameters bend; and with a pitch of 1.4 times the radius of the footprint, for a zigzag of a little
# less than twice. A zigzag covers better with the same length and has far fewer corners. In the experiment of
# Wang and Jan the finer of two fractal paths left the smoothest surface nevertheless; but they print the
# pitch of neither.
plt.show()
