"""`check`: everything that is missing, in one readable report."""

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


def test_empty_objects_lack_everything():
    assert faults(object(), object()) == (
        "plant lacks measures",
        "plant lacks accepts",
        "plant lacks tick",
        "plant lacks start",
        "controller lacks period",
        "controller lacks reset",
        "controller lacks step",
    )


def test_machine_that_lacks_something():
    class Halved(Tank):
        def start(self, rng):
            return object()

    assert faults(Halved()) == tuple(f"machine lacks {name}" for name in ("time", "done", "event", "step", "outcome"))


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
    assert hwsim.__all__ == ["Journal", "Log", "WeldBeadStand", "check", "compare", "protocols", "run"]
    assert all(getattr(hwsim, name) is not None for name in hwsim.__all__) and dir(hwsim) == hwsim.__all__
    with pytest.raises(AttributeError, match="module 'hwsim' has no attribute 'Stand'"):
        assert hwsim.Stand
