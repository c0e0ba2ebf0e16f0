"""Several hidden states by several measurements: against the best points themselves, and a model that is
wrong; starts, margins, lags, seldom readings, hidden states beyond the range.
"""

import copy
import functools
import warnings

import numpy as np
import pytest

import hwsim
from sdpgrind import locus

HIDDEN = {"dullness": 1.3, "dressing_state": 0.85}


@functools.cache
def area():
    return locus.plan(locus.preset("grinding-roughness"))


def measured(problem, controls, hidden):
    """What the process reads at controls, by its own functions."""
    s, c = (type("Values", (), values)() for values in (hidden, controls))
    return {one.name: float(one.response(s, c)) for one in problem.varying}


def walked(controller, hidden, steps, problem=None):
    """Slacks, scaled, after each step, and the last controls."""
    problem = problem or area().problem
    command = controller.command
    for _ in range(steps):
        command = controller.step(**measured(problem, command, hidden))
    return command


@pytest.mark.parametrize("theta", [0.3, 0.7, 1.0])
def test_it_comes_to_the_best_point(theta):
    """Errors fall by the share theta: 1 in a few steps, as Newton's method."""
    controller = locus.AreaController(area(), theta=theta)
    command = walked(
        controller, HIDDEN, 8 if theta == 1.0 else int(np.ceil(np.log(1e-9) / np.log(1 - theta))) + 8
    )
    best = area().at(**HIDDEN).controls
    np.testing.assert_allclose(list(command.values()), list(best.values()), rtol=1e-6)
    np.testing.assert_allclose(list(controller.hidden.values()), list(HIDDEN.values()), rtol=1e-6)


def test_near_the_best_point_errors_fall_by_theta():
    """The loop is I - theta I: no constraint disturbs another."""
    near = {name: 1.002 * value for name, value in HIDDEN.items()}
    controller = locus.AreaController(area(), theta=0.4, start=near)
    system, true = area().system, np.array(list(HIDDEN.values()))
    before = system.scaled(np.array(list(near.values())), system.n) - system.scaled(true, system.n)
    walked(controller, HIDDEN, 1)
    after = controller.state - system.scaled(true, system.n)
    np.testing.assert_allclose(after, 0.6 * before, atol=0.02 * np.max(np.abs(before)))


def test_a_wrong_model_keeps_the_true_limits():
    """Chips take 3 % more energy than the model knows: readings come to the limits, the believed states not
    to the true.
    """
    wheel = area().problem.model.grinding
    power = wheel.power.replace(specific_energy=1.03 * wheel.power.specific_energy)
    plant = area().problem.replace(grinding=wheel.replace(power=power))
    controller = locus.AreaController(area(), theta=0.7)
    command = walked(controller, HIDDEN, 40, plant)
    found, limit = measured(plant, command, HIDDEN), area().at(**controller.hidden).limit
    for name, value in found.items():
        assert value == pytest.approx(limit[name], rel=1e-6)
    assert controller.report()["dullness"] > 1.02 * HIDDEN["dullness"]


def test_a_margin_is_kept():
    controller = locus.AreaController(area(), theta=0.7, margin={"grinding_power": 20.0})
    command = walked(controller, HIDDEN, 40)
    _, found, limit = area().system.values(list(command.values()), list(HIDDEN.values()))
    assert limit[0] - found[0] == pytest.approx(20.0, abs=1e-3)
    assert limit[1] == pytest.approx(found[1], rel=1e-6)
    assert controller.hidden == pytest.approx(HIDDEN, rel=1e-6)  # a margin is no error of the estimate
    assert controller.report()["grinding_power_slack"] == pytest.approx(20.0, abs=1e-3)


def test_states_are_clamped_and_nothing_winds_up():
    controller = locus.AreaController(area(), theta=1.0)
    with pytest.warns(UserWarning, match="20 readings in a row are explained by a dullness beyond its range"):
        for _ in range(30):
            controller.step(grinding_power=1e5, roughness=0.0008)
    assert np.all((controller.state >= 0) & (controller.state <= 1))
    command = walked(controller, HIDDEN, 12)
    np.testing.assert_allclose(list(command.values()), list(area().at(**HIDDEN).controls.values()), rtol=1e-6)


