"""Problems without a deadline: what settles, and when."""

import pytest

from sdpgrind import sdp


@pytest.mark.parametrize("apart", [6e-10, 8e-8])  # a tie is 1e-9 + 1e-7 of the value, which is 1 to 10 here
def test_actions_that_tie_do_not_follow_each_other_for_ever(apart):
    """The first of two is taken within the width of a tie: its exact cost is off the least by that, at every sweep."""

    def step(s, c, e):
        return (s.x - 0.3 - 0.1 * e.n,)

    def move(name, charge):
        return sdp.Move(name, {}, sdp.Sampled(step, {"n": sdp.Normal(0.0, 1.0)}), charge=charge)

    axis = sdp.Axis("x", 0.0, 3.0, 31, "mm", below=0.0, above="hold")
    problem = sdp.Problem((axis,), (move("first", 1.0 + apart), move("least", 1.0)), (), sdp.Forever())
    least = sdp.Problem((axis,), (move("least", 1.0),), (), sdp.Forever())
    tied = sdp.plan(problem)
    assert tied.value(x=3.0) == pytest.approx(sdp.plan(least).value(x=3.0), abs=20 * apart + 1e-9)
    assert tied.action(x=3.0).name == "first"
