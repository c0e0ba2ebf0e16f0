"""Copies of controllers have a state of their own and share the rest."""

import copy

import numpy as np

from sdpgrind.base.controllers import Stateful


class Counting(Stateful):
    _changing = ("state", "not_there_yet")

    def __init__(self, plan):
        self.plan, self.count, self.state = plan, 0, np.zeros(2)


def test_a_copy_goes_its_own_way_and_shares_the_plan():
    one = Counting(plan=["whatever a user gives"])
    one.state[0], one.count = 1.0, 1
    twin = copy.deepcopy(one)
    twin.state[0], twin.count = 2.0, 2
    assert (one.state[0], one.count, twin.state[0], twin.count) == (1.0, 1, 2.0, 2)
    assert twin.plan is one.plan and "not_there_yet" not in twin.__dict__
