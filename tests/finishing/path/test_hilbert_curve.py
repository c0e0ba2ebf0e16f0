"""A Hilbert curve by its index, by strings and by recursion; its counts, turns and lengths; what the source's
drawing does.
"""

import numpy as np
import pytest
from finishing_inside import hilbert as module

from sdpgrind.finishing import hilbert
from sdpgrind.finishing.path import hilbert_lsystem, hilbert_nodes
from sdpgrind.finishing.surface import flat_surface

TURNS = {1: 2, 2: 12, 3: 50, 4: 204, 5: 818, 6: 3276, 7: 13106}


def recursive(order):
    """Four curves of the order before: one mirrored in the diagonal, two as they are, one mirrored in the
    other diagonal.
    """
    nodes, side = np.zeros((1, 2), int), 1
    for _ in range(order):
        x, y = nodes.T
        last = np.stack([2 * side - 1 - y, side - 1 - x], axis=1)
        nodes = np.concatenate([nodes[:, ::-1], nodes + np.array([0, side]), nodes + side, last])
        side *= 2
    return nodes


def distinct(nodes):
    return len(set(map(tuple, nodes.tolist())))


@pytest.mark.parametrize("order", range(1, 9))
def test_three_ways_to_the_same_nodes(order):
    np.testing.assert_array_equal(hilbert_nodes(order), recursive(order))
    np.testing.assert_array_equal(hilbert_lsystem(order), recursive(order))


@pytest.mark.parametrize("order", range(1, 10))
def test_counts_steps_and_turns(order):
    nodes = hilbert_nodes(order)
    side = 2**order
    assert len(nodes) == 4**order
    assert set(np.unique(nodes[:, 0] * side + nodes[:, 1])) == set(range(side**2))
    steps = np.diff(nodes, axis=0)
    assert np.all(np.abs(steps).sum(axis=1) == 1)
    turns = int(np.any(np.diff(steps, axis=0), axis=1).sum())
    assert turns == 4 * (4**order - 1) // 5 == TURNS.get(order, turns)
    assert nodes[0].tolist() == [0, 0] and nodes[-1].tolist() == [side - 1, 0]


@pytest.mark.parametrize("order", range(1, 8))
@pytest.mark.parametrize("edge", [False, True])
def test_lengths(order, edge):
    path = hilbert(flat_surface(20.0), order, mapping="parametric", edge=edge)
    expected = 20.0 * (2**order + 1 if edge else 2**order - 0.5**order)
    assert path.length == pytest.approx(expected, rel=1e-12)
    assert path.pitch == pytest.approx(400.0 / expected, rel=1e-12)


def test_nodes_lie_in_the_middle_of_cells_or_reach_the_edge():
    assert hilbert(flat_surface(8.0), 2).nodes.min() == 0.125
    assert hilbert(flat_surface(8.0), 2).nodes.max() == 0.875
    edge = hilbert(flat_surface(8.0), 2, edge=True)
    assert edge.nodes.min() == 0.0 and edge.nodes.max() == 1.0
    assert edge.points[-1].tolist() == [8.0, 0.0, 0.0]


def test_names_of_pattern_and_mapping():
    path = hilbert(flat_surface(8.0), 5)
    assert (path.pattern, path.mapping) == ("hilbert5", "equal_area")


def test_printed_drawing_runs_over_itself():
    found = {order: (distinct(hilbert_lsystem(order, printed=True)), 4**order) for order in (1, 2, 3, 4)}
    assert found == {1: (4, 4), 2: (14, 16), 3: (37, 64), 4: (74, 256)}
    assert (np.ptp(hilbert_lsystem(4, printed=True), axis=0) + 1).tolist() == [10, 12]


def test_printed_rules_are_right_and_only_one_drawing_is_wrong(monkeypatch):
    monkeypatch.setattr(module, "_PRINTED", str.maketrans({"L": "+F-F-F+", "R": "-F+F+F-"}))
    for order in range(1, 6):
        np.testing.assert_array_equal(hilbert_lsystem(order, printed=True), hilbert_nodes(order))


@pytest.mark.parametrize(
    ("order", "error", "message"),
    [
        (0, ValueError, r"order must be >= 1; got 0"),
        (13, ValueError, r"order must be <= 12; got 13"),
        (2.0, TypeError, r"order must be a whole number; got 2.0"),
        (True, TypeError, r"order must be a whole number; got True"),
        ("5", TypeError, r"order must be a whole number; got '5'"),
    ],
)
def test_orders_that_are_none(order, error, message):
    with pytest.raises(error, match=message):
        hilbert_nodes(order)
    with pytest.raises(error, match=message):
        hilbert(flat_surface(8.0), order)


def test_strings_are_not_grown_without_end():
    with pytest.raises(ValueError, match=r"order must be <= 8; got 9"):
        hilbert_lsystem(9)
