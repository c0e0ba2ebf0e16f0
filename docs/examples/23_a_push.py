"""
A push, and what it teaches
===========================

A ring lies off the axis of a turning table, and a slide pushes it there. When must the slide start, where
does the ring come to rest, how fast can the push be, and what does friction have to do with it? A push
answers the last question itself."""

import time

import matplotlib.pyplot as plt
import numpy as np

import centering
from sdpgrind import units

# %%
# When to start
# -------------
# A heavy ring, 1 mm off, at 20 turns a minute. The slide goes near to where the rim will be, rests, and
# pushes. The lead is the angle that the table turns meanwhile; the rim comes nearer on the way, so that the
# lead depends on itself.
problem = centering.preset("printed").replace(part=centering.push.Part(mass=18.9, radius=89.5))
task = {"offset": 1.0, "spindle_speed": units.rpm(20), "push_speed": 10.0}
push = centering.plan_push(problem, **task)
print(push)
limit = centering.push.turning.spindle_speed_limit(problem, offset=10.0)
print(f"at 10 mm the table may do {limit.value / units.rpm(1):.0f} turns a minute ({limit.reason});", end=" ")
print(f"friction would hold the ring up to {limit.all['friction'] / units.rpm(1):.0f}")
push.plot()

# %%
# The table carries the ring along during the push. The right angle depends on the moment at which the ring is
# to be on the line of the push; the source aligns at the end. ``"exact"`` brings the ring to the axis, with
# the drift of its inertia.
for direction in ("exact", "quasi-static", "contact", "end"):
    leads = [
        np.rad2deg(
            centering.plan_push(
                problem, **task | {"spindle_speed": units.rpm(rpm)}, direction=direction
            ).lead_angle
        )
        for rpm in (5, 20)
    ]
    print(f"{direction:12} lead {leads[0]:7.3f} deg at 5, {leads[1]:7.3f} deg at 20 turns a minute")

# %%
# Where it comes to rest
# ----------------------
# The contact is a spring and a damper that never pull. All phases (sticking, slipping, flying) are solved in
# closed form, so that a push takes microseconds and its energy balances to rounding. At a constant speed the
# ring leaves the tip again and again, and a stop harder than friction can brake throws it off.
speed, way = 40.0, 5.0  # mm/s, mm
hard = centering.TipProfile.move(way, speed, problem.limits.acceleration_max)
gentle = centering.push.gentle_profile(problem.model, way, speed)
trace = centering.simulate_push(problem.model, hard)
print(trace, f"energy balances to {trace.energy_balance:.0e}")
trace.plot()

# %%
# A gentle push breaks away slowly, accelerates at half of the friction limit, and stops so that the ring
# stays at the tip. Its final position depends far less on friction, which nobody knows to 10 %:
print("friction           0.9        1      1.1   times that of the model")
for name, profile in (("hard", hard), ("gentle", gentle)):
    models = [problem.model.replace(mu_static=0.2 * f, mu_kinetic=0.15 * f) for f in (0.9, 1.0, 1.1)]
    came = centering.push.simulate_pushes(models, profile)
    stroke = float(np.max(profile.position(np.linspace(0.0, profile.total_time, 2001))))
    told = " ".join(f"{1e3 * (end - stroke):8.1f}" for end in came[:, 0])
    print(f"{name:12} {told}   µm beyond the tip, peak {came[1, 2]:.0f} N, {profile.total_time:.3f} s")

# %%
# Slow pushes have a limit of their own: after sticking the friction falls, and the ring jumps. No slow push
# is finer than that.
for mass in (0.8, 5.0, 18.9):
    model = problem.model.replace(mass=mass)
    smallest = centering.push.simulate_pushes(
        model, [centering.push.tap_profile(x, 5.0) for x in np.geomspace(5e-4, 0.1, 400)]
    )
    least = 1e3 * smallest[smallest[:, 0] > 1e-6, 0].min()
    print(
        f"{mass:4.1f} kg: jump {1e3 * model.stick_slip_quantum:6.2f} µm;"
        f" drawn back at once, it moves by {least:.2f} µm at least"
    )

# %%
# The fastest push
# ----------------
# The gentle push is a rule. `minimum_time_push` searches the motion of the tip of least time that keeps
# contact and stops within the tolerance at every friction from 0.9 to 1.1 times that of the model. It pays
# where the same push comes again, in a series of rings that lie alike: below are its gain, and the number of
# pushes that repay the search. Over short ways it also spares the second push that the gentle one leaves to
# do.
quick = problem.replace(push_speed_max=speed)
print("  mm   gentle: time, worst stop   least time: time, worst stop    gain of time")
for way in (0.3, 1.0, 5.0):
    begin = time.perf_counter()
    fastest = centering.push.minimum_time_push(quick, way)
    search = time.perf_counter() - begin
    plain = centering.push.gentle_profile(problem.model, way, speed)
    traces = [centering.simulate_push(model, plain) for model in models]
    rests = max(trace.time[trace.part_velocity > 0.0].max() for trace in traces)
    worst = max(abs(trace.final_position - way) for trace in traces)
    print(
        f"{way:4.1f}   {rests:8.3f} s {1e3 * worst:8.1f} µm   {fastest.time:11.3f} s"
        f" {1e3 * abs(fastest.stop_error).max():8.1f} µm   {rests - fastest.time:8.3f} s,"
        f" {search / (rests - fastest.time):4.0f} pushes repay the search"
    )
fastest.plot()

# %%
# What it teaches
# ---------------
# A ring whose friction is 12 % above the model. Fast pushes with a hard stop let it slide, which determines
# the kinetic friction; a slow breakaway determines the static one. The friction of each push scatters about
# that of the ring by 4 %.
true = problem.model.replace(mu_static=0.2 * 1.12, mu_kinetic=0.15 * 1.12)
friction = centering.FrictionEstimator(problem)
rng = np.random.default_rng(1)
slow = centering.TipProfile.constant_speed(1.0, 0.2)
found, sd = [[0.2, 0.15]], [[0.2 * 0.08, 0.15 * 0.08]]
for k in range(8):
    met = 1.0 + 0.04 * rng.normal()
    model = true.replace(mu_static=true.mu_static * met, mu_kinetic=true.mu_kinetic * met)
    friction.update(centering.simulate_push(model, slow if k % 2 else hard))
    estimate = friction.estimate
    found.append(list(estimate.value))
    sd.append(list(estimate.sd))
    if k < 3:
        print(
            f"after push {k + 1}:",
            ", ".join(f"{name} {estimate[name]:.4f}" for name in estimate.names),
            estimate.message,
        )
better = problem.updated(friction.estimate)
print(
    f"believed now: mu_kinetic {better.model.mu_kinetic:.4f} (truly {true.mu_kinetic:.4f}), known to", end=" "
)
print(
    f"{100 * better.scatter.friction_part_sd:.1f} % instead of {100 * problem.scatter.friction_part_sd:.0f} %"
)

# %%
# Estimates with two standard deviations; dashed, the truth.
found, sd = np.array(found), np.array(sd)
figure, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
for j, (name, color, truth) in enumerate(
    (("mu_static", "#b04a3a", true.mu_static), ("mu_kinetic", "#4878a8", true.mu_kinetic))
):
    axis.errorbar(
        np.arange(9) + 0.06 * j, found[:, j], yerr=2 * sd[:, j], fmt="o-", color=color, capsize=3, label=name
    )
    axis.axhline(truth, color=color, ls="--", lw=1)
axis.set(xlabel="pushes seen", ylabel="coefficient of friction")
axis.legend(frameon=False)
plt.show()
