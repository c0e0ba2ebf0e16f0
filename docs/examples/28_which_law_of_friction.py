"""
Which law of friction
=====================

Six laws describe the friction between a ring and its table, from Coulomb's to those with a bond that
deflects before it slides. A recorded push tells which of them a machine needs, and a ring that must stay
tells which of them must not be used."""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import centering
from centering import friction

# %%
# Two recorded pushes
# -------------------
# A record holds the contact force over time and the travel of the ring. Here the simulator makes it, with
# Coulomb and viscous friction; on a machine a force sensor and a probe do so.
problem = centering.preset("printed")
model, mass, step = problem.model, problem.model.part.mass, 1e-5  # step in s
slow = centering.simulate_push(model, centering.TipProfile.move(2.0, 20.0, 2560.0))
fast = centering.simulate_push(model, centering.TipProfile.move(5.0, 80.0, 2560.0))
for name, record in (("slow", slow), ("fast", fast)):
    print(
        f"{name}: {record.final_position:.3f} mm in {record.duration:.3f} s, up to {record.peak_force:.0f} N"
    )


# %%
# Which law fits
# --------------
# A law that is driven by the recorded force gives a travel. Its Coulomb force is fitted to the slow push;
# then the law predicts the fast one. A wrong law fits one push as well as the right one does, and misses the
# other.
def travel(law, record):
    load = record.at(np.arange(0.0, record.duration, step)).contact_force.values
    return friction.simulate_friction(law, load, mass=mass, step=step).position[-1]


NAMES = ("coulomb", "viscous", "stribeck", "dahl", "lugre", "elasto_plastic")
between = 0.85 * model.coulomb_force, 1.15 * model.coulomb_force
for name in NAMES:
    law = friction.friction_law(model, name)

    def off(force, law=law):
        return travel(law.replace(coulomb_force=force), slow) - slow.final_position

    fitted = law.replace(coulomb_force=brentq(off, *between))
    error = travel(fitted, fast) - fast.final_position
    print(f"{name:14} F_k {fitted.coulomb_force:6.3f} N, error of the fast push {1e3 * error:+8.1f} µm")
print(
    f"{'record':14} F_k {model.coulomb_force:6.3f} N, tolerance of centering {1e3 * problem.tolerance:.1f} µm"
)

# %%
# Without the viscous share the fast push comes out far too long. The bonds of LuGre's and of the
# elasto-plastic law matter little for a push, and neither does Stribeck's fall of friction: the model of
# pushes leaves both out.

# %%
# A ring that must stay
# ---------------------
# A machine hums while the ring is measured. The load oscillates about a fifth of the breakaway force and
# never exceeds half of it, so that the ring stays. Some laws with a bond let it creep: a simulation with them
# loses the centred ring after a while, and a plan made with them corrects a motion that no ring makes.
load = {"mean_load": 0.2 * model.breakaway_force, "load_amplitude": 0.3 * model.breakaway_force}
frequency, cycles = 20.0, (10, 300)  # Hz
seconds = (cycles[1] - cycles[0]) / frequency
for name in NAMES:
    law = friction.friction_law(model, name)
    creep = friction.friction_drift(law, mass=mass, frequency=frequency, cycles=cycles, **load)
    lost = f"out of tolerance after {seconds * problem.tolerance / creep:.1f} s" if creep > 1e-6 else "stays"
    print(f"{name:14} {1e3 * creep:8.3f} µm in {seconds:.1f} s: {lost}")

# %%
# The first cycles in detail, for LuGre's law and for the elasto-plastic one, which differs by a truly elastic
# range of the bond.
phase = 2 * np.pi * np.arange(2000) / 2000
hum = load["mean_load"] + load["load_amplitude"] * np.sin(phase)
figure, axis = plt.subplots(figsize=(7, 3.4), layout="constrained")
for name, color in (("lugre", "#b04a3a"), ("elasto_plastic", "#4878a8")):
    law = friction.friction_law(model, name)
    trace = friction.simulate_friction(
        law, hum, mass=mass, step=1.0 / frequency / phase.size, repeats=20, every=10
    )
    axis.plot(trace.time, 1e3 * trace.position, color=color, label=name.replace("_", "-"))
axis.set(xlabel="time [s]", ylabel="position of the ring [µm]")
axis.legend(frameon=False)
plt.show()
