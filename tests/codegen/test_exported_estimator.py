"""The estimator of a ring as C: bits of its kernels, results of `GeometryEstimator`, one for each setting."""

import shutil
from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from codegen_inside import LibrarySteps

import centering
import sdpgrind

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
SETTINGS = {
    "plain": {},
    "form": {"form": {3: 0.002}, "radius_prior": (60.0, 0.01), "joint": True, "forgetting": 0.5},
}


def readings(rng, count, moved):
    """A ring at an offset of 3 mm, with dust; it moves half way."""
    angle = 0.1 * np.arange(count)
    offset = np.where(np.arange(count) < count // 2, 3.0, moved)
    reading = offset * np.cos(angle) + np.sqrt(60.0**2 - (offset * np.sin(angle)) ** 2)
    reading += rng.normal(0.0, 0.001, count)
    reading[rng.random(count) < 0.05] += 0.5
    return angle, reading


def estimator_of(name):
    return centering.GeometryEstimator(noise_sd=0.002, **SETTINGS[name])


@pytest.fixture(scope="module")
def exported(few_blocks, tmp_path_factory):
    """The export of an estimator with some settings, made once."""
    return cache(lambda name: sdpgrind.export(estimator_of(name), tmp_path_factory.mktemp("out") / "ring"))


@pytest.fixture(scope="module")
def compiled(exported):
    """The plain one as a controller."""
    return exported("plain").controller()


@pytest.mark.parametrize("name", SETTINGS)
def test_the_same_bits(exported, name):
    made = exported(name)
    found = made.check(3000, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    assert made.manifest["stack"] >= max(found.stack.values())


def test_the_results_of_the_estimator(compiled):
    estimator, c = estimator_of("plain"), deepcopy(compiled)
    for angle, reading in zip(*readings(np.random.default_rng(1), 240, 2.0), strict=True):
        found = c.step(angle=angle, reading=reading)
        estimator.update(angle=angle, reading=reading)
        assert found["valid"] == estimator.valid and found["restarts"] == estimator.restarts
    circle = estimator.estimate
    assert (found["radius"], found["center_x"], found["center_y"]) == (
        circle.radius,
        circle.center_x,
        circle.center_y,
    )
    assert found["band"] == estimator.band and estimator.restarts == 1
    with pytest.raises(ValueError, match="within their range"):
        c.step(angle=np.nan, reading=60.0)


def test_readings_that_are_refused_within_their_range(compiled):
    """The meanings say both; a refusal does not put them on the range."""
    c = deepcopy(compiled)
    angle, reading = c._recipe.inputs.values()
    assert "a jump of more than a turn" in angle.meaning and "0 is refused" in reading.meaning
    with pytest.raises(ValueError, match="as their meanings in the header say"):
        c.step(angle=0.0, reading=0.0)
    c.step(angle=0.0, reading=60.0)
    with pytest.raises(ValueError, match="status -1"):
        c.step(angle=6.3, reading=60.0)
    for k in range(13):
        c.step(angle=0.8 * k, reading=60.0)
    with pytest.raises(ValueError, match="status -1"):
        c.step(angle=0.8 * 13, reading=60.0)
    limacon = centering.GeometryEstimator(noise_sd=0.002, model="limacon").__export__()
    assert "refused" not in limacon.inputs["reading"].meaning


def test_a_used_estimator_is_exported_fresh(tmp_path):
    used, fresh = (centering.GeometryEstimator(noise_sd=0.002) for _ in range(2))
    used.extend(*readings(np.random.default_rng(2), 50, 3.0))
    assert used.__export__().fingerprint == fresh.__export__().fingerprint and used.estimate.samples > 40


def test_vectors_reach_every_outcome():
    recipe = centering.GeometryEstimator(noise_sd=0.002).__export__()
    found: set[int] = set()
    steps = LibrarySteps(recipe)
    for rows in recipe.chains(np.random.default_rng(0), 512):
        resets = np.zeros(len(rows), dtype=bool)
        resets[0] = True
        found |= set(steps.take(rows, resets).codes.tolist())
    assert found >= set(range(len(recipe.status)))


def test_a_setting_that_the_step_would_change_is_refused(tmp_path):
    from codegen_kernels import counted

    recipe = sdpgrind.codegen.Recipe(
        "c", counted, {"x": ""}, {"y": ""}, state=np.array([2.0, 0.0]), settings=(0,)
    )
    made = sdpgrind.export(recipe, tmp_path / "good")
    assert made.controller().step(x=1.5) == {"y": 3.0}
    wrong = sdpgrind.codegen.Recipe(
        "c", counted, {"x": ""}, {"y": ""}, state=np.array([2.0, 0.0]), settings=(0, 1)
    )
    with pytest.raises(ValueError, match="setting an entry that never changes is not translated"):
        sdpgrind.export(wrong, tmp_path / "wrong")
