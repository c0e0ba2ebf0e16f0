"""What a user hands over by mistake is refused at the door: the argument, the value, what it must be, its
unit.
"""

import itertools
import re
import types

import numpy as np
import pytest
import xarray as xr

import hwsim
import sdpgrind
from sdpgrind import identify, units, weldbead
from sdpgrind.base import checks, rng
from sdpgrind.weldbead import force, passes

P1 = weldbead.preset("P1")
LOOP = force.PI.design(crossover=units.hz(3.0))
DISC = passes.TiltedDisc(P1.model, relaxed_angle=units.deg(20.0), rotational_stiffness=6e5)
BEAD = passes.Contour([0, 75, 150], [1.0, 1.3, 1.0])
PASS = passes.PassProblem(DISC, BEAD, mean_cut=0.2, feed_rate=20.0)
STAND = hwsim.WeldBeadStand(P1)


def follower(**options):
    plan = types.SimpleNamespace(time=[0.0, 5.0], normal_force=[30.0, 30.0], fly_height=[10.0, 10.0])
    return force.ForceController(plan, LOOP, **options)


class Stop:
    """A controller that leaves the bead alone."""

    period = None

    def reset(self):
        pass

    def step(self, **measured):
        return {"stop": 1.0}


def looped(**options):
    return force.simulate_loop(follower(), duration=0.5, **options)


REFUSED = [
    (
        lambda: hwsim.compare(STAND, [Stop()]),
        "controllers must be a mapping name -> controller, such as {'mine': controller}; got a",
    ),
    (
        lambda: hwsim.compare(STAND, Stop()),
        "controllers must be a mapping name -> controller, such as {'mine': controller}; got a",
    ),
    (
        lambda: hwsim.run(STAND, Stop(), progress=3),
        "progress must be True, None or a function of the share done (0..1) and a text; got 3",
    ),
    (
        lambda: hwsim.run(STAND, Stop(), executor=3),
        "executor must be None or a concurrent.futures.Executor; got 3",
    ),
    (
        lambda: hwsim.run(STAND, Stop(), adapt=3),
        "adapt must be None or an adaptation, with next(controller, part_log); got 3",
    ),
    (lambda: hwsim.Journal(3), "path must be a path; got 3"),
    (lambda: sdpgrind.load(None), "path must be a path; got None"),
    (lambda: passes.plan(PASS).save(None), "path must be a path; got None"),
    (
        lambda: P1.replace(burn_limit=3),
        "burn_limit must be ForceBurnLimit or PowerBurnLimit or MalkinBurnLimit; got 3",
    ),
    (
        lambda: PASS.replace(burn_limit=3),
        "burn_limit must be a ForceBurnLimit, PowerBurnLimit or MalkinBurnLimit; got 3",
    ),
    (lambda: PASS.replace(disc=P1.model), "disc must be a TiltedDisc; got a GrindingProcess"),
    (lambda: passes.Contour("a", [1, 2]), "x must be numbers (mm); got 'a'"),
    (lambda: passes.plan(PASS).simulate(3), "model must be a TiltedDisc, the disc as it really is; got 3"),
    (lambda: follower(limits=4), "limits must be a Limits; got 4"),
    (lambda: force.ForceController(P1, LOOP), "as passes.plan gives it; a SequenceProblem has no time"),
    (
        lambda: force.simulate_loop(None, duration=1.0),
        "as force.ForceController(plan, loop) makes one; got None",
    ),
    (
        lambda: force.simulate_loop(LOOP, duration=1.0),
        "controller must be a ForceController, as force.ForceController(plan",
    ),
    (lambda: looped(plant=3), "plant must be a ForcePlant; got 3"),
    (
        lambda: looped(surface=3),
        "surface must be None or a function of times (s) that gives heights (mm); got 3",
    ),
    (lambda: force.tuned_pi(3), "plant must be a ForcePlant; got 3"),
    (lambda: force.q_loop(limits=3), "limits must be a DesignLimits; got 3"),
    (
        lambda: weldbead.SequenceController(P1),
        "policy must be a policy, as weldbead.plan gives it; got a SequenceProblem",
    ),
    (lambda: hwsim.ForceTableStand(PASS, motor=3), "motor must be a Motor; got 3"),
    (lambda: hwsim.ForceTableStand(PASS, sequence=3), "sequence must be a SequenceProblem; got 3"),
    (lambda: units.deg("20"), "value must be a number or an array of numbers (degrees); got '20'"),
    (lambda: units.hz(True), "value must be a number or an array of numbers (Hz); got True"),
    (lambda: units.um([1.0]), "value must be a number or an array of numbers (um); got [1.0]"),
    (
        lambda: units.rpm(np.array(["300"])),
        "value must be a number or an array of numbers (rev/min); got array(['300']",
    ),
]


@pytest.mark.parametrize(("call", "said"), REFUSED)
def test_of_another_kind(call, said):
    with pytest.raises(TypeError, match=re.escape(said)):
        call()


