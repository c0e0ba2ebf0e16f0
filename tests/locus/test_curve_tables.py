"""Tables by one number, and the way from a measurement to the best point: against roots by scipy and exact
points.
"""

import functools

import numpy as np
import pytest
from hard_problems import PROBLEMS
from scipy.optimize import brentq

from sdpgrind import locus
from sdpgrind.locus import kernels

EXAMPLE = locus.processes.KorenExample()


@functools.cache
def traced(name):
    return locus.plan(PROBLEMS[name] if name in PROBLEMS else locus.preset(name))


@functools.cache
def tight():
    """Koren's example where the constraint is active all along."""
    return locus.plan(locus.preset("koren-example").replace(hidden={"x": (0.5, 20.0)}))


@pytest.mark.parametrize(
    "name", ["koren", "for-a-while", "swap", "bounds", "one-control", "turning", "grinding", "motor"]
)
def test_table_by_the_hidden_state_is_exact_between_its_nodes(name):
    """1e-7 of the span with 200 nodes; by twice the points at least 8 times better (fourth order)."""
    curve = traced(name)
    low, high = curve.range
    x = low + (high - low) * (np.arange(60) + 0.31) / 60
    exact = np.array([list(curve.at(**{curve.hidden_name: value}).controls.values()) for value in x])
    errors = [
        np.max(np.abs(curve.table(points=count).at(x) - exact) / (np.ptp(exact, axis=0) + 1e-300))
        for count in (50, 100, 200)
    ]
    assert errors[2] <= 1e-7
    assert errors[1] <= errors[0] / 8 or errors[1] < 1e-10


def test_table_by_the_limit_is_koren_s_second_figure():
    """P_b = 17 + u - 4 v belongs to one point; roots of it along the circle by brentq."""
    table = tight().table("response")
    for response in np.linspace(table.low, table.high, 23)[1:-1]:
        v = brentq(lambda v, r=response: 17 + EXAMPLE.u_on_locus(v) - 4 * v - r, 44 / 401, 4.0, xtol=1e-14)
        assert table.at(float(response)) == pytest.approx([float(EXAMPLE.u_on_locus(v)), v], abs=1e-7)


def test_table_by_a_control():
    table = tight().table("v")
    for v in np.linspace(0.12, 3.99, 17):
        assert table.at(float(v)) == pytest.approx([float(EXAMPLE.u_on_locus(v)), v], abs=1e-7)
    assert table.clamped(4.1)
    assert not table.clamped(4.0 - 1e-9)
    assert table.at(5.0) == pytest.approx([1.0, 4.0], abs=1e-9)


def test_u_of_the_example_is_no_key():
    with pytest.raises(ValueError, match="key must change one way along the locus"):
        tight().table("u")


def test_a_key_is_one_of_the_names():
    with pytest.raises(ValueError, match="key must be one of x, u, v, response; got 'w'"):
        tight().table("w")


@pytest.mark.parametrize(("name", "fine"), [("koren", 1e-7), ("turning", 1e-7), ("grinding", 1e-6)])
def test_inversion_and_retrieval_against_a_root(name, fine):
    curve, rng = traced(name), np.random.default_rng(3)
    inversion, (low, high) = curve.inversion(), curve.problem.hidden[curve.hidden_name]
    for _ in range(25):
        places = rng.uniform(0.2, 0.8, len(curve.names))
        controls = curve.system.unscaled(places)
        x = rng.uniform(low, high)

        def response(state, controls=controls):
            return float(curve.system.values(controls, [state])[1][0])

        measured = response(x)
        root = brentq(lambda state, r=response, m=measured: r(state) - m, low, high, xtol=1e-16)
        found = curve.retrieve(
            **dict(zip(curve.names, controls, strict=True)), **{curve.responses[0]: measured}
        )
        assert found.hidden[curve.hidden_name] == pytest.approx(root, rel=1e-9)
        assert not found.clamped
        row, outside = inversion.at(measured, *controls)
        assert not outside
        assert row[0] == pytest.approx(root, rel=1e-9)
        assert row[1:] == pytest.approx(list(found.controls.values()), rel=fine)


def test_what_no_state_explains_is_told():
    curve = traced("koren")
    found = curve.retrieve(u=2.0, v=3.0, response=1e3)
    assert found.clamped
    assert found.hidden == {"x": pytest.approx(20.0)}
    assert curve.inversion().at(1e3, 2.0, 3.0)[1]
    with pytest.raises(
        ValueError, match=r"response must be what some hidden state in its range explains; got 1000"
    ):
        curve.retrieve(u=2.0, v=3.0, response=1e3, throw=True)


def test_where_a_response_tells_nothing():
    """At v = 0 the response of the example does not know x."""
    with pytest.raises(
        ValueError, match="response must tell something of x; at these controls it tells nothing"
    ):
        traced("koren").retrieve(u=2.0, v=0.0, response=16.0)


def test_public_kernels_are_what_tables_and_inversions_run():
    """The compiled part gives the same to the bit, and says where the number was."""
    curve = traced("koren")
    table, inversion = curve.table("response"), curve.inversion()
    out, state = np.empty(table.width), np.empty(inversion.places)
    assert kernels.look_up(table.packed, 7.0, out) == kernels.INSIDE
    np.testing.assert_array_equal(out, table.at(7.0))
    assert kernels.look_up(table.packed, 1e3, out) == kernels.ABOVE
    assert kernels.look_up(table.packed, np.nan, out) == kernels.NO_KEY
    assert kernels.retrieve(inversion.packed, (2.1, 2.8), 7.0, state) == kernels.INSIDE
    np.testing.assert_array_equal(state, inversion.at(7.0, 2.1, 2.8)[0])
