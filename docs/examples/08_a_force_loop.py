"""
A force loop
============

The bottom tier. Sixty times a second a force is read and a platform is moved. What such a loop can do is
decided by what it drives: a table of 9 Hz, a sensor that averages, a sample of delay, a contact as stiff as
the disc's compliance."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np

from sdpgrind import units
from sdpgrind.weldbead import force

# %%
# What is driven
# --------------
# The drive of Appendix B of the source, in two ways: as it is used for design, and as its own numbers give
# it, with friction at the motor that lets it stick.

for name in ("design", "appendix-b"):
    drive = force.table_drive(name)
    poles = ", ".join(f"{abs(pole) / units.hz(1):.1f}" for pole in drive.poles)
    print(
        f"{name}: poles {poles} Hz, lag {1e3 * drive.lag_time:.0f} ms, sticks within {1e3 * drive.stuck_band:.1f} µm"
    )

# %%
# What is seen
# ------------
# The 30 Hz filter behind the sensor does not keep out what is above 30 Hz: a disc that wobbles at 50 Hz is
# read as 10 Hz, at 58 Hz as 2 Hz, and at 60 Hz as a force that is not there.

sensor = force.SensorChain()
for spin in (50.0, 58.0, 60.0):
    seen, gain = sensor.alias(units.hz(spin)) / units.hz(1), abs(complex(sensor.response(units.hz(spin))))
    print(f"{spin:.0f} Hz is seen at {abs(seen):4.1f} Hz, {20 * np.log10(gain):6.1f} dB")

# %%
# PI, and what it may claim
# -------------------------

loop = force.PI.design(crossover=units.hz(3.0), drive=force.table_drive())
print(force.margins(loop, delay_samples=1))

# %%
# What feedback can do at all
# ---------------------------
# Four designs within the same limits: gain margin, peak of the sensitivity, and response to a wobbling disc.
# `f_b` is the frequency up to which an error is less than 0.707 f/f_b of what it would be without feedback.
# The convex design is the best that any linear law can do: at 60 Hz and one sample of delay nobody beats a
# well tuned PI by more than a half.

limits = force.DesignLimits(runout_response=0.1)
table = force.design_table(force.designs(limits=limits))
print(f"{'':12s} {'f_b [Hz]':>9s} {'GM [dB]':>8s} {'PM [deg]':>9s} {'Ms':>5s} {'runout':>7s}")
for row in range(table.sizes["design"]):
    one = table.isel(design=row)
    print(
        f"{str(one.design.values):12s} {float(one.bandwidth) / units.hz(1):9.2f} {float(one.gain_margin_db):8.1f} "
        f"{np.degrees(float(one.phase_margin)):9.1f} {float(one.sensitivity_peak):5.2f} {float(one.runout_response):7.3f}"
    )

# %%
# Two degrees of freedom
# ----------------------
# Feedback only has to do what nobody could foresee, if the planned height is sent ahead by the lag of the
# loop. Here the plan asks for 45 N and a sine of 15 N; the table has play worth 4.8 N, and the contact is 15
# % softer than planned.


def wanted(hertz):
    t = np.arange(0.0, 12.0, 0.004)
    normal_force = 45.0 + 15.0 * np.sin(units.hz(hertz) * t)
    return SimpleNamespace(
        time=t, normal_force=normal_force, fly_height=-normal_force / loop.plant.contact_stiffness
    )


stiffness = loop.plant.contact_stiffness
truth = loop.plant.replace(
    drive=loop.plant.drive.replace(play=4.8 / stiffness), contact_stiffness=0.85 * stiffness
)
figure, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for axis, hertz in zip(axes, (0.33, 1.2), strict=True):
    for name, feedforward, color in (
        ("PI alone", False, "#b04a3a"),
        ("with the planned height", True, "#3a6ea5"),
    ):
        controller = force.ForceController(wanted(hertz), loop, feedforward=feedforward)
        record = force.simulate_loop(controller, duration=12.0, plant=truth, rng=1)
        rms = record.error_rms(after=4.0)[0]
        axis.plot(record.time, record.force[0], color=color, lw=1, label=f"{name}: {rms:.1f} N rms off")
        print(f"{hertz:.2f} Hz, {name}: {rms:.2f} N rms")
    axis.plot(record.time, record.planned, "k--", lw=0.8, label="planned")
    axis.set(xlim=(4, 12), ylabel="normal force [N]", ylim=(20, 75))
    axis.legend(loc="upper right", ncols=3, fontsize=8, frameon=False)
axes[-1].set_xlabel("time [s]")

# %%
# Limits that are known beforehand
# --------------------------------
# The predictive controller solves a small quadratic program in each sample: it knows how fast the platform
# may move, and that a disc can push but not pull. A step of 60 N with a platform that makes 4 mm/s: PI begins
# when the step is there, and winds up; the predictive controller sees it coming in the plan, begins before,
# and arrives without overshoot.

t = np.arange(0.0, 4.0, 0.004)
jump = np.where(t < 1.5, 10.0, 70.0)
step = SimpleNamespace(time=t, normal_force=jump, fly_height=-jump / stiffness)
slow = force.Limits(command_rate_max=4.0)
predictive = force.Predictive.design(limits=limits)
figure, axis = plt.subplots(figsize=(8, 3), layout="constrained")
for name, controller in {
    "PI": force.ForceController(step, force.tuned_pi(limits=limits), feedforward=False, limits=slow),
    "predictive": force.PredictiveController(step, predictive, limits=slow),
}.items():
    record = force.simulate_loop(controller, duration=3.0, rng=1)
    axis.plot(record.time, record.force[0], lw=1, label=name)
axis.plot(record.time, record.planned, "k--", lw=0.8, label="planned")
axis.set(xlabel="time [s]", ylabel="normal force [N]", xlim=(1.4, 3))
axis.legend(frameon=False)
plt.show()
