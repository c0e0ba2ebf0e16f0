"""
Mears (2006): pushing a ring to the centre
==========================================

What chapters 3, 5 and 6 of the thesis print of motion, pushes, friction and cycles, beside what its own
inputs give and what this library computes. Its traces survive as captions only. Where its tables cannot be
had from its inputs, they stand beside both sets of parameters that are offered here: ``printed``, what it
prints, and ``identified``, what was fitted to its tables.

*reproduced*
    computed here from inputs that the source prints; agrees to the last printed digit.
*printed value wrong*
    the printed inputs give something else; why is said.
*cannot be reproduced*
    the printed inputs do not give it, or an input is missing; what they do give is said.
*ours*
    not in the source: a number of this library, checked in another way.

What is correct is known beforehand; this page fails where it does not come out.
"""

import math

import matplotlib.pyplot as plt
import numpy as np
from published import Published
from scipy import integrate

import centering
import hwsim
from sdpgrind import units

page = Published()
row, missing, beyond = page.row, page.missing, page.beyond
PRESETS = {name: centering.preset(name) for name in ("printed", "identified")}
printed, identified = PRESETS.values()
RAPID, ACCELERATION = units.mm_per_min(5000), 2560.0  # mm/s, mm/s^2: of the slide


def degrees(angle):
    return math.degrees(angle)


# %%
# How fast a rim moves
# --------------------
# Its greatest speed is not the offset times the speed of the table, and has no closed form.
psi = np.linspace(0.0, np.pi, 200001)
along = 25.0 * np.sin(psi)
dense = float(np.max(along + along * 25.0 * np.cos(psi) / np.sqrt(30.0**2 - along**2)))
slope = centering.push.turning.max_rim_slope(offset=25.0, radius=30.0)
row("offset 25, radius 30 mm: rim speed over table speed [mm]", "-", 34.86100, slope, 3.5e-5)
row("the same, by 200 000 places", "-", dense, slope, 1e-7)
slippery = printed.replace(mu_static=0.05, mu_kinetic=0.04)
rpm = centering.push.turning.spindle_speed_limit(slippery, offset=25.0).all["friction"] / units.rpm(1)
row("(3.9): greatest table speed at mu 0.05, 25 mm [1/min]", "42.3", 42.2916, rpm, 1e-4)
speed = slope * units.rpm(42.2916)
row(
    "(3.3): rim speed [mm/s]",
    "154.3",
    154.39,
    speed,
    5e-3,
    "no speed is stated; it belongs to (3.9), 42.29 1/min with g = 9.807",
)
row(
    "the same at the working speed of 20 1/min [mm/s]",
    "154.3",
    73.013,
    slope * units.rpm(20),
    5e-4,
    "see above",
)
stop = centering.push.stopping_way(274.3, ACCELERATION)
row("(3.5): stopping from 274.3 mm/s [s]", "0.11", 0.10715, stop.time, 1e-5)
row("(3.6): the same [mm]", "14.7", 14.6954, stop.distance, 1e-4)
closing = {"offset": 25.0, "radius": 30.0, "spindle_speed": units.rpm(42.2916), "slide_speed": 120.0}
nearer = centering.push.turning.closing_distance(**closing, acceleration=ACCELERATION)
row(
    "how much nearer the rim really comes [mm]",
    "14.7",
    15.586,
    nearer,
    1e-3,
    "the slide brakes its own speed only, and withdraws more slowly than the rim comes",
)

# %%
# Stiffness and restitution
# -------------------------
# Table 3.1 is all that is said of the stiffness; the model takes 1.2 N/µm, and 0.729 N/µm come nearest to its
# results. Through the origin the line of least squares is 3 % steeper.
DISTANCE = np.array([10, 15, 20, 25, 30, 35]) / 1e3  # mm
FORCE = np.array([10.7, 16.0, 22.4, 31.0, 37.4, 40.6])  # N
row(
    "Table 3.1: stiffness [N/µm]",
    "1.15",
    1.15056,
    centering.push.contact_stiffness(DISTANCE, FORCE) / 1e3,
    1e-4,
)
squares = centering.push.contact_stiffness(DISTANCE, FORCE, method="least_squares") / 1e3
row(
    "Table 3.1: stiffness by least squares [N/µm]",
    "-",
    float(np.linalg.lstsq(DISTANCE[:, None], FORCE)[0][0]) / 1e3,
    squares,
    1e-9,
)
SPEEDS = {"slide_before": 139.0, "slide_after": 104.0, "part_after": 222.0}
row("(3.14): coefficient of restitution", "0.85", 0.84892, centering.push.restitution(**SPEEDS), 1e-4)
row("mass of the part over that of the slide", "-", 0.158, centering.push.mass_ratio(**SPEEDS), 5e-4)

