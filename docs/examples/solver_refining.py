"""
Refining: recycle, blend or demote
==================================

A batch of a product has some purity. It may be *recycled* (refined once more, with an uncertain success and
at a cost), or be sold: *blended* with purer stock, which takes the more of that the fouler the batch is, or
*demoted* to a cheaper grade. There is no deadline; recycling goes on until it does not pay.

Several stops stand side by side, and the step is any function: :class:`~sdpgrind.sdp.Sampled`.
"""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# What refining leaves of the impurity is random: mostly a third, sometimes nearly all.
LEFT = sdp.Discrete([0.25, 0.4, 0.95], [0.5, 0.35, 0.15])
RECYCLE = 0.5  # $ a run


def refine(s, c, e):
    return (1.0 - (1.0 - s.purity) * e.left,)


def blend(s):
    """Pure stock needed, growing faster than the impurity; refused below 70 %."""
    return 12.0 * (1.0 - s.purity) + 40.0 * (1.0 - s.purity) ** 2


def demote(s):
    return 1.9 - 0.1 * s.purity


problem = sdp.Problem(
    axes=[sdp.Axis("purity", 0.0, 1.0, 201)],
    moves=[sdp.Move("recycle", {}, sdp.Sampled(refine, {"left": LEFT}), charge=RECYCLE)],
    stops=[sdp.Stop("blend", blend, allowed=lambda s: s.purity >= 0.7), sdp.Stop("demote", demote)],
    stages=sdp.Forever(),
)
print(sdp.check(problem))
policy = sdp.plan(problem)

# %%
# The best action by purity: a batch that is very foul is not worth refining, one that is nearly pure needs
# none.
purity = policy.grid.coordinates[0]
names = policy.action(purity=purity).name
changes = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1), names.size - 1]
for first, last in zip(changes, changes[1:], strict=False):
    print(f"from {purity[first]:.3f} to {purity[last]:.3f}: {names[first]}")

# %%
# Loss against selling at once.
figure, ax = plt.subplots(figsize=(6, 3.6), layout="constrained")
state = policy.grid.coordinates[0]
ax.plot(state, 1.9 - 0.1 * state, "--", label="demote")
ax.plot(state[state >= 0.7], (12 * (1 - state) + 40 * (1 - state) ** 2)[state >= 0.7], "--", label="blend")
ax.plot(state, policy.value(purity=state), "k", label="best")
ax.set(xlabel="purity", ylabel="loss [$]", ylim=(0, 5))
ax.legend(frameon=False)
plt.show()
