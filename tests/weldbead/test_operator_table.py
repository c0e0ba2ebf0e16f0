"""The operator's table: what reading it in steps costs, by two ways; files; refusals."""

import csv

import numpy as np
import pytest

from sdpgrind import weldbead
from sdpgrind.weldbead.sequence._operator_rule import TableRule

ROWS, COLUMNS = (0.1, 0.25, 0.5, 0.8, 1.2, 2.0), (6.0, 20.0, 40.0, 60.0)


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(weldbead.preset("P1"), tolerance=1e-2)


@pytest.fixture(scope="module")
def table(policy):
    return policy.operator_table(heights=ROWS, times=COLUMNS)


def by_hand(table, height, left, rng):
    """One bead ground by `table.action` alone, each cut drawn from the law of the problem."""
    problem = weldbead.preset("P1")
    penalty = 0.0
    while True:
        duration, force = table.action(height, left)
        if duration == 0:
            charge = problem.height_charge
            return penalty + float((charge.under if height >= 0 else charge.over)(np.array(abs(height))))
        law = problem.scatter.cut(problem.model, force, problem.feed_rate(duration))
        height -= float(law.sample(rng, (1,))[0])
        left -= duration


def test_expected_penalty_is_that_of_20_000_parts_ground_by_the_table(policy, table):
    rule = TableRule(policy.table, table.heights, table.times)
    runs = rule.simulate(runs=20_000, height=2.0, time_left=60.0, rng=3)
    assert abs(runs.mean - table.expected) < 4 * runs.standard_error
    assert runs.standard_error < 0.01 * table.expected


def test_following_the_printed_cells_gives_the_same(table):
    rng = np.random.default_rng(5)
    penalties = [by_hand(table, 2.0, 60.0, rng) for _ in range(1000)]
    error = np.std(penalties) / np.sqrt(len(penalties))
    assert abs(np.mean(penalties) - table.expected) < 4 * error


def test_more_rows_and_columns_cost_less_and_the_plan_least(policy, table):
    rows = np.linspace(0.02, 2.0, 100)
    finer = policy.operator_table(heights=rows, times=np.arange(6.0, 62.0, 2.0))
    assert 0 < finer.loss < 0.2 * table.loss
    assert table.planned == pytest.approx(policy.value(2.0, 60.0), abs=policy.error)


def test_the_whole_table_says_what_it_costs(policy):
    found = policy.operator_table()
    assert found.full == (found.loss > 0.02 * found.planned) and found.heights[-1] == 2.0
    assert found.loss < 0.5 * found.planned and ("does not fit" in str(found)) == found.full
    assert len(found.heights) <= 45 and len(found.times) <= 15


@pytest.mark.parametrize(
    ("height", "left", "row", "column"),
    [(0.3, 40.0, 2, 2), (0.5, 39.9, 2, 1), (0.5001, 60.0, 3, 3), (5.0, 61.0, 5, 3)],
)
def test_a_cell_is_found_up_in_height_and_down_in_time(table, height, left, row, column):
    assert table.action(height, left) == (table.duration[row, column], table.normal_force[row, column])


def test_at_the_target_and_without_time_it_stops(table):
    for state in (0.0, 30.0), (-0.1, 30.0), (1.0, 5.0):
        assert table.action(*state)[0] == 0 and np.isnan(table.action(*state)[1])


def test_files_hold_the_table(table, tmp_path):
    for ending in "csv", "txt", "html":
        table.save(tmp_path / f"bead.{ending}")
    with (tmp_path / "bead.csv").open() as file:
        lines = list(csv.reader(file))
    assert lines[0] == ["height [mm]", "time_left [s]", "duration [s]", "normal_force [N]"]
    numbers = np.array([[float(x or "nan") for x in line] for line in lines[1:]])
    np.testing.assert_array_equal(numbers[:, 2].reshape(table.duration.shape), table.duration)
    np.testing.assert_array_equal(numbers[:, 3].reshape(table.duration.shape), table.normal_force)
    for ending in "txt", "html":
        text = (tmp_path / f"bead.{ending}").read_text()
        assert f"{table.duration[5, 3]:g} / {table.normal_force[5, 3]:.4g}" in text
        assert all(sentence in text for sentence in table.sentences)
    assert np.all(np.diff(table.heights) > 0) and "of the greater height, further down." in table.sentences[0]
    assert np.all(np.diff(table.times) > 0) and "of the shorter time, further left." in table.sentences[0]


def test_forces_are_within_the_limits(policy):
    found = policy.operator_table(heights=np.linspace(0.05, 2, 40), times=[6, 30, 60])
    for duration in np.unique(found.duration[found.duration > 0]):
        low, high = policy.problem.force_interval(float(duration))
        force = found.normal_force[found.duration == duration]
        assert np.all(force <= high) and np.all(force >= low * (1 - 1e-3))  # four digits, rounded down


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"heights": [1.0, 0.5]}, r"heights must be rising numbers > 0 \(mm\)"),
        ({"heights": [0.5, 3.0]}, r"heights\[-1\] must be <= height_max, 2 \(mm\); got 3.0"),
        ({"times": [20.0, 90.0]}, r"times\[-1\] must be <= horizon, 60 \(s\); got 90.0"),
        ({"path": "bead.pdf"}, r"ending of path must be one of"),
    ],
)
def test_wrong_input_is_refused(policy, given, sentence):
    with pytest.raises(ValueError, match=sentence):
        policy.operator_table(**{"heights": ROWS, "times": COLUMNS} | given)
