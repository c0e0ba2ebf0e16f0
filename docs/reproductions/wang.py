"""
Wang and Jan (2001): robot-assisted finishing
=============================================

What the paper prints beside what its own inputs give and what this library computes. Its figures hold no
numbers, and of the specimen, the robot and the encoder it prints nothing.

*reproduced*
    computed here from inputs that the source prints; agrees to the last printed digit.
*printed value wrong*
    the printed inputs give something else; why is said.
*cannot be reproduced*
    an input is missing, or no number is printed.
*ours*
    not in the source: a number of this library, checked in another way (closed form, least squares, an
    independent program).

What is correct is known beforehand; this page fails where it does not come out.
"""

import matplotlib.pyplot as plt
import numpy as np
from published import Published

from sdpgrind import finishing, units

page = Published()
row, missing = page.row, page.missing

# %%
# The experiment: Tables 2 and 3
# ------------------------------
# The printed ratios are those of the roughness over 10 µm. The sums of squares must be made from the
# roughness, not from the rounded ratios.
study = finishing.Study.published("wang-2001")
PRINTED = [6.021, 9.119, 8.519, 1.671, 4.437, 4.437, 7.432, 5.597, 3.414]
PRINTED += [6.936, 4.082, 6.021, 2.499, 3.414, -0.424, 3.414, 0.677, 3.742]
ratios = finishing.study.sn_ratio(study.readings, reference=units.um(10.0))
row("S/N of 18 runs: largest difference [dB]", "0.000", 0.0, float(np.max(np.abs(ratios - PRINTED))), 5e-4)
row(
    "S/N of 5 µm as the formula is printed [dB]",
    "6.021",
    -13.979,
    float(finishing.study.sn_ratio([5.0])),
    1e-3,
    "it is over 10 µm",
)

table = study.anova()
TABLE_3 = {
    "tool_diameter": ("22.862", 22.86223, "20.2", 20.2, 22.497, 19.907, 62.536),
    "pattern": ("52.549", 52.54950, "46.5", 46.5, 51.818, 45.854, 71.870),
    "feed_rate": ("0.453", 0.45308, "0.4", 0.4, -0.278, -0.246, 0.620),
    "normal_force": ("33.487", 33.48709, "29.6", 29.6, 32.756, 28.986, 45.799),
}
for name, (ss, exact, *_) in TABLE_3.items():
    row(f"sum of squares, {name} [dB²]", ss, exact, table[name].ss, 1e-5)
row("sum of squares, error [dB²]", "3.656", 3.65585, table.error.ss, 1e-5)
row("sum of squares, total [dB²]", "113.008", 113.00775, table.total.ss, 1e-5)
row("degrees of freedom, error", "empty", 10, table.error.df, 0, "18 runs less 1 less 7 of the factors")
row("degrees of freedom, total", "7", 17, table.total.df, 0, "18 runs less 1; 7 are those of the factors")
for name, (_, _, share, percent, *_) in TABLE_3.items():
    row(f"contribution, {name} [%]", share, percent, 100 * table[name].contribution, 0.05)
row(
    "contribution, error [%]",
    "3.3",
    3.235,
    100 * table.error.contribution,
    1e-3,
    "it is 100 less the others, rounded",
)
for name, (ss, _, _, _, pure, _, _) in TABLE_3.items():
    row(f"pure sum of squares, {name} [dB²]", ss, pure, table[name].pure_ss, 1e-3, "it is the plain one")
for name, (*_, percent, _) in TABLE_3.items():
    row(f"pure contribution, {name} [%]", "-", percent, 100 * table[name].pure_contribution, 1e-3)
row("pure contribution, error [%]", "-", 5.500, 100 * table.error.pure_contribution, 1e-3)
for name, (*_, ratio) in TABLE_3.items():
    row(f"F, {name}", "-", ratio, table[name].F, 1e-3)

# %%
# The best levels
# ---------------
# The paper takes 1.667 N. The means of its own readings are higher at 1.111 N, by an amount that these
# readings cannot tell from nothing. The feed has no effect that they show.
best = study.best()
means = study.level_means()["normal_force"]
row("mean S/N at 1.111 N [dB]", "-", 5.541, means[1.111], 1e-3)
row("mean S/N at 1.667 N [dB]", "-", 5.386, means[1.667], 1e-3)
row("best force [N]", "1.667", 1.111, best["normal_force"], 0.0, "1.111 N is 0.155 dB better, a tie")
row("chance of that difference without an effect", "-", 0.67, best.ties[0].p, 0.01)
kept = {"tool_diameter": 4.0, "pattern": "hilbert5", "normal_force": 1.111}
found = study.predict(kept, confirm=1)
row("4 mm, order 5, 1.111 N: S/N [dB]", "-", 8.951, found.mean, 1e-3)
row("the same as roughness [µm]", "-", 3.568, 1e3 * found.response, 1e-3)
row("as good as how many runs", "-", 3.0, found.n_eff, 1e-9)
row("95 % of the mean, +- [dB]", "-", 0.736, found.ci_mean, 1e-3)
row("95 % of one run that confirms, +- [dB]", "-", 1.472, found.ci_confirm, 1e-3)
for force, correct in ((1.667, 8.957), (1.111, 9.113)):
    every = study.predict({**kept, "feed_rate": 12.5, "normal_force": force}, confirm=1)
    row(f"with 12.5 mm/s and {force} N: S/N [dB]", "-", correct, every.mean, 1e-3)
    row("its 95 %, +- [dB]", "-", 0.898, every.ci_mean, 1e-3)