def test_a_surface_that_is_no_height_for_each_time():
    with pytest.raises(ValueError, match=r"surface\(time\)\[0\] must be finite \(mm\); got nan"):
        looped(surface=lambda t: t * np.nan)
    with pytest.raises(ValueError, match=r"one height \(mm\) for each time \(s\); got \(3,\) for \(1440,\)"):
        looped(surface=lambda t: t[:3])
    np.testing.assert_array_equal(
        looped(surface=lambda t: 0.1).force, looped(surface=lambda t: np.full(t.size, 0.1)).force
    )


def test_one_controller_of_several_is_named():
    with pytest.raises(
        ValueError, match=r"controllers\['no'\]: NoneType and WeldBeadStand do not fit: controller must be"
    ):
        hwsim.compare(STAND, {"yes": Stop(), "no": None})


def test_a_cut_deeper_than_the_bead_is_warned_of():
    """Heights may be measured from anything, so that only a warning is due; `parent` or `allow_overground`
    settle it.
    """
    with pytest.warns(
        UserWarning,
        match=r"mean_cut of 1\.2 mm is deeper than the bead is high: 1\.15 mm above 0; parent says",
    ):
        PASS.replace(mean_cut=1.2)
    PASS.replace(mean_cut=1.14)
    PASS.replace(mean_cut=1.2, allow_overground=True)
    PASS.replace(mean_cut=1.2, bead=BEAD.shifted(-5.0))
    PASS.replace(mean_cut=1.2, parent=passes.Contour([0, 150], [-1.0, -1.0]))


def test_a_cut_as_deep_as_the_disc_is_high_names_the_cut():
    with pytest.raises(
        ValueError, match=r"must rise < 29\.07 .* \(mm\); got 40\.15; mean_cut is 40 mm of it"
    ):
        PASS.replace(mean_cut=40.0, allow_overground=True)


def test_a_coarse_pass_is_planned_as_it_is():
    """The plan of twice the spacing, made for its error only, is not held against the user."""
    coarse = PASS.replace(spacing=9.0)
    assert coarse.nodes.size == 18 and passes.plan(coarse).error > 0


def test_numbers_and_arrays_are_converted():
    assert units.deg(180) == pytest.approx(np.pi)
    np.testing.assert_allclose(units.um(np.array([1, 2])), [1e-3, 2e-3])
    assert units.mm_per_min(np.float32(60.0)) == 1.0
    assert float(units.inch(xr.DataArray(2.0))) == 50.8


@pytest.mark.parametrize(
    "value", ["12.5", ["1", "2"], [True, False], [[1.0], [1.0, 2.0]], [1.0, None]], ids=str
)
@pytest.mark.parametrize("check", [checks.finite_array, checks.reals])
def test_texts_and_truth_values_are_no_numbers(check, value):
    """numpy makes 12.5 of a text and 1.0 of a truth value: as likely the wrong column."""
    with pytest.raises(TypeError, match=r"height must be .*number.* \(mm\); got "):
        check("height", value, "mm")


def test_a_probability_is_neither_0_nor_1():
    assert checks.probability("alpha", 0.05) == 0.05
    for value in (0.0, 1.0, -0.1, 95):
        with pytest.raises(ValueError, match=rf"alpha must be in \(0, 1\) \(1\); got {value}"):
            checks.probability("alpha", value)
    with pytest.raises(TypeError, match=r"alpha must be a number \(1\); got '5 %'"):
        checks.probability("alpha", "5 %")


def test_what_is_long_is_told_by_its_type():
    assert checks.shown(3.0) == "3.0" and checks.shown("a") == "'a'"
    assert checks.shown(P1) == "a SequenceProblem" and checks.shown(np.arange(200.0)) == "a ndarray"
    assert checks.shown(object()) == "an object"
    with pytest.raises(TypeError, match=r"^estimate must be an Estimate; got None$"):
        checks.kind("estimate", None, identify.Estimate)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (10**20, "got a whole number of 67 bits"),
        (10**5000, "got a whole number of 16610 bits"),
        (2**31 + 1, "got 2147483649"),
    ],
    ids=["67 bits", "16610 bits", "one more"],
)
def test_a_count_beyond_all_reason_is_refused_by_its_number(number, said):
    with pytest.raises(ValueError, match=rf"parts must be <= 2147483648, the largest count; {said}"):
        checks.count("parts", number)
    assert checks.count("parts", 2**31) == 2**31
    assert checks.whole("rng", number) == number


def test_children_one_by_one_are_those_of_one_call():
    together = [child.bit_generator.state for child in rng.children(5, 4)]
    assert [child.bit_generator.state for child in itertools.islice(rng.one_by_one(5), 4)] == together
    alone = [np.random.default_rng(np.random.SeedSequence(5, spawn_key=(k,))) for k in range(4)]
    assert [child.bit_generator.state for child in alone] == together