def test_readings_that_are_missing_count_for_nothing():
    controller = locus.AreaController(area())
    before = controller.command
    assert controller.step(grinding_power=np.nan, roughness=np.nan) == before
    controller.step(grinding_power=np.inf, roughness=0.0006)
    assert controller.command != before
    controller.reset()
    assert controller.command == before


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: locus.AreaController(None), TypeError, "curve must be an Area"),
        (lambda: locus.AreaController(area(), theta=0.0), ValueError, r"theta must be in \(0, 1\]; got 0"),
        (
            lambda: locus.AreaController(area(), start={"dullness": 1.0}),
            ValueError,
            "start must have dullness, dressing_state",
        ),
        (
            lambda: locus.AreaController(area(), start=None),
            TypeError,
            'start must be "feasible", "learned" or a mapping of dullness, dressing_state to numbers; got None',
        ),
        (
            lambda: locus.AreaController(area(), start="middle"),
            ValueError,
            "start must be one of feasible, learned; got 'middle'",
        ),
        (
            lambda: locus.AreaController(area(), margin=3.0),
            TypeError,
            r"margin must be a mapping of responses \(grinding_power, roughness\) to numbers; got 3.0",
        ),
        (
            lambda: locus.AreaController(area(), margin="wide"),
            ValueError,
            "margin must be one of designed; got 'wide'",
        ),
        (
            lambda: locus.AreaController(area(), margin={"roughness": 0.001}),
            ValueError,
            r"margin\['roughness'\] must be < 0.0008, the greatest limit on the area \(mm\); got 0.001",
        ),
        (
            lambda: locus.AreaController(area(), noise={"roughness": -1.0}),
            ValueError,
            r"noise\['roughness'\] must be >= 0 \(mm\); got -1.0",
        ),
        (
            lambda: locus.AreaController(area(), drift={"power": 1.0}),
            ValueError,
            "drift must be one of grinding_power, roughness; got 'power'",
        ),
        (
            lambda: locus.AreaController(area(), confidence=99.0),
            ValueError,
            r"confidence must be in \[0.5, 1\), such as 0.999; got 99.0",
        ),
        (
            lambda: locus.AreaController(area(), lag={"infeed": 1.0}, period=0.5),
            ValueError,
            "lag must be one of infeed_rate, work_rotation, dressing_lead; got 'infeed'",
        ),
        (
            lambda: locus.AreaController(area(), lag={"infeed_rate": 1.25}),
            ValueError,
            r"period must be a number \(s\) where lag or hold is a time; got None",
        ),
        (
            lambda: locus.AreaController(area(), hold="settling"),
            ValueError,
            "hold must be one of none, settled; got 'settling'",
        ),
        (
            lambda: locus.AreaController(area(), per_part="lead"),
            ValueError,
            "per_part must be one of infeed_rate, work_rotation, dressing_lead; got 'lead'",
        ),
        (
            lambda: locus.AreaController(area(), per_part=area().names),
            ValueError,
            "per_part must be fewer than all controls, which leaves nothing to control",
        ),
        (
            lambda: locus.AreaController(area(), start={**HIDDEN, "dullness": 9.0}),
            ValueError,
            r"start\['dullness'\] must be in",
        ),
        (
            lambda: locus.AreaController(area(), margin={"power": 1.0}),
            ValueError,
            "margin must be one of grinding_power, roughness",
        ),
        (
            lambda: locus.AreaController(area()).step(roughness=0.001),
            ValueError,
            "measurement must have grinding_power",
        ),
        (
            lambda: locus.AreaController(area()).step(roughness="1", grinding_power=1.0),
            TypeError,
            "roughness must be a number",
        ),
    ],
)
def test_refusals(make, kind, message):
    with pytest.raises(kind, match=message):
        make()


def test_it_is_a_controller():
    controller = locus.AreaController(area(), period=0.5)
    assert isinstance(controller, hwsim.protocols.Controller)
    assert controller.commands == {"infeed_rate": "mm/s", "work_rotation": "rad/s", "dressing_lead": "mm"}


TIGHT = {"dullness": 1.6, "dressing_state": 1.4}
NOISE = {"grinding_power": 10.0, "roughness": 8e-6}  # W, mm


