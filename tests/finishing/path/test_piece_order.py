"""Order and directions of pieces on a table of costs: all of few against every order, many by small moves."""

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.finishing.path._order import EXACT, SEGMENT, best_order, cost_of, improved, least


def table(count, seed, even=False):
    """Costs of pieces whose ends lie in a square; uneven: any costs, other ones backwards."""
    rng = np.random.default_rng(seed)
    if not even:
        return rng.uniform(0.0, 1.0, (2 * count, 2 * count))
    ends = rng.uniform(0.0, 1.0, (count, 2, 2))
    ends[:, 1] = 0.7 * ends[:, 0] + 0.3 * ends[:, 1]
    starts, stops = ends.reshape(-1, 2), ends[:, ::-1].reshape(-1, 2)
    return np.linalg.norm(stops[:, None] - starts, axis=-1)


def every(count):
    """All sequences of states (m, n)."""
    orders = np.array(list(permutations(range(count))))
    ways = np.array(list(product((0, 1), repeat=count)))
    return (2 * orders[:, None] + ways).reshape(-1, count)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("count", range(1, 7))
def test_of_few_pieces_no_order_and_directions_are_cheaper(count, even):
    states = every(count)
    for seed in range(3):
        cost = table(count, seed, even)
        found = best_order(cost)
        total = cost[states[:, :-1], states[:, 1:]].sum(axis=1)
        assert found.exact and sorted(found.states // 2) == list(range(count))
        assert cost_of(cost, found.states) == pytest.approx(total.min(), abs=1e-12)


def moves_of(states):
    """Every reversal of a part, and every part of up to three pieces elsewhere: slow, obvious."""
    count = len(states)
    for i in range(count):
        for j in range(i, count):
            yield np.concatenate([states[:i], states[i : j + 1][::-1] ^ 1, states[j + 1 :]])
            if j - i < SEGMENT:
                rest, part = np.concatenate([states[:i], states[j + 1 :]]), states[i : j + 1]
                for place in range(len(rest) + 1):
                    for one in (part, part[::-1] ^ 1):
                        yield np.concatenate([rest[:place], one, rest[place:]])


@given(st.integers(2, 16), st.integers(0, 2**20), st.booleans())
def test_no_small_move_makes_an_improved_order_cheaper(count, seed, even):
    cost = table(count, seed, even)
    start = np.arange(0, 2 * count, 2)
    found = improved(cost, start)
    assert sorted(found // 2) == list(range(count)) and cost_of(cost, found) <= cost_of(cost, start)
    cheapest = min(cost_of(cost, each) for each in moves_of(found))
    assert cheapest >= cost_of(cost, found) - 1e-8 * cost_of(cost, start)


@settings(max_examples=30)
@given(st.integers(EXACT + 1, 30), st.integers(0, 2**20))
def test_many_pieces_are_never_dearer_than_as_given(count, seed):
    cost = table(count, seed, even=True)
    found = best_order(cost)
    assert not found.exact and sorted(found.states // 2) == list(range(count))
    assert cost_of(cost, found.states) <= cost_of(cost, np.arange(0, 2 * count, 2))


@pytest.mark.parametrize("seed", range(6))
def test_the_exact_order_is_never_dearer_than_the_improved_one(seed):
    cost = table(EXACT, seed, even=True)
    best = cost_of(cost, least(cost))
    assert best <= cost_of(cost, improved(cost, np.arange(0, 2 * EXACT, 2))) + 1e-12
    assert best == pytest.approx(cost_of(cost, best_order(cost).states), abs=1e-12)


@pytest.mark.parametrize("count", [EXACT, EXACT + 1, 40])
def test_rows_are_done_there_and_back(count):
    """Rows of 5 mm, 1 mm apart, in any order: no order is shorter than one step a row."""
    across = np.random.default_rng(count).permutation(count).astype(float)
    ends = np.stack([np.zeros((count, 2)), np.repeat(across[:, None], 2, axis=1)], axis=-1)
    ends[:, 1, 0] = 5.0
    starts, stops = ends.reshape(-1, 2), ends[:, ::-1].reshape(-1, 2)
    cost = np.linalg.norm(stops[:, None] - starts, axis=-1)
    assert cost_of(cost, best_order(cost).states) == pytest.approx(count - 1.0)


@pytest.mark.parametrize("count", [5, 20])
def test_an_order_that_is_as_good_stays(count):
    assert best_order(np.ones((2 * count, 2 * count))).states.tolist() == list(range(0, 2 * count, 2))


def test_of_two_orders_of_one_cost_more_pieces_go_forward():
    """A row of pieces from right to left: backwards all, or all forward from the other end."""
    starts = np.arange(6.0)[::-1]
    ends = np.stack([starts, starts + 0.5], axis=1)
    cost = np.abs(ends[:, ::-1].reshape(-1)[:, None] - ends.reshape(-1))
    assert best_order(cost).states.tolist() == [10, 8, 6, 4, 2, 0]
