"""
A bead that is learned
======================

No two beads grind alike: a gain, unknown and the same in all passes of a bead, multiplies their friction, and
each pass scatters about it. A controller that learns the bead plans its next pass by what it believes: as if
that were certain, or with its doubt as one more scatter of each pass (:func:`sdpgrind.weldbead.plan`,
"certain" and "cautious"). The best plan knows that each pass will narrow the belief. It takes a third
coordinate and too much time for a controller; here it is the reference of the others, in 40 lines of
:mod:`sdpgrind.sdp`."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import sdp, weldbead

bead = weldbead.preset("P1")
process, LENGTH, RESET = bead.model, bead.bead_length, bead.reset_time
IDLE, PER_DEPTH = process.idle_power, process.specific_energy * process.bead_width  # W; J/mm^2
POWER = 1e-3 * process.friction_ratio * process.disk_radius * process.free_speed  # W/N
PASS_SD, DEPTH_SD, TIME, HEIGHT = 0.10, 0.02, 24.0, 0.5  # of a log gain; of a measured depth, mm; s; mm

# %%
# The coordinates are the height, and mean and standard deviation of the belief in the log gain. The log gain
# of the next pass is the mean, and a draw from the doubt and the scatter together. The same draw removes
# metal and teaches: a belief that moved by a draw of its own would promise too small a penalty. Only the
# error of the measured depth is a second draw. A Kalman filter of weight `k` takes both in.


def grind(s, c, e):
    power, feed = POWER * c.force, LENGTH / (c.seconds - RESET)
    off = np.sqrt(s.sd**2 + PASS_SD**2) * e.draw
    depth = np.maximum(power * np.exp(s.gain + off) - IDLE, 0.0) / (PER_DEPTH * feed)
    error = DEPTH_SD * PER_DEPTH * feed / power
    k = c.learns * s.sd**2 / (s.sd**2 + PASS_SD**2 + error**2)
    return s.height - depth, s.gain + k * (off + error * e.error), s.sd * np.sqrt(1.0 - k)


def plan(learns, points=16):
    noise = {"draw": sdp.Normal(0.0, 1.0), "error": sdp.Discrete([-1.0, 1.0])}
    step = sdp.Sampled(grind, noise, points=points)
    moves = [
        sdp.Move(
            f"{seconds:g} s",
            {"force": sdp.Levels(8.0, 50.0, 14), "seconds": [seconds], "learns": [learns]},
            step,
            duration=round(seconds / 2),
        )
        for seconds in (6.0, 10.0, 14.0, 20.0)
    ]
    axes = [
        sdp.Axis("height", 0.0, HEIGHT, 65, "mm", below="stop"),
        sdp.Axis("gain", -0.75, 0.6, 19, below="hold", above="hold"),
        sdp.Axis("sd", 0.0, 0.32, 9),
    ]
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)))
    return sdp.plan(sdp.Problem(axes, moves, [stop], sdp.Stages(12, 2.0)))


belief, drawn_afresh = plan(1.0), plan(0.0)

# %%
# The second program, whose belief stays as it is, contains all the others: a planner is the belief that it
# looks up.


def follow(decide, doubt, beads=4000):
    """Penalty of each bead, $; the believed log gain has the mean of a log-normal gain of mean 1."""
    rng, prior = np.random.default_rng(1), -(doubt**2 + PASS_SD**2) / 2
    true = prior + doubt * rng.standard_normal(beads)
    height, gain, sd, left = (np.full(beads, x) for x in (HEIGHT, prior, doubt, TIME))
    for _ in range(4):
        action = decide(
            np.maximum(height, 0.0), np.clip(gain, -0.75, 0.6), sd, left, np.clip(true, -0.75, 0.6)
        )
        going = ~action.stop
        force, seconds = np.where(going, action.force, 8.0), np.where(going, action.seconds, 6.0)
        power, per_depth = POWER * force, PER_DEPTH * LENGTH / (seconds - RESET)
        shown = true + PASS_SD * rng.standard_normal(beads)
        height -= np.where(going, np.maximum(power * np.exp(shown) - IDLE, 0.0) / per_depth, 0.0)
        error = DEPTH_SD * per_depth / power
        k = np.where(going, sd**2 / (sd**2 + PASS_SD**2 + error**2), 0.0)
        gain += k * (shown + error * rng.standard_normal(beads) - gain)
        sd, left = sd * np.sqrt(1.0 - k), left - np.where(going, seconds, 0.0)
    return np.where(height > 0, 2.0 * height, -10.0 * height)


def look_up(policy, height, gain, sd, left):
    return policy.action(height=height, gain=gain, sd=sd, time_left=left)


def planners(doubt):
    prior = -(doubt**2 + PASS_SD**2) / 2
    return {
        "never learns": lambda x, m, sd, t, b: look_up(drawn_afresh, x, prior + 0 * m, doubt + 0 * sd, t),
        "certain": lambda x, m, sd, t, b: look_up(drawn_afresh, x, m, 0 * sd, t),
        "cautious": lambda x, m, sd, t, b: look_up(drawn_afresh, x, m, sd, t),
        "belief": lambda x, m, sd, t, b: look_up(belief, x, m, sd, t),
        "gain known": lambda x, m, sd, t, b: look_up(drawn_afresh, x, b, 0 * sd, t),
    }


doubts = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
paid = {name: np.array([follow(planners(doubt)[name], doubt) for doubt in doubts]) for name in planners(0.0)}
for name, penalty in paid.items():
    less = penalty[5] - paid["belief"][5]
    error = less.std() / len(less) ** 0.5
    print(f"{name:14s}{penalty[5].mean():.4f} $, less belief {less.mean():+.4f} +- {error:.4f}")

# %%
# Certainty is dear where beads differ by more than passes do. Caution is nearly as good as the best plan,
# which begins a little lighter, since it will know more later.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for name, penalty in paid.items():
    left.plot(doubts, penalty.mean(axis=1), "o-", ms=3, label=name)
left.set(xlabel="standard deviation of the beads' log gain", ylabel="expected penalty [\\$]", ylim=(0, None))
left.legend(frameon=False)
sd = np.linspace(0.0, 0.32, 65)
for name, policy in (("cautious", drawn_afresh), ("belief", belief)):
    first = look_up(policy, HEIGHT, -(sd**2 + PASS_SD**2) / 2, sd, TIME)
    right.plot(sd, first.force, label=name)
right.set(xlabel="standard deviation of the belief", ylabel="force of the first pass [N]")
right.legend(frameon=False)
plt.show()

# %%
# What a coarse grid costs
# ------------------------
# On 65 heights, 19 gains and 9 standard deviations all planners pay some 0.01 \$ too much, as their forces
# are read between far nodes, and the promise is off by as much. ``benchmarks/bead_belief.py`` has fine grids,
# weights that are exact about the end at 0 mm, and no error of the depth: certain 0.1011, cautious 0.0373,
# belief 0.0347, known 0.0234 \$ for these beads.
promise = belief.value(height=HEIGHT, gain=-(0.25**2 + PASS_SD**2) / 2, sd=0.25, time_left=TIME)
print(f"promised {promise:.4f} $, realised {paid['belief'][5].mean():.4f} $")