missing("run that confirms the best levels", "none", "none was made")

# %%
# Roughness as a law
# ------------------
# Not in the paper: least squares through the logarithms of its 18 readings. Left out one at a time, they are
# predicted to 8 %.
estimate = finishing.identify(study, "roughness")
LAW = {
    "intercept": (1.865764, 0.0355),
    "hilbert5": (-0.473250, 0.0389),
    "zigzag": (-0.158149, 0.0389),
    "tool_exponent": (-0.902040, 0.1104),
    "force_slope": (-0.154618, 0.0532),
    "force_bend": (0.489693, 0.1213),
}
model = finishing.roughness.RoughnessModel.published()
for (name, (correct, error)), standard in zip(LAW.items(), model.standard_errors, strict=True):
    row(f"ln R_a: {name}", "-", correct, estimate[name], 1e-5)
    row("its standard error", "-", error, float(standard), 1e-4)
row("scatter of ln R_a", "-", 0.06737, estimate["residual_sd"], 1e-5)
row("force of least roughness [N]", "-", 1.301, model.best_force(), 1e-3)
alone = finishing.roughness.leave_one_out(study)
row("left out: share of the variance predicted", "-", 0.918, alone.q_squared, 1e-3)
row("left out: rms of ln R_a", "-", 0.0825, alone.rms_log, 1e-4)
row("left out: rms [µm]", "-", 0.481, 1e3 * alone.rms, 1e-3)
power = study.power(rng=0, model=model)
row("2000 repetitions: same order of factors", "-", 0.86, power.ranking_returned, 0.03)
row("2000 repetitions: feed found, wrongly", "-", 0.053, power.significant["feed_rate"], 0.02)
row("2000 repetitions: 1.667 N beats 1.111 N", "-", 0.34, power.beats("normal_force", 1.667, 1.111), 0.04)

# %%
# Controller and observer
# -----------------------
# The printed gains are three equal poles each, at -61 and -40 1/s: the observer is slower than the loop
# around it. Both together have none of these poles. The loop answers 3.7 times more slowly than was designed,
# and overshoots more.
axis = finishing.TorqueAxis()
printed, designed = (
    finishing.torque.PidffGains(),
    finishing.torque.PidffGains.of_poles(axis, pole=61.0, observer_pole=40.0),
)
PRINTED_GAINS = {
    "kp": "299.3636",
    "ki": "226981",
    "kd": "183",
    "obs_kp": "5.28",
    "obs_ki": "70.4",
    "obs_kd": "0.132",
}
for name, digits in PRINTED_GAINS.items():
    row(f"{name} from poles at -61, -40 1/s", digits, float(digits), float(getattr(designed, name)), 1e-4)
of_torque = (printed.kd, printed.kp + axis.contact_angular_stiffness / axis.inertia, printed.ki)
observed = finishing.torque.observed_torque(axis)
for k in range(3):
    row(f"(8): denominator over J, s^{2 - k}", "-", (183.0, 11163.0, 226981.0)[k], of_torque[k], 1e-4)
for k in range(3):
    ours = float(observed.denominator[k + 1]) / axis.inertia
    row(f"(10): denominator over J, s^{2 - k}", "-", (120.0, 4800.0, 64000.0)[k], ours, 1e-9 * ours)

POLES = {"pid": (-16.54 + 8.88j, -20.55 + 45.68j, -114.41 + 57.79j), "state": (-0.97 + 17.21j,)}
loops = {
    form: finishing.TorqueController(axis, normal_force=1.111, observer=form)
    for form in ("pid", "state", "ideal")
}
for form, correct in POLES.items():
    upper = [complex(pole) for pole in loops[form].poles.continuous if pole.imag > 0]
    for pole, ours in zip(correct, upper, strict=False):
        row(f"with the observer ({form}) [1/s]", "-", pole, ours, 1e-2)
softer = axis.replace(contact_angular_stiffness=0.5 * axis.contact_angular_stiffness)
row(
    "state form, contact half as stiff: stable",
    "-",
    "no",
    "yes" if loops["state"].poles_at(softer).stable else "no",
)

