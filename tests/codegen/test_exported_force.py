"""Force controllers as C: along a plan for every design, in bits what `ForceController.step` commands."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import sdpgrind
from sdpgrind import units
from sdpgrind.weldbead import force

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
DESIGNS = {
    "pi": (force.PI.design(crossover=units.hz(3.0)), {}),
    "blended": (force.PI.design(crossover=units.hz(3.0)), {"blend": 0.3, "datum": 2.0}),
    "alone": (force.PI.design(crossover=units.hz(2.0)), {"feedforward": False}),
    "observer": (force.DisturbanceObserver(cutoff=units.hz(3.0)).loop, {}),
    "foreseen": (force.Predictive().loop, {}),
    "limited": (force.PI.design(crossover=units.hz(3.0)), {"limits": force.Limits(command_max=-9.9)}),
}


def plan(place=True):
    time = np.array([0.0, 0.4, 1.0, 1.1, 2.0])
    known = {"center_x": 30.0 * time, "face_leaves": 1.8} if place else {}
    forces, heights = [30.0, 30.0, 55.0, 20.0, 20.0], [10.0, 9.9, 9.8, 10.2, 10.0]
    return SimpleNamespace(time=time, normal_force=forces, fly_height=heights, **known)


def passes(rng, count=400):
    """Readings of two passes, the second from its start again: lost ones, places that are off."""
    for k in range(count):
        time = (k % (count // 2)) / 60.0
        row = {
            "force": rng.uniform(-5.0, 70.0),
            "pass_time": time,
            "center_x": 30.0 * time + rng.normal(0.0, 0.3),
        }
        for name, share in (("force", 0.1), ("pass_time", 0.2), ("center_x", 0.3)):
            if rng.random() < share and time > 0.0:
                row[name] = np.nan
        yield row


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("place", [True, False])
def test_commands_are_those_of_the_controller(tmp_path, name, place):
    loop, more = DESIGNS[name]
    controller = force.ForceController(plan(place), loop, **more)
    made = sdpgrind.export(controller, tmp_path / "press")
    c = made.controller()
    for row in passes(np.random.default_rng(3)):
        assert c.step(**row) == controller.step(**row)
    assert (
        c.period == controller.period
        and c.state[made.manifest["state"]["places"]["correction"]] == (controller.report()["correction"])
    )


def test_a_pass_that_begins_elsewhere(tmp_path):
    """The state of an endless demand is that of 1 N times it, to rounding: |x| some 10 mm, 1e-15 each."""
    controller = force.ForceController(plan(), DESIGNS["pi"][0])
    c = sdpgrind.export(controller, tmp_path / "press").controller()
    for k in range(20):
        row = {"force": 40.0, "pass_time": 0.9 + k / 60.0, "center_x": np.nan}
        wanted = controller.step(**row)["platform_command"]
        assert c.step(**row)["platform_command"] == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("loop", [DESIGNS["alone"][0]])
def test_without_a_plan_the_law_is_exported(tmp_path, loop):
    made = sdpgrind.export(force.ForceController(None, loop), tmp_path / "law")
    assert [one["name"] for one in made.manifest["inputs"]] == ["force", "normal_force_plan", "position_plan"]
    assert made.check(2000, ["gcc"], levels=["-O2"], targets=()).differing == 0


def test_passes_reach_what_the_self_test_needs(tmp_path):
    made = sdpgrind.export(force.ForceController(plan(), DESIGNS["pi"][0]), tmp_path / "press")
    found = made.check(3000, ["gcc"], levels=["-O0"], targets=())
    assert found.differing == 0, found.first
