"""
A shaft: from a trace to an optimal locus
=========================================

A cylindrical grinder recorded power, infeed, rotation and removed depth of a shaft in an HDF5 file, with units as
attributes. Which infeed and rotation are best for every sharpness of *this* wheel?
"""

import hwsim
from sdpgrind import locus

log = hwsim.Log.read(
    "tests/data/samples/shaft.h5",
    group="shaft 1",
    time="t",
    grinding_power="P",
    infeed_rate="v",
    work_rotation="n",
    removed="removed",
)
print(log.source)

# %%
# What it says
# ------------
# The wheel dulls while it grinds, and no column shows it: its wear flats were measured under the microscope before and
# after the part, 0.6 % and 0.98 % of the surface. In between they are *assumed* to grow with the removed depth, and this
# state is a column like any other.

believed = locus.preset("grinding").replace(width=4.0)
flats = log["data"].assign(wear_flat_area=lambda rows: 0.006 + 0.0038 * rows.removed / rows.removed.max())
print(believed.doubts(flats))

# %%
# Two values
# ----------
# One value alone does not explain the power; infeed and rotation never changed, so that at most two can be told: the
# specific energy from the level of the power, the pressure on the wear flats from its rise. This power is a straight
# line without noise, so the intervals are those of rounding: what is not known is how the flats grew.

found = locus.identify(flats, ("specific_energy", "pressure"), problem=believed)
print(found)

# %%
# The plan
# --------
# The best infeed and rotation for every state of the wheel; a controller follows them by the measured power. The pressure
# is higher than believed, so that the wheel has to be fed more slowly before it burns, the more so the duller it is: at
# wear flats of 0.72 % the cost, minus the removal rate of a millimetre of width, is above that of the plan as believed.

plan = locus.plan(believed.updated(found))
print(plan.at(wear_flat_area=0.0072))
plan.plot()
