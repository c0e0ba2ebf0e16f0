"""
Mears (2006): friction and whole cycles
=======================================

What chapters 5 and 6 of the thesis print of the friction that a push tells, and of cycles, beside what its own
inputs give and what this library computes.

What the words of the table mean is said on :doc:`mears_motion`. Where the tables of the thesis cannot be had
from its inputs, they stand beside both sets of parameters that are offered here: ``printed``, what it prints,
and ``identified``, what was fitted to its tables. Its traces survive as captions only. The page fails where
what is correct does not come out.
"""

import math

import numpy as np
from published import Published

import centering
import hwsim
from sdpgrind import units

page = Published()
row, missing, beyond = page.row, page.missing, page.beyond
PRESETS = {name: centering.preset(name) for name in ("printed", "identified")}
RAPID = units.mm_per_min(5000)  # mm/s: of the slide

# %%
# Friction from a push: Tables 6.2 and 6.3
# ----------------------------------------
# The formulas hold for one part and fast pushes. The forces are used as read: with the correction of 14.1 N,
# which the text speaks of, the first would be 0.231.
PRINTED = centering.friction.PrintedFriction()
TABLE_6_2 = {
    "dry": {
        500: (46.1, "0.134", 265, "0.018"), 1000: (80.2, "0.187", 613, "0.086"), 2000: (127.3, "0.147", 1240, "0.186"),
        3000: (181.0, "0.152", 2844, "0.165"), 4000: (232.0, "0.139", 5215, "0.145"), 5000: (283.9, "0.133", 8175, "0.133"),
    },
    "oily": {
        500: (42.1, "0.107", 267, "0.016"), 1000: (79.7, "0.183", 590, "0.193"), 2000: (136.3, "0.209", 1240, "0.186"),
        3000: (183.7, "0.171", 2875, "0.162"), 4000: (236.8, "0.172", 5475, "0.134"), 5000: (285.9, "0.147", 8620, "0.122"),
    },
}  # fmt: skip
MEASURED = {"dry": 0.141, "oily": 0.135}
errors = {}
for surface, table in TABLE_6_2.items():
    for rate, (force, by_force, slide, by_slide) in table.items():
        speed = units.mm_per_min(rate)
        correct = (force - 0.0529 * rate) / 146.2
        # forces to 0.1 N
        read = None if abs(float(by_force) - correct) <= 5e-4 else (correct - 8.4e-4, correct + 8.4e-4)
        found = PRINTED.from_force(force, speed)
        row(f"Table 6.2, {surface}, {rate} mm/min: mu by force", by_force, correct, found, 5e-4, within=read)
        errors[surface, rate] = [100 * (found / MEASURED[surface] - 1)]
        correct = 0.3415 - math.sqrt((slide - 0.00041 * rate**1.8997) / (0.07379 * rate**1.6428))
        found = PRINTED.from_slide(slide / 1e3, speed)
        row(
            f"Table 6.2, {surface}, {rate} mm/min: mu by slide",
            by_slide,
            correct,
            found,
            5e-4,
            "0.093 is meant: its error is so",
        )
        errors[surface, rate].append(100 * (found / MEASURED[surface] - 1))
RECOMPUTED = {
    500: (-20.7, -88.0),
    1000: (35.8, -30.8),
    2000: (54.5, 37.5),
    3000: (26.7, 20.2),
    4000: (27.7, -0.5),
    5000: (8.4, -9.9),
}
SHOWN = {
    500: (-19.9, -84.3),
    1000: (34.3, -29.5),
    2000: (52.5, 36.1),
    3000: (25.7, 19.5),
    4000: (26.7, -0.4),
    5000: (8.3, -9.5),
}
for rate, correct in RECOMPUTED.items():
    for k, what in enumerate(("force", "slide")):
        name = f"Table 6.2, oily, {rate} mm/min: error by {what} [%]"
        row(
            name,
            f"{SHOWN[rate][k]:.1f}",
            correct[k],
            errors["oily", rate][k],
            0.2,
            "divided by the dry 0.141",
        )
row("largest error by force, oily [%]", "53", 54.5, errors["oily", 2000][0], 0.1, "divided by the dry 0.141")
newton = 0.0189 * 9807.0
row("mu of 27.6 N at 18.9 kg", "0.141", 0.149, 27.6 / newton, 5e-4, "0.141 is for 20.0 kg")
row("mu of 26.5 N at 18.9 kg", "0.135", 0.143, 26.5 / newton, 5e-4, "0.135 is for 20.0 kg")
for surface, published, correct, off in (("dry", "0.133", 0.13312, 5.6), ("oily", "0.131", 0.13097, 3.0)):
    force, _, slide, _ = TABLE_6_2[surface][5000]
    found = PRINTED.combine(force, slide / 1e3, RAPID)["mu_static"]
    row(f"Table 6.3, {surface}: mu", published, correct, found, 1e-4)
    said, why = {"dry": ("5.2", "it is of an unrounded 0.1405"), "oily": ("2.9", "3.0")}[surface]
    row(f"Table 6.3, {surface}: error [%]", said, off, 100 * (1 - found / MEASURED[surface]), 0.05, why)
    best = PRINTED.combine(force, slide / 1e3, RAPID, weights="minimum_variance")
    both = np.array([PRINTED.from_force(force, RAPID), PRINTED.from_slide(slide / 1e3, RAPID)])
    # for 1 N and 50 µm
    weight = np.array([146.2 / 1.0, PRINTED.slide_sensitivity(both[1], RAPID) / 0.05]) ** 2
    row(
        f"{surface}: mu with weights of least variance",
        "-",
        float(weight @ both / weight.sum()),
        best["mu_static"],
        1e-12,
    )

