"""
An optimal locus
================

A process is best where a limit just allows it, and the limit drifts with something that nobody can measure: a
tool wears, a wheel dulls. What can be measured is how near the limit is. Koren's idea: all points that can
ever be best lie on one curve. Find it beforehand, then walk along it by that one measurement."""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import hwsim
from sdpgrind import locus, units

# %%
# The curve
# ---------
# Functions are written once, of hidden states ``s`` and controls ``c``. What is measured must stay under what
# can be computed.
problem = locus.Problem(
    controls={"u": (0.0, 5.0), "v": (0.0, 10.0)},
    hidden={"x": (0.2, 20.0)},
    cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
    constraints=[
        locus.Varying(response=lambda s, c: s.x * c.v + 16 - 4 * c.v, limit=lambda s, c: 17 + c.u - 4 * c.v)
    ],
)
curve = locus.plan(problem)
print(curve)
for piece in curve.pieces:
    print(piece)
curve.plot()

# %%
# Up to x = 0.5 nothing limits the process. From there on the best point walks along a circle. Somebody runs
# it at (2.1, 2.8) and reads 7.0: which hidden state explains that, and what is best for it?
print(curve.retrieve(u=2.1, v=2.8, response=7.0))

# %%
# A control system of one's own needs no more than a table by one number, here by the reading on the locus.
table = curve.table("response")
print(f"{table.key.size} nodes; the best u and v where 7.0 is read on the locus: {table.at(7.0)}")

# %%
# Gains that are designed
# -----------------------
# Where the model may be wrong, feedback is safer: change one control until response and limit meet, and let
# the other follow on the locus. How strongly? Along the locus the slack falls with a known slope. It tells
# which gain is stable, which one never steps over the limit, and how far drift will push it over.
design = locus.gains.design_gain(curve, along="v", x=(0.758, 1.721))
print(f"stable below {design.stable:.3f}; no violation up to {design.violation_free:.3f}")
print(f"noise of the reading comes through {design.noise_gain:.2f} times")
print(f"a drift of 0.01 a step goes over the limit by up to {design.drift_margin(0.01):.3f}")

figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
for gain, colour in ((0.9, "#b04a3a"), (design.gain, "#4878a8"), (0.2, "0.6")):
    with warnings.catch_warnings():
        # 0.9 may step over the limit: that is what is to be seen
        warnings.simplefilter("ignore", UserWarning)
        controller = locus.LocusController(
            curve, along="v", gain=gain, x=(0.758, 1.721), start=0.3, hold="none"
        )
    command, slack = controller.command, []
    for _ in range(14):
        response, limit = 1.0 * command["v"] + 16 - 4 * command["v"], 17 + command["u"] - 4 * command["v"]
        slack.append(limit - response)
        command = controller.step(response=response)
    axis.plot(slack, "o-", ms=3, color=colour, label=f"gain {gain:.2f}")
axis.axhline(0, color="0.3", lw=0.8)
axis.set(xlabel="step", ylabel="slack (negative: over the limit)", title="x = 1")
axis.legend(frameon=False)

# %%
# Grinding
# --------
# The same for a grinding machine: as much removed as the dulling wheel allows without burning the work. Power
# is measured, infeed is changed, the speed of the work follows on the locus. The slide lags by 1.25 s.
# Koren's controller computes the limit from the commanded infeed, which the work does not feel yet; where the
# limit is taken at the actual infeed, nothing is overstated.
grinding = locus.preset("grinding")
curve = locus.plan(grinding)
grinder = hwsim.AdaptiveGrinder(grinding)
start = {"start": {"infeed_rate": units.um(1)}, "floor": units.um(0.8)}
koren = {"gain": 3.3e-6, "kp": 5.3e-6, "at": "command", "hold": 3.0}
dulling = 3e-6  # of the wear flat area in one sample
margin = locus.gains.design_gain(curve, along="infeed_rate").drift_margin(dulling)
print(f"margin for the drift: {margin:.2f} W; it knows nothing of the lag, so twice that is taken")
controllers = {
    "Koren's gains": locus.LocusController(curve, along="infeed_rate", **koren, **start),
    "designed": locus.LocusController(curve, along="infeed_rate"),
    "with margin": locus.LocusController(curve, along="infeed_rate", margin=2 * margin),
    "inversion": locus.LocusController(curve, along="infeed_rate", method="inversion"),
}
for name, controller in controllers.items():
    outcome = hwsim.run(grinder, controller, parts=5, rng=0, adapt=locus.LearnedStart()).outcome
    converged, slack = outcome.convergence_time.values, outcome.slack.values
    print(
        f"{name:14s} at the best infeed after {np.round(converged, 1)} s; least slack {np.round(slack, 1)} W"
    )

# %%
# Five parts, one after the other, each beginning where the one before ended: the wheel dulls, the best infeed
# falls.
log = hwsim.run(grinder, controllers["with margin"], parts=5, rng=0, adapt=locus.LearnedStart())
log.plot()

# %%
# Two limits
# ----------
# With roughness as a second limit the lead of the dresser is a third control, and two states are hidden: how
# dull dressing leaves the wheel, and how rough it grinds. Power is read in each sample, roughness once a part,
# and a lead counts at dressing only. The controller starts where no state of the range exceeds a limit, and
# keeps a margin for the noise of both gauges and for what dulling takes from the slack between two readings.
dressed = locus.preset("grinding-roughness")
area = locus.plan(dressed)
noise = {"grinding_power": 5.0, "roughness": units.um(0.005)}  # W, mm
controller = locus.AreaController(
    area, theta=0.5, noise=noise, drift={"grinding_power": 1.0}, per_part="dressing_lead", period=0.5
)
margin = controller.margins
print(f"margins: {margin['grinding_power']:.1f} W and {1e3 * margin['roughness']:.3f} um")
grinder = hwsim.AdaptiveGrinder(
    dressed,
    dullness=1.2,
    dressing_state=1.0,
    power_gauge=hwsim.devices.Gauge(noise_sd=noise["grinding_power"]),
    roughness_gauge=hwsim.devices.Gauge(noise_sd=noise["roughness"]),
)
outcome = hwsim.run(grinder, controller, parts=6, rng=0, adapt=locus.LearnedStart()).outcome
best = area.at(dullness=1.2, dressing_state=1.0).controls
print(f"time {np.round(outcome.time.values, 1)} s, at best {grinder.stock / best['infeed_rate']:.1f} s")
print(f"least slack of the power {np.round(outcome.slack.values, 1)} W")
print(f"slack of the roughness {np.round(1e3 * outcome.roughness_slack.values, 3)} um")
print(f"lead {np.round(outcome.dressing_lead.values, 3)} mm, best {best['dressing_lead']:.3f} mm")
plt.show()
