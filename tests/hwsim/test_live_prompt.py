"""Who waits for whom in a live run: the interpreter's switch interval, and the bell of the link's thread."""

import asyncio
import sys

import pytest
from hwsim_fakes import Drain, Tank
from opcua_fakes import Axis, served

import hwsim
from hwsim._live.prompt import SWITCH, hurry, leave
from hwsim.opcua._bell import Bell

pytestmark = pytest.mark.usefixtures("nothing_collected")
UNIT = 1.5e-6  # s; the interpreter cuts intervals off to whole microseconds


@pytest.fixture
def interval():
    former = sys.getswitchinterval()
    yield former
    assert sys.getswitchinterval() == pytest.approx(former, abs=UNIT)
    sys.setswitchinterval(former)


def test_the_last_who_leaves_restores_the_interval_in_whatever_order(interval):
    with served(Axis()):
        hurry()
        assert sys.getswitchinterval() == pytest.approx(SWITCH, abs=UNIT)
    assert sys.getswitchinterval() == pytest.approx(SWITCH, abs=UNIT)  # the server has left, another has not
    leave()


def test_a_shorter_interval_of_the_user_stays(interval):
    sys.setswitchinterval(SWITCH / 5)
    hurry()
    assert sys.getswitchinterval() == pytest.approx(SWITCH / 5, abs=UNIT)
    leave()
    assert sys.getswitchinterval() == pytest.approx(SWITCH / 5, abs=UNIT)
    sys.setswitchinterval(interval)


def test_a_live_run_hurries_and_restores_also_when_it_fails(interval):
    class Asked(Drain):
        def step(self, **read):
            seen.append(sys.getswitchinterval())
            if self.steps == 2:
                raise RuntimeError("fault")
            return super().step(**read)

    seen = []
    with pytest.raises(hwsim.Aborted):
        hwsim.run(Tank(), Asked(1.0, 0.01), live=hwsim.Live(safe={"flow": 0.0}, deadline=1.0))
    assert seen[-1] == pytest.approx(SWITCH, abs=UNIT)


def test_a_bell_wakes_who_waits_and_who_waits_next_and_time_does():
    async def work():
        bell, woken = Bell(), []

        async def sleeper():
            for seconds in (60.0, 60.0, 0.001):
                await bell.wait(seconds)
                woken.append(seconds)

        task = asyncio.create_task(sleeper())
        await asyncio.sleep(0)
        bell.ring()
        bell.ring()  # rung twice is rung once
        while not woken:
            await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert woken == [60.0]
        bell.ring()
        await task
        assert woken == [60.0, 60.0, 0.001]  # the last one by time alone

    asyncio.run(work())


def test_a_bell_that_was_rung_before_is_not_waited_for():
    async def work():
        bell = Bell()
        bell.ring()
        await asyncio.wait_for(bell.wait(60.0), 5.0)

    asyncio.run(work())
