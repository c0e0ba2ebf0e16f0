"""
A ring: from a form tester's file to a push
===========================================

A form tester exports a profile of a ring as X3P: heights over the length of arc, in metres. How round is it, where is
its centre, and which push brings it to the axis?"""

import sys
from pathlib import Path

import centering
from sdpgrind import units

SAMPLES = Path(sys.argv[0]).resolve().parents[2] / "tests" / "data" / "samples"
ring = centering.Profile.read(SAMPLES / "ring.x3p", radius=40.0)
print(ring)
ring.plot()

# %%
# The gauge of the turning table writes degrees and micrometres, two turns in one file; the angle that starts again begins
# the second turn.

turns = centering.Profile.read(
    SAMPLES / "ring_degrees.csv", angle="angle", deviation="deviation", radius=40.0
)
print(turns)

# %%
# What the data say
# -----------------

problem = centering.preset("printed").replace(part=centering.push.Part(mass=5.0, radius=40.0))
print(problem.doubts(turns))

# %%
# The plan
# --------
# The ring lies 0.3 mm off the axis. One push moves it there, and the report tells whether its form is within 10 µm.

push = centering.plan_push(
    problem, offset=turns.circle.offset, spindle_speed=units.rpm(60), push_speed=units.mm_per_min(600)
)
print(push)
push.plot()
print(ring.report(limits={"RONt": units.um(10)}))
