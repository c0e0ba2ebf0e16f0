"""
The next push
=============

No push ends exactly where it was meant to. So the question is not how to hit, but which sequence of pushes is
over soonest. That is a stochastic dynamic program over the offset and what is believed of the friction, and
its answer is a table that is looked up in microseconds."""

import time
import warnings

import matplotlib.pyplot as plt
import numpy as np

import centering
from sdpgrind import units

# %%
# A strategy
# ----------
# The heavy ring once more. Planning simulates thousands of pushes of ten kinds exactly, and solves. A warning
# comes first: half of the jump of stick and slip is three times the tolerance, so that slow pushes alone
# would centre this ring by luck.
problem = centering.preset("printed").replace(
    part=centering.push.Part(mass=18.9, radius=89.5), tolerance=0.0025
)
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    strategy = centering.plan(problem)
print(*(each.message for each in heard))
strategy.plot()

# %%
# From afar the ring is pushed fast, whatever it slides on: there is time to measure again. Then gently, so
# that it stays at the tip, and the last micrometres are made by taps: a slow push cannot move this ring by
# less than 15 µm, a tap can by 2 µm.
for offset in (10.0, 1.0, 0.1, 0.03, 0.01, 0.005):
    push = strategy.push(offset=offset)
    print(
        f"{1e3 * offset:6.0f} µm: {push.shape:9} of {push.push_speed:4.1f} mm/s, table {push.spindle_speed / units.rpm(1):3.0f} "
        f"1/min, aims at {100 * push.aim / offset:3.0f} % of the offset; {strategy.cycle_time(offset):.2f} s to the end"
    )
begin = time.perf_counter()
for _ in range(1000):
    strategy.push(offset=0.3, friction=1.05, evidence=2)
print(f"a look-up takes {1e3 * (time.perf_counter() - begin):.0f} us")

# %%
# Why it draws back
# -----------------
# The same strokes at 5 mm/s, ending at rest in contact, or drawn back at once at 2560 mm/s^2. The contact
# gives back what it has stored, and the part moves on while the tip rests: by 12 µm, or not at all. Drawn
# back, it moves by 2 µm or more.
strokes = np.geomspace(0.005, 0.1, 300)
figure, axis = plt.subplots(figsize=(7, 3.8), layout="constrained")
rests = [centering.TipProfile.move(x, 5.0, problem.limits.acceleration_max) for x in strokes]
taps = [centering.push.tap_profile(x, 5.0) for x in strokes]
for label, profiles, color in (
    ("stays in contact", rests, "#b04a3a"),
    ("drawn back at once", taps, "#4878a8"),
):
    axis.plot(
        1e3 * strokes,
        1e3 * centering.push.simulate_pushes(problem.model, profiles)[:, 0],
        color=color,
        label=label,
    )
axis.axhline(1e3 * problem.model.stick_slip_quantum, color="0.5", ls="--", lw=1, label="jump of a slow push")
axis.set(xlabel="travel of the tip [µm]", ylabel="travel of the part [µm]")
axis.legend(frameon=False)

# %%
# What is believed
# ----------------
# The friction of a ring persists. A ring that went too far goes too far again, unless the strategy carries
# what it has seen: a mean, and how many pushes' worth of evidence there is.
friction, evidence, weights = 1.0, 0.0, None
for travelled in (1.03, 0.99, 1.0):
    push = strategy.push(offset=1.0, friction=friction, evidence=evidence)
    friction, evidence, weights = strategy.update_belief(
        friction, evidence, push, travelled * push.aim, weights=weights
    )
    print(
        f"went {100 * travelled:.0f} % of its aim: friction {friction:.3f} of the model's, evidence of {evidence:.2f} pushes"
    )

# %%
# What it promises
# ----------------
# Followed on its own model, on rings whose friction is not the mean one; beside it what the tables expected.
runs = strategy.simulate(runs=400, rng=0)
expected = np.mean([strategy.cycle_time(start) for start in runs.start])
print(runs, f"expected {expected:.2f} s")
runs.plot()

# %%
# What it risks
# -------------
# The mean friction may not be what was told. A problem says between which factors it lies; without a word it is
# 0.8 to 1.25. Until a push has shown the friction of a ring, the table gains speed only as fast as the lowest
# factor, less three standard deviations of the rings, holds place and spin of the ring:
# :math:`\sqrt{(w^2 d)^2 + (w' R)^2} \le 0.9\, \mu g`. The first push is felt by its forces, too. The table of the
# risk follows rings of another friction by the plan's own tables, and with the belief that they would leave.
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # the warning that was heard above
    doubted = centering.plan(problem.replace(friction_range=(0.6, 1.4)), spindle_speed="scheduled")
print(doubted.robust(friction_range=(0.6, 1.4)).to_dataframe().round(3))
plt.show()
