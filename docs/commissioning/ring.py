"""
A ring: from a form tester's file to a push
===========================================

How round is a ring, where is its centre, and which push brings it to the axis? Two files: a profile of a form tester as
X3P, and two turns of a gauge on the turning table. The problem that is believed comes first: the source's machine, with
a ring of 5 kg and 40 mm radius; the speeds of table and slide are those of the job.
"""

import centering
from sdpgrind import units

believed = centering.preset("printed").replace(part=centering.push.Part(mass=5.0, radius=40.0))
speeds = {"spindle_speed": units.rpm(60), "push_speed": units.mm_per_min(600)}

# %%
# The turning table
# -----------------
# The gauge writes degrees and micrometres from a nominal radius. The angle that starts again begins the second turn.

turns = centering.Profile.read(
    "tests/data/samples/ring_degrees.csv", angle="angle", deviation="deviation", radius=40.0
)
print(turns)

# %%
# What it says
# ------------
# Where the centre is, and how surely; nothing on mass and friction, which stay as believed: each line says which
# measurement would tell. The radius is what the call says plus the mean deviation: its interval is that of the deviation,
# not that of the nominal radius.

print(believed.doubts(turns))

# %%
# The plan
# --------
# Without a centre there is no push. The file puts it 0.3 mm off the axis, known to hundredths of a micrometre: how well
# the push ends depends on friction and mass, not on the gauge. The tip approaches, pauses, and runs up to the push speed,
# so that it meets the rim where that is furthest out.

push = centering.plan_push(believed, offset=turns.circle.offset, **speeds)
print(push)
push.plot()

# %%
# The form tester
# ---------------
# X3P holds heights over the length of arc, in metres; the nominal radius makes angles of it. The report compares the
# form with its limit of 10 µm, and the interval of the peak-to-valley is part of the verdict.

ring = centering.Profile.read("tests/data/samples/ring.x3p", radius=40.0)
print(ring.report(limits={"RONt": units.um(10)}))
ring.plot()

# %%
# Laid on the table as it was on the tester, it is 0.05 mm off the axis, and a shorter push does.

print(centering.plan_push(believed, offset=ring.circle.offset, **speeds))
