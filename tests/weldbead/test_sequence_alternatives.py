"""Alternatives at a state, against value and gap of the policy."""

import pytest

from sdpgrind import weldbead

POLICY = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=201)


@pytest.mark.parametrize(
    ("height", "time_left"),
    # on nodes; long passes do not fit in
    [(1.5, 30.0), (0.2, 12.0), (1.0, 10.0), (2.0, 8.0), (0.0, 6.0), (1.0, 4.0)],
)
def test_begins_with_the_value_and_goes_on_with_the_gap(height, time_left):
    costs = list(POLICY.alternatives(height, time_left, within=1e6).values())
    assert costs == sorted(costs)
    assert costs[0] == pytest.approx(POLICY.value(height, time_left), abs=1e-9)
    fitting = sum(duration <= time_left for duration in POLICY.problem.durations)
    assert len(costs) == fitting + 1  # and stopping
    if fitting:
        assert costs[1] - costs[0] == pytest.approx(POLICY.action(height, time_left).gap, abs=1e-9)