def truths(count, seed):
    """Hidden states in the range, its corners first."""
    drawn = np.random.default_rng(seed).uniform((0.8, 0.7), (1.6, 1.4), (count, 2))
    drawn[:4] = [(0.8, 0.7), (0.8, 1.4), (1.6, 0.7), (1.6, 1.4)]
    return drawn


def played(controller, truth, steps, noise=(0.0, 0.0), seed=0, drift=(1.0, 1.0)):
    """Slacks (steps, 2) at the readings of a process whose hidden states grow by factors of `drift`."""
    system, rng, truth = area().system, np.random.default_rng(seed), np.array(list(truth), dtype=float)
    command, slacks = controller.command, np.empty((steps, 2))
    for k in range(steps):
        _, response, limit = system.values(np.array(list(command.values())), truth)
        slacks[k] = limit - response
        read = response + np.array(noise) * rng.standard_normal(2)
        command = controller.step(grinding_power=read[0], roughness=read[1])
        truth = truth * drift
    return slacks


def warned(controller, truth, steps=30):
    """Number of readings until the first warning, and its text; (None, ""): none."""
    for k in range(steps):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            played(controller, truth, 1)
        if caught:
            return k + 1, str(caught[0].message)
    return None, ""


def test_the_default_start_is_the_tight_corner():
    assert locus.AreaController(area()).hidden == TIGHT


@pytest.mark.parametrize(("theta", "steps"), [(0.5, 12), (1.0, 5)])
def test_from_the_default_start_no_limit_is_exceeded(theta, steps):
    """Slacks are exact to the residual of the optima, 1e-10 of the spread of a slack."""
    for truth in truths(24, 1):
        slacks = played(locus.AreaController(area(), theta=theta), truth, steps)
        assert np.all(slacks.min(axis=0) > -1e-9 * area().system.scales), truth


def test_from_the_middle_of_the_range_limits_are_exceeded():
    """The start of former versions: 187 W over at once for a dull wheel."""
    middle = {"dullness": np.sqrt(0.8 * 1.6), "dressing_state": np.sqrt(0.7 * 1.4)}
    slacks = played(locus.AreaController(area(), start=middle), (1.5, 1.3), 1)
    assert slacks[0, 0] == pytest.approx(-187.0, abs=1.0)


def two_sided(room):
    """Limits a <= u <= a + room: the best u is in the middle, and for v the least b is loosest."""
    return locus.Problem(
        controls={"u": (-3.0, 3.0), "v": (0.0, 3.0)},
        hidden={"a": (0.0, 1.0), "b": (0.5, 1.0)},
        cost=lambda s, c: (c.u - s.a - room / 2) ** 2 + (c.v - 4.0) ** 2,
        constraints=[
            locus.Varying(response=lambda s, c: s.a - c.u, limit=lambda s, c: 0.0 * c.u, name="low"),
            locus.Varying(response=lambda s, c: c.u - s.a, limit=lambda s, c: room + 0.0 * c.u, name="high"),
            locus.Varying(response=lambda s, c: c.v * s.b, limit=lambda s, c: 1.0 + 0.0 * c.v, name="side"),
        ],
    )


def test_a_start_is_looked_for_on_a_grid_where_no_corner_is_feasible():
    """For a in 0..1 all of 1 <= u <= room: the best u, a + room/2, is there at a = 0.5 alone of the grid."""
    controller = locus.AreaController(locus.plan(two_sided(1.4)))
    assert controller.hidden == {"a": 0.5, "b": 1.0}
    with pytest.raises(ValueError, match='start "feasible" must have a point without violation in the whole'):
        locus.AreaController(locus.plan(two_sided(0.8)))


def test_a_learned_start_is_kept():
    controller = locus.AreaController(area(), start="learned")
    walked(controller, HIDDEN, 20)
    found = controller.hidden
    controller.reset()
    assert controller.hidden == found
    other = locus.AreaController(area())
    walked(other, HIDDEN, 20)
    other.reset()
    assert other.hidden == TIGHT


