"""
A program for the control
=========================

A machine without a gauge in the bore, or without a controller that a size can reach, runs a program: the feed
of the axis against time, fixed beforehand. What is not known of a part is then paid in full."""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

from sdpgrind import plunge, units

problem = plunge.preset("simulation").replace(burning_sd=0.02, sharpness_sd=0.03, contact_zero_sd=0.003)
gauged = plunge.plan(problem, confidence=0.999)
blind = plunge.plan(problem, confidence=0.999, gauge=False)
print(f"{gauged.time:.2f} s with a gauge, {blind.time:.2f} s without; of these for doubts:")
for name, seconds in blind.price.items():
    print(f"{name:15s} {seconds:5.2f} s")

# %%
# The plan without a gauge becomes a program of few straight blocks, which stays within a deviation of the plan at
# all times. It is read back before it is written.

program = blind.program("ngc", deviation=units.um(0.1))
print(program.text)
found = program.check()
print(f"{1e3 * found.deviation:.3f} µm from the plan, ends after {found.time:.3f} s")
with tempfile.TemporaryDirectory() as folder:
    program.save(Path(folder) / "cycle.ngc")

# %%
# A coarser program has fewer blocks. A control that is programmed by the diameter takes ``diameter=True``, a
# sampled axis ``"csv"``.

deviations = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0]  # µm
texts = [blind.program(deviation=units.um(deviation)).text for deviation in deviations]
blocks = [sum(line.startswith(("G1", "G4")) for line in text.splitlines()) for text in texts]
course = blind.trajectory
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
left.plot(course.time, program.course(course.time.values), color="0.3")
left.set(xlabel="time [s]", ylabel="position of the axis [mm]")
right.semilogx(deviations, blocks, "o-")
right.set(xlabel="deviation [µm]", ylabel="blocks", ylim=(0, None))
plt.show()

# %%
# What a program cannot do
# ------------------------
# Nothing measures the part. Damage stays below the surface with the confidence asked for, but the size is off by
# the whole error of the contact, and by the error of the deflection at the end. A wheel that wears is fed in
# addition, as far as the grinding ratio is right. A plan that relies on a gauge is refused:

try:
    gauged.program(deviation=units.um(0.1))
except ValueError as refused:
    print(refused)
