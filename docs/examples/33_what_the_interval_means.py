"""
What the interval means
=======================

Noise lifts RONt: a peak to valley counts the highest of all readings. The interval takes that off, and holds the
true RONt in about 95 of 100 measurements. It does so on average over forms, not for each of them; here is where it
fails."""

import numpy as np

from centering.roundness import Profile
from sdpgrind import units

# %%
# Three lobes, twenty times
# -------------------------
# The same form of 2 µm with new noise of 0.3 µm a reading, a Gaussian filter of 50 upr. As measured, RONt is too
# high nearly always; the value without the lift is not.
angle = np.linspace(0.0, 2 * np.pi, 1024, endpoint=False)


def measured(form, noise, rng):
    turn = Profile(angle, 30.0 + units.um(1.0) * form + units.um(noise) * rng.standard_normal(angle.size))
    return turn.filter("gaussian", upr=50).roundness("LSC")


def told(name, form, noise):
    circles = [measured(form, noise, rng) for rng in np.random.default_rng(1).spawn(20)]
    true = measured(form, 0.0, np.random.default_rng(0)).ron_t
    ends = [circle.interval() for circle in circles]
    lifted = 1e3 * (np.mean([circle.ron_t for circle in circles]) - true)
    left = 1e3 * (np.mean([each.value for each in ends]) - true)
    held = sum(each.low <= true <= each.high for each in ends)
    print(f"{name:20} lifted by {lifted:.2f} µm, without the lift {left:+.2f} µm off; {held} of 20 hold")


lobes = np.cos(3 * angle)
told("three lobes", lobes, 0.3)

# %%
# How far depends on the form
# ---------------------------
# One notch has one deepest place, chatter of 42 undulations has 42 highest: the more places tie, the more noise lifts.
# The calibrated interval draws noise about the harmonics that stand out of it. On a plateau the ripple that is below
# the noise decides how many places tie, and nobody can see it: the value stays high there, while the lower end is
# lowered for it.
told("chatter of 42 upr", np.cos(42 * angle), 0.3)
told("clipped oval", np.clip(np.cos(2 * angle), -0.6, 0.6) / 0.6, 0.3)
form = measured(np.clip(np.cos(2 * angle), -0.6, 0.6) / 0.6, 0.3, np.random.default_rng(2))
print(form.interval())
print(form.interval(method="guaranteed"))

# %%
# The guaranteed interval assumes nothing of the form: RONt is a norm, so that noise lifts it by no more than its own
# RONt. It is about twice as wide.
#
# How often it holds
# ------------------
# ``benchmarks/coverage_roundness.py``: 13 forms of 2 µm, 1024 points, Gaussian of 50 upr, phases and noise drawn anew in
# each copy. Share of calibrated intervals of 95 % that hold the true RONt, %: mean of eight forms, worst of them, worst of
# five others (trapezium and square wave, oval clipped, slot, one dent); largest median error of the value over the width
# of the interval. 1000 copies about the least squares circle; in the minimum zone 1000 at 0.3 µm, 200 at the other
# noises.
#
# .. list-table::
#    :header-rows: 1
#
#    * - noise of a reading, µm
#      - LSC: mean (worst); others
#      - median error; others
#      - MZC: mean (worst); others
#      - median error; others
#    * - 0.05
#      - 97.4 (96.8); 94.5
#      - 0.08; 0.36
#      - 98.2 (97.0); 97.0
#      - 0.12; 0.36
#    * - 0.1
#      - 97.6 (96.8); 94.5
#      - 0.08; 0.34
#      - 97.6 (95.0); 96.0
#      - 0.13; 0.36
#    * - 0.3
#      - 97.3 (94.8); 96.8
#      - 0.06; 0.29
#      - 97.3 (94.0); 95.6
#      - 0.11; 0.31
#    * - 0.5
#      - 98.0 (95.3); 97.1
#      - 0.06; 0.28
#      - 98.6 (96.0); 97.0
#      - 0.07; 0.25
#
# The guaranteed interval held in 98.1 % and more of the copies of each form. Other filters and bands, least squares
# circle; copies as told, so that a worst case is sure to some 2 %:
#
# .. list-table::
#    :header-rows: 1
#
#    * - filter
#      - copies
#      - noise 0.1 µm: mean (worst); others
#      - noise 0.3 µm
#    * - Gaussian band 2-15
#      - 200
#      - 97.0 (95.5); 95.0
#      - 96.3 (90.5); 96.5
#    * - Gaussian band 15-150
#      - 150
#      - 97.6 (94.7); 97.3
#      - 98.8 (94.7); 96.7
#    * - spline of 50 upr
#      - 150
#      - 98.2 (97.3); 92.7
#      - 98.1 (94.0); 94.0
#    * - 2RC of 50 upr
#      - 150
#      - 97.2 (95.3); 90.0
#      - 99.0 (96.0); 98.0
#    * - Gaussian of 50 upr, 512 points
#      - 150
#      - 97.4 (95.3); 89.3
#      - 98.1 (94.0); 94.0
#    * - Gaussian of 50 upr, 3600 points
#      - 80
#      - 98.4 (96.3); 92.5
#      - 98.6 (97.5); 92.5
#
# Of 52 cases some lie low by chance; the three lowest were drawn again. The dip on an oval in the band 2-15 held in 97.5 %
# of 1600 copies. The square wave of 9 lobes does hold less often with noise of 0.1 µm: in 87 % of 600 copies after 2RC, and in
# 83 % with 512 points.
#
# Where it fails
# --------------
# * A plateau: the value without the lift is high, by up to a third of the width.
# * After high passes and bands of spline and 2RC nothing was measured: the guaranteed interval is the default there. Nor
#   was it at other cut-offs than these, where the calibrated one is.
# * MCC and MIC have no interval: about them RONt is no norm. Neither has a robust filter, which is not linear.
# * An interval for one form may hold in fewer than 95 of 100 copies; only the guaranteed one never does.
# * The errors of the tester are not in it: they are in the budget (:doc:`32_a_sheet_to_sign`).
