"""What doubts say to type next, typed: the call stands in a sentence, runs, and changes the problem."""

import re
from pathlib import Path

import numpy as np
import pytest

import centering
import hwsim
from sdpgrind import finishing, locus, plunge, weldbead

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
AREAS = {
    "centering": centering,
    "finishing": finishing,
    "locus": locus,
    "plunge": plunge,
    "weldbead": weldbead,
}


def cycle(name="simulation"):
    read = {"time": "t", "size": "X", "command_rate": "v", "grinding_power": "P"}
    return plunge.preset(name), hwsim.Log.read(SAMPLES / "plunge_brackets.csv", **read)


def bead():
    columns = {"normal_force": "Fn", "tangential_force": "Ft", "grinding_power": "P", "removal_rate": "Q"}
    more = {"feed_rate": "feed", "cut_depth": "a"}
    return weldbead.preset("P1"), hwsim.Log.read(SAMPLES / "bead_passes.csv", period=1.0, **columns, **more)


def roughness():
    columns = {"pattern": "pattern", "tool_diameter": "tool", "normal_force": "F", "roughness_ra": "Ra"}
    return finishing.preset("nominal"), hwsim.Log.read(SAMPLES / "finishing_runs.csv", period=1.0, **columns)


def wheel():
    problem = locus.preset("grinding")
    rate, area = (x.ravel() for x in np.meshgrid([0.01, 0.015, 0.02], np.linspace(0.006, 0.009, 8)))
    log = {"infeed_rate": rate, "work_rotation": np.full(rate.size, 10.0), "wear_flat_area": area}
    power = problem.model.replace(specific_energy=12.0).grinding_power(*log.values())
    return problem, log | {"grinding_power": power + np.random.default_rng(0).normal(0.0, 1.0, rate.size)}


def ring():
    return centering.preset("printed"), centering.Profile.read(SAMPLES / "ring.x3p", radius=40.0)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("make", [cycle, lambda: cycle("experiment"), bead, roughness, wheel, ring])
def test_the_call_in_the_sentence_runs(make):
    problem, log = make()
    sentences = problem.doubts(log).sentences
    calls = [
        call for each in sentences for call in re.findall(r"problem\.\w+\(\S.*?\)(?=[.;] |\.$| puts)", each)
    ]
    assert calls
    for call in calls:
        changed = eval(call, AREAS | {"problem": problem, "log": log})  # as a user types it
        assert type(changed) is type(problem) and changed != problem
