"""`check`: everything that is missing, in one readable report."""

from typing import ClassVar

import numpy as np
import pytest
from hwsim_fakes import Drain, FixedTank, Tank, Water, noisy_tank

import hwsim
from hwsim import protocols
from sdpgrind import weldbead


def faults(plant, controller=None):
    report = hwsim.check(plant, controller or Drain())
    assert bool(report) is (report.faults == ())
    return report.faults


class Wrapped(Tank):
    """A tank whose machine is spoilt by a function."""

    def spoil(self, machine):
        pass

    def start(self, rng):
        machine = super().start(rng)
        self.spoil(machine)
        return machine


def test_what_fits():
    report = hwsim.check(noisy_tank(), Drain(period=1 / 60))
    assert report and str(report) == "Drain and Tank fit"


def test_what_is_neither():
    assert faults(3, 4) == (
        "plant must be a machine, as hwsim.WeldBeadStand(problem) is one; got 3",
        "controller must be a controller; got 4",
    )
    assert faults(object())[0].endswith("is one; got an object")


def test_a_plan_is_told_what_follows_it():
    policy = weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=51)
    (said,) = faults(hwsim.WeldBeadStand(weldbead.preset("P1")), policy)
    assert said.startswith(
        f"controller must be a controller; got {policy!r}: weldbead.SequenceController(policy) follows it"
    )
    with pytest.raises(ValueError, match=r"weldbead\.SequenceController\(policy\)"):
        hwsim.run(hwsim.WeldBeadStand(weldbead.preset("P1")), policy)


def test_a_class_is_no_controller_and_the_order_is_plant_first():
    assert faults(Tank(), Drain) == (
        "controller must be a controller; got <class 'hwsim_fakes.Drain'>: an object of it is meant",
    )
    (said,) = faults(Drain(), Tank())
    assert said.startswith("plant and controller must be given in this order; got ")


def test_what_lacks_something():
    class Half:
        tick, period = 0.1, None

    assert faults(Half(), Half()) == (
        "plant lacks measures",
        "plant lacks accepts",
        "plant lacks start",
        "controller lacks reset",
        "controller lacks step",
    )


def test_machine_that_lacks_something():
    class Halved(Tank):
        def start(self, rng):
            return object()

    assert faults(Halved()) == tuple(
        f"machine lacks {name}" for name in ("time", "done", "event", "step", "outcome")
    )


def test_measurement_that_is_not_announced():
    class Chatty(Wrapped):
        def spoil(self, machine):
            machine.step = lambda command, ticks: {"level": 1.0, "colour": 2.0}

    assert faults(Chatty()) == ("machine measures colour, which the plant does not announce in measures",)


def test_time_that_does_not_begin_at_zero():
    class Late(Wrapped):
        def spoil(self, machine):
            machine.time = 3

    assert faults(Late()) == ("machine must be at time 0 when it is started and measured; its time is 3",)


def test_randomness_that_rng_does_not_rule():
    source = np.random.default_rng(0)

    class Wild(Wrapped):
        def spoil(self, machine):
            machine.level = source.random()

    assert any("differently when it is started twice with equal rng" in fault for fault in faults(Wild()))


def test_machine_that_cannot_be_copied():
    class Water2(Water):
        def __deepcopy__(self, memo):
            return Water2(self.tank, self.leak + 1.0)

        def step(self, command, ticks):
            return {"level": self.leak}

    class Uncopied(Tank):
        def start(self, rng):
            return Water2(self, 0.0)

    assert faults(Uncopied()) == ("a copy of the machine measures differently from the machine",)


def test_rates():
    assert faults(FixedTank(), Drain(period=0.25)) == (
        "controller's period is no whole number of the plant's ticks of 0.1 s; a tick of 1/20 s would fit",
    )
    assert faults(FixedTank(), Drain(period=0.3)) == ()
    (fault,) = faults(Tank(), Drain(period=-1.0))
    assert fault.startswith("period of tap must be > 0 (s); got -1.0")


