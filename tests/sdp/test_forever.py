"""Problems without a deadline: what settles, and when."""

import numpy as np
import pytest

from sdpgrind import sdp
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve import forever as _forever
from sdpgrind.sdp._solve.bundles import Bundles


@pytest.mark.parametrize("apart", [6e-10, 8e-8])  # a tie is 1e-9 + 1e-7 of the value, which is 1 to 10 here
def test_actions_that_tie_do_not_follow_each_other_for_ever(apart):
    """The first of two is taken within the width of a tie: its exact cost is off the least by that, at every
    sweep.
    """

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


def swept_and_evaluated(chance):
    """A process that ends with a chance at each step of 1 $: after one sweep, and its cost as it is found."""

    def step(s, c, e):
        return (s.x - e.n,)

    axis = sdp.Axis("x", 0.0, 1.0, 3, "mm", below=0.0)
    ends = sdp.Discrete([0.0, 2.0], [1.0 - chance, chance])
    move = sdp.Move("try", {}, sdp.Sampled(step, {"n": ends}), charge=1.0)
    problem = sdp.Problem((axis,), (move,), (), sdp.Forever())
    grid = Grid.of(problem)
    bundles, stops, begun = Bundles(problem, grid), StopCharges(problem, grid), np.zeros((1, grid.size))
    table = _forever._improve(problem, grid, bundles, stops, begun)
    found = _forever._evaluated(problem, grid, stops, table, table.value[0])
    return table.value[0, 0, 1:], found[0, 1:]  # the first node lies on the edge where it ends


def test_a_policy_that_is_not_evaluated_to_the_end_is_not_believed(monkeypatch):
    """Of a large grid the cost is found by steps: 5000 of them find 4 thousand of 10 thousand $."""
    swept, direct = swept_and_evaluated(1e-4)
    np.testing.assert_allclose(direct, 1e4, rtol=1e-9)
    monkeypatch.setattr(_forever, "DIRECT", 0)
    swept, stepped = swept_and_evaluated(0.01)
    np.testing.assert_allclose(stepped, 100.0, rtol=1e-9)
    swept, stepped = swept_and_evaluated(1e-4)
    np.testing.assert_array_equal(stepped, swept)
    assert np.all(swept == 1.0)


def test_charges_of_stops_lie_in_memory_as_values_do():
    """Kernels are compiled for the order of arrays: of another one, they would be compiled again."""
    axis = sdp.Axis("x", 0.0, 1.0, 3, "mm", below=0.0)
    wait = sdp.Move("wait", {}, sdp.Stay(), charge=1.0)
    stops = [sdp.Stop("stop", lambda s: s.x**2)]  # the same in both modes
    problem = sdp.Problem((axis,), (wait,), stops, sdp.Forever(), modes=("a", "b"))
    found = StopCharges(problem, Grid.of(problem)).at(0, 0.0)
    assert found.shape == (1, 2, 3) and found.flags.c_contiguous