for after, correct in (
    (0.01, 0.327386),
    (0.02, 0.784010),
    (0.05, 1.248753),
    (0.1, 1.067533),
    (0.15, 1.007815),
):
    row(
        f"step of (8) after {1e3 * after:g} ms",
        "-",
        correct,
        float(finishing.torque.contact_step(after)),
        1e-6,
    )
figures = finishing.torque.step_figures(finishing.torque.contact_step)
row("step of (8): overshoot [%]", "-", 24.894, 100 * figures.overshoot, 1e-3)
row("step of (8): peak [ms]", "-", 49.18, 1e3 * figures.peak_time, 0.1)
row("step of (8): within 2 % [ms]", "-", 129.3, 1e3 * figures.settling, 0.1)
together = finishing.torque.step_figures(loops["pid"].loop())
row("with the observer: overshoot [%]", "-", 33.5, 100 * together.overshoot, 0.335)
row("with the observer: within 2 % [ms]", "-", 211.5, 1e3 * together.settling, 2.1)
missing("contact torque while finishing", "none", "no trace is printed")

# %%
# What a load torque does
# -----------------------
# "The steady-state error will disappear": only if the true contact torque were fed back. Current and angle
# show the sum of contact and load torque. The loop brings that sum to its target, the estimate has no error,
# and the contact lacks all of the load.
for form, correct in (("ideal", 0.0), ("pid", -1.0), ("state", -1.0)):
    ours = float(loops[form].loop().dc_gain("load_torque")[0])
    row(
        f"contact over a lasting load ({form})",
        "= 0",
        correct,
        ours,
        1e-9,
        "the observer takes it for contact",
    )
ours = float(loops["pid"].loop().dc_gain("load_torque")[1])
row("estimate over a lasting load (pid)", "-", 0.0, ours, 1e-9)
slow = 1e-5  # rad/s
lag = abs(loops["ideal"].loop().response(slow, "load_torque")[0]) / slow
row(
    "(7): error over the rate of a load that rises [s]",
    "= 0",
    0.04786,
    float(lag),
    1e-5,
    "k_e/(J k_fi) is missing in (7)",
)

# %%
# Digital limits
# --------------
# The smallest step of the command is not what the observer can tell: that is one count of the encoder. The
# paper does not print how many counts it has; 20 000 in a turn are assumed here.
REASON = "the step of the current was rounded first"
# N, the weight of a gram as the source has it; in N m it is that of a kilogram at a millimetre
GRAM = 9.81e-3
LIMITS = {
    "step of the current [mA]": ("2.44", 2.4414, 1e3 * axis.current_step, ""),
    "step of the torque [mN m]": ("0.4514", 0.45166, 1e3 * axis.torque_step, REASON),
    "step of the torque [kgf mm]": ("0.04601", 0.046041, axis.torque_step / GRAM, REASON),
    "step of the force [gf]": ("0.48", 0.48464, axis.force_step / GRAM, ""),
    "greatest torque [kgf mm]": ("18.9", 18.858, axis.torque_max / GRAM, ""),
    "greatest force [gf]": ("199", 198.51, axis.force_max / GRAM, ""),
}
for name, (digits, correct, ours, why) in LIMITS.items():
    row(name, digits, correct, ours, 1e-4 * correct, why)
row(
    "greatest force at the 1.2 A of Table 1 [gf]",
    "-",
    238.2,
    axis.replace(current_limit=1.2).force_max / GRAM,
    0.05,
)
missing(
    "least force that the observer can tell (gf)",
    "0.48",
    "counts of the encoder are not printed; 0.48 is the command's",
)
row("the same, with 20 000 counts [N]", "-", 0.040, axis.force_resolution, 1e-3)

# %%
# Force from torque
# -----------------
# F = T/R holds where the tool lies flat on the surface. At 30 degrees and a friction ratio of 0.3 the same
# torque presses with 2 % less where the tool is dragged, and with 40 % more where it is pushed. And a tool
# that turns into the feed, as the contact angle is defined, makes this kind of robot carry the work around
# its base at each corner: there is no joint that yaws the wrist.
CASES = (
    ("dragged", 0.3, False, 0.984),
    ("pushed", 0.3, True, 1.397),
    ("without friction", 0.0, False, 1.155),
)
for name, friction, pushed, correct in CASES:
    torque = finishing.arm.torque_per_force(
        units.deg(30), axis.lever_arm, friction_ratio=friction, pushed=pushed
    )
    ours = axis.lever_arm / 1e3 / torque
    row(
        f"F R/T at 30 degrees, {name}",
        "= 1",
        correct,
        float(ours),
        1e-3,
        "contact angle and friction are left out",
    )
