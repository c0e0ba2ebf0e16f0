"""
How sure is sure?
=================

"99.9 %" is easily said. Here it is counted: fifteen hundred parts whose centre is known, because they are
simulated. Then the two things that no formula of independent noise knows of: form, and noise that is not
independent."""

import matplotlib.pyplot as plt
import numpy as np

import centering
from sdpgrind import units

# %%
# Counting
# --------
# Three pushes of a part, from far off-centre to nearly centred, with noise of 40 µm, as in chapter 4 of Mears
# (2006). The printed rule takes the error of a mean, and stops too early. ``GeometryEstimator`` asks how well
# these angles determine the centre in its worst direction. "Inside" means: the true centre was no farther
# away than was said.
angle = units.deg(np.arange(6000.0))
rng = np.random.default_rng(0)
shares = {"printed": [], "ours": []}
printed_rule = centering.circle.PrintedEstimator("prls")
ours = centering.GeometryEstimator(noise_sd=0.04, joint=True, model="limacon")
print(f"{'offset':>10}{'printed: readings':>20}{'inside':>10}{'ours: readings':>18}{'inside':>10}")
for offset, most in ((20.0, 360), (1.0, 360), (0.1, 6000)):
    true = centering.circle.limacon_reading(angle[:most], 61.94, offset, units.deg(90))
    inside, readings = {"printed": [], "ours": []}, {"printed": [], "ours": []}
    for _ in range(500):
        seen = true + rng.normal(0.0, 0.04, most)
        history = printed_rule.history(angle[:360], seen[:360])
        last = int(np.argmax(history.valid)) if history.valid.any() else 359
        found = history.offset[last] * np.exp(1j * history.offset_angle[last])
        inside["printed"].append(abs(found - 1j * offset) <= history.band[last] / 2)
        readings["printed"].append(last + 1)
        ours.reset()
        readings["ours"].append(ours.first_valid(angle[:most], seen) + 1)
        circle = ours.estimate
        off = np.hypot(circle.center_x, circle.center_y - offset)
        inside["ours"].append(off <= circle.uncertainty(0.999, joint=True))
    for name, many in inside.items():
        shares[name].append(100 * np.mean(many))
    told = "".join(
        f"{np.median(readings[name]):{wide}.0f}{shares[name][-1]:9.1f} %"
        for name, wide in (("printed", 20), ("ours", 18))
    )
    print(f"{offset:7g} mm{told}")
figure, ax = plt.subplots(figsize=(6.5, 3), layout="constrained")
for shift, (name, color) in zip((-0.2, 0.2), (("printed", "#b04a3a"), ("ours", "#4878a8")), strict=True):
    ax.bar(np.arange(3) + shift, shares[name], 0.38, color=color, label=name)
ax.axhline(99.9, color="0.3", lw=0.8, ls="--")
ax.set(
    xticks=range(3), xticklabels=["20 mm", "1 mm", "0.1 mm"], xlabel="offset", ylabel="true centre inside [%]"
)
ax.legend(frameon=False)

# %%
# Being sure takes data: for the last push fourteen turns, where the source believed one. That is what 3 µm
# cost at a noise of 40 µm; a quieter probe or a coarser tolerance is the way out, not another formula.
#
# Form
# ----
# A part with three lobes of 3 µm, measured with 1 µm of noise. The estimator that knows of noise alone is
# sure after 60 degrees, and 18 µm wrong where it says 10. Told that there may be lobes (``form=``) it adds
# how far they could bend the estimate, and turns on. Once the spectrum is known, it can be subtracted
# (``harmonics=``), and a short arc is enough again.
lobes, offset = 0.003, 0.5
turn = units.deg(np.arange(0.0, 360.0))
spectrum = centering.roundness.Harmonics([3], [lobes], [1.0])


def read(turned):
    """Readings of a ring with three lobes, near enough for so small an offset."""
    circle = centering.circle.circle_reading(turned, 61.94, offset, 0.4)
    return (
        circle + lobes * np.cos(3 * turned - 1.0) + np.random.default_rng(1).normal(0.0, 0.001, turned.size)
    )


figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
cases = {
    "noise alone": {},
    "told of lobes": {"form": {3: lobes}},
    "lobes subtracted": {"harmonics": spectrum},
}
for (name, told), color in zip(cases.items(), ("#b04a3a", "#4878a8", "#5a9a68"), strict=True):
    estimator = centering.GeometryEstimator(noise_sd=0.001, rel_tol=0.02, **told)
    estimator.extend(turn[:10], read(turn)[:10])
    errors, bands, valid = [], [], None
    for a, r in zip(turn[10:], read(turn)[10:], strict=True):
        estimator.update(angle=a, reading=r)
        circle = estimator.estimate
        errors.append(
            1e3 * np.hypot(circle.center_x - offset * np.cos(0.4), circle.center_y - offset * np.sin(0.4))
        )
        bands.append(1e3 * estimator.band)
        valid = a if valid is None and estimator.valid else valid
    at = int(np.argmin(np.abs(turn[10:] - valid)))
    print(
        f"{name:18} valid after {np.rad2deg(valid):3.0f} degrees: within {bands[at]:5.1f} µm, it says; {errors[at]:5.1f} µm it is"
    )
    ax.semilogy(np.rad2deg(turn[10:]), bands, color=color, label=f"{name}: said")
    ax.semilogy(np.rad2deg(turn[10:]), errors, color=color, ls=":", label="true")
ax.axhline(1e3 * 0.02 * offset, color="0.5", lw=0.8, ls="--")
ax.set(xlabel="turned [degrees]", ylabel="centre within [µm]", xlim=(10, 360), ylim=(0.03, 1e3))
ax.legend(frameon=False, fontsize=8, ncols=3)

# %%
# How much an arc makes of a lobe can be known beforehand:
for upr in (2, 3, 5):
    gains = [
        centering.circle.form_gain(units.deg(np.arange(0.0, arc, 0.5)), upr)
        for arc in (30, 60, 90, 120, 180, 270, 360)
    ]
    print(
        f"{upr} undulations: centre off by",
        "".join(f"{gain:7.2f}" for gain in gains),
        "times their amplitude",
    )

# %%
# So can the effect of noise: from the derivatives of the curve follows the least standard deviation that an
# unbiased fit to an arc can have, here for 1 µm of noise and a reading a degree.
for arc in (30, 60, 90, 180, 360):
    rows = centering.circle.circle_derivatives(units.deg(np.arange(float(arc))), 61.94, offset, 0.4)
    sd = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    print(f"{arc:3} degrees: radius known to {sd[0]:5.2f} µm, offset to {sd[1]:5.2f} µm")

# %%
# Noise that is not independent
# -----------------------------
# A ground surface is smooth from degree to degree: neighbours err together, and ten readings say no more than
# one. A test for a normal distribution often sees nothing of it; the correlation does. The estimator widens
# its band by what it sees.
rng, noise = np.random.default_rng(7), np.zeros(720)
for k in range(1, 720):
    noise[k] = 0.88 * noise[k - 1] + rng.normal(0.0, 0.01 * np.sqrt(1 - 0.88**2))
two = units.deg(np.arange(720.0))
estimator = centering.GeometryEstimator(noise_sd=0.001)
estimator.extend(two, centering.circle.circle_reading(two, 61.94, 0.5, 0.4) + noise)
circle = estimator.estimate
left = centering.circle.circle_reading(two, 61.94, 0.5, 0.4) + noise - circle.reading(two)
checks = centering.circle.residual_checks(left)
print(
    f"looks normal: {checks.normal}; looks independent: {checks.independent}, with a correlation of {checks.lag_1:.2f}"
)
print(f"band times {circle.inflation:.2f}; {circle.message}")

# %%
# Both of these are why the answer comes with a sentence that says what limits it. Look at it before buying a
# better probe.
plt.show()
