"""Doubts about the model of a locus: one field at a time, and the least cost at both ends."""

import numpy as np
import pytest

from sdpgrind import locus

PROBLEM = locus.preset("grinding")
RATE, AREA = (each.ravel() for each in np.meshgrid([0.01, 0.015, 0.02], np.linspace(0.006, 0.009, 8)))


def measured(model, seed, sd=1.0):
    controls = {"infeed_rate": RATE, "work_rotation": np.full(RATE.size, 10.0), "wear_flat_area": AREA}
    power = model.grinding_power(*controls.values())
    return controls | {"grinding_power": power + np.random.default_rng(seed).normal(0.0, sd, RATE.size)}


def test_a_field_that_differs_and_stakes_solved_again():
    true = PROBLEM.model.replace(specific_energy=12.0)
    doubts = PROBLEM.doubts(measured(true, 0))
    row = doubts["specific_energy"]
    assert row.verdict == "differs" and row.low < 12.0 < row.high
    assert any("specific_energy alone explains grinding_power best" in each for each in doubts.sentences)
    assert any("work_rotation never changed" in each for each in doubts.sentences)
    assert doubts["u0"].verdict == "not told" and doubts["width"].verdict == "not told"
    stake = next(each for each in doubts.stakes if each.name == "specific_energy")
    again = locus.plan(PROBLEM.replace(specific_energy=stake.low)).at(wear_flat_area=0.0072)
    assert stake.at_low == pytest.approx(again.cost, rel=1e-9)


def test_a_true_model_differs_by_chance_only(monkeypatch):
    """5 % of 60 are 3; 10 at the most but once in a thousand, the fields of one log being alike."""
    monkeypatch.setattr("sdpgrind.locus._doubts.cost.of_plan", lambda problem, rows: (None, ()))
    said = [PROBLEM.doubts(measured(PROBLEM.model, seed))["specific_energy"].verdict for seed in range(60)]
    assert said.count("differs") <= 10 and said.count("not told") == 0


def test_a_hidden_state_that_was_not_measured_is_named():
    data = {name: values for name, values in measured(PROBLEM.model, 1).items() if name != "wear_flat_area"}
    doubts = PROBLEM.doubts(data)
    assert "data must hold wear_flat_area" in doubts["specific_energy"].note and not doubts.stakes
    with pytest.raises(ValueError, match="data must hold a response, grinding_power"):
        PROBLEM.doubts({"infeed_rate": RATE})