# %%
# Following and moving
# --------------------
# A step of a whole gap saturates the slide, so that 0.11 s is no property of gains.
least = centering.cycle.FollowingLimits().least_time(7.928)
bound = least - math.sqrt(2 * 0.01 * 7.928 / ACCELERATION)
row("full gap of 7.928 mm, 99 %: not faster than [s]", "0.11", 0.10507, bound, 1e-5, within=(bound, least))
settled = float(centering.cycle.tune_following().settling_time.min())
row("the same with the best gains, 1 % too far allowed [s]", "-", 0.104, settled, 2e-3)
row(
    "(3.15): error of the PI law, 25 1/s, 60 1/s^2, 20 1/min",
    "-",
    0.057427,
    centering.cycle.FollowingGains(25, 60).error_gain(units.rpm(20)),
    1e-5,
)
missing("(3.16): gains 50000 and 50, 70", "-", "counts of a drive, in ms or in s")
move = {"speed": RAPID, "acceleration": ACCELERATION}
row("7.5 mm at 5000 mm/min [s]", "-", 0.122552, centering.push.move_time(7.5, **move), 1e-5)
slow, fast = (centering.push.move_time(7.5, **move, timing=timing) for timing in ("exact", "printed"))
row("(5.13): by how much it is too long [ms]", "-", 1e3 * RAPID / ACCELERATION, 1e3 * (fast - slow), 1e-9)

# %%
# Lead and stroke
# ---------------
# (5.17) as it stands, aligned at the end of the push; then with the printed times, which turn the lead by so
# much as the source finds, and last where the ring must lie to be pushed to the axis.
LIMITS = printed.limits.replace(approach_speed=83.333, push_speed_max=83.333)
source = printed.replace(part=centering.push.Part(18.9, 61.94), limits=LIMITS)
LEADS = (
    (1.0, 10.0, 38.749828, 8.7047237, 0.3229152, 4.303),
    (10.0, 83.333, 36.407758, 15.6911104, 0.3033980, 6.618),
)
for offset, speed, lead, stroke, time, more in LEADS:
    task = {"offset": offset, "spindle_speed": units.rpm(20), "push_speed": speed, "direction": "end"}
    push = centering.plan_push(source, **task)
    alpha = push.lead_angle
    rim = offset * math.cos(alpha) + math.sqrt(61.94**2 - (offset * math.sin(alpha)) ** 2)
    row(f"offset {offset:g} mm: lead [deg]", "-", lead, degrees(alpha), 1e-6)
    row(f"offset {offset:g} mm: stroke [mm]", "-", stroke, push.stroke, 1e-7)
    row(f"offset {offset:g} mm: (5.6) at that lead [mm]", "-", 7.928 + rim - 61.94, push.stroke, 1e-9)
    row(f"offset {offset:g} mm: time [s]", "-", time, push.time, 1e-7)
    longer = degrees(centering.plan_push(source, **task, timing="printed").lead_angle - alpha)
    what = f"offset {offset:g} mm: lead too large by the printed times [deg]"
    row(what, "4.9", more, longer, 1e-3, "a mean over all; it grows with the offset, as this does")


def pushed(state, v):
    """How the centre of a ring without inertia and the tip move: carried by the table, pushed along the
    contact normal only.
    """
    x, y, tip = state
    normal = np.array([x - tip, y]) / math.hypot(x - tip, y)
    turned = units.rpm(20) * np.array([-y, x])
    return np.append(turned - (normal @ turned + v * normal[0]) * normal, -v)


def touched(rows):
    """Where the ring must be when a tip touches it that then moves as the rows (s, mm/s, mm/s^2) say: from
    the axis, backward.
    """
    state = np.array([0.0, 0.0, 61.94])
    for duration, begin, rate in rows[::-1]:

        def slope(t, now, begin=begin, rate=rate):
            return pushed(now, begin + rate * t)

        state = integrate.solve_ivp(slope, (duration, 0.0), state, rtol=1e-11, atol=1e-12).y[:, -1]
    return state[:2]