@pytest.mark.parametrize("theta", [0.2, 0.5])
def test_noise_of_the_slack_follows_the_law(theta):
    """sd (theta/(2 - theta))^(1/2) that of the readings.

    N samples with correlation 1 - theta estimate it with relative sd (1/(2 N) (1 + r^2)/(1 - r^2))^(1/2),
    r = 1 - theta: 0.053 and 0.032 for 800; the bound is three of them, and 1 % for the curvature."""
    controller = locus.AreaController(area(), theta=theta, start=HIDDEN)
    slacks = played(controller, HIDDEN.values(), 800, (10.0, 8e-6))
    r2 = (1 - theta) ** 2
    bound = 0.01 + 3 * np.sqrt((1 + r2) / (1 - r2) / 1600)
    law = np.sqrt(theta / (2 - theta)) * np.array([10.0, 8e-6])
    np.testing.assert_allclose(slacks.std(axis=0), law, rtol=bound)


@pytest.mark.parametrize("theta", [0.2, 0.5])
def test_drift_of_the_slack_leaves_its_share(theta):
    """d/theta: a dullness that grows by 5e-4 a sample. The slope of the power changes by 5e-4, too, a sample,
    so the steady slack is behind by some of them over 1/theta samples: 1 %."""
    controller = locus.AreaController(area(), theta=theta, start={"dullness": 1.0, "dressing_state": 1.0})
    slacks = played(controller, (1.0, 1.0), 80, drift=(1.0005, 1.0))
    here = np.array(list(area().at(dullness=1.0005**79, dressing_state=1.0).controls.values()))
    powers = [area().system.values(here, np.array([1.0005**k, 1.0]))[1][0] for k in (79, 80)]
    assert slacks[-1, 0] == pytest.approx(-(powers[1] - powers[0]) / theta, rel=0.01)


@pytest.mark.parametrize("theta", [0.2, 0.5])
def test_a_designed_margin_keeps_the_limits_in_noise(theta):
    """At most 1 % of samples over a limit, corners of the range included; designed for 0.1 % of each limit."""
    margins = locus.AreaController(area(), theta=theta, noise=NOISE).margins
    assert margins["grinding_power"] == pytest.approx(3.0902 * np.sqrt(theta / (2 - theta)) * 10.0, rel=1e-4)
    over = [
        played(locus.AreaController(area(), theta=theta, noise=NOISE), truth, 50, (10.0, 8e-6), seed)
        < -1e-9 * area().system.scales
        for seed, truth in enumerate(truths(8, 2))
    ]
    assert np.mean(np.any(over, axis=2)) <= 0.01
    bare = played(locus.AreaController(area(), theta=theta), HIDDEN.values(), 60, (10.0, 8e-6))
    assert np.mean(np.any(bare < 0, axis=1)) > 0.3


def test_a_margin_is_kept_at_the_tight_end_of_the_range():
    """The estimate is clamped there, and follows errors of one sign only; the margin is kept from the start."""
    controller = locus.AreaController(area(), theta=0.2, noise=NOISE)
    slacks = played(controller, TIGHT.values(), 300, (10.0, 8e-6), 5)
    np.testing.assert_allclose(slacks[0], list(controller.margins.values()), rtol=1e-6)
    assert np.mean(slacks < 0) <= 0.01
    played(controller, HIDDEN.values(), 120)
    assert controller.hidden["dullness"] == pytest.approx(HIDDEN["dullness"], rel=0.02)  # no wind-up


@pytest.mark.parametrize("truth", [(1.9, 1.3), (1.61, 1.3), (1.0, 1.45), (1.9, 1.6)])
def test_a_hidden_state_beyond_the_range_is_told(truth):
    controller = locus.AreaController(area())
    steps, text = warned(controller, truth)
    assert steps == 20
    assert "over its limit by" in text
    assert controller.report()["saturated"] == 1.0
    assert warned(controller, truth)[0] is None  # once


def test_what_the_warning_says():
    _, text = warned(locus.AreaController(area()), (1.9, 1.3))
    assert text == (
        "20 readings in a row are explained by a dullness beyond its range, 0.8 to 1.6 (estimate 1.6);"
        " now grinding_power is over its limit by 80.2 W: plan the area for a wider range of dullness"
    )


