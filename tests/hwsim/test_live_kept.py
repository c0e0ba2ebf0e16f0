"""What stays of a run against the clock: acts, aborted parts, names, and the state of the process."""

import threading
from typing import ClassVar

import centering_fakes
import numpy as np
import pytest
from hwsim_fakes import Drain, Tank, noisy_tank
from live_fakes import PERIOD, Failing, asleep, broken

import hwsim

pytestmark = pytest.mark.usefixtures("nothing_collected")
SAFE = {"close": 1.0}
LONG = 1.0  # s; see test_live


def live(**options):
    return hwsim.Live(**{"safe": SAFE, "deadline": LONG, **options})


class Named(Failing):
    """The same controller to the journal whether it fails or not."""

    identity = "named"


def outcomes(path):
    with hwsim.Journal(path) as journal:
        return journal.log().outcome


def test_a_run_that_resumes_without_a_clock_does_an_aborted_part_again(tmp_path):
    path = tmp_path / "run.db"
    with pytest.raises(hwsim.Aborted):
        hwsim.run(noisy_tank(), Named(broken, at=2), parts=2, rng=3, live=live(), journal=path)
    plain = hwsim.run(noisy_tank(), Named(lambda: None), parts=2, rng=3)
    whole = hwsim.run(noisy_tank(), Named(lambda: None), parts=2, rng=3, journal=path)
    np.testing.assert_array_equal(whole.outcome.leak, plain.outcome.leak)
    np.testing.assert_array_equal(outcomes(path).leak, plain.outcome.leak)


def test_an_aborted_part_stays_until_the_one_in_its_place_is_written(tmp_path):
    class Killed(BaseException):
        pass

    def killed():
        raise Killed

    path = tmp_path / "run.db"
    with pytest.raises(hwsim.Aborted):
        hwsim.run(noisy_tank(), Named(broken, at=2), rng=3, live=live(), journal=path)
    with pytest.raises(Killed):
        hwsim.run(noisy_tank(), Named(killed, at=2), rng=3, journal=path)
    np.testing.assert_array_equal(outcomes(path).aborted, [1.0])


def test_only_an_aborted_part_is_replaced(tmp_path):
    from hwsim._log.journal import SecondWriterError

    path = tmp_path / "run.db"
    log = hwsim.run(Tank(level=3.0, leak=0.5), Named(lambda: None), rng=3, live=live(), journal=path)
    with hwsim.Journal(path) as journal:
        (part,) = journal.read()
        with pytest.raises(SecondWriterError):
            journal.add(0, part)
    np.testing.assert_array_equal(outcomes(path).leak, log.outcome.leak)


def test_acts_after_the_last_part_are_in_the_journal(tmp_path):
    path, operator = tmp_path / "run.db", live()
    operator.pause(who="night shift")
    threading.Timer(0.2, operator.abort, ("door open", "guard")).start()
    with pytest.raises(hwsim.Aborted, match="no part was begun: door open"):
        hwsim.run(noisy_tank(), Drain(10.0), live=operator, journal=path)
    with hwsim.Journal(path) as journal:
        told = [(act.who, act.what) for act in journal.acts]
    assert told == [("night shift", "pause"), ("guard", "abort: door open")]


def test_an_outcome_of_the_plant_keeps_its_name():
    class Counting(Tank):
        @property
        def outcomes(self):
            return {**super().outcomes, "overruns": "mm"}

        def with_tick(self, tick):
            return Counting(self.level, tick, self.alarm, self.leak)

        def start(self, rng):
            machine = super().start(rng)
            found = machine.outcome
            machine.outcome = lambda: {**found(), "overruns": 7.0}
            return machine

    outcome = hwsim.run(Counting(level=0.5, tick=0.01), Drain(10.0), live=live()).outcome
    assert float(outcome.overruns[0]) == 7.0 and outcome.overruns.units == "mm"
    assert float(outcome.live_overruns[0]) == 0.0 and outcome.live_overruns.units == "1"


def test_a_machine_with_a_computer_of_its_own_takes_the_safe_command_at_its_next_sample():
    machine = hwsim.CenteringMachine(centering_fakes.problem())
    safe = machine.safe

    class Turning:
        tier, reads, commands = "turning", {"angle": "rad"}, {"spindle_speed": "rad/s"}
        period = machine.with_tick(1e-3).sample_ticks * 1e-3

        def reset(self):
            self.steps = 0

        def step(self, **read):
            self.steps += 1
            if self.steps == 4:
                asleep(0.5)()
            return {"spindle_speed": 2.0}

    with pytest.raises(hwsim.Aborted) as caught:
        hwsim.run(machine, Turning(), live=hwsim.Live(safe=safe, deadline=0.2))
    outcome = caught.value.log.outcome.isel(part=-1)
    assert str(outcome.safe_by.values) == "link"  # the machine did not refuse it
    assert "live_overruns" in outcome and "worst_response" in outcome


def test_a_watchdog_in_a_tier_is_refused():
    class Watching(Drain):
        tripped = False

    class Tiers(Drain):
        tiers: ClassVar = {"tap": Watching(10.0, PERIOD)}

    with pytest.raises(ValueError, match="controller must not be a Watchdog in a live run"):
        hwsim.run(Tank(level=0.5, tick=PERIOD / 2), Tiers(), live=live())
