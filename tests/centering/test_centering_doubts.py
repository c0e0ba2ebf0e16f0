"""Doubts about centering, on the sample ring, drawn scans and pushes."""

from pathlib import Path

import numpy as np
import pytest

from centering import Profile, TipProfile, preset, simulate_push

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
PROBLEM = preset("printed")


def test_the_sample_ring():
    """Offset 0.3 mm at 0.7 rad, harmonic 3 of 3.007 um, radius 40 mm, by the specification."""
    ring = Profile.read(SAMPLES / "ring_degrees.csv", angle="angle", deviation="deviation", radius=40.0)
    doubts = PROBLEM.replace(radius=40.0).doubts((ring.angle, ring.reading))
    assert doubts["radius"].verdict == "agrees" and doubts["radius"].low < 40.0 < doubts["radius"].high
    assert "0.3000 mm at 0.7 rad" in str(doubts) and "harmonic 3: 3.01 µm" in str(doubts)
    assert doubts["mu_static"].verdict == "not told" and doubts.figure is None


def test_another_radius_differs_and_an_arc_is_said():
    angle = np.radians(np.arange(0.0, 200.0))
    reading = 61.9 + 0.05 * np.cos(angle - 1.0) + np.random.default_rng(0).normal(0.0, 1e-3, angle.size)
    doubts = PROBLEM.doubts({"angle": angle, "reading": reading})
    assert doubts["radius"].verdict == "differs" and doubts["radius"].chance < 1e-6
    assert any("cover 199 degrees: a whole turn" in sentence for sentence in doubts.sentences)


def test_pushes_tell_the_kinetic_friction(monkeypatch):
    monkeypatch.setattr("centering._doubts.cost._time", lambda problem, start: 1e1 * problem.model.mu_kinetic)
    true = PROBLEM.model.replace(mu_static=0.22, mu_kinetic=0.165)
    push = simulate_push(true, TipProfile.constant_speed(40.0, 0.1))
    doubts = PROBLEM.doubts([push] * 5)
    row = doubts["mu_kinetic"]
    assert row.verdict == "differs" and row.low < 0.165 < row.high
    assert doubts["radius"].verdict == "not told"
    (stake,) = [each for each in doubts.stakes if each.name == "mu_kinetic"]
    assert (stake.at_low, stake.at_high) == pytest.approx((10 * row.low, 10 * row.high))


def test_both_coefficients_are_taken_over_together(monkeypatch):
    """One alone has no plan: the kinetic coefficient told exceeds the static one believed."""

    def time(problem, start):
        return problem.model.mu_static + 10 * problem.model.mu_kinetic

    monkeypatch.setattr("centering._doubts.cost._time", time)
    true = PROBLEM.model.replace(mu_static=0.26, mu_kinetic=0.225)
    push = simulate_push(true, TipProfile.constant_speed(40.0, 0.1))
    doubts = PROBLEM.doubts([push] * 5)
    alone = next(each for each in doubts.stakes if each.name == "mu_kinetic")
    assert np.isnan(alone.at_low) and "mu_static must be >= mu_kinetic" in alone.reason
    static, kinetic = (doubts[name].told for name in ("mu_static", "mu_kinetic"))
    together = doubts.stakes[-1]
    assert together.name == "all of them" and together.at_low == together.at_high
    assert together.at_low == pytest.approx(static + 10 * kinetic)
    assert "each as told" in str(doubts)


def test_refusals():
    with pytest.raises((TypeError, ValueError), match=r"pushes|data"):
        PROBLEM.doubts(3.0)
