"""Presets of problems on a locus: they are whole, they can be saved, and floats, arrays and symbols pass
through them.
"""

import casadi as ca
import numpy as np
import pytest
from closed_forms import named
from locus_inside import _presets

from sdpgrind.base import stored

NAMES = [info.name for info in _presets.presets()]


@pytest.mark.parametrize("name", NAMES)
def test_model_comes_back_from_a_file(name):
    model = _presets.preset(name).model
    assert stored.decode(stored.encode(model)) == model


@pytest.mark.parametrize("name", NAMES)
def test_units_are_of_the_names_of_the_problem(name):
    problem = _presets.preset(name)
    known = {*problem.names, *problem.hidden_names, "cost"}
    assert set(problem.model.units) in (known, set())
    assert len({one.name for one in problem.varying}) == len(problem.varying)


@pytest.mark.parametrize("name", NAMES)
def test_floats_arrays_and_symbols_give_the_same(name):
    problem = _presets.preset(name)
    rng = np.random.default_rng(1)
    ranges = {**problem.hidden, **problem.controls}
    values = {key: rng.uniform(low, high, 5) for key, (low, high) in ranges.items()}
    symbols = {key: ca.SX.sym(key) for key in ranges}

    def at(point):
        s, c = (named(**{key: point[key] for key in keys}) for keys in (problem.hidden, problem.controls))
        pairs = [value for one in problem.varying for value in (one.response(s, c), one.limit(s, c))]
        return [problem.objective(s, c), *pairs]

    arrays = [np.broadcast_to(part, 5) for part in at(values)]
    function = ca.Function("f", list(symbols.values()), [ca.SX(part) for part in at(symbols)])
    for k in range(5):
        point = {key: float(array[k]) for key, array in values.items()}
        floats = at(point)
        by_symbols = [float(part) for part in function(*point.values())]
        np.testing.assert_allclose(by_symbols, floats, rtol=1e-13)
        np.testing.assert_allclose([array[k] for array in arrays], floats, rtol=1e-14)


def test_an_unknown_preset_is_refused():
    with pytest.raises(ValueError, match=r"name must be one of koren-example, turning, .*; got 'boring'"):
        _presets.preset("boring")
