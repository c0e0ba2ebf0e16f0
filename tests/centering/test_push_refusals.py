"""What is no problem or no model is refused by name, at every door."""

import pytest
from push_inside import TooFastError

from centering import plan_push, preset
from centering.push import energy_balance_speed, free_slide, gentle_profile, plan_touch, sliding_speed
from centering.push.turning import launch_for, slide_to_rest, spindle_acceleration_limit, spindle_speed_limit

PROBLEMS = [
    lambda: spindle_speed_limit(5, offset=1.0),
    lambda: spindle_acceleration_limit(5, offset=1.0, spindle_speed=1.0),
    lambda: energy_balance_speed(5, 1.0),
    lambda: plan_touch(5, offset=1.0, spindle_speed=1.0, push_speed=1.0),
    lambda: plan_push(5, offset=1.0, spindle_speed=1.0, push_speed=1.0),
]
MODELS = [
    lambda: sliding_speed(5, 1.0),
    lambda: free_slide(5, 1.0),
    lambda: slide_to_rest(5, speed=1.0, spin=1.0),
    lambda: launch_for(5, distance=1.0, turn=1.0),
    lambda: gentle_profile(5, 1.0, 1.0),
    lambda: plan_push(preset("printed"), offset=1.0, spindle_speed=1.0, push_speed=10.0).arrival(5),
    lambda: plan_push(preset("printed"), offset=1.0, spindle_speed=1.0, push_speed=10.0).simulate(5),
]


@pytest.mark.parametrize("call", PROBLEMS)
def test_what_is_no_problem_is_refused(call):
    with pytest.raises(TypeError, match=r"^problem must be a CenteringProblem; got 5$"):
        call()


@pytest.mark.parametrize("call", MODELS)
def test_what_is_no_model_is_refused(call):
    with pytest.raises(TypeError, match=r"^model must be a PushModel; got 5$"):
        call()


def test_a_table_too_fast_for_an_offset_is_named():
    """20 mm at 3 rad/s: the speed of the table must change, and the message begins with it."""
    told = r"^spindle_speed must be less at an offset of 20 mm, .* the rim arrives before the push; .*\(rad/s\); got 3.0$"
    with pytest.raises(TooFastError, match=told):
        plan_push(preset("printed"), offset=20.0, spindle_speed=3.0, push_speed=15.0)
