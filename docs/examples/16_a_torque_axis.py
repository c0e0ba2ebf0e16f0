"""
A torque axis
=============

One motor presses the tool on. Nothing measures the force: there is the current that is sent, and the angle of
the motor that an encoder shows. How fast, how quietly and how surely can a force be held with that? Known
before it is tried, this saves specimens."""

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import finishing, units

# %%
# Four controllers
# ----------------
# The contact is a spring, and nothing damps it: a motor with a constant current bounces. "pidff" is that of
# Wang and Jan (2001), with their gains, and misprints put right. "damped" is the constant current less a
# little for the motor's speed: what any other has to be better than. "lqg" estimates the force by a Kalman
# filter.
axis = finishing.TorqueAxis()
force = 1.111  # N
kinds = ("constant", "pidff", "damped", "lqg")
controllers = {kind: finishing.TorqueController(axis, normal_force=force, kind=kind) for kind in kinds}
print(
    f"the motor can press {axis.force_max:.2f} N; a count of the encoder is {1000 * axis.force_resolution:.0f} mN of contact"
)

# %%
# Poles: always with the observer
# -------------------------------
# The gains of the paper are poles at -61 1/s for the loop and at -40 1/s for the observer. Together they are
# neither, because the observer takes the contact for a disturbance. The slowest pole says how long it rings.
for kind, controller in controllers.items():
    print(f"{kind:9} {controller.poles}")

# %%
# A better observer is three times as fast as the loop; a prefilter takes away the overshoot that the law
# itself brings.
gains = finishing.torque.PidffGains.of_poles(axis, pole=61.0)
controllers["pidff, better"] = finishing.TorqueController(
    axis, normal_force=force, gains=gains, prefilter=True
)
print(f"pidff, better: {controllers['pidff, better'].poles}")

# %%
# Pressing on
# -----------
# A step to 1.111 N, on 20 surfaces that differ by parts of a count of the encoder: rounding decides how a
# loop comes to rest, so figures are means.
figure, axes = plt.subplots(1, 5, figsize=(12, 2.6), sharey=True, layout="constrained")
print(f"\n{'':14}{'within 5 %':>12}{'within 2 %':>12}{'overshoot':>12}{'ripple':>10}")
for ax, (kind, controller) in zip(axes, controllers.items(), strict=True):
    record = finishing.torque.simulate_axis(controller, duration=0.5)
    found = record.figures
    times = f"{1e3 * found['settling_5']:9.0f} ms{1e3 * found['settling_2']:9.0f} ms"
    print(f"{kind:14}{times}{100 * found['overshoot']:10.1f} %{1e3 * found['ripple']:7.1f} mN")
    record.plot(ax)
    ax.set(
        title=kind, xlabel="time [s]", ylabel="normal force [N]" if kind == "constant" else "", ylim=(0, 2.3)
    )
    if kind != "constant" and ax.get_legend() is not None:
        ax.get_legend().remove()

# %%
# A stiffer contact
# -----------------
# Nobody knows the stiffness of a contact to better than a factor of two. What is fast on the contact that it
# was designed for may be of no use on another. So choose by the worst of those that may come, and look at how
# far the loop is stable at all.
print(f"{'':14}{'stable for':>16}{'worst: within 5 %':>20}{'overshoot':>12}{'ripple':>10}")
for kind, controller in controllers.items():
    case = finishing.torque.worst_case(controller, factors=(0.5, 1.0, 2.0), duration=0.6)
    worst, (low, high) = case.worst, case.stable
    told = f"{low:.2f} to {high:.1f} k_e".rjust(16) + f"{1e3 * worst['settling_5']:17.0f} ms"
    print(f"{kind:14}{told}{100 * worst['overshoot']:10.1f} %{1e3 * worst['ripple']:7.1f} mN")

# %%
# "lqg" is the fastest and the least tolerant: it is unstable on a contact that is 4.4 times as stiff. (0.05
# and 20 are only how far was looked.) On one that is twice as stiff none of them settles to 2 %, 22 mN: there
# a count of the encoder is 80 mN.
#
# A surface that is not where it should be
# ----------------------------------------
# The robot leads the tool along the planned surface; the true one is higher here and lower there. Slow waves
# are followed. From some 10 Hz on no loop is better than a motor that does not move. At 25 mm/s that is all
# that is shorter than 2.5 mm; the passes of a path are not seen by the controller at all.
frequencies = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
for kind in ("pidff", "damped", "lqg"):
    loop = controllers[kind].loop()
    gain = np.abs(loop.response(units.hz(frequencies), "surface_angle")[:, 0])
    ax.loglog(frequencies, 0.1 / axis.lever_arm * gain / (1e-3 * axis.lever_arm), "o-", ms=3, label=kind)
still = 0.1 / axis.lever_arm * axis.contact_angular_stiffness / (1e-3 * axis.lever_arm)
ax.axhline(still, color="0.6", ls="--", lw=0.8, label="a motor that does not move")
ax.set(xlabel="surface waves of 0.1 mm [Hz]", ylabel="error of the force [N]")
ax.legend(frameon=False, fontsize=8)

# %%
# Damping by the motor's speed holds the motor back where it should go with the surface. "lqg" damps the speed
# relative to the surface that it has estimated: that is why its error on slow waves is a third of the
# others'.
#
# The torque that nobody can tell from the contact
# ------------------------------------------------
# Weight of the tool, friction in the bearing, a cable: all act on the motor as the contact does. Current and
# angle show the sum. Each controller holds the *sum*, and reports no error.
for kind in ("pidff", "damped", "lqg"):
    record = finishing.torque.simulate_axis(controllers[kind], load_torque=0.01)
    seen = float(record.estimate[:, -200:].mean() / (1e-3 * axis.lever_arm))
    print(
        f"{kind:7} load torque 10 mN m: contact {1e3 * record.offset.mean():+.0f} mN off, believed to be {seen:.3f} N"
    )
record = finishing.torque.simulate_axis(
    controllers["lqg"], truth=axis.replace(torque_constant=1.1 * axis.torque_constant)
)
print(f"and a torque constant that is 10 % higher: {1e3 * record.offset.mean():+.0f} mN")

# %%
# What helps is to look before touching. On its way down the tool moves freely: whatever turns it besides the
# current is load. The simulated cell starts with the tool 0.5 mm above the surface.
problem = finishing.preset("specimen")
problem = problem.replace(path=finishing.hilbert(problem.surface, order=3))
motion = finishing.plan(problem)
truth = hwsim.CellTruth.nominal(problem, axis).replace(load_torque=0.01)
cell = hwsim.FinishingCell(problem, truth=truth, axis=axis, gap=0.5, target_force=force)
log = hwsim.run(cell, finishing.TorqueController(axis, motion, normal_force=force, kind="lqg"), rng=0)
estimate = finishing.identify(log, "load_torque", axis=axis, until=float(log.outcome.touch_down[0]))
print(estimate)
told = finishing.TorqueController(
    axis, motion, normal_force=force, kind="lqg", load_torque=estimate["load_torque"]
)
again = hwsim.run(cell, told, rng=0)
print(
    f"mean force {float(log.outcome.normal_force[0]):.3f} N before, {float(again.outcome.normal_force[0]):.3f} N after"
)

# %%
# From 50 µm there would be too few readings, and it would say so: begin half a millimetre up, now and then.
# What a heavy tool weighs on the motor changes with the pose, so that once for a job is not enough: 0.44 kg
# at 50 mm is more than the motor has.
print(f"{finishing.torque.gravity_torque(0.44, 50.0, 0.0):.3f} N m of {axis.torque_max:.3f}")
plt.show()
