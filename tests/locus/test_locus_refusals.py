"""What is refused of a problem, a plan, a look-up: argument, value, rule."""

import functools
import math
import re

import numpy as np
import pytest
from hard_problems import EXAMPLE, PROBLEMS, one, problem

from sdpgrind import locus

BOX = {"u": (0.0, 1.0), "v": (0.0, 1.0)}


def made(cost=lambda s, c: c.u + c.v, response=lambda s, c: s.x - c.u, limit=lambda s, c: 0.0 * c.u, **more):
    given = {"controls": BOX, "hidden": {"x": (0.0, 1.0)}} | more
    return locus.Problem(cost=cost, constraints=[locus.Varying(response=response, limit=limit)], **given)


@functools.cache
def example():
    return locus.plan(PROBLEMS["koren"])


def branching(s, c):
    if c.u > 0.5:
        return c.u
    return c.v


def looping(s, c):
    while c.u < 0.5:
        pass
    return c.u


SYMBOLS = "must be made of operators, \\*\\* and functions that take symbols"


@pytest.mark.parametrize(
    ("make", "error", "told"),
    [
        (
            lambda: made(controls={}),
            TypeError,
            "controls must be a mapping of names to .* with one name at least",
        ),
        (
            lambda: made(controls={"u": (1.0, 0.0)}),
            ValueError,
            r"controls\['u'\] must be \(least, greatest\) with least < greatest; got \(1.0, 0.0\)",
        ),
        (lambda: made(controls={"u": (1.0, 1.0)}), ValueError, "least < greatest"),
        (
            lambda: made(controls={"u": (0.0, math.inf)}),
            ValueError,
            r"controls\['u'\]\[1\] must be .*finite.*inf",
        ),
        (
            lambda: made(controls={"u": (0.0, 1.0, 2.0)}),
            TypeError,
            r"controls\['u'\] must be \(least, greatest\)",
        ),
        (
            lambda: made(controls={"u": 1.0}),
            TypeError,
            r"controls\['u'\] must be \(least, greatest\); got 1.0",
        ),
        (
            lambda: made(controls={"2u": (0.0, 1.0)}),
            ValueError,
            "controls must be named by identifiers; got '2u'",
        ),
        (
            lambda: made(hidden={"u": (0.0, 1.0)}),
            ValueError,
            "names of controls, hidden states and constraints must",
        ),
        (lambda: made(hidden={"x": (float("nan"), 1.0)}), ValueError, r"hidden\['x'\]\[0\] must be .*nan"),
        (lambda: made(hidden={"x": (2.0, 1.0)}), ValueError, r"hidden\['x'\] must be .*got \(2.0, 1.0\)"),
        (
            lambda: made(cost=None),
            TypeError,
            r"cost must be a function f\(s, c\) of hidden states and controls; got None",
        ),
        (lambda: made(cost=3.0), TypeError, "cost must be a function"),
        (
            lambda: locus.Varying(response=1.0, limit=lambda s, c: c.u),
            TypeError,
            "Varying.response must be a function",
        ),
        (
            lambda: locus.Varying(response=lambda s, c: c.u, limit=lambda s, c: c.u, name="a b"),
            ValueError,
            "name must be named by identifiers",
        ),
        (
            lambda: locus.Problem(
                controls=BOX, hidden={"x": (0.0, 1.0)}, cost=lambda s, c: c.u, constraints=[3]
            ),
            TypeError,
            r"constraints\[0\] must be .*Varying",
        ),
        (
            lambda: locus.Problem(
                hidden={"x": (0.2, 1.0)}, **(EXAMPLE | {"constraints": EXAMPLE["constraints"] * 2})
            ),
            ValueError,
            "names of controls, hidden states and constraints must",
        ),
        (
            lambda: locus.preset("koren-example").replace(cost=lambda s, c: c.u),
            ValueError,
            "cost and constraints must be left out where a model is given",
        ),
    ],
)
def test_problems_are_checked_at_the_door(make, error, told):
    with pytest.raises(error, match=told):
        make()