# %%
# The model, told the measured friction, does not give what was read in Table 6.2 either. With the printed
# parameters forces are a third too high and slides a quarter too short at 5000 mm/min; the fitted ones, whose
# viscous friction is three times as much, are right in the force of fast pushes and give half of the slide.
# So what the general estimator finds of one pair of readings depends on the speed: one friction does not
# explain them.
for name, problem in PRESETS.items():
    doubted = problem.replace(scatter=problem.scatter.replace(friction_part_sd=0.5))
    print(
        f"{name}: mm/min, model at mu 0.141 (peak [N], slide [µm]), read when dry, mu_static and mu_kinetic of these readings"
    )
    for rate, (force, _, slide, _) in TABLE_6_2["dry"].items():
        profile = centering.TipProfile.constant_speed(units.mm_per_min(rate), 0.4)
        trace = centering.simulate_push(
            problem.model.replace(mu_static=0.141, mu_kinetic=0.75 * 0.141), profile
        )
        friction = centering.FrictionEstimator(
            doubted, ratio_sd=0.3, force_sd=5.0, position_sd=0.05, model_error=0.1
        )
        friction.update(profile=profile, peak_force=force, free_slide=slide / 1e3)
        mu = friction.estimate
        told = f"{rate:5d} {trace.peak_force:8.1f} {1e3 * trace.free_slide:8.0f} {force:8.1f} {slide:8d}"
        print(f"{told} {mu['mu_static']:8.3f} {mu['mu_kinetic']:8.3f}")
    model = problem.model.replace(mu_static=0.141, mu_kinetic=0.75 * 0.141)
    last = centering.simulate_push(model, centering.TipProfile.constant_speed(RAPID, 0.4))
    peak, way = {"printed": (365.9, 6126), "identified": (303.9, 3672)}[name]
    beyond(
        "Table 6.2, dry, 5000 mm/min: peak force [N]",
        "283.9",
        peak,
        last.peak_force,
        0.1,
        f"{name} parameters, mu 0.141",
    )
    beyond(
        "Table 6.2, dry, 5000 mm/min: slide [µm]",
        "8175",
        way,
        1e3 * last.free_slide,
        1.0,
        f"{name} parameters, mu 0.141",
    )

# %%
# Whole cycles: Table 5.4
# -----------------------
# Where parts were placed, how fast the table turned and how much pushes scattered is not said. What can be
# checked: a push takes about a turn. The simulated machine, with the scatter assumed here and at 30 rpm, and
# the controller as the source describes it:
for part, (mean_time, pushes) in enumerate(((28.0, 10.8), (25.5, 10.0), (24.6, 9.3), (29.1, 8.9)), 1):
    row(f"part {part}: turns a push at 20 1/min (0.7 to 1.1)", "-", 0.9, mean_time / pushes / 3.0, 0.2)
row("17.5 s, 9 pushes: slowest table [1/min]", "20", 30.9, 60 * 9 / 17.5, 0.1, "more than a turn a push")
for name, problem in PRESETS.items():
    for number, mass, radius, published in (
        (1, 0.77, 61.95, "28.0 s, 10.8 pushes"),
        (4, 18.9, 89.5, "29.1 s, 8.9 pushes"),
    ):
        ring = problem.replace(part=centering.push.Part(mass, radius), pushes_max=20)
        controller = centering.PrintedController(ring, spindle_speed=units.rpm(30))
        outcome = hwsim.run(hwsim.CenteringMachine(ring), controller, parts=5, rng=0).outcome
        done = outcome.finished.values == 1
        told = f"{name}: {done.sum()} of 5 done by 20 pushes"
        if done.any():
            told += f", in {outcome.time.values[done].mean():.1f} s and {outcome.pushes.values[done].mean():.1f} pushes"
        missing(f"Table 5.4, part {number}, {mass:g} kg", published, told)

# %%
# With the heavy part the reason is the jump of stick and slip, 15 µm of the printed parameters and 71 µm of
# the fitted ones, while the window of the tolerance is 5 µm wide. That the real machine came there in 8.9
# pushes says that its jump was smaller, or its scatter larger, than its model says.
for name, correct in (("printed", 15.446), ("identified", 70.581)):
    row(
        f"{name}: jump of stick and slip, 18.9 kg [µm]",
        "-",
        correct,
        1e3 * PRESETS[name].model.stick_slip_quantum,
        5e-3,
    )

page.show()
