"""The running correction of the stroke: Mears (6.16)-(6.18)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from centering.cycle import StrokeCorrection, travelled

OFFSETS, ANGLES = st.floats(0.0, 20.0), st.floats(-7.0, 7.0)


@settings(deadline=None)
@given(OFFSETS, ANGLES, OFFSETS, ANGLES)
def test_travel_is_the_difference_of_the_two_places(before, from_angle, offset, angle):
    apart = abs(before * np.exp(1j * from_angle) - offset * np.exp(1j * angle))
    assert travelled(before, from_angle, offset, angle) == pytest.approx(apart, abs=1e-6)


def test_travel_keeps_small_differences():
    assert travelled(10.0, 1.0, 10.0 - 1e-7, 1.0) == pytest.approx(1e-7, rel=1e-6)


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.01, 10.0), st.floats(0.0, 12.0), st.floats(-1.0, 1.0)), max_size=20))
def test_the_correction_is_the_clamped_running_sum(pushes):
    correction, value = StrokeCorrection(0.5), 0.0
    for wanted, way, gap in pushes:
        value = np.clip(value + (max(gap, 0.0) if way < 0.05 * wanted else wanted - way), -0.5, 0.5)
        assert correction.update(wanted=wanted, travelled=way, gap_left=gap) == pytest.approx(
            value, abs=1e-12
        )
    correction.reset()
    assert correction.value == 0.0


def test_a_missed_push_adds_the_gap_and_nothing_else():
    correction = StrokeCorrection()
    assert correction.update(wanted=1.0, travelled=0.049, gap_left=0.2) == 0.2
    assert correction.update(wanted=1.0, travelled=0.051, gap_left=0.2) == 0.5  # 0.2 + 0.949, clamped


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"wanted": 0.0, "travelled": 1.0}, "wanted must be > 0 .mm."),
        ({"wanted": 1.0, "travelled": -1.0}, "travelled must be >= 0 .mm."),
        ({"wanted": 1.0, "travelled": 1.0, "gap_left": float("nan")}, "gap_left must be finite .mm."),
    ],
)
def test_bad_input_of_an_update(arguments, message):
    with pytest.raises(ValueError, match=message):
        StrokeCorrection().update(**arguments)


def test_bad_limit_and_places():
    with pytest.raises(ValueError, match=r"limit must be > 0 .mm.; got 0.0"):
        StrokeCorrection(0.0)
    with pytest.raises(ValueError, match=r"offset must be >= 0 .mm."):
        travelled(1.0, 0.0, -1.0, 0.0)
