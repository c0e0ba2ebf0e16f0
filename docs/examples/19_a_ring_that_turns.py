"""
A ring that turns
=================

A ring was put down on a turning table, a few millimetres off-centre. A probe reads it while it turns, and a
pusher waits to push it to the middle. Each degree of turning costs time; each push in the wrong direction
costs more. So: where is the centre, how sure is that, and when is it sure enough?"""

import matplotlib.pyplot as plt
import numpy as np

import centering
import hwsim
from sdpgrind import units

# %%
# Reading by reading
# ------------------
# A simulated table of 20 turns a minute, read 100 times a second; the surface is rough by 40 µm. The
# estimator is told how rough, how sure it has to be, and which error may remain: 3 % of the offset, but never
# less than 2 µm.
ring = hwsim.Ring(61.94, offset=3.6, offset_angle=units.deg(40))
probe = hwsim.Probe(ring, errors=hwsim.ProbeErrors(noise_sd=0.04))
scan = probe.scan(turns=1, rng=0)
asked = {"noise_sd": 0.04, "confidence": 0.999, "rel_tol": 0.03, "abs_tol": 0.002}
estimator = centering.GeometryEstimator(**asked, tip_radius=3.75)
bands = []
for angle, reading in zip(scan.angle, scan.reading, strict=True):
    estimator.update(angle=angle, reading=reading)
    bands.append(estimator.band)
    if estimator.valid:
        break
circle = estimator.estimate
print(circle)
print(f"limited by {circle.limited_by or 'nothing'} after {np.rad2deg(circle.swept):.0f} degrees")

# %%
# The model is the exact curve of an offset circle under a round tip. A cosine, which many use, would be off
# by 0.16 mm here, without any noise. The dashed part has not been seen yet.
used = slice(circle.samples)
circle.plot(scan.angle[used], scan.reading[used])

# %%
# A real machine reads two scales, of the slide and of the probe on it; a master ring gives the constant.
# Moving the slide by 2 mm along a part that stands still changes nothing:
print(centering.circle.radial_position(slide=[10.0, 12.0], probe=[1.5, -0.5], calibration=50.0), "mm")

# %%
# What the estimator said on its way. It knows how long it will still take: that is worth something to whoever
# moves the pusher.
turned = np.rad2deg(scan.angle[used] - scan.angle[0])
figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
ax.semilogy(turned, 1e3 * np.array(bands), color="#4878a8", label="centre within, at 99.9 %")
error = np.hypot(circle.center_x - ring.center_x, circle.center_y - ring.center_y)
ax.axhline(1e3 * 0.03 * circle.offset, color="0.5", ls="--", lw=1, label="allowed")
ax.plot(turned[-1], 1e3 * error, "o", color="#b04a3a", ms=5, label="true error at the end")
ax.set(xlabel="turned [degrees]", ylabel="distance from the centre [µm]", xlim=(0, None), ylim=(20, 1e5))
ax.legend(frameon=False)
for at in (30, 60, 90):
    early, soon = centering.GeometryEstimator(**asked, tip_radius=3.75), int(np.sum(turned <= at))
    early.extend(scan.angle[:soon], scan.reading[:soon])
    needed = np.rad2deg(early.estimate.arc_needed)
    print(f"after {at} degrees it said {needed:.0f} more; {turned[-1] - at:.0f} it was")
print(early.estimate.message)

# %%
# The whole machine
# -----------------
# The same estimator as a controller that stops the table as soon as it is sure, and the log of it.
controller = centering.MeasuringController(estimator)
log = hwsim.run(probe, controller, parts=5, rng=1)
print(log.outcome[["turns", "time", "true_offset"]].to_dataframe().round(3))
log.plot()

# %%
# After a push
# ------------
# A push moves the centre and leaves the radius as it was. Whoever has waited for one full turn may carry the
# radius over: an arc of 30 degrees then says ten times as much; no algorithm makes up for that. Pushes of
# this machine end some percent beside where they should.


def pushed(part, found, rng):
    """Where the part lies after a push that was to bring the found centre to the axis."""
    x, y = (1 + 0.05 * rng.normal()) * np.array([found.center_x, found.center_y]) + 0.002 * rng.normal(size=2)
    x, y = part.center_x - x, part.center_y - y
    return part.replace(offset=float(np.hypot(x, y)), offset_angle=float(np.arctan2(y, x)))


def centred(keep_radius, seed=5):
    """Centres as they were found, push by push, until the offset is below 10 µm."""
    pushes, part, centers = np.random.default_rng(seed), ring, []
    quick = centering.GeometryEstimator(noise_sd=0.01, rel_tol=0.05, abs_tol=0.003, tip_radius=3.75)
    while not centers or centers[-1].offset > 0.010:
        table = probe.replace(ring=part, errors=hwsim.ProbeErrors(noise_sd=0.01, runout=0.0))
        scan = table.scan(turns=3 if centers else 1, rng=len(centers))
        measure = quick.first_valid if centers else quick.extend
        measure(scan.angle, scan.reading)
        centers.append(quick.estimate)
        part = pushed(part, quick.estimate, pushes)
        quick.reset(keep_radius=keep_radius)
    return centers


for keep in (False, True):
    centers = centred(keep)
    told = ", ".join(
        f"{1e3 * each.offset:.3g} µm after {np.rad2deg(each.swept):.0f} degrees" for each in centers
    )
    print(f"radius {'kept' if keep else 'forgotten'}: {told}")
centering.circle.plot_centers(centers, tolerance=0.010)

# %%
# The distance from the middle is the logarithm of the offset: millimetres at the rim, micrometres inside, the
# tolerance in green.
#
# When the part moves
# -------------------
# Somebody touches the part after a third of a turn. The readings after it are refused one by one, and when
# that are more than half of the latest 30, the estimator begins anew by itself with these; the radius it
# keeps. What was refused can be looked at.
moved = probe.replace(
    moved=(1.0, 0.8, -0.5), errors=hwsim.ProbeErrors(noise_sd=0.004, dust=0.02, dust_size=0.2)
)
scan = moved.scan(turns=1, rng=2)
watching = centering.GeometryEstimator(noise_sd=0.004, tip_radius=3.75)
watching.extend(scan.angle, scan.reading)
print(f"restarts: {watching.restarts}; {watching.rejected[0].size} readings refused, of which dust is a part")
print(
    f"offset {watching.estimate.offset:.3f} mm; truly {np.hypot(ring.center_x + 0.8, ring.center_y - 0.5):.3f} mm"
)
plt.show()
