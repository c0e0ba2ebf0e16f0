"""
Roundness
=========

The same readings that tell where a ring lies tell how round it is, once the offset, the noise and the probe's
own roller are out of them. Here a ground ring is measured as it lies, 3.6 mm off-centre, with a roller that
runs out by more than the ring does."""

import matplotlib.pyplot as plt
import numpy as np

import centering
import hwsim
from sdpgrind import units

# %%
# A ring, and what the probe shows of it
# --------------------------------------
# The lines are those of a bearing ring on a roundness machine (Mears, Table 6.5). Four turns, one reading a
# degree. upr: µm
LINES = {
    2: 0.155,
    3: 0.206,
    4: 0.018,
    6: 0.048,
    18: 0.018,
    21: 0.038,
    22: 0.036,
    42: 0.029,
    43: 0.235,
    44: 0.040,
}
rng = np.random.default_rng(3)
lobes = {upr: (units.um(amplitude), rng.uniform(0, 2 * np.pi)) for upr, amplitude in LINES.items()}
ring = hwsim.Ring(61.94, offset=3.6, offset_angle=0.5, lobes=lobes)
errors = hwsim.ProbeErrors(probe_quantum=0.0, slide_quantum=0.0, counts=0, noise_sd=1e-4, runout=1.5e-3)
scan = hwsim.Probe(ring, samples_per_turn=360, errors=errors).scan(turns=4, rng=0)
profile = centering.Profile(scan.angle, scan.reading, tip_radius=3.75)
print(profile)
print(f"truly {1e3 * ring.roundness:.3f} µm from peak to valley")

print(f"a cosine would leave {1e3 * centering.circle.limacon_wave(61.94, 3.6):.0f} µm of two undulations")

# %%
# A cosine of that offset has an error of its own, 52 µm of two undulations; the exact curve has none. What is
# left are 4 µm, most of them the roller's.
#
# The roller
# ----------
# A roller of 3.75 mm turns 16.5 times a turn of the part. It follows the arc, so that on an offset part its
# tone is not a line of the spectrum, and a notch in the spectrum of one turn would smear it over the part's
# own lines. One least-squares fit over all turns tells both apart, and finds the roller's true radius on the
# way.
clean = profile.remove_roller_error()
print(clean.roller_error)
one_turn = centering.Profile(scan.angle[:360], scan.reading[:360], tip_radius=3.75)
figure, axes = plt.subplots(2, 1, figsize=(7, 5), layout="constrained", sharex=True)
one_turn.harmonics(upr_max=60).plot(axes[0])
clean.harmonics(upr_max=60).plot(axes[1])
axes[0].set(title="one turn, as measured", xlabel="")
axes[1].set(title="four turns, without the roller; grey: noise")
found = clean.harmonics(upr_max=60)
for upr, amplitude in found.largest(5):
    print(f"{upr:3.0f} upr: {1e3 * amplitude:.3f} µm, truly {LINES.get(int(upr), 0.0):.3f} µm")

# %%
# With an integer ratio the roller stands at the same place of the part in each turn. Nothing can tell them
# apart then, and nothing is made up:
try:
    profile.remove_roller_error(ratio=17.0)
except ValueError as error:
    print(error)

# %%
# Filter
# ------
# A Gaussian filter of 50 undulations, as roundness is usually stated. The amplitude at the cut-off is halved.
# Each step is written into the profile.
smooth = clean.filter("gaussian", upr=50)
print(smooth)
smooth.plot()

# %%
# Drawings also ask for a spline, for the 2RC filter of old instruments, or for a band. A band without 1 upr has
# no circle of its own: its RONt is the range of what has passed.
for asked in ({"upr": 50}, {"kind": "spline", "upr": 50}, {"kind": "2rc", "upr": 50}, {"upr": (15, 50)}):
    found = clean.filter(**asked)
    print(f"{found.steps[-1].split(',')[0]:20} {1e3 * found.roundness().ron_t:.3f} µm")

# %%
# Four circles
# ------------
# Least squares, minimum circumscribed, maximum inscribed and minimum zone: ISO 12181 knows them all, and
# roundness is a number only together with its circle. The three extreme ones rest on two to four points, and
# these prove them: no circle can be better than its contacts allow.
print(f"{'':6}{'RONt':>10}{'RONp':>10}{'RONv':>10}{'radius':>14}   contacts [degrees]")
for kind in ("LSC", "MCC", "MIC", "MZC"):
    circle = smooth.roundness(kind)
    told = "".join(f"{1e3 * value:7.3f} µm" for value in (circle.value, circle.ron_p, circle.ron_v))
    print(
        f"{kind:6}{told}{circle.radius:11.5f} mm   {np.rad2deg(circle.contact_angles).round(0).astype(int).tolist()}"
    )
zone = smooth.roundness("MZC")
print(zone.certificate)
zone.plot()

# %%
# The zone is the smallest, always. Noise lifts RONt, the more the more places tie for the highest and the
# lowest. The interval takes that off: from noise drawn about the form, or, wider, whatever the form is.
print(zone.interval())
print(zone.interval(method="guaranteed"))
print(f"a limit of 1.5 µm: {zone.conforms(0.0015)}")

# %%
# A part with two lobes
# ---------------------
# Squeezed in a chuck: the circumscribed circle then rests on two points across from each other. Where dust
# was under the probe one of the contacts is the dust: look at them before you believe an extreme circle.
oval = hwsim.Ring(61.94, lobes={2: (0.010, 0.3), 4: (0.001, 0.0)})
scan = hwsim.Probe(oval, samples_per_turn=720, errors=None).scan(turns=1)
squeezed = centering.Profile(scan.angle, scan.reading, tip_radius=3.75)
for kind in ("MCC", "MIC"):
    circle = squeezed.roundness(kind)
    print(f"{kind}: {1e3 * circle.value:.2f} µm; {circle.certificate}")
squeezed.roundness("MCC").plot()
plt.show()