@pytest.mark.parametrize(
    ("given", "error", "told"),
    [
        (
            made(cost=lambda s, c: c.w),
            ValueError,
            "cost must use names of hidden states and controls, x, u, v; got 'w'",
        ),
        (
            made(response=lambda s, c: s.y * c.u),
            ValueError,
            r"constraints\[0\].response must use names of hidden states and controls, x, u, v; got 'y'",
        ),
        (made(cost=branching), ValueError, f"cost {SYMBOLS}"),
        (made(cost=looping), ValueError, f"cost {SYMBOLS}"),
        (
            made(cost=lambda s, c: math.sqrt(c.u)),
            ValueError,
            "cost must be finite somewhere .*functions of math do not take symbols",
        ),
        (made(cost=lambda s, c: max(c.u, c.v)), ValueError, f"cost {SYMBOLS}"),
        (made(limit=lambda s, c: min(c.u, 1.0)), ValueError, rf"constraints\[0\].limit {SYMBOLS}"),
        (made(cost=lambda s, c: float(c.u)), ValueError, "cost must be finite somewhere"),
        (made(cost=lambda s, c: 1 / 0 + c.u), ValueError, f"cost {SYMBOLS}; division by zero"),
        (
            made(cost=lambda s, c: [c.u, c.v]),
            (TypeError, ValueError),
            "cost must give (a|one) number for each point",
        ),
        (made(cost=lambda s, c: None), TypeError, "cost must give a number for each point; got NoneType"),
        (made(cost=lambda s, c: "no"), TypeError, "cost must give a number for each point; got str"),
        (
            made(cost=lambda s, c: np.array([c.u, c.v])),
            (TypeError, ValueError),
            "cost must give (a|one) number for each point",
        ),
        (
            made(cost=lambda s, c: c.u * float("nan")),
            ValueError,
            "cost must be finite somewhere in the ranges",
        ),
        (
            made(response=lambda s, c: (-1 - c.u - s.x) ** 0.5),
            ValueError,
            r"constraints\[0\] must be finite somewhere",
        ),
        (made(cost=lambda s: s), ValueError, f"cost {SYMBOLS}; .*positional argument"),
    ],
)
def test_functions_are_read_once_and_told_of(given, error, told):
    with pytest.raises(error, match=told):
        locus.plan(given)


def test_costs_that_single_out_nothing():
    """The largest slack decides; where it is equal too, the problem is refused."""
    curve = locus.plan(
        made(cost=lambda s, c: 1.0, response=lambda s, c: s.x - c.u * (1 - c.u) - c.v * (1.2 - c.v))
    )
    assert curve.degenerate
    assert curve.at(x=0.3).controls == pytest.approx({"u": 0.5, "v": 0.6}, abs=1e-6)
    with pytest.raises(
        ValueError,
        match="cost must single out a point: over u, v many cost the same, and leave the same slack",
    ):
        locus.plan(made(cost=lambda s, c: 1.0))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            made(hidden={"x": (0.0, 1.0), "y": (0.0, 1.0)}, response=lambda s, c: s.x + s.y - c.u),
            "hidden must be no more states than there are measured constraints, 1: .* got 2: x, y",
        ),
        (
            locus.Problem(controls=BOX, hidden={"x": (0.0, 1.0)}, cost=lambda s, c: c.u),
            "hidden must be no more states than there are measured constraints, 0",
        ),
        (
            made(response=lambda s, c: s.x * (c.u - 0.4)),
            "hidden states must move a constraint one way .* limit of response rises with x at some controls and falls",
        ),
        (
            made(response=lambda s, c: c.u + c.v),
            "hidden states must be seen in what is measured; nothing of it depends on x",
        ),
        (
            made(response=lambda s, c: 3 + s.x + c.u),
            "constraints must leave a feasible point at some hidden state; none was found over x = 0 to 1;"
            " nearest is u = 0, v = 0 and x = 0, where response is 3.00 above its limit of 0",
        ),
    ],
)
def test_plans_that_cannot_be(given, told):
    with pytest.raises(ValueError, match=told):
        locus.plan(given)


