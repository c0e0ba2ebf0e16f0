"""
A sheet to sign
===============

A tester's file, a drawing with a limit, and a tester whose errors are known. The result is a decision that says
what it rests on: circle, filter, corrections, interval with its method, budget, digest of the file."""

from centering.roundness import Instrument, Profile
from sdpgrind import units

ring = Profile.read("tests/data/samples/ring_degrees.csv", angle="angle", deviation="deviation", radius=40.0)
zone = ring.filter("gaussian", upr=50).roundness("MZC")
tester = Instrument(spindle_error=units.um(0.05), gain_sd=0.01, probe_linearity=0.005, temperature_sd=0.01)
print(zone.report(limits={"RONt": units.um(6.5)}, instrument=tester))

# %%
# With a path, ``zone.report("ring.html", ...)``, it is one page with pictures that needs nothing else, and
# ``hwsim verify ring.html`` finds what was changed in it. The picture on it:
zone.plot()

# %%
# The budget
# ----------
# Noise goes through the form: each draw of it is added to the harmonics that stand out, and the circle is found
# anew. GUM's linear law takes the places of contact as they are; where several places nearly tie, as here, it says
# too much. The spindle is not known in its form: whatever that is, RONt changes by its height from valley to peak at
# most, and the worst case stands beside the draws.
budget = zone.budget(tester)
print(budget)
print(f"worst case of the spindle: {budget.worst_case().ends} µm")

# %%
# A budget is a result like the circle: both are saved, loaded and decide on a limit (ISO 14253-1). Between
# "accepted" and "rejected" lies what this tester cannot tell.
for limit in (6.5, 6.0, 5.5):
    print(f"{limit} µm: {budget.conforms(units.um(limit))}")
