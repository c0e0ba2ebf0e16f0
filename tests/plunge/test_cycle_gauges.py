"""Controllers of plunge cycles with failing gauges, and their errors."""

import copy

import numpy as np
import pytest
from cycle_parts import EXACT, KNOWN, MODEL, PROBLEM, SAMPLE, SHARP, became, nan, run, zero_at

import hwsim
from sdpgrind import plunge


def grind(controller, spoil, rng=0, noise=None, **options):
    """Outcome of a part with readings changed by `spoil`."""
    machine = hwsim.PlungeGrinder(PROBLEM, noise=noise, **options).start(np.random.default_rng(rng))
    controller.reset()
    reading = machine.step({}, 0)
    while not machine.done:
        reading = machine.step(controller.step(**spoil(machine.time, dict(reading))), 1)
    return machine.outcome()


def replaced(name, begin, number, value):
    """Change of one gauge's reading for some samples: a number, or a function of the reading."""

    def spoil(sample, reading):
        if begin <= sample < begin + number:
            reading[name] = value(reading[name]) if callable(value) else value
        return reading

    return spoil


def frozen(begin, number):
    held = []

    def spoil(sample, reading):
        if sample == begin:
            held.append(reading["size"])
        if begin <= sample < begin + number:
            reading["size"] = held[0]
        return reading

    return spoil


SAFE = plunge.CycleController(PROBLEM, safety_margin=0.003)
# without estimation every doubt would last: all but the gauge is known
OFFLINE = plunge.CycleController(KNOWN.replace(size_sd=5e-4), safety_margin=0.003, online=False)
STAGES = plunge.StagedController(PROBLEM, 0.09, 0.0079)
ALL = pytest.mark.parametrize("controller", [SAFE, OFFLINE, STAGES], ids=["online", "offline", "stages"])


@ALL
@pytest.mark.parametrize("begin", [0, 60, 200])
def test_missing_sizes_are_bridged_four_times(controller, begin):
    whole = grind(controller, lambda _, reading: reading)
    out = grind(controller, replaced("size", begin, 4, nan))
    assert not controller.lost
    assert out["time"] == pytest.approx(whole["time"], abs=1.01 * SAMPLE)
    assert out["part_slack"] == pytest.approx(whole["part_slack"], abs=2e-5)
    out = grind(controller, replaced("size", begin, 5, nan))
    assert controller.lost and out["time"] == pytest.approx((begin + 4) * SAMPLE)


@ALL
@pytest.mark.parametrize("begin", [60, 200, 285])
def test_a_frozen_gauge_ends_the_part_before_it_is_spoiled(controller, begin):
    out = grind(controller, frozen(begin, 10_000))
    assert controller.lost or out["remaining"] < 2e-4
    assert out["remaining"] > -0.0026  # not much past its size
    fed = out["time"] - begin * SAMPLE
    assert begin > 200 or fed < 12 * SAMPLE


@ALL
@pytest.mark.parametrize("jump", [-0.05, -0.01, 0.01, 0.05])
def test_a_size_that_jumps_is_not_used(controller, jump):
    """Backwards beyond noise, forwards beyond the feed: bridged for a time, the end of the part if it
    stays.
    """
    whole = grind(controller, lambda _, reading: reading)
    for number in (1, 3):
        out = grind(controller, replaced("size", 60, number, lambda size: size + jump))
        assert not controller.lost and out["time"] == pytest.approx(whole["time"], abs=1.01 * SAMPLE)
        assert out["part_slack"] == pytest.approx(whole["part_slack"], abs=2e-5)
    out = grind(controller, replaced("size", 60, 10_000, lambda size: size + jump))
    assert controller.lost and out["time"] == pytest.approx(64 * SAMPLE)


def test_noise_is_no_fault():
    for seed in range(30):
        machine = hwsim.PlungeGrinder(PROBLEM, contact_zero_sd=0.01).start(np.random.default_rng(seed))
        SAFE.reset()
        reading = machine.step({}, 0)
        while not machine.done:
            reading = machine.step(SAFE.step(**reading), 1)
        assert not SAFE.lost and machine.outcome()["remaining"] < 3e-4


