"""
Your own process
================

The solver knows nothing of grinding. Any work in steps can be planned with it, if the outcome of a step is
uncertain, the result is measured, and one may stop or go on. This page plans the honing of a bore.

A bore is 40 µm too small. Honing strokes take stock off; how much depends on the stone and scatters by 20 %.
After each round of strokes the bore is measured, which takes time. A bore that is too small has to be honed
again elsewhere, a bore that is too large is scrap. How many strokes should the next round have, and when is
the bore good?"""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp

# %%
# Axes, moves, stops, stages
# --------------------------
# A problem is made of four things. The *axis* is the state: the stock that is left, in mm. Below 0 the bore
# is too large and the process ends, and is charged for it, exactly, however far it goes.

stock = sdp.Axis("stock", 0.0, 0.040, 161, "mm", below="stop")

# %%
# A *move* is what one may do: one round of strokes. Its charge is the time of the machine: 0.02 $ a stroke,
# 0.30 $ to stop and measure. Its transition says what happens to the stock: it falls by a random amount. Such
# a ``Shift`` is the fast and exact case; the only thing to write is the law of the amount. ``c`` holds the
# controls.

PER_STROKE = 0.0004  # mm, mean


def removed(s, c):
    mean = PER_STROKE * c.strokes
    return sdp.LogNormal(mean, 0.2 * mean)


def time_charge(s, c):
    return 0.30 + 0.02 * c.strokes


hone = sdp.Move("hone", {"strokes": sdp.Levels(1, 120, 121)}, sdp.Shift("stock", removed), charge=time_charge)

# %%
# A *stop* ends it. Taguchi's square law suits a bore that should be on size: 4 µm of stock left cost 1.60 $.
# Too large is worse: it costs four times that, and scrap does not get better by being only just scrap, but
# let it be smooth here; :doc:`/words_of_warning` tells what a jump would do.

done = sdp.Stop("done", sdp.Charge(under=sdp.Quadratic(1.6 / 0.004**2), over=sdp.Quadratic(6.4 / 0.004**2)))

# %%
# *Stages* count down to a deadline. There is none here: moves go on until it is best to stop.

problem = sdp.Problem([stock], [hone], [done], sdp.Forever())
print(sdp.check(problem))

# %%
# ``check`` tries everything once on a small grid and tells all that is wrong, before a long solve. Nothing
# is. Solve it:

policy = sdp.plan(problem, tolerance=1e-3)
print(policy)
print(policy.action(stock=0.040))
print(f"expected: {policy.value(stock=0.040):.3f} $")
print(policy.simulate(runs=20_000, stock=0.040, rng=0))

# %%
# How many strokes, for how much stock? A long first round, then short ones; and below some 2 µm it is not
# worth going on.

x = np.linspace(0.0, 0.040, 801)
action = policy.action(stock=x)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
left.plot(1e3 * x, policy.value(stock=x), label="with the plan")
left.plot(1e3 * x, np.minimum(done.charge(x), 6), ":", label="stop now")
left.set(xlabel="stock left [µm]", ylabel=r"expected charge [\$]", ylim=(0, 5))
left.legend(frameon=False)
right.plot(1e3 * x, np.where(action.stop, 0, action.strokes))
right.plot(1e3 * x, x / PER_STROKE, "k:", lw=0.8, label="for all of the stock, on average")
right.set(xlabel="stock left [µm]", ylabel="strokes of the next round")
right.legend(frameon=False)

# %%
# Between whole numbers of strokes the table interpolates. Where only whole numbers make sense, give a list
# instead of ``Levels``: ``{"strokes": np.arange(1, 121)}``.
#
# A second coordinate, and a step of your own
# -------------------------------------------
# Stones glaze: the more strokes since the last dressing, the less they cut. Glazing is a second coordinate,
# and it changes how much the next round removes. Now the amount depends on where one is, so that ``Shift`` on
# the stock with a law that reads ``s.glaze`` is still right, with ``others`` telling where the glaze goes;
# but suppose the stone also cuts less the less stock is left, because the bore gets rounder and bears more.
# Then nothing shifts any more. ``Sampled`` takes any step: state ``s``, controls ``c`` and noise ``e`` in,
# next coordinates out. It is written with operators and numpy functions only, no ``if``, so that the same
# lines work on arrays and in compiled code.


def round_of_strokes(s, c, e):
    rate = PER_STROKE * np.exp(-s.glaze) * (0.7 + 0.3 * np.minimum(1.0, s.stock / 0.020))
    return s.stock - rate * c.strokes * e.cut, s.glaze + 0.004 * c.strokes


def dressing(s, c, e):
    return s.stock, 0.0 * s.glaze


axes = [sdp.Axis("stock", 0.0, 0.040, 61, "mm", below="stop"), sdp.Axis("glaze", 0.0, 1.0, 21)]
moves = [
    sdp.Move(
        "hone",
        {"strokes": np.arange(2, 121, 2.0)},
        sdp.Sampled(round_of_strokes, {"cut": sdp.LogNormal(1.0, 0.2)}, points=12),
        charge=time_charge,
    ),
    sdp.Move("dress", {"passes": [1.0]}, sdp.Sampled(dressing), charge=0.80),
]
glazing = sdp.Problem(axes, moves, [done], sdp.Forever())
print(sdp.check(glazing))

# %%
# The check found it: from a glazed stone, a long round leads beyond the end of the axis. A real stone does
# not glaze without end, so the far end holds.

glazing = sdp.Problem([axes[0], sdp.Axis("glaze", 0.0, 1.0, 21, above="hold")], moves, [done], sdp.Forever())
print(sdp.check(glazing))

# %%
# When should the stone be dressed? The plan knows: not at a certain age, but when the work that is left is
# worth it.

policy = sdp.plan(glazing)
s, g = np.meshgrid(np.linspace(0.0005, 0.040, 159), np.linspace(0.0, 1.0, 101), indexing="ij")
action = policy.action(stock=s, glaze=g)
figure, ax = plt.subplots(figsize=(7, 3.8), layout="constrained")
strokes = np.where(action.name == "hone", action.strokes, np.nan)
image = ax.pcolormesh(1e3 * s, g, strokes, cmap="viridis", rasterized=True)
figure.colorbar(image, ax=ax, label="strokes of the next round")
ax.contourf(1e3 * s, g, action.name == "dress", levels=[0.5, 1.5], colors=["#d95f02"], alpha=0.6)
ax.contourf(1e3 * s, g, action.name == "done", levels=[0.5, 1.5], colors=["0.8"])
ax.set(xlabel="stock left [µm]", ylabel="glaze of the stone")
ax.set_title("grey: stop; orange: dress first", loc="left", fontsize=10)

# %%
# How much a simplification costs is a question of two plans: solve both, and follow the simple one on the
# richer truth. What the solver can do besides (deadlines, modes, several stops, three coordinates, a late
# side) is in the reference of :mod:`sdpgrind.sdp`.