def test_a_narrow_small_work_and_the_heat_that_would_do():
    """Ploughing alone burns it: by hand, at sharp flats and fast work; a plan is found with the B that is told, and with no less."""
    process = locus.preset("grinding").model.replace(wheel_diameter=20.0, work_diameter=5.0, width=3.0, B=7.2)
    ranges = {"controls": {"infeed_rate": (1e-4, 0.05), "work_rotation": (0.4, 63.0)}}
    problem = locus.Problem(model=process, hidden={"wear_flat_area": (0.004, 0.0104)}, **ranges)
    with pytest.raises(
        ValueError, match=r"nearest is .* and wear_flat_area = 0.00400, where grinding_pow"
    ) as told:
        locus.plan(problem)
    words = re.search(
        r"infeed_rate = (\S+) µm/s, .* is (\S+) W above its limit of (\S+) W; B = (\S+) J", str(told.value)
    )
    rate, above, limit, heat = map(float, words.groups())
    burning = process.burning_power(rate / 1e3, 63.0)
    power = process.grinding_power(rate / 1e3, 63.0, 0.004)
    assert (above, limit) == (pytest.approx(power - burning, rel=5e-3), pytest.approx(burning, rel=5e-3))
    assert locus.plan(problem.replace(B=heat)).pieces
    with pytest.raises(ValueError, match="none was found"):
        locus.plan(problem.replace(B=0.98 * heat))
    cold = locus.preset("grinding").replace(B=2.0)  # 4.57 would leave a point that no search finds
    with pytest.raises(ValueError, match="B = ") as told:
        locus.plan(cold)
    assert locus.plan(cold.replace(B=float(re.search(r"B = (\S+) J", str(told.value))[1]))).pieces


def test_a_plan_is_of_a_problem():
    with pytest.raises(TypeError, match=r"problem must be .*Problem.*locus.preset.*; got 3"):
        locus.plan(3)
    with pytest.raises(ValueError, match=r"points must be .*got 1"):
        locus.plan(PROBLEMS["koren"], points=1)


def test_where_feasibility_ends_is_told():
    curve = locus.plan(made(response=lambda s, c: 2 * s.x - c.u, cost=lambda s, c: (c.u - 0.2) ** 2 + c.v**2))
    (end,) = (event for event in curve.events if event.kind == "infeasible")
    assert end.hidden == pytest.approx(0.5, abs=1e-9)
    assert "no best point was found elsewhere in 0 to 1" in curve.status
    with pytest.raises(ValueError, match=r"x must be in \[0, 0.5\], where best points are known; got 0.8"):
        curve.at(x=0.8)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda c: c.at(y=1.0), "hidden state must be given by its name, x=...; got y"),
        (lambda c: c.at(), "hidden state must be given by its name, x=...; got nothing"),
        (lambda c: c.at(x=float("nan")), "x must be .*finite.*nan"),
        (lambda c: c.at(x=math.inf), "x must be .*finite.*inf"),
        (lambda c: c.at(x=21.0), r"x must be in \[0.2, 20\], where best points are known; got 21"),
        (lambda c: c.retrieve(u=1.0, v=1.0), "measured must be all of u, v and one of response; got u, v"),
        (
            lambda c: c.retrieve(u=1.0, response=1.0),
            "measured must be all of u, v and one of response; got response, u",
        ),
        (lambda c: c.retrieve(u=1.0, v=1.0, w=2.0, response=1.0), "measured must be .*got response, u, v, w"),
        (lambda c: c.retrieve(u=1.0, v=1.0, response=float("nan")), "response must be .*finite.*nan"),
        (lambda c: c.retrieve(u=math.inf, v=1.0, response=7.0), "u must be .*finite.*inf"),
        (lambda c: c.table("u"), "key must change one way along the locus"),
        (lambda c: c.table("cost"), "key must be one of x, u, v, response; got 'cost'"),
        (lambda c: c.inversion("force"), "response must be one of response; got 'force'"),
        (lambda c: c.stretch("w"), "along must be one of u, v, x; got 'w'"),
        (
            lambda c: c.stretch("v", x=(0.2, 0.4)),
            "x must hold states at which a measured constraint is active: from 0.2 to 0.4 none is",
        ),
        (
            lambda c: c.stretch("v", x=(2.0, 1.0)),
            r"x must be \(least, greatest\) within \[0.2, 20\]; got \(2.0, 1.0\)",
        ),
        (lambda c: c.stretch("v", x=3.0), "x must be the least and the greatest x that may come; got 3.0"),
        (
            lambda c: c.stretch("u"),
            "along must be single-valued on the locus; 'u' is not, but v (and x are|is)",
        ),
    ],
)
def test_look_ups(call, told):
    with pytest.raises(ValueError, match=told):
        call(example())