def test_seldom_readings_are_counted_and_told_once():
    controller = locus.AreaController(area())
    command, told = controller.command, []
    for k in range(66):
        read = measured(area().problem, command, {"dullness": 1.2, "dressing_state": 1.6})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            command = controller.step(**(read if k % 3 == 0 else {**read, "roughness": np.nan}))
        told += [k] * len(caught)
    assert told == [57]  # the 20th of every third


@pytest.mark.parametrize("truth", [(0.6, 1.0), (0.79, 1.3), (1.2, 0.6), (1.2, 0.68)])
def test_a_hidden_state_below_the_range_is_told(truth):
    """Nothing is exceeded, but less is done than is possible."""
    steps, text = warned(locus.AreaController(area()), truth)
    assert 20 <= steps <= 25
    assert "now no limit is exceeded" in text


@pytest.mark.parametrize("margin", ["designed", {"grinding_power": 30.0, "roughness": 2e-5}])
def test_within_the_range_nothing_is_told(margin):
    for truth in truths(8, 3):
        assert warned(locus.AreaController(area(), margin=margin), truth)[0] is None, truth


def test_a_response_that_is_read_seldom_keeps_its_state():
    controller = locus.AreaController(area(), theta=0.5)
    command = controller.command
    for k in range(60):
        before = controller.hidden["dressing_state"]
        read = measured(area().problem, command, HIDDEN)
        if k % 10 != 9:
            read["roughness"] = np.nan
        command = controller.step(**read)
        if k % 10 != 9:
            assert controller.hidden["dressing_state"] == pytest.approx(before, rel=1e-12)
    assert controller.hidden["dullness"] == pytest.approx(1.3, rel=1e-6)
    assert controller.hidden["dressing_state"] == pytest.approx(0.85 * (1.4 / 0.85) ** (0.5**6), rel=0.01)


def test_one_reading_disturbs_no_other_response():
    """Both responses depend on both states: a reading of one moves along the level of the other."""
    problem = locus.Problem(
        controls={"u": (0.1, 9.0), "v": (0.1, 9.0)},
        hidden={"a": (1.0, 2.0), "b": (1.0, 2.0)},
        cost=lambda s, c: -(c.u + c.v),
        constraints=[
            locus.Varying(
                response=lambda s, c: s.a**2 * s.b * c.u, limit=lambda s, c: 8.0 + 0.0 * c.u, name="p"
            ),
            locus.Varying(
                response=lambda s, c: s.a * s.b**2 * c.v, limit=lambda s, c: 8.0 + 0.0 * c.v, name="q"
            ),
        ],
    )
    controller = locus.AreaController(locus.plan(problem), theta=1.0)
    for _ in range(6):
        read = measured(problem, controller.command, {"a": 1.5, "b": 1.5})
        before = controller.hidden
        controller.step(p=read["p"], q=np.nan)
        now = controller.hidden
    assert now["a"] ** 2 * now["b"] == pytest.approx(1.5**3, rel=1e-6)
    assert now["a"] * now["b"] ** 2 == pytest.approx(before["a"] * before["b"] ** 2, rel=1e-6)


def lagging(controller, steps, lag, period=0.5, told=True):
    """Least slack under an infeed that follows its command by a lag."""
    actual, least = 0.0, np.inf
    command = controller.command
    for k in range(steps):
        if k:
            actual = command["infeed_rate"] + np.exp(-period / lag) * (actual - command["infeed_rate"])
        controls = {**command, "infeed_rate": max(actual, 1e-9)}
        read = measured(area().problem, controls, HIDDEN)
        if k:
            limit = area().system.values(list(controls.values()), list(HIDDEN.values()))[2]
            # at touch-in the model burns, whatever is commanded
            least = min(least, limit[0] - read["grinding_power"]) if k * period > 3.0 else least
        command = controller.step(**read, **({"infeed_rate": actual} if told else {}))
    return least


@pytest.mark.parametrize("told", [True, False])
def test_a_lagging_control_does_not_mislead(told):
    """Measured, or known by its lag: both come to the optimum without a violation."""
    options = {} if told else {"lag": {"infeed_rate": 1.25}}
    controller = locus.AreaController(area(), period=0.5, **options)
    assert lagging(controller, 120, 1.25, told=told) > -1e-3
    best = area().at(**HIDDEN).controls
    np.testing.assert_allclose(list(controller.command.values()), list(best.values()), rtol=1e-6)