PUSH = {"spindle_speed": units.rpm(20), "push_speed": 83.333, "direction": "quasi-static"}
x, y = touched([(0.12, 83.333, 0.0)])
# no time to speak of is lost with starting and stopping
constant = source.replace(limits=LIMITS.replace(acceleration_max=1e9))
touch = centering.push.plan_touch(constant, offset=math.hypot(x, y), **PUSH)
ours = math.hypot(x, y) * math.cos(touch.angle), -math.hypot(x, y) * math.sin(touch.angle)
row("20 1/min, 83.333 mm/s over 0.12 s: begin, x [mm]", "-", 10.01141, ours[0], 6e-6)
row("begin, y [mm]", "-", -1.19093, ours[1], 6e-6)
row("begin [deg]", "-", 6.784, degrees(touch.angle), 5e-4)
row("time from touch to the axis [s]", "-", 0.12, touch.time, 1e-6)
row("a rule of half the turn of the push [deg]", "-", 7.2, degrees(units.rpm(20) * touch.time / 2), 1e-4)
for offset, speed, *_ in LEADS:
    touch = centering.push.plan_touch(source, offset=offset, **PUSH | {"push_speed": speed})
    x, y = touched(touch.push_profile.segments)
    row(
        f"offset {offset:g} mm, braked: angle at touch [deg]",
        "-",
        -degrees(math.atan2(y, x)),
        degrees(touch.angle),
        1e-5,
    )

# %%
# What a push does: Tables 5.1 and 6.1
# ------------------------------------
# The part of 18.9 kg, pushed at constant speed for 0.4 s. The printed parameters do not give the modelled
# columns, whatever the static friction, which is not printed: a slide at 300 mm/min needs a force that swings
# down to nothing, and with it a peak 28 N above the Coulomb friction; 18.5 N are printed. The fitted ones
# come near to both tables.
MODELLED = {  # mm/min: slide [µm], peak force [N]
    100: (0, 39.81), 200: (0, 41.83), 300: (13, 46.25), 400: (36, 51.00), 500: (65, 56.19), 600: (109, 61.39), 700: (140, 66.65),
    800: (184, 71.87), 900: (229, 76.16), 1000: (272, 79.76), 1200: (366, 86.95), 1500: (494, 118.48), 2000: (948, 123.14),
}  # fmt: skip
OBSERVED = {  # mm/min: slide [µm], peak force [N]
    100: (0, 35.53), 200: (0, 30.33), 300: (0, 33.94), 400: (58, 37.30), 500: (67, 40.94), 600: (128, 54.22), 700: (158, 47.16),
    800: (157, 50.20), 900: (192, 57.01), 1000: (279, 66.71), 1200: (400, 77.89), 1500: (410, 107.05), 2000: (1089, 97.58),
}  # fmt: skip
CORRECT = {  # mm/min: slide [µm], peak force [N]
    "printed": {600: (0.0, 69.602), 1000: (193.83, 96.640), 2000: (859.87, 164.783)},
    "identified": {600: (95.24, 59.791), 1000: (267.81, 79.660), 2000: (921.05, 134.079)},
}
rates = np.array(list(MODELLED))
constant_speeds = [centering.TipProfile.constant_speed(units.mm_per_min(rate), 0.4) for rate in rates]
result = {
    name: centering.push.simulate_pushes(problem.model, constant_speeds) for name, problem in PRESETS.items()
}
for name, ours in result.items():
    assert np.all(ours[:, 5] <= 1e-9)  # energy
    for k in (5, 9, 12):
        rate = int(rates[k])
        (slide, peak), (correct_slide, correct_peak) = MODELLED[rate], CORRECT[name][rate]
        why = f"{name} parameters"
        beyond(
            f"Table 5.1, {rate} mm/min: slide [µm]",
            str(slide),
            correct_slide,
            1e3 * float(ours[k, 1]),
            0.01,
            why,
        )
        beyond(
            f"Table 6.1, {rate} mm/min: peak force [N]",
            f"{peak:.2f}",
            correct_peak,
            float(ours[k, 2]),
            1e-3,
            why,
        )
modelled, observed = (np.array(list(table.values())) for table in (MODELLED, OBSERVED))
print(
    "mm/min   slide [µm]: modelled observed printed identified   peak [N]: modelled observed printed identified"
)
for k, rate in enumerate(rates):
    slides = "".join(
        f"{x:11.0f}"
        for x in (modelled[k, 0], observed[k, 0], *(1e3 * each[k, 1] for each in result.values()))
    )
    peaks = "".join(
        f"{x:11.2f}" for x in (modelled[k, 1], observed[k, 1], *(each[k, 2] for each in result.values()))
    )
    print(f"{rate:6d}{slides}{peaks}")
