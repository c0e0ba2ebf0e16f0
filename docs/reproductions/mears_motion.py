"""
Mears (2006): motion, lead and stroke
=====================================

What chapters 3 and 5 of the thesis print of the rim, the slide and the aim of a push, beside what its own inputs
give and what this library computes. Its traces survive as captions only.

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

import numpy as np
from published import Published
from scipy import integrate

import centering
from sdpgrind import units

page = Published()
row, missing, beyond = page.row, page.missing, page.beyond
PRESETS = {name: centering.preset(name) for name in ("printed", "identified")}
printed = PRESETS["printed"]
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

page.show()