contact = {"contact_angle": units.deg(30), "lever_arm": axis.lever_arm, "heading": "feed_aligned"}
for name, feed, correct in (("corner", (0.0, 1.0, 0.0), 734.0), ("reversal", (-1.0, 0.0, 0.0), 1038.0)):
    ends = [
        finishing.arm.tool_poses([(0.0, 0.0, 0.0)], [each], [(0.0, 0.0, 1.0)], **contact)
        for each in ((1.0, 0.0, 0.0), feed)
    ]
    jump = float(np.hypot(*finishing.arm.corner_jumps(finishing.Arm.generic(), ends).table[0]))
    row(f"heading along the feed: table at a {name} [mm]", "-", correct, jump, 1.0)
missing("poses of the A530", "photographs", "lengths and limits of the robot are not printed")

# %%
# Paths
# -----
# The substitution rules are right. What R draws is misprinted: the curve runs over itself. As L already draws
# four nodes at order 0, the order of the paper is one less than ours; if it counts otherwise in its Table 2,
# nothing printed tells.
plate = finishing.surface.flat_surface(1.0)
for order in range(1, 8):
    nodes = finishing.path.hilbert_nodes(order)
    steps = np.diff(nodes, axis=0)
    turns = int(np.sum(np.any(steps[1:] != steps[:-1], axis=1)))
    every = len({tuple(node) for node in nodes.tolist()})
    row(f"order {order}: nodes, each once", "-", 4**order, every)
    row(f"order {order}: corners", "-", 4 * (4**order - 1) // 5, turns)
for order in (3, 5):
    side = 2**order
    for edge, correct in ((False, side - 1 / side), (True, side + 1.0)):
        length = finishing.hilbert(plate, order, mapping="parametric", edge=edge).length
        row(
            f"order {order}: length over side, {'to the edges' if edge else 'middles of cells'}",
            "-",
            correct,
            length,
            1e-9,
        )
for order, correct in ((2, 14), (3, 37), (4, 74)):
    drawn = finishing.path.hilbert_lsystem(order, printed=True)
    different = len({tuple(node) for node in drawn.tolist()})
    row(
        f"as printed: different nodes of {len(drawn)}",
        str(len(drawn)),
        correct,
        different,
        0,
        "R must draw -F+F+F-",
    )
missing("figures 3 to 7", "pictures", "no numbers of surface, specimen and pitch")

# %%
# Feed that is commanded and feed that is had
# -------------------------------------------
# Four nodes in five of a fractal path are corners. A robot that stops at each of them never comes near to the
# commanded feed, which may be why it has no effect in Table 3.
for feed, correct in ((12.5, 0.56), (25.0, 0.28), (37.5, 0.19)):
    law = finishing.timing.Trapezoid(0.2, speed_max=feed, acceleration=1000.0)
    row(f"0.2 mm from rest to rest: mean over {feed} mm/s", "-", correct, law.mean_share, 5e-3)

page.show()

# %%
# The path as it is printed, and as it must be
# --------------------------------------------
figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
for ax, misprinted in zip(axes, (True, False), strict=True):
    drawn = finishing.path.hilbert_lsystem(3, printed=misprinted)
    different = len({tuple(node) for node in drawn.tolist()})
    ax.plot(*drawn.T, "-o", ms=3, lw=1, color="#b04a3a" if misprinted else "#4878a8")
    ax.set(
        title=f"{'as printed' if misprinted else 'correct'}: {different} of 64 nodes",
        aspect="equal",
        xticks=[],
        yticks=[],
    )

# %%
# The step as it was designed, and as it is
# -----------------------------------------
# A quarter of overshoot is there by design, since (8) has a zero at -20 1/s; a prefilter takes it away. The
# rest is the slow observer: with one of three times the pole of the loop it is gone.
time = np.linspace(0.0, 0.3, 601)
faster = finishing.TorqueController(
    axis, normal_force=1.111, gains=finishing.torque.PidffGains.of_poles(axis, pole=61.0)
)
figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
ax.plot(
    1e3 * time,
    finishing.torque.triple_pole_step(time, prefilter=True),
    "0.5",
    ls=":",
    label="the same with a prefilter",
)
ax.plot(
    1e3 * time, loops["pid"].loop().step_response(time)[:, 0], "#b04a3a", label="with the printed observer"
)
ax.plot(
    1e3 * time,
    faster.loop().step_response(time)[:, 0],
    "#4878a8",
    lw=3,
    label="with an observer of three times the pole",
)
ax.plot(
    1e3 * time, finishing.torque.contact_step(time), "0.1", ls="--", lw=1, label="(8): true torque fed back"
)
ax.axhline(1.0, color="0.7", lw=0.8)
ax.set(xlabel="time [ms]", ylabel="contact torque over command")
ax.legend(frameon=False, fontsize=8)
plt.show()
