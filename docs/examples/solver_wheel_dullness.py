"""
Bead height with wheel dullness: two coordinates
================================================

A disc dulls as it grinds: the same force cuts less, and scatters more. Dullness is a second coordinate beside
the height of the bead. The height falls by a random amount, a :class:`~sdpgrind.sdp.Shift`; where dullness
goes is known (``others=``). Dressing takes time and makes the disc sharp again.

Problems of two or three axes can be solved on an executor: ``sdp.plan(problem, executor=...)`` gives the same
bits."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# A pass at a force (N) takes 4 s, removes 0.02 mm a newton with a sharp disc and half of that at dullness 1,
# with a relative scatter from 10 % to 25 %.
FORCES = sdp.Levels(0.0, 50.0, 65)


def cut(s, c):
    mean = 0.02 * c.force / (1.0 + s.dullness)
    return sdp.Rayleigh(mean, (0.10 + 0.15 * s.dullness) * mean)


def dulls(s, c):
    return (s.dullness + 0.006 * c.force,)


def dressed(s, c, e):
    return s.height, 0.0 * s.dullness


def problem(wear=dulls, height=81, dullness=11):
    return sdp.Problem(
        axes=[
            sdp.Axis("height", 0.0, 2.0, height, "mm", below="stop"),
            sdp.Axis("dullness", 0.0, 1.0, dullness, above="hold"),
        ],
        moves=[
            sdp.Move("grind", {"force": FORCES}, sdp.Shift("height", cut, wear), duration=2),
            sdp.Move("dress", {}, sdp.Sampled(dressed), duration=1, charge=0.02),
        ],
        stops=[sdp.Stop("stop", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))],
        stages=sdp.Stages(12, 2.0),
    )


policy = sdp.plan(problem())

# %%
# A sharp disc grinds, a dull one is dressed where time allows.
for dullness in (0.0, 0.5, 1.0):
    action = policy.action(height=1.0, dullness=dullness, time_left=16.0)
    value = policy.value(height=1.0, dullness=dullness, time_left=16.0)
    print(f"dullness {dullness}: {value:.4f} $, {action.name}, {action.force:.1f} N")

# %%
# What is best, 24 s and 8 s before the deadline.
height, dull = np.linspace(0, 2, 201)[:, None], np.linspace(0, 1, 101)
figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", sharey=True)
for ax, time_left in zip(axes, (24.0, 8.0), strict=True):
    action = policy.action(height=height, dullness=dull, time_left=time_left)
    shown = np.where(action.name == "grind", action.force, np.where(action.stop, np.nan, -5.0))
    image = ax.pcolormesh(dull, height.ravel(), shown, cmap="viridis", vmin=-5, vmax=50)
    ax.set(xlabel="dullness", title=f"{time_left:g} s left")
axes[0].set_ylabel("height [mm]")
figure.colorbar(image, ax=axes, label="force [N] (dark: dress, white: stop)")
plt.show()