def test_a_lag_that_nobody_tells_misleads():
    assert lagging(locus.AreaController(area(), period=0.5), 40, 1.25, told=False) < -5.0


def test_a_hold_waits():
    controller = locus.AreaController(area(), hold=1.2, period=0.5)
    before = controller.command
    read = measured(area().problem, before, HIDDEN)
    for _ in range(3):  # readings at 0, 0.5 and 1 s
        assert controller.step(**read) == before
    assert controller.step(**read) != before


def test_what_is_set_once_a_part_is_held_in_it():
    """A stuck lead: the others are optimal for it, and no limit is exceeded on the way."""
    controller = locus.AreaController(area(), per_part="dressing_lead")
    lead = controller.command["dressing_lead"]
    slacks = played(controller, (0.8, 1.4), 30)
    assert slacks.min() > -1e-6 and controller.command["dressing_lead"] == lead
    model = area().problem.model
    thickest = model.grinding.roughness.chip_thickness_max(lead, 1.4)  # it does not burn
    assert controller.command["infeed_rate"] == pytest.approx(
        model.grinding.infeed_rate(thickest * model.grinding.wheel_speed), rel=1e-6
    )
    controller.reset()
    assert controller.command["dressing_lead"] == lead


def test_a_measured_lead_is_the_one_that_counts():
    """Of a wheel that was not dressed."""
    controller = locus.AreaController(area(), per_part="dressing_lead", start=HIDDEN)
    model, lead = area().problem.model, 0.15
    command = controller.step(grinding_power=np.nan, roughness=np.nan, dressing_lead=lead)
    assert command["dressing_lead"] == lead
    read = measured(area().problem, command, HIDDEN)
    assert read["roughness"] < 0.0008 and read["grinding_power"] == pytest.approx(
        float(model.grinding.burning_power(command["infeed_rate"], command["work_rotation"])), rel=1e-9
    )


def test_copies_go_their_own_way():
    controller = locus.AreaController(area(), per_part="dressing_lead")
    walked(controller, HIDDEN, 3)
    twin = copy.deepcopy(controller)
    walked(twin, HIDDEN, 5)
    assert twin.hidden != controller.hidden
    assert twin.report() != controller.report()


def test_the_designed_theta_has_the_least_mean_cost():
    """Against all others, and what simulated drift and noise cost at the designed margins."""
    drift = {"grinding_power": 1.0}
    design = locus.gains.design_gain(area(), noise=NOISE, drift=drift)
    margins = [
        locus.AreaController(area(), theta=theta, noise=NOISE, drift=drift).margins
        for theta in (0.5 * design.theta, 0.9 * design.theta, design.theta, 1.1 * design.theta, 1.0)
    ]
    assert margins[2] == design.margin
    charged = area().dataset.multipliers.mean(area().problem.hidden_names)
    costs = [sum(float(charged.sel(constraint=n)) * v for n, v in margin.items()) for margin in margins]
    assert costs[2] == pytest.approx(design.cost, rel=1e-9) and min(costs) == costs[2]
    assert locus.gains.design_gain(area(), drift=drift).theta == 1.0


def test_the_mean_cost_is_what_the_margins_cost():
    """First order: the mean of multiplier times margin; the controls of a margin of 15 W cost it."""
    margin = {"grinding_power": 15.0}
    controller = locus.AreaController(area(), margin=margin, start=HIDDEN)
    command = walked(controller, HIDDEN, 30)
    best, cost = area().at(**HIDDEN), area().problem.model.cost
    paid = cost(None, type("Values", (), command)()) - best.cost
    assert paid == pytest.approx(15.0 * best.multipliers["grinding_power"], rel=0.03)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: locus.gains.design_gain(area(), noise=NOISE), "drift must be > 0 for a response"),
        (lambda: locus.gains.design_gain(area(), x=(0.0, 1.0)), "x must be left out for an area"),
        (
            lambda: locus.gains.design_gain(
                locus.plan(locus.preset("koren-example")), along="v", noise=NOISE
            ),
            "noise must be left out for a locus: see GainDesign.noise_gain_at and drift_margin",
        ),
    ],
)
def test_designs_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
