"""
What an experiment says
=======================

Eighteen specimens, four factors: which tool, path, feed and force leave the smoothest surface? Taguchi's
arrays answer that with few runs. They answer many other questions as well, whether or not the data can. Here
is what these eighteen say, and what not."""

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import finishing, units

# %%
# The readings
# ------------
# Wang and Jan (2001) ground one specimen at each of 18 settings of an L18. Any two factors meet in all
# combinations equally often, so the mean at a level can be compared with the mean at another as if nothing
# else had been changed.
study = finishing.Study.published("wang-2001")
print(study.level_means())
study.plot()

# %%
# The ratio is -20 log10 of the roughness over 10 µm: more is better, 6 dB more is half the roughness. It is
# called signal to noise, but of one specimen a setting it holds no noise. It is the reading on another scale.
#
# What has an effect
# ------------------
# F compares what a factor changes with what nothing explains. Three factors stand out by 45 to 72 times; the
# feed changes less than chance does. Its *pure* share is negative, which is shown as it is and means:
# nothing.
print(study.anova())

# %%
# Such a factor may be counted as error ("pooled"). That is a rule that is named, applied once and recorded.
# Pooling until something becomes significant finds something in any data.
pooled = study.anova(pool="F<1")
print(pooled.pooling.names, "counted as error;", pooled.error.df, "degrees of freedom")

# %%
# The best settings
# -----------------
# For each factor the level of the highest mean, and which others these data cannot tell from it. The paper
# recommends 1.667 N. 1.111 N was 0.155 dB (2 %) better on average, which is what chance does two times in
# three.
best = study.best(pool="F<1")
print(best)

# %%
# What is to be expected there, and where a run that confirms it has to fall. The second interval is the one
# to bring to the machine: a reading in it confirms the analysis, one outside says that factors do not simply
# add up.
print(study.predict(best, confirm=1))

# %%
# Would it come out again?
# ------------------------
# The whole experiment, repeated 2000 times on a simulated process that has the effects of the real one and
# its scatter:
power = study.power(rng=0)
print(power)

# %%
# The order of the factors can be relied on. One repetition in twenty finds an effect of the feed that is not
# there: that is what p < 0.05 means. And in one of three the larger force wins. So nobody should move a
# machine for that difference.
#
# Where to look next
# ------------------
# A parabola through the forces has its top between two of them. Three more runs near there are worth more
# than the best of the levels; each comes with what it should read if that is right.
print(study.next_runs(3))

# %%
# A law instead of a number
# -------------------------
# The same readings as a law of the roughness: a median for each setting, and a scatter of 6.7 % that no
# setting takes away. This is what a planner needs who has to decide for each specimen whether to finish it
# again.
model = finishing.roughness.RoughnessModel.published()
law = model.law("hilbert5", tool_diameter=4.0, normal_force=model.best_force())
print(
    f"best force {model.best_force():.2f} N: mean {1e3 * law.mean:.2f} µm, standard deviation {1e3 * law.sd:.2f} µm"
)
alone = finishing.roughness.leave_one_out(study)
print(
    f"each run predicted from the others: {100 * alone.rms_log:.1f} % off (rms), at worst {100 * alone.worst_error:.0f} %"
)
try:
    model.law("hilbert5", tool_diameter=6.0, normal_force=1.3)
except ValueError as error:
    print(error)
force = np.linspace(0.556, 1.667, 60)
figure, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
for pattern in ("hilbert5", "zigzag", "hilbert4"):
    median = 1e3 * model.median(pattern, tool_diameter=4.0, normal_force=force)
    (line,) = ax.plot(force, median, label=pattern)
    ax.fill_between(
        force, median * np.exp(-2 * model.residual_sd), median * np.exp(2 * model.residual_sd), alpha=0.2
    )
    settings = study.settings
    ours = (settings["pattern"] == pattern) & (settings["tool_diameter"] == 4.0)
    ax.plot(settings["normal_force"][ours], 1e3 * study.readings[ours, 0], "o", color=line.get_color())
ax.set(xlabel="normal force [N]", ylabel="R_a with the tool of 4 mm [µm]", ylim=(0, None))
ax.legend(frameon=False, fontsize=8)

# %%
# An experiment of one's own
# --------------------------
# Levels by value, in the order of the columns. A run that failed may be missing: then the means no longer
# balance, and a general linear model takes over, which is said. ``report`` tells all of the above as one
# text.
readings = [5.1, 4.0, 4.4, 4.9, 3.9, 3.1, np.nan, 3.5, 3.0]
factors = {"grit": (240, 400, 600), "feed_rate": (10.0, 20.0, 30.0)}
own = finishing.Study(
    "L9",
    factors,
    units.um(1.0) * np.array(readings),
    name="roughness R_a",
    unit="mm",
    reference=units.um(10.0),
)
print(own.report())

# %%
# Nothing is significant here, and one repetition in three would rank the two factors otherwise: eight
# readings are too few for effects of this size. Better to know that before the machine is set by them.
plt.show()