def test_tiers_are_checked_one_by_one():
    class Deaf:
        period = 0.1

        def reset(self):
            pass

    class Two:
        period = None

        def __init__(self):
            self.tiers = {"good": Drain(), "deaf": Deaf()}

        def reset(self):
            pass

        def step(self, **measured):
            return {}

    assert faults(Tank(), Two()) == ("controller lacks step",)


@pytest.mark.parametrize(
    ("thing", "protocol"),
    [
        (Drain(), protocols.Controller),
        (noisy_tank(), protocols.Plant),
        (noisy_tank().start(np.random.default_rng(0)), protocols.Machine),
        (hwsim.WeldBeadStand(weldbead.preset("P1")), protocols.Plant),
        (hwsim.WeldBeadStand(weldbead.preset("P1")).start(np.random.default_rng(0)), protocols.Machine),
    ],
)
def test_protocols_are_checkable_at_run_time(thing, protocol):
    assert isinstance(thing, protocol) and not isinstance(object(), protocol)


def test_public_names():
    stands = {
        "CoefficientScatter",
        "ForceTableStand",
        "GrinderNoise",
        "Motor",
        "PlungeGrinder",
        "WeldBeadStand",
    }
    assert {"Journal", "Log", "check", "compare", "devices", "protocols", "repeat", "run", *stands} <= set(
        hwsim.__all__
    )
    assert all(getattr(hwsim, name) is not None for name in hwsim.__all__) and dir(hwsim) == hwsim.__all__
    with pytest.raises(AttributeError, match="module 'hwsim' has no attribute 'Stand'"):
        assert hwsim.Stand


def with_job(thing, **job):
    """A plant or controller that says what part and machine it is for."""
    return type(type(thing).__name__, (type(thing),), {"job": job})()


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        ({}, {"width": (2.0, "mm")}),
        ({"width": (2.0, "mm")}, {}),
        ({"length": (1.0, "mm")}, {"width": (2.0, "mm")}),
        ({"width": (2, "mm"), "material": "steel"}, {"width": (2.0, "mm"), "material": "steel"}),
        ({"profile": (np.arange(3), "mm")}, {"profile": (np.arange(3.0), "mm")}),
        ({"limit": None}, {"limit": None}),
    ],
)
def test_jobs_that_fit(ours, theirs):
    assert faults(with_job(Tank(), **ours), with_job(Drain(), **theirs)) == ()


@pytest.mark.parametrize(
    ("ours", "theirs", "said"),
    [
        ((2.0, "mm"), (3.0, "mm"), "3.0 mm, that of the plant 2.0 mm"),
        ((2.0, "mm"), (2.0, "m"), "2.0 m, that of the plant 2.0 mm"),
        ("steel", None, "None, that of the plant 'steel'"),
    ],
)
def test_another_job_is_one_fault(ours, theirs, said):
    tank, drain = with_job(Tank(), part=ours, alike=1), with_job(Drain(), part=theirs, alike=1)
    fault = f"controller is made for another part or machine: its part is {said}"
    assert faults(tank, drain) == (fault,)
    calls = {
        "": lambda: hwsim.run(tank, drain),
        "controllers['bad']: ": lambda: hwsim.compare(tank, {"good": Drain(), "bad": drain}),
    }
    for whose, refused in calls.items():
        with pytest.raises(ValueError) as caught:
            refused()
        assert str(caught.value) == f"{whose}Drain and Tank do not fit: {fault}"


def test_job_of_one_of_several_controllers():
    class Two(Drain):
        tiers: ClassVar = {"good": Drain(), "bad": with_job(Drain(), a=(1, "N"), b=2)}

    assert faults(with_job(Tank(), a=(2, "N"), b=3), Two()) == (
        "controller is made for another part or machine: its a is 1 N, that of the plant 2 N, its b is 2, that of the plant 3",
    )


def test_adaptation_that_plans_for_another_job():
    class Stray:
        def next(self, controller, part_log):
            return with_job(Drain(), width=(3.0, "mm"))

    with pytest.raises(
        ValueError,
        match=r"must return a controller that fits: .* its width is 3.0 mm, that of the plant 2.0 mm",
    ):
        hwsim.run(with_job(Tank(), width=(2.0, "mm")), Drain(), parts=2, adapt=Stray())
