"""What the adaptive grinder refuses: values, things, problems, commands, controllers."""

import numpy as np
import pytest
from adaptive_fakes import NOMINAL, PROBLEM, Printed

import hwsim
from hwsim.devices import Gauge
from sdpgrind import locus

GRINDER = hwsim.AdaptiveGrinder(PROBLEM)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stock": 0.0}, r"stock must be > 0 \(mm\); got 0.0"),
        ({"wear_flat_area": 6.0}, r"wear_flat_area must be in \(0, 1\]; got 6.0"),
        ({"wear_flat_area": 0.0}, r"wear_flat_area must be in \(0, 1\]; got 0.0"),
        ({"dulling": -1e-4}, r"dulling must be >= 0 \(1/mm\); got -0.0001"),
        ({"infeed_lag": -1.0}, r"infeed_lag must be >= 0 \(s\); got -1.0"),
        ({"power_lag": 1e-9}, r"power_lag must be 0 or >= 0.0001 \(s\); got 1e-09"),
        ({"idle_error": np.nan}, r"idle_error must be finite \(W\); got nan"),
        ({"max_time": 0.0}, r"max_time must be > 0 \(s\); got 0.0"),
        ({"tick": 0.0}, r"tick must be > 0 \(s\); got 0.0"),
        ({"dress_at": 0.006}, r"dress_at must be > dressed_area = 0.006; got 0.006"),
        ({"dressed_area": 6.0}, r"dressed_area must be in \(0, 1\]; got 6.0"),
    ],
)
def test_values_out_of_range(options, message):
    with pytest.raises(ValueError, match=message):
        GRINDER.replace(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"truth": 3.0}, r"truth must be a Grinding \(see locus.processes.Grinding\); got 3.0"),
        ({"power_gauge": 2.0}, r"power_gauge must be a Gauge \(see hwsim.devices\); got 2.0"),
        (
            {"problem": NOMINAL},
            r'problem must be a Problem \(see locus.preset\("grinding"\)\); got a Grinding',
        ),
    ],
)
def test_things_of_another_kind(options, message):
    with pytest.raises(TypeError, match=message):
        GRINDER.replace(**options)


def test_problems_of_another_machine():
    with pytest.raises(
        TypeError, match=r"problem.model must be a Grinding \(see locus.processes.Grinding\); got None"
    ):
        hwsim.AdaptiveGrinder(
            locus.Problem(controls={"u": (0, 1)}, hidden={"x": (0, 1)}, cost=lambda s, c: c.u, constraints=())
        )
    with pytest.raises(
        ValueError, match=r"problem.controls must be infeed_rate and work_rotation; got 'infeed_rate'"
    ):
        hwsim.AdaptiveGrinder(PROBLEM.replace(controls={"infeed_rate": (0.0, 0.1)}))
    with pytest.raises(
        ValueError, match=r'problem.controls\["work_rotation"\]\[0\] must be > 0 \(rad/s\); got 0.0'
    ):
        hwsim.AdaptiveGrinder(
            PROBLEM.replace(controls={"infeed_rate": (0.0, 0.1), "work_rotation": (0.0, 60.0)})
        )


def test_a_truth_that_draws_something_else():
    with pytest.raises(
        TypeError, match=r"truth\(rng\) must be a Grinding \(see locus.processes.Grinding\); got None"
    ) as caught:
        hwsim.run(GRINDER.replace(truth=lambda rng: None), Printed())
    assert caught.value.__notes__ == ["in part 0"]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"infeed_rate": -0.01}, r"infeed_rate must be >= 0 \(mm/s\); got -0.01"),
        ({"infeed_rate": 1.0}, r"infeed_rate must be <= 0.05 \(mm/s\); got 1.0"),
        ({"work_rotation": 300.0}, r"work_rotation must be in \[0.4, 63\] \(rad/s\); got 300.0"),
        (
            {"infeed_rate": 0.01},
            r"work_rotation must be commanded with the first infeed_rate; got none \(rad/s\)",
        ),
    ],
)
def test_commands_that_cannot_be_done(command, message):
    with pytest.raises(ValueError, match=message):
        GRINDER.start(np.random.default_rng(0)).step(command, 1)


def test_a_controller_for_another_wheel_is_refused():
    class Other(Printed):
        job = {"wheel_diameter": (400.0, "mm"), "width": (9.3, "mm")}  # noqa: RUF012

    with pytest.raises(ValueError, match=r"its wheel_diameter is 400.0 mm, that of the plant 300.0 mm"):
        hwsim.run(GRINDER, Other())


def test_a_controller_in_other_units_is_refused():
    class Minutes(Printed):
        commands = {"infeed_rate": "mm/min", "work_rotation": "rad/s"}  # noqa: RUF012

    with pytest.raises(
        ValueError, match="controller commands infeed_rate in mm/min, the plant accepts it in mm/s"
    ):
        hwsim.run(GRINDER, Minutes())


def test_a_limit_of_roughness_is_another_machine():
    rough = NOMINAL.replace(roughness=locus.processes.Roughness(roughness_max=8e-4, base=5e-4, exponent=0.4))
    with pytest.raises(
        ValueError, match=r"truth.roughness must be None: this machine has no gauge of roughness; got"
    ):
        GRINDER.replace(truth=rough)


DRESSED = hwsim.AdaptiveGrinder(locus.preset("grinding-roughness"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dullness": 1.2}, "dullness must be left out where dressing_lead is no control of the problem"),
        ({"dressing_lead": 0.1}, r"dressing_lead must be left out where .* \(mm\); got 0.1"),
        ({"roughness_gauge": Gauge()}, "roughness_gauge must be left out where dressing_lead is no control"),
    ],
)
def test_dressing_without_a_dressed_wheel(options, message):
    with pytest.raises(ValueError, match=message):
        GRINDER.replace(**options)


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"dullness": 0.0}, ValueError, "dullness must be > 0; got 0.0"),
        ({"dressing_lead": 5.0}, ValueError, r"dressing_lead must be in \[0.05, 0.5\] \(mm\); got 5.0"),
        (
            {"truth": NOMINAL},
            TypeError,
            r"truth must be a DressedGrinding \(see locus.processes.DressedGrinding\); got a Grinding",
        ),
    ],
)
def test_values_of_a_dressed_wheel(options, kind, message):
    with pytest.raises(kind, match=message):
        DRESSED.replace(**options)


def test_a_dressed_truth_of_another_machine():
    with pytest.raises(TypeError, match=r"truth must be a Grinding \(see .*\); got a DressedGrinding"):
        GRINDER.replace(truth=DRESSED.problem.model)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"dressing_lead": 5.0}, r"dressing_lead must be in \[0.05, 0.5\] \(mm\); got 5.0"),
        (
            {"infeed_rate": 0.01, "work_rotation": 9.0},
            r"dressing_lead must be commanded with the first infeed_rate; got none \(mm\)",
        ),
    ],
)
def test_commands_to_a_dresser_that_cannot_be_done(command, message):
    with pytest.raises(ValueError, match=message):
        DRESSED.start(np.random.default_rng(0)).step(command, 1)
