"""What a path cannot be made of, and what it cannot be asked: the messages."""

import numpy as np
import pytest
from path_surfaces import BALL, FLAT

from sdpgrind.finishing import Path

NODES = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)]


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([(0.1, 0.1), (0.5, 0.2), (0.5, 0.2)], r"nodes\[2\] must be apart from nodes\[1\]; got \(0.5, 0.2\)"),
        ([(0.1, 0.1), (0.5, 1.2)], r"nodes\[1\] must be in the unit square; got \(0.5, 1.2\)"),
        ([(0.1, 0.1), (-0.5, 0.2)], r"nodes\[1\] must be in the unit square; got \(-0.5, 0.2\)"),
        ([(0.1, 0.1), (0.5, np.nan)], r"nodes\[3\] must be finite; got nan"),
        ([(0.1, 0.1)], r"nodes must be of shape \(n, 2\) with n >= 2; got shape \(1, 2\)"),
        ([0.1, 0.2, 0.3], r"nodes must be of shape \(n, 2\) with n >= 2; got shape \(3,\)"),
    ],
)
def test_nodes(nodes, message):
    with pytest.raises(ValueError, match=message):
        Path(FLAT, nodes)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (
            {"mapping": "conformal"},
            ValueError,
            r"mapping must be one of parametric, equal_area; got 'conformal'",
        ),
        ({"deviation": -0.1}, ValueError, r"deviation must be >= 0 \(mm\); got -0.1"),
        ({"pattern": 5}, TypeError, r"pattern must be a str; got 5"),
        ({"surface": 5}, TypeError, r"surface must be a Surface; got 5"),
        (
            {"corners": [True]},
            ValueError,
            r"corners must be of shape \(3,\), true or false; got shape \(1,\), bool",
        ),
        (
            {"corners": [0, 1, 2]},
            ValueError,
            r"corners must be of shape \(3,\), true or false; got shape \(3,\), int64",
        ),
        (
            {"corners": [True, False, True]},
            ValueError,
            r"corners\[1\] must be True, as straight legs turn there",
        ),
        ({"corner": None}, ValueError, r"Path has no field 'corner'; is corners meant\?"),
    ],
)
def test_what_else_a_path_is_made_of(changes, error, message):
    with pytest.raises(error, match=message):
        Path(FLAT, NODES).replace(**changes)


@pytest.mark.parametrize(
    ("ask", "error", "message"),
    [
        (lambda path: path.sample(step=0.0), ValueError, r"step must be > 0 \(mm\); got 0.0"),
        (lambda path: path.sample(per_leg=0), ValueError, r"per_leg must be >= 1; got 0"),
        (lambda path: path.resampled(-1.0), ValueError, r"step must be > 0 \(mm\); got -1.0"),
        (lambda path: path.blended(0.0), ValueError, r"deviation must be > 0 \(mm\); got 0.0"),
        (lambda path: path.at([1.0, 16.1]), ValueError, r"length\[1\] must be in \[0, 16\] \(mm\); got 16.1"),
        (lambda path: path.at(-0.1), ValueError, r"length\[0\] must be in \[0, 16\] \(mm\); got -0.1"),
        (lambda path: path.at(np.nan), ValueError, r"length\[0\] must be finite \(mm\); got nan"),
    ],
)
def test_what_a_path_is_asked(ask, error, message):
    with pytest.raises(error, match=message):
        ask(Path(FLAT, NODES))


def test_nodes_apart_in_the_square_and_one_point_of_the_surface():
    path = Path(BALL, [(0.5, 0.2), (0.2, 1.0), (0.8, 1.0)])  # an edge that is a pole
    with pytest.raises(
        ValueError,
        match=r"nodes must be apart on the surface; leg 1, from \(u, v\) = \(0.2, 1\), has no length",
    ):
        _ = path.length
    with pytest.raises(
        ValueError, match=r"the path must move on the surface everywhere; at \(u, v\) = \(0.2, 1\) it stands"
    ):
        path.frames()


def test_a_path_that_stays_at_a_point():
    for nodes in ([(0.0, 1.0), (1.0, 1.0)], [(0.0, 1.0), (0.3, 1.0), (1.0, 1.0)]):
        with pytest.raises(
            ValueError,
            match=r"nodes must be apart on the surface; leg 0, from \(u, v\) = \(0, 1\), has no length",
        ):
            _ = Path(BALL, nodes).length


def test_equal_areas_that_come_to_a_point():
    path = Path(BALL, [(0.5, 0.5), (0.2, 1.0), (0.8, 1.0)], mapping="equal_area")
    message = r"come to a point; \(u, v\) = \(0.\d+, 1\) has no area|at \(u, v\) = \(0.\d+, 1\) it stands still|has no length"
    for ask in (path.frames, path.sample, lambda: path.length):
        with pytest.raises(ValueError, match=message):
            ask()


def test_a_spline_that_leaves_the_square():
    nodes = [(0.1, 0.5), (0.2, 0.99), (0.8, 0.99), (0.9, 0.5)]
    with pytest.raises(
        ValueError, match=r"the path must stay in the unit square; its leg 1 comes to \(0.\d*, 1.\d*\)"
    ):
        _ = Path(FLAT, nodes, smooth=True).length


def test_nodes_cannot_be_changed_in_place():
    path = Path(FLAT, NODES)
    with pytest.raises(ValueError, match="read-only"):
        path.nodes[0] = 0.5