def test_area_that_is_given_in_percent():
    """More than the whole wheel is no fraction."""
    with pytest.raises(ValueError, match=r"wear_flat_area.*(fraction|1)"):
        locus.preset("grinding").replace(hidden={"wear_flat_area": (0.4, 1.2)})


def test_a_controller_over_a_jump_or_beyond_a_fold_is_refused():
    jump = locus.plan(PROBLEMS["jump"])
    with pytest.raises(ValueError, match=r"x must not span a jump: at x = -0.54"):
        jump.stretch("u", x=(-0.9, 0.99))
    wave = problem(
        lambda s, c: (c.u - 3) ** 2 + 0.1 * c.v**2,
        one(lambda s, c: s.x + (c.u - 1) ** 2 + (c.v - 0.5) ** 2, lambda s, c: 1.0),
        x=(-2.0, 2.0), u=(-1.0, 4.0), v=(-2.0, 2.0),
    )  # fmt: skip
    with pytest.raises(
        ValueError, match=r"x must stay where the locus goes on: it ends \(infeasible\) at x = 1"
    ):
        locus.plan(wave).stretch("u", x=(-1.0, 1.5))


KINKS = {
    "abs": lambda c: abs(c.u - 1),
    "maximum": lambda c: np.fmax(c.u, 1.0),
    "a choice": lambda c: np.where(c.u > 1, (c.u - 3) ** 2, -100.0),
    "floor": lambda c: np.floor(c.u),
}


@pytest.mark.parametrize("what", KINKS)
def test_kinks_and_steps_are_refused(what):
    """A best point on a kink has no slope, and would be missed."""
    problem = made(cost=lambda s, c: KINKS[what](c) + (c.v - 4) ** 2)
    with pytest.raises(ValueError, match=f"cost must be smooth.*{what}"):
        locus.plan(problem)


def test_a_table_does_not_lead_over_a_jump():
    """Between the two ends nothing is best."""
    curve = locus.plan(
        locus.Problem(
            controls={"u": (0.1, 12.0)},
            hidden={"x": (0.3, 30.0)},
            cost=lambda s, c: -np.sin(c.u) - 0.1 * c.u,
            constraints=[locus.Varying(response=lambda s, c: s.x * c.u, limit=lambda s, c: 5.0 + 0 * c.u)],
        )
    )
    assert curve.jumps
    with pytest.raises(
        ValueError, match=r"key must lead along the locus without a jump|key must change one way"
    ):
        curve.table("u")


def test_readings_that_are_none_leave_the_command():
    """NaN and infinity are no readings; a value that is no number is refused by its name."""
    controller = locus.LocusController(example(), along="v", x=(0.76, 1.72))
    before = controller.step(response=9.0)
    for bad in (math.nan, math.inf, -math.inf):
        assert controller.step(response=bad) == before
    assert controller.step(response=9.0) != before
    for bad in (None, "7", np.array([7.0])):
        with pytest.raises(TypeError, match="response must be a number"):
            controller.step(response=bad)


def test_controls_far_from_their_range_are_refused():
    with pytest.raises(ValueError, match=r"u must be in \[-0.25, 5.25\]; got -20"):
        example().retrieve(u=-20.0, v=2.0, response=7.0)
    with pytest.raises(ValueError, match=r"infeed_rate must be in \[0, 0.052495\] \(mm/s\); got 10"):
        locus.plan(locus.preset("grinding")).retrieve(
            infeed_rate=10.0, work_rotation=10.0, grinding_power=900.0
        )
