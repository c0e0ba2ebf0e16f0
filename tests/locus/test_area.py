"""Areas of best points over several hidden states: against brute force, vertices by hand, retrieval, a file."""

import functools

import numpy as np
import pytest
from brute_force import evaluated, least
from hard_problems import one

import sdpgrind
from sdpgrind import locus

TWO = locus.Problem(
    controls={"u": (0.0, 3.0), "v": (0.0, 3.0)},
    hidden={"x": (0.5, 2.0), "y": (0.5, 2.0)},
    cost=lambda s, c: -c.u - 0.8 * c.v + 0.05 * c.u * c.v,
    constraints=[
        one(lambda s, c: s.x * c.u + 0.3 * c.v, lambda s, c: 1.5 + 0 * c.u, "first"),
        one(lambda s, c: 0.2 * c.u + s.y * c.v, lambda s, c: 1.2 + 0 * c.u, "second"),
    ],
)
THREE = locus.Problem(
    controls={"u": (0.0, 3.0), "v": (0.0, 3.0), "w": (0.1, 3.0)},
    hidden={"x": (0.5, 3.0), "y": (0.2, 2.0)},
    cost=lambda s, c: (c.u - 2) ** 2 + (c.v - 1.5) ** 2 + 2 * (c.w - 1) ** 2 + 0.2 * s.x * c.u,
    constraints=[
        one(lambda s, c: s.x * c.u + c.w, lambda s, c: 2 + 0.3 * c.v, "first"),
        one(lambda s, c: s.y * (c.v + c.w**2), lambda s, c: 2 + 0.1 * c.u, "second"),
    ],
)
AREAS = {"two": TWO, "three": THREE}


@functools.cache
def planned(name):
    return locus.plan(AREAS[name])


@pytest.mark.parametrize("name", AREAS)
def test_least_cost_is_that_of_brute_force(name):
    area, rng = planned(name), np.random.default_rng(1)
    assert area.error <= 1e-10
    for _ in range(12):
        states = {key: float(rng.uniform(*ends)) for key, ends in area.problem.hidden.items()}
        point = area.at(**states)
        best, _ = least(area.problem, *states.values(), ticks=13 if name == "three" else 41, starts=2)
        assert point.cost == pytest.approx(best, abs=1e-6)
        _, excess = evaluated(area.problem, list(point.controls.values()), list(states.values()))
        assert np.all(excess <= 1e-9)


def test_vertex_by_two_linear_equations():
    """Where both are active with two controls, stationarity plays no part."""
    for x, y in ((1.0, 1.0), (1.7, 0.8), (0.9, 1.9)):
        point = planned("two").at(x=x, y=y)
        assert point.kind == "vertex"
        assert list(point.controls.values()) == pytest.approx(
            np.linalg.solve([[x, 0.3], [0.2, y]], [1.5, 1.2]), rel=1e-9
        )
        assert min(point.multipliers.values()) > 0


@pytest.mark.parametrize("name", AREAS)
def test_retrieval_finds_both_states_and_the_point(name):
    area, rng = planned(name), np.random.default_rng(2)
    for _ in range(8):
        states = {key: float(rng.uniform(*ends)) for key, ends in area.problem.hidden.items()}
        controls = {key: float(rng.uniform(0.2, 1.5)) for key in area.names}
        _, response, _ = area.system.values(
            np.array(list(controls.values())), np.array(list(states.values()))
        )
        measured = dict(zip(area.responses, response.tolist(), strict=True))
        found = area.retrieve(**controls, **measured)
        assert found.hidden == pytest.approx(states, abs=1e-7)
        assert not found.clamped
        assert found.controls == pytest.approx(area.at(**states).controls, abs=1e-6)


def test_retrieval_tells_what_no_state_explains():
    assert planned("two").retrieve(u=1.0, v=1.0, first=9.0, second=1.0).clamped


def test_a_file_gives_the_same_area(tmp_path):
    planned("two").save(tmp_path / "area.nc")
    again = sdpgrind.load(tmp_path / "area.nc")
    assert again.at(x=1.234, y=0.789) == planned("two").at(x=1.234, y=0.789)
    fresh = locus.plan(again.problem).at(x=1.234, y=0.789).controls
    assert fresh == pytest.approx(planned("two").at(x=1.234, y=0.789).controls, rel=1e-9)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda a: a.at(x=1.0), "hidden states must be x, y; got x"),
        (lambda a: a.at(x=1.0, y=9.0), r"y must be .*\[0.5, 2\].*got 9"),
        (lambda a: a.at(x=float("nan"), y=1.0), "x must be .*finite.*nan"),
        (
            lambda a: a.retrieve(u=1.0, v=1.0, first=1.0),
            "measured must be all of u, v and 2 of first, second; got first, u, v",
        ),
        (lambda a: a.retrieve(u=1.0, v=1.0, first=1.0, second=float("nan")), "second must be .*finite.*nan"),
    ],
)
def test_refusals(call, told):
    with pytest.raises(ValueError, match=told):
        call(planned("two"))
