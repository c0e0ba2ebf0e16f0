"""Doubts about finishing, on the sample file, the source's study and motion of the axis."""

from pathlib import Path

import numpy as np
import pytest

import hwsim
from sdpgrind import finishing

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
CALL = {
    "period": 1.0,
    "pattern": "pattern",
    "tool_diameter": "tool",
    "normal_force": "F",
    "roughness_ra": "Ra",
}
PROBLEM = finishing.preset("nominal")


def test_the_sample_file():
    """Tool exponent -0.813 +- 0.022 by the specification, true -0.8."""
    doubts = PROBLEM.doubts(hwsim.Log.read(SAMPLES / "finishing_runs.csv", **CALL))
    row = doubts["tool_exponent"]
    assert row.told == pytest.approx(-0.813, abs=1e-3) and row.low < -0.8 < row.high
    assert row.verdict == "differs" and doubts["intercept"].verdict == "not told"
    assert "normal_force was 5, 8, 12 N; the model is meant for 0.556 to 1.667 N." in doubts.sentences


def test_the_study_of_the_source_agrees_with_its_model():
    doubts = PROBLEM.doubts(finishing.Study.published("wang-2001"))
    assert {row.verdict for row in doubts.rows} == {"agrees"} and len(doubts.rows) == 7
    force, model = PROBLEM.model.best_force(), PROBLEM.model
    believed = model.median(PROBLEM.path.pattern, PROBLEM.tool_diameter, force, extrapolate=True)
    assert doubts.figure.value == pytest.approx(1e3 * float(believed))
    assert doubts.stakes[0].change(doubts.figure.value) >= doubts.stakes[-1].change(doubts.figure.value)


def motion(way, load=0.02, amplitude=0.3):
    """Free motion under a current that changes each 0.1 s, as the encoder shows it."""
    axis = finishing.TorqueAxis()
    time = np.arange(400) * axis.sample_time
    current = load / axis.torque_constant + amplitude * np.sign(
        np.sin(2 * np.pi * time / (40 * axis.sample_time) + 0.1)
    )
    gain = (axis.torque_constant * current[:-1] - load) / axis.inertia
    step = axis.sample_time
    speed = np.concatenate([[0.0], np.cumsum(gain * step)])
    angle = np.concatenate([[0.0], np.cumsum(speed[:-1] * step + 0.5 * gain * step**2)])
    shown = np.round(angle / axis.angle_step) * axis.angle_step
    before = np.concatenate([current[:1], current[:-1]])
    recorded = {"begin": current, "end": before, "centre": 0.5 * (current + before)}[way]
    return {"time": time, "motor_angle": shown, "current": recorded}


def test_a_load_torque_and_the_alignment_of_the_current():
    doubts = PROBLEM.doubts(motion("begin"))
    row = doubts["load_torque"]
    assert row.low < 0.02 < row.high and row.verdict == "differs" and doubts.alignment == "begin"
    assert doubts["tool_exponent"].verdict == "not told"


def test_angles_that_do_not_move_as_the_current_drives_them():
    words = "times as far as torque_constant x current / inertia"
    right = motion("begin")
    for data in (right, right | {"current": np.full(400, 0.1)}):
        assert not any(words in each for each in PROBLEM.doubts(data).sentences)
    degrees = right | {"motor_angle": np.degrees(right["motor_angle"])}
    (told,) = [each for each in PROBLEM.doubts(degrees).sentences if words in each]
    assert " 57 times " in told
    amperes = right | {"current": 1e3 * right["current"]}
    (told,) = [each for each in PROBLEM.doubts(amperes).sentences if words in each]
    assert " 0.00100 times " in told


def test_missing_columns():
    with pytest.raises(ValueError, match="data must hold roughness_ra"):
        PROBLEM.doubts({"time": [0.0, 1.0]})