for name, (um, newton, most_um, most_newton) in {
    "printed": (65, 15.9, None, None),
    "identified": (21.5, 5.0, 68, 12),
}.items():
    off = result[name][:, 1:3] * [1e3, 1.0] - modelled
    rms, worst = np.sqrt(np.mean(off**2, axis=0)), np.abs(off).max(axis=0)
    row(f"{name}: rms of the slides off Table 5.1 [µm]", "-", um, float(rms[0]), 0.5)
    row(f"{name}: rms of the forces off Table 6.1 [N]", "-", newton, float(rms[1]), 0.05)
    if most_um is not None:
        row(f"{name}: largest of them [µm]", "-", most_um, float(worst[0]), 0.5)
        row(f"{name}: largest of them [N]", "-", most_newton, float(worst[1]), 0.5)
error = 100 * (modelled[:, 1] - observed[:, 1]) / observed[:, 1]
row(
    "Table 6.1: mean of modelled less observed [N]",
    "14.1",
    14.12,
    float(np.mean(modelled[:, 1] - observed[:, 1])),
    5e-3,
)
row("Table 6.1: mean error [%]", "27.7", 27.7, float(np.mean(error)), 0.05)
corrected = np.abs(modelled[:, 1] - observed[:, 1] - 14.1)
row(
    "Table 6.1: largest error after + 14.1 N is within [N]",
    "10",
    11.46,
    float(corrected.max()),
    1e-2,
    "it is that of 2000 mm/min",
)
at_rest = (modelled[:, 1] - printed.model.coulomb_force)[2]
row("peak above Coulomb friction, 300 mm/min, as printed [N]", "-", 18.45, float(at_rest), 5e-3)
row("least swing of the force that can end contact there [N]", "-", 27.80, printed.model.coulomb_force, 5e-3)

# %%
# The energy balance
# ------------------
balance = 60 * centering.push.energy_balance_speed(printed, 0.1)
row("(5.25): speed for 100 µm [mm/min]", "3700", 556.3, balance, 0.05, "3700 belongs to 4.4 mm")
row(
    "(5.25): speed for 4.4 mm [mm/min]",
    "-",
    3690,
    60 * centering.push.energy_balance_speed(printed, 4.4),
    1.0,
)
for name, problem in PRESETS.items():
    table = centering.push.free_slide_table(problem.model)
    correct = {"printed": 790, "identified": 615}[name]
    beyond(
        f"{name}: speed that slides 100 µm [mm/min]",
        "600",
        correct,
        60 * float(table.speed_for(0.1)),
        5.0,
        f"{name} parameters",
    )
for rate, um, said in ((500, 81, "70"), (1000, 323, "110"), (2000, 1293, "1000")):
    thrown = (units.mm_per_min(rate) * 1.85) ** 2 / (2 * 0.15 * 9807.0)
    beyond(
        f"limit cycle at {rate} mm/min [µm]",
        said,
        um,
        1e3 * thrown,
        0.5,
        "order of magnitude of the inverse energy balance",
    )

# %%
# Stiction resonance
# ------------------
# The dominant line of the contact force, above 4 Hz, of a push of 0.2 s at 600 mm/min (zero-padded). One
# stiffness cannot serve both masses: the light part wants 82 N/mm. And it is no property of the part alone:
# as soon as the tip comes off, the period grows by the flight, and the frequency falls with the speed.


def by_hand(model, rate):
    """The dominant line, by a transform written out here."""
    trace = centering.simulate_push(model, centering.TipProfile.constant_speed(units.mm_per_min(rate), 0.2))
    force = trace.at(np.arange(0, 0.2, 1e-4)).contact_force.values
    lines = np.abs(np.fft.rfft(force - force.mean(), 1 << 17))
    frequency = np.fft.rfftfreq(1 << 17, 1e-4)
    return float(frequency[np.argmax(np.where(frequency > 4.0, lines, 0.0))])


for name, hertz, um in (("printed", 39.8, 57), ("identified", 30.7, 91)):
    model = PRESETS[name].model
    why = f"{name} parameters"
    slower, at_600, faster = centering.push.resonance_over_speed(
        model, [units.mm_per_min(rate) for rate in (300, 600, 2000)]
    )
    beyond(f"{name}: resonance, 18.9 kg, 600 mm/min [Hz]", "29.9", hertz, at_600.line, 0.3, why)
    row(f"{name}: the same, transformed by hand [Hz]", "-", by_hand(model, 600), at_600.line, 0.1)
    row(f"{name}: the same, by the spacing of peaks [Hz]", "-", hertz, at_600.spacing, 0.3)
    trace = centering.simulate_push(model, centering.TipProfile.constant_speed(10.0, 0.4))
    closure = trace.part_position - trace.tip_position
    beyond(f"{name}: part moves against the tip by [µm]", "100", um, 1e3 * float(np.ptp(closure)), 1.0, why)
    correct = {"printed": (40.0, 29.0), "identified": (31.0, 24.0)}[name]
    row(f"{name}: resonance at 300 mm/min [Hz]", "-", correct[0], slower.line, 0.6)
    row(f"{name}: resonance at 2000 mm/min [Hz]", "-", correct[1], faster.line, 1.6)
