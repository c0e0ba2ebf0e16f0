"""
A shaft, the tester's spindle, before and after
===============================================

One section says how round a part is there. Several sections make a cylinder; several setups tell the part from
the spindle of the tester; two measurements tell what grinding took off. The readings here are made up, so that
the truth is known: 5 nm of noise, lobes of the part, and an error of the spindle of 0.1 µm at 2 upr.
"""

import numpy as np

from centering import roundness
from sdpgrind import units

angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
rng = np.random.default_rng(0)


def read(lobes, radius=25.0, turned=0.0, spindle=0.1):
    """A turn of the tester: lobes as upr -> µm, on a part that was turned by an angle; radius in mm."""
    form = sum(size * np.cos(upr * (angle - turned) - upr) for upr, size in lobes.items())
    error = spindle * np.cos(2 * angle - 1.9)
    return roundness.Profile(angle, radius + units.um(form + error + 0.005 * rng.normal(size=angle.size)))


# %%
# Part and spindle
# ----------------
# The part is turned on the table between seven measurements. Angles that are not even lose no harmonic of 2 to
# 50 upr; the library proposes them for an index of 36 teeth. What is separated is taken off later measurements
# by ``correct``.

steps = roundness.step_angles(7, index=36, upr_max=50)
found = roundness.multistep([read({3: 0.4, 7: 0.2}, turned=step) for step in steps], steps)
print(found)

later = read({5: 0.3})
for name, profile in (("as read", later), ("corrected", later.correct(found.spindle))):
    print(f"{name:9} RONt {profile.filter(upr=50).roundness('MZC').interval()}")
found.plot()

# %%
# Sections of a shaft
# -------------------
# A cylinder in the minimum zone has a certificate for axes near by; it is no proof for all. Total run-out is about
# a datum: the spindle, unless another is given. About the part's own axis it has nothing of how the part was
# clamped.

heights = np.array([0.0, 20.0, 40.0, 60.0])  # mm
shaft = roundness.Sections(
    [read({3: 0.4 + 0.005 * z}, radius=25.0 + units.um(0.02 * z)).correct(found.spindle) for z in heights],
    heights,
)
cylinder = shaft.cylinder("MZC")
print(cylinder)
print(
    f"total run-out {1e3 * shaft.total_runout(cylinder):.3f} µm about its own axis,"
    f" straightness {1e3 * shaft.straightness():.3f} µm, coaxiality {1e3 * shaft.coaxiality(cylinder):.3f} µm"
)

# %%
# Before and after grinding
# -------------------------
# The part was taken off between both measurements: the rotation is found from the forms. The table tells each
# harmonic before and after, and the change.

before = read({2: 2.0, 3: 1.0, 12: 0.3}, spindle=0.0).filter(upr=50)
after = read({2: 0.3, 3: 0.6, 12: 0.1}, turned=1.0, spindle=0.0).filter(upr=50)
change = after.compare(before)
print(change)
table = change.to_dataframe().loc[[2, 3, 12], ["before", "after", "change"]]
print((1e3 * table).round(3))  # µm
change.plot()