@pytest.mark.parametrize("rng", range(4))
@pytest.mark.parametrize(("begin", "number"), [(0, 3), (2, 3), (0, 12), (60, 5), (60, 10_000)])
def test_power_that_is_missing(rng, begin, number):
    """Before, at and after contact, up to 0.04 mm early or late: the doubt that is left costs 1 um at most."""
    controller = plunge.CycleController(PROBLEM, safety_margin=0.005, **EXACT)
    out = grind(controller, replaced("grinding_power", begin, number, nan), rng=rng, contact_zero_sd=0.02)
    most = 6e-4 if number < 10_000 else 1.2e-3
    assert 0.005 < out["part_slack"] < 0.005 + most and abs(out["remaining"]) < 2.5e-4
    assert out["roundness"] < 3.03e-3


def test_a_grinder_without_a_power_monitor():
    """Contact, deflection and sharpness by the size alone: slower by 10 %, and never burned."""
    out, whole = (
        grind(SAFE, replaced("grinding_power", 0, 10_000, nan)),
        grind(SAFE, lambda _, reading: reading),
    )
    assert out["part_slack"] > 0.003 and (out["burned"], out["out_of_round"]) == (0, 0)
    assert whole["time"] < out["time"] < 1.12 * whole["time"]


@pytest.mark.parametrize("share", [1.0, 0.98, 0.9, 0.7])
def test_clipped_power_does_not_fool_it(share):
    """10 % less power at full rate means 17 um less damage; flagged power is not used."""
    power = float(MODEL.grinding_power(0.0448))
    assert MODEL.burn_depth(0.0448, 0.9 * power) == pytest.approx(0.0708, abs=2e-4)  # of 0.0882 mm
    controller = plunge.CycleController(SHARP, safety_margin=0.01)
    grinder = hwsim.PlungeGrinder(PROBLEM, power_max=share * power, contact_zero_sd=0.01)
    log = hwsim.run(grinder, controller, parts=60, rng=1)
    assert log["controller"].power_saturated.values.any()
    assert log.outcome.part_slack.values.min() > 0.009 and log.outcome.burned.values.sum() == 0
    if share > 0.9:
        return
    fooled = hwsim.run(grinder, Believing(controller), parts=5, rng=1)
    assert fooled.outcome.part_slack.values.mean() < log.outcome.part_slack.values.mean()


class Believing:
    """Controller that uses clipped power."""

    def __init__(self, controller):
        self.controller, self.period = copy.deepcopy(controller), controller.period

    def reset(self):
        self.controller.reset()

    def step(self, *, power_saturated, **measured):
        return self.controller.step(**measured)


def test_gauges_without_noise():
    for sds in (
        {"power_sd": 0.0},
        {"size_sd": 0.0},
        {"power_sd": 0.0, "size_sd": 0.0},
        {"deflection_sd": 0.0},
    ):
        out = became(plunge.CycleController(PROBLEM.replace(**sds), **EXACT), **zero_at(0.004))
        assert out["time"] == pytest.approx(12.12, abs=1.01 * SAMPLE) and out["burned"] == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"safety_margin": -0.01}, r"safety_margin must be >= 0 \(mm\); got -0.01"),
        ({"safety_margin": 0.3}, r"safety_margin must be < stock = 0.282 \(mm\); got 0.3"),
        ({"safety_margin": nan}, r"safety_margin must be finite \(mm\); got nan"),
        ({"sparkout": "q_k"}, "sparkout must be one of p_end, gauge, printed; got 'q_k'"),
        (
            {"roundness_margin": 2e-3},
            r"roundness_margin must be < roundness_max - roundness_base = 0.00141 \(mm\); got 0.002",
        ),
        ({"roundness_margin": -1e-5}, r"roundness_margin must be >= 0 \(mm\)"),
        ({"observer_gain": 0.0}, r"observer_gain must be in \(0, 1\]; got 0"),
        ({"observer_gain": 1.5}, r"observer_gain must be in \(0, 1\]; got 1.5"),
        (
            {"online": True, "sparkout": "printed"},
            "online must be False with sparkout='printed' or a linear model; got True",
        ),
    ],
)
def test_controllers_that_are_none(options, message):
    with pytest.raises(ValueError, match=message):
        plunge.CycleController(PROBLEM, **options)


