"""A part of a served machine in wall time, with times given as numbers: ticks, commands, latch."""

import numpy as np
import pytest
from hwsim_fakes import Tank
from opcua_fakes import Axis

import centering
import hwsim
from hwsim.opcua._course import PacedPart
from hwsim.opcua._driver import Refused
from sdpgrind import locus, plunge, weldbead

MS = 1_000_000


def course(plant=None, speed=1.0, samples=1, part=1):
    plant = plant or Axis()
    return PacedPart(part, plant.start(np.random.default_rng(0)), plant.tick, speed, samples)


def test_a_command_takes_effect_at_the_first_tick_after_it_came():
    axis = Axis()
    one = course(axis)
    one.take({"velocity": 1.0}, 1000 * MS)
    one.advance(1034 * MS)
    assert one.machine.time == 3
    one.take({"velocity": 2.0}, 1034 * MS)
    assert axis.told == [(0, {"velocity": 1.0}), (4, {"velocity": 2.0})]
    one.advance(1060 * MS)
    assert one.machine.place == pytest.approx(4 * 0.01 + 2 * 0.02, abs=1e-12)


def test_time_begins_with_the_first_command():
    one = course()
    one.advance(5000 * MS)
    assert one.machine.time == 0 and one.sample().time == 0.0
    one.go(6000 * MS)
    one.advance(6020 * MS)
    assert one.machine.time == 2


@pytest.mark.parametrize(("speed", "ticks"), [(1.0, 5), (20.0, 100), (0.5, 2), (1 / 3, 1)])
def test_speed_is_simulated_over_wall_time(speed, ticks):
    one = course(Axis(length=10.0), speed)
    one.go(7)
    for now in range(0, 51, 5):
        one.advance(7 + now * MS)
    assert one.machine.time == ticks


def test_a_slow_plant_slips_and_skips_nothing():
    one = course(Axis(length=10.0))
    one.take({"velocity": 1.0}, 0)
    one.advance(1000 * MS)  # 100 ms are made up for
    assert one.machine.time == 10 and one.slip == 900 * MS
    one.advance(1050 * MS)
    assert one.machine.time == 15 and one.slip == 900 * MS
    assert one.machine.place == pytest.approx(0.15, abs=1e-12)


def test_a_machine_that_waits_for_its_operator_stands_still():
    stand = hwsim.WeldBeadStand(weldbead.preset("P1"), height=1.0, time=20.0)
    one = course(stand, speed=20.0)
    one.take({"duration": 8.0, "normal_force": 30.0}, 0)
    for now in range(0, 900, 5):
        one.advance(now * MS)
    assert one.machine.time == 8000 and one.waiting and one.sample().event == 1
    one.take({"duration": 12.0, "normal_force": 30.0}, 900 * MS)  # all of the time that is left
    for now in range(900, 1600, 5):
        one.advance(now * MS)
    assert one.sample().event == 2 and one.sample().time == 20.0


def test_a_machine_that_goes_on_after_an_event_is_not_held():
    one = course(Tank(tick=0.1))
    one.take({"flow": 2.0}, 0)
    for now in range(0, 4000, 50):
        one.advance(now * MS)
    assert one.sample().event == 1 and not one.waiting and one.machine.time == 39


def test_after_the_safe_command_nothing_moves_the_machine():
    axis = Axis()
    one = course(axis)
    one.take({"velocity": 1.0}, 0)
    one.latch(axis.safe, "no heartbeat", 52 * MS)
    place = one.machine.place
    for command in ({"velocity": 1.0}, {"stop": 0.0}, {}):
        with pytest.raises(
            Refused, match=r"the machine was made safe \(no heartbeat\): it waits for a new part"
        ):
            one.take(command, 60 * MS)
    one.advance(200 * MS)
    one.latch(axis.safe, "another reason", 300 * MS)
    assert one.machine.place == place and axis.told[-1][1] == axis.safe and len(axis.told) == 2
    last = one.sample()
    assert last.latched == "no heartbeat" and not last.done and last.outcome["stopped"] == 1.0


def test_a_refused_command_has_the_machine_s_sentence_and_changes_nothing():
    one = course(hwsim.WeldBeadStand(weldbead.preset("P1")))
    with pytest.raises(Refused, match="a pass needs normal_force"):
        one.take({"duration": 5.0}, 0)
    assert one.waiting and one.sample().held == {}


PLANTS = {
    "weldbead": hwsim.WeldBeadStand(weldbead.preset("P1")),
    "plunge": hwsim.PlungeGrinder(plunge.preset("simulation")),
    "locus": hwsim.AdaptiveGrinder(locus.preset("grinding")),
    "centering": hwsim.CenteringMachine(centering.preset("printed")),
    "probe": hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5)),
}
FIRST = {
    "weldbead": {"normal_force": 20.0, "duration": 10.0},
    "plunge": {"command_rate": 0.04},
    "locus": {"infeed_rate": 1e-3, "work_rotation": 20.0},
    "centering": {"spindle_speed": 2.0, "velocity": 5.0},
    "probe": {"spindle_speed": 3.0},
}


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("moments", [0, 1, 7])
def test_the_safe_command_of_a_plant_is_accepted_at_any_moment(name, moments):
    plant = PLANTS[name]
    one = course(plant, samples=getattr(plant, "sample_ticks", 1))
    if moments:
        one.take(FIRST[name], 0)
    for k in range(moments):
        one.advance(round(k * 50 * MS))
    one.latch(plant.safe, "asked", 50 * moments * MS)
    assert one.latched == "asked" and one.sample().outcome is not None
    assert set(plant.safe) <= set(plant.accepts) and set(plant.ranges) <= set(plant.accepts)


def test_a_centering_machine_is_withdrawn_by_its_safe_command():
    machine = PLANTS["centering"]
    one = course(machine, samples=machine.sample_ticks)
    one.take(FIRST["centering"], 0)
    one.advance(30 * MS)
    one.latch(machine.safe, "asked", 30 * MS)
    assert one.machine.done  # its computer took the command at the next sample


class Broken(Axis):
    """Its physics fails from 0.05 s on; with `untold` it has no outcome either."""

    untold = False

    def start(self, rng):
        slide = super().start(rng)
        step, outcome = slide.step, slide.outcome

        def failing(command, ticks):
            if slide.time + ticks > 5:
                raise ZeroDivisionError("stiffness")
            return step(command, ticks)

        def told():
            if self.untold:
                raise RuntimeError("nothing was measured")
            return outcome()

        slide.step, slide.outcome = failing, told
        return slide


class Untold(Broken):
    untold = True


@pytest.mark.parametrize(("plant", "outcome"), [(Broken(), {"place": 0.05, "stopped": 0.0}), (Untold(), {})])
def test_a_plant_that_fails_ends_its_part_and_not_the_thread_of_the_machine(plant, outcome):
    one = course(plant)
    one.take({"velocity": 1.0}, 0)
    one.advance(50 * MS)
    assert not one.over
    assert one.advance(80 * MS) is False
    assert one.over and one.latched == "the machine failed: ZeroDivisionError: stiffness"
    shown = one.sample()
    assert shown.latched == one.latched and not shown.done and shown.outcome == pytest.approx(outcome)
    with pytest.raises(Refused, match="stiffness"):
        one.take({"velocity": 1.0}, 90 * MS)
