"""
Roll bending: a law of two signs
================================

A bar is bent hit by hit. Each hit bends by what is asked for, give or take a tenth of it (springback), so
that a timid hit is accurate and a bold one is not. Too little bend can be mended by another hit; too much is
four times as dear, and can be bent back as well, a little more awkwardly. A few hits are left before the bar
has to go.

The error of the shape falls by a random amount that does not depend on it: a :class:`~sdpgrind.sdp.Shift`,
whose expectations are exact. Unlike a bead under a grinding disc, the error may come out on either side."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# Both ends of the axis stop: what falls beyond is charged exactly, through the partial moments of the normal
# law.
SPRINGBACK = 0.1


def forward(s, c):
    return sdp.Normal(c.bend, SPRINGBACK * c.bend)


def back(s, c):
    return sdp.Normal(-c.bend, 1.5 * SPRINGBACK * c.bend)


def problem(nodes=301, hits=4, levels=201):
    bends = sdp.Levels(0.0, 4.0, levels)
    return sdp.Problem(
        axes=[sdp.Axis("error", -3.0, 3.0, nodes, "mm", below="stop", above="stop")],
        moves=[
            sdp.Move("bend", {"bend": bends}, sdp.Shift("error", forward), charge=0.02),
            sdp.Move("bend back", {"bend": bends}, sdp.Shift("error", back), charge=0.05),
        ],
        stops=[sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))],
        stages=sdp.Stages(hits, 1.0, "hits_left", ""),
    )


policy = sdp.plan(problem())

# %%
# With one hit left one aims short of the target; with more, one starts bolder and comes nearer.
for hits in (0, 1, 2, 4):
    action = policy.action(error=2.0, hits_left=hits)
    print(
        f"{hits} hits left: {policy.value(error=2.0, hits_left=hits):.4f} $, {action.name}, {action.bend:.4f} mm"
    )

# %%
# The exact distribution of the final penalty, and a Monte-Carlo of the same policy.
outcome = policy.distribution(error=2.0, hits_left=4)
runs = policy.simulate(error=2.0, hits_left=4, runs=50_000, rng=0)
print(
    f"mean {outcome.mean:.4f} $ (Monte-Carlo {runs.mean:.4f} +- {runs.standard_error:.4f}), {outcome.moves:.3f} hits"
)
print(f"the worst 5 % end at {outcome.cvar(0.95):.4f} $ on average, hits not counted")

# %%
# What to do, by the error and the hits that are left.
error = np.linspace(-3, 3, 601)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for hits in range(5):
    left.plot(error, policy.value(error=error, hits_left=hits), label=f"{hits}")
    action = policy.action(error=error, hits_left=hits)
    right.plot(error, np.where(action.name == "bend back", -1, 1) * action.bend, ".", ms=2)
left.set(xlabel="error [mm]", ylabel="expected penalty-to-go [$]", ylim=(0, 3))
left.legend(title="hits left")
right.set(xlabel="error [mm]", ylabel="bend asked for [mm]")
plt.show()