@pytest.mark.parametrize(
    "sds",
    [
        {"size_sd": 1e-3},
        {"power_sd": 0.02, "contact_zero_sd": 0.02, "deflection_sd": 0.05, "sharpness_sd": 0.05},
    ],
    ids=["one", "four"],
)
def test_standard_deviations_of_the_controller_are_those_of_the_problem(sds):
    with pytest.warns(
        DeprecationWarning, match=r"deprecated: problem\.replace\(.*\) declares what the controller"
    ):
        given = plunge.CycleController(PROBLEM, **sds)
    assert given == plunge.CycleController(PROBLEM.replace(**sds)) and given.size_sd is None
    own = given.problem.uncertainty
    assert {name: getattr(own, name) for name in sds} == sds
    assert given != plunge.CycleController(PROBLEM)


def test_the_rule_for_gauges_is_the_only_one():
    with pytest.warns(DeprecationWarning, match="sparkout='gauge' is deprecated: 'p_end' is the same"):
        named = plunge.CycleController(PROBLEM, sparkout="gauge")
    np.testing.assert_array_equal(named.law, plunge.CycleController(PROBLEM).law)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stage_rate": 0.01}, "stage_remaining and stage_rate must both be given, or none"),
        ({"stage_remaining": 0.3, "stage_rate": 0.01}, r"stage_remaining must be .*0.282.*\(mm\); got 0.3"),
        ({"stage_remaining": 0.1, "stage_rate": 0.0}, r"stage_rate must be > 0 \(mm/s\); got 0"),
        (
            {"stage_remaining": 0.1, "stage_rate": 0.01, "observer_gain": 2.0},
            r"observer_gain must be in \(0, 1\]; got 2",
        ),
    ],
)
def test_stages_that_are_none(options, message):
    with pytest.raises(ValueError, match=message):
        plunge.StagedController(PROBLEM, **options)


@pytest.mark.parametrize("make", [plunge.CycleController, plunge.StagedController])
def test_problems_that_are_none(make):
    with pytest.raises(TypeError, match=r"problem must be a CycleProblem .*plunge\.preset"):
        make("simulation")


def test_a_gauge_that_shows_more_than_the_stock_at_the_start():
    for controller in (SAFE, OFFLINE, STAGES):
        controller.reset()
        with pytest.raises(
            ValueError, match=r"size must be < stock = 0.282 before any feed \(mm\); got 0.29"
        ):
            controller.step(size=0.29, grinding_power=0.0)
    with pytest.raises(ValueError, match=r"size must be < stock = 0.282 before any feed \(mm\); got 0.3"):
        run(SAFE, size_offset=0.3)


def test_a_part_of_another_machine():
    with pytest.raises(ValueError, match="stock"):
        run(plunge.CycleController(PROBLEM.replace(stock=0.3)))
    with pytest.raises(ValueError, match="sample_time"):
        run(plunge.CycleController(PROBLEM.replace(sample_time=0.02)))


def test_reset_forgets_everything():
    first = grind(SAFE, lambda _, reading: reading, rng=5, noise=hwsim.GrinderNoise())
    SAFE.step(size=0.1, grinding_power=5000.0)
    assert grind(SAFE, lambda _, reading: reading, rng=5, noise=hwsim.GrinderNoise()) == first
    fresh = plunge.CycleController(PROBLEM, safety_margin=0.003)
    assert fresh == SAFE and not np.array_equal(fresh.state, SAFE.state, equal_nan=True)
