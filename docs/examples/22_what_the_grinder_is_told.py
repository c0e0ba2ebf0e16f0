"""
What the grinder is told
========================

The table has measured each part before the grinder sees it. Four things can be handed on: where the wheel may
stop rushing in, how far to stay away at all, which speeds to avoid, and that something upstream has changed.
"""

import matplotlib.pyplot as plt
import numpy as np

import centering
import hwsim
from sdpgrind import units

# %%
# Where rapid feed ends
# ---------------------
# Without a measurement the wheel has to stop where no part of the population reaches. With one it may go on
# to this part's largest radius: that about the axis that it is ground about, with what noise and gaps between
# samples can hide. The rest is air, and time.
lobes = {2: (0.004, 0.3), 3: (0.002, 1.0), 43: (0.0003, 0.0)}
ring = hwsim.Ring(62.05, offset=0.002, offset_angle=1.0, lobes=lobes)
scan = hwsim.Probe(ring, samples_per_turn=400).scan(turns=4, rng=0)
profile = centering.Profile(scan.angle, scan.reading, tip_radius=3.75).remove_roller_error()
stock = centering.setup.Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
job = {"finish_radius": 61.9, "gap": 0.010, "approach_rate": units.mm_per_min(1.56)}
change = centering.plan_changeover(profile, stock, **job)
print(change)
told = change.contact_probability
print(
    f"farther than was allowed for, into the gap: {1e6 * told.population:.0f} parts in a million by the population's rule;"
    f" measured, at most {1e6 * told.part:.0f}"
)
change.plot()

# %%
# "3 sigma" of the population are 3.5 here, as both scatters are added up. Combined as they should be, the
# population's rule gains a little, too:
rss = centering.plan_changeover(profile, stock, combine="rss", **job)
print(
    f"{change.population_position:.4f} mm added up, {rss.population_position:.4f} mm as the root of squares"
)
print(f"against that the measurement saves {rss.time_saved:.2f} s")

# %%
# How far away at all
# -------------------
# Each standard deviation of allowance is ground in air at each part; a crash costs a dressing now and then.
# Where both together are least depends on what a crash costs, by its logarithm: some half of a standard
# deviation for ten times the cost.
sigmas = np.linspace(1.5, 5.0, 71)
figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
for minutes, color in ((0.5, "#5a9a68"), (5.0, "#4878a8"), (60.0, "#b04a3a")):
    best = centering.setup.best_allowance(stock.height_sd, approach_rate=0.026, crash_time=60 * minutes)
    ax.plot(sigmas, [best.cost(z) for z in sigmas], color=color, label=f"a crash costs {minutes:g} min")
    ax.plot(best.sigmas, best.cost(), "o", color=color)
    print(f"a crash of {minutes:4g} min: {best}")
ax.set(xlabel="allowance [sd]", ylabel="air and crashes [s a part]", ylim=(0, 10))
ax.legend(frameon=False)

# %%
# Which speeds to avoid
# ---------------------
# Undulations that the part brings along shake the grinder at their number times the rotation of the work.
# Where that is a resonance, or in step with the wheel, they are ground in instead of off. A little faster or
# slower is enough.
spectrum = profile.harmonics(upr_max=60)
speeds = {"wheel_rotation": units.rpm(4210), "work_rotation": units.rpm(300)}
check = centering.setup.chatter_check(
    spectrum, **speeds, resonances={"tailstock": units.hz(218), "wheel head": units.hz(95)}
)
print(check)
check.plot()

# %%
# What drifts
# -----------
# The table pushes each part to the middle, and notes by how much it had to correct its stroke, and how much
# the part resisted. Both walk slowly. A step is something else: a chip on a locating face, another oil. From
# part 60 on the correction is 6 µm off. After an alarm that quantity is not watched until the alarm is
# acknowledged, here before part 75, with clean faces.
rng = np.random.default_rng(0)
track = centering.DriftTrack({"stroke_offset": 0.002, "mu_kinetic": 0.004})
for part in range(100):
    if part == 75:
        print(track)
        track.acknowledge()
    offset = 0.150 + (0.006 if 60 <= part < 75 else 0.0) + 0.002 * rng.normal()
    for alarm in track.update(stroke_offset=offset, mu_kinetic=0.135 + 0.004 * rng.normal()):
        print(alarm)
print(f"a step of 3 sd is flagged within 5 parts with a probability of {track.detection_probability():.3f}")
track.plot()

# %%
# What the machine upstream is told
# ---------------------------------
# Roundness and stock of each part are known here first. Limits come from the first 50 parts; then a turning
# tool wears, and parts come with more and more stock. The summary is plain text for whatever connects the
# machines.
rng = np.random.default_rng(2)
chart = centering.ControlChart(
    {"roundness": 0.010 + 0.001 * rng.normal(size=50), "stock": 0.150 + 0.004 * rng.normal(size=50)}
)
seen = []
for part in range(60):
    wear = 0.0004 * max(part - 20, 0)
    seen += chart.update(roundness=0.010 + 0.001 * rng.normal(), stock=0.150 + wear + 0.004 * rng.normal())
print(seen[0])
print(chart.summary["quantities"]["stock"])
chart.plot()
plt.show()
