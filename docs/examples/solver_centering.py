"""
Centering a part: a log axis, until done
========================================

A part lies off the axis of a turntable and is pushed towards it. How far a push moves it, and in which
direction, is uncertain; so one aims short of the centre, and pushes until the offset is within tolerance.
Every push costs 2 s, and there is no deadline: :class:`~sdpgrind.sdp.Forever`.

The offset spans three decades, so the axis is logarithmic. Within the tolerance nothing is left to do, which
is what the number 0 at the low end says."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# The step is written once, with operators and numpy functions. It serves arrays in numpy and floats in a
# compiled kernel.
TOLERANCE = 0.0025  # mm


def push(s, c, e):
    travel = c.aim * s.offset * (1 + e.travel)
    return (np.sqrt(s.offset**2 + travel**2 - 2 * s.offset * travel * np.cos(e.direction)),)


noise = {
    "travel": sdp.Discrete([-0.12, -0.04, 0.04, 0.12]),
    "direction": sdp.Discrete([-0.03, 0.0, 0.03], [0.25, 0.5, 0.25]),
}
problem = sdp.Problem(
    axes=[sdp.Axis("offset", TOLERANCE, 3.0, 121, "mm", scale="log", below=0.0)],
    moves=[sdp.Move("push", {"aim": np.linspace(0.7, 1.1, 21)}, sdp.Sampled(push, noise), charge=2.0)],
    stops=[],
    stages=sdp.Forever(),
)
policy = sdp.plan(problem)

# %%
# Expected time to the centre, and a Monte-Carlo on the continuous offset.
for offset in (2.0, 0.2):
    runs = policy.simulate(offset=offset, runs=20_000, rng=0)
    planned = policy.value(offset=offset)
    print(f"from {offset} mm: {planned:.5f} s; Monte-Carlo {runs.mean:.3f} +- {runs.standard_error:.3f} s")

# %%
# The fraction of the offset to aim for, and the time left.
offset = policy.grid.coordinates[0]
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left.semilogx(offset, policy.value(offset=offset))
left.set(xlabel="offset [mm]", ylabel="expected time to the centre [s]", ylim=(0, None))
right.semilogx(offset, policy.action(offset=offset).aim, ".-", ms=3)
right.set(xlabel="offset [mm]", ylabel="aim, fraction of the offset")
plt.show()