for mass, hertz, stiffness in ((18.9, 29.9, 667), (18.9, 27.8, 577), (0.8, 51.0, 82)):
    needed = centering.push.implied_stiffness(hertz, mass=mass)
    row(
        f"{mass:g} kg at {hertz:g} Hz needs [N/mm]",
        "1200",
        stiffness,
        needed,
        0.6,
        "a nylon tip is softer under less load",
    )

# %%
# The band-stop filter
# --------------------
# The text has a band of 5 to 40 Hz, a caption 20 to 40 Hz, and the lag is that of 25 to 40 Hz. With 5 Hz the
# pusher would have to draw back. What the filter does to the peak force of the light part is no property of
# part and filter: it is how the first sample jumps.
for low, correct in ((25.0, 47.746), (20.0, 79.577), (5.0, 557.04)):
    lag = 1e3 * centering.push.band_stop_lag(10.0, band=(low, 40.0))
    row(
        f"lag at 10 mm/s, {low:g}-40 Hz [µm]",
        "47",
        correct,
        lag,
        0.1,
        "47 µm is 25-40 Hz" if low < 25 else "47.7, not rounded",
    )
sampled = centering.push.band_stop_profile(10.0, 1.0)
joined = 47.90 - 5.0 * (
    1.0 - sampled.velocity[0] / 10.0
)  # 47.90 where samples are held; half a sample of what is not yet there less
row("lag at 1 kHz, samples joined by lines [µm]", "-", float(joined), 1e3 * (10.0 - sampled.stroke), 0.01)
for name, stays in (("printed", (27, 37)), ("identified", (33, 30))):
    for low, correct in zip((25.0, 20.0), stays, strict=True):
        push = centering.push.band_stop_profile(10.0, 0.4, band=(low, 40.0))
        trace = centering.simulate_push(PRESETS[name].model, push)
        late = trace.time > 0.05
        ours = 1e3 * float(np.ptp(trace.part_position[late] - 10.0 * trace.time[late]))
        row(f"{name}: x - v t after 0.05 s, {low:g}-40 Hz [µm]", "-", correct, ours, 2.0)
        assert ours < 40  # as the source says
        touching = "no" if "free" in trace.event_mode else "yes"
        published, correct = {"printed": ("yes", "yes"), "identified": ("-", "no")}[name]
        row(f"{name}: always in contact, {low:g}-40 Hz", published, correct, touching)
light = printed.model.replace(mass=0.8)
rapid = units.mm_per_min(2500)
jump = centering.simulate_push(light, centering.TipProfile.constant_speed(rapid, 0.2)).peak_force
row("0.8 kg, 2500 mm/min: peak force [N]", "-", 41.667, jump, 1e-3)
for rate, correct in ((1000.0, 23.482), (4000.0, 36.169)):
    push = centering.push.band_stop_profile(
        rapid, 0.2, band=(10.0, 100.0), sample_rate=rate, allow_reverse=True
    )
    peak = centering.simulate_push(light, push).peak_force
    row(f"the same, 10-100 Hz, filter at {rate / 1e3:g} kHz [N]", "-", correct, peak, 1e-3)
    beyond(
        f"by which that is less [%], {rate / 1e3:g} kHz",
        "58",
        100 * (1 - correct / 41.667),
        100 * (1 - peak / jump),
        0.1,
        "see above",
    )

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

# %%
# Slides and peak forces
# ----------------------
# Tables 5.1 and 6.1 over the speed.
figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
COLORS = {"printed": "#b04a3a", "identified": "#4878a8"}
fine = np.linspace(50, 2050, 161)
pushes = [centering.TipProfile.constant_speed(units.mm_per_min(rate), 0.4) for rate in fine]
for k, (axis, label) in enumerate(zip(axes, ("longest free slide [µm]", "peak force [N]"), strict=True)):
    for name, problem in PRESETS.items():
        axis.plot(
            fine,
            centering.push.simulate_pushes(problem.model, pushes)[:, 1 + k] * (1e3, 1.0)[k],
            color=COLORS[name],
            label=name,
        )
    axis.plot(rates, modelled[:, k], "o", color="0.15", ms=4, label="modelled by the source")
    axis.plot(rates, observed[:, k], "x", color="0.5", ms=5, label="observed by the source")
    axis.set(xlabel="speed of the push [mm/min]", ylabel=label, xlim=(0, 2100), ylim=(0, None))
axes[0].legend(frameon=False, fontsize=8)
plt.show()
