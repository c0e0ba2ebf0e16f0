"""Recursive least squares and the filter of random walks as C: states in bits, estimates as the library has them."""

import shutil

import numpy as np
import pytest

import sdpgrind
from sdpgrind import identify

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
NAMES = ("start", "slope", "bend")
PRIOR = identify.Estimate(NAMES, [1.0, 2.0, 3.0], np.diag([0.1, 0.2, 0.3]))
ONE_KNOWN = identify.Estimate(NAMES, [1.0, 2.0, 3.0], np.diag([0.1, np.inf, np.inf]))
PAUSE = 30  # rows before it
NONE = "same bits on every IEEE 754 target: no libm function is used"


def squares(**more):
    return identify.RecursiveLeastSquares(NAMES, forgetting=0.98, units=("mm", "mm/s"), **more)


def walk(names=NAMES, noise=(0.1, 0.2, 0.0), **more):
    return identify.RandomWalk(names, walk_variance=1e-3, noise_variance=noise, units=("mm",), **more)


CASES = {
    "residuals": lambda: squares(),
    "noise known": lambda: squares(prior=PRIOR, noise_sd=0.1),
    "one value known": lambda: squares(prior=ONE_KNOWN, noise_sd=0.1),
    "one row": lambda: identify.RecursiveLeastSquares(("level",), noise_sd=2.0),
    "readings": lambda: walk(),
    "one reading": lambda: walk(("gap",), 0.2),
    "combination": lambda: walk(noise=0.2, prior=PRIOR),
    "readings, prior": lambda: walk(prior=ONE_KNOWN),
}


@pytest.mark.parametrize("name", CASES)
def test_the_same_bits(tmp_path, name):
    made = sdpgrind.export(CASES[name](), tmp_path / "thing")
    found = made.check(3000, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    assert made.manifest["stack"] >= max(found.stack.values()) > 0
    assert (made.promise == NONE) == (name != "residuals")  # squares of residuals are those of pow


def rows(rng, count=60):
    """Rows, targets and weights: enough of them only later on, then a pause in which the others are forgotten."""
    found = rng.normal(size=(count, 3))
    found[:5, 2] = 0.0
    weight = np.where(rng.random(count) < 0.3, 0.9, np.nan)
    found[PAUSE : PAUSE + 15], weight[PAUSE : PAUSE + 15] = found[PAUSE], 1e-3
    found[rng.random(count) < 0.05] = 0.0
    return zip(found, found @ [1.0, 2.0, 3.0] + 0.1 * rng.normal(size=count), weight, strict=True)


@pytest.mark.parametrize("name", ["residuals", "noise known", "one value known"])
def test_rows_as_the_estimator_takes_them(tmp_path, name):
    """States are equal; estimates come of the triangle, not of singular values: equal to 1e-16 times its condition.

    In the pause that grows until both say that the digits are lost: at 1 % of a standard deviation.
    """
    rls = CASES[name]()
    c = sdpgrind.export(rls, tmp_path / "thing").controller()
    outcomes = set()
    for k, (row, target, weight) in enumerate(rows(np.random.default_rng(1))):
        given = dict(zip(("start_row", "slope_row", "bend_row"), row.tolist(), strict=True))
        found = c.step(target=target, forgetting=weight, **given)
        rls.update(row, target, None if np.isnan(weight) else weight)
        assert c.state.tobytes() == rls._form.state.tobytes()
        wanted = rls.estimate
        outcomes.add(c.status)
        assert (c.status == 0) == wanted.ok, wanted.message
        if wanted.ok:
            got = np.array([[found[one], found[f"{one}_sd"]] for one in NAMES]).T
            np.testing.assert_allclose(got, [wanted.value, wanted.sd], rtol=1e-9 if k < PAUSE else 0.01)
        else:
            assert {found[f"{one}_sd"] for one in NAMES} == {np.inf}
    assert outcomes == {0, 1}


@pytest.mark.parametrize("name", ["readings", "one reading", "readings, prior"])
def test_readings_as_the_filter_takes_them(tmp_path, name):
    track, rng = CASES[name](), np.random.default_rng(2)
    c = sdpgrind.export(track, tmp_path / "thing").controller()
    names = track.estimate.names
    assert list(c.reads) == [f"{one}_reading" for one in names] and c.reads[f"{names[0]}_reading"] == "mm"
    for _ in range(40):
        reading = rng.normal(size=len(names))
        reading[rng.random(len(names)) < 0.4] = np.nan
        found = c.step(**dict(zip(c.reads, reading.tolist(), strict=True)))
        track.update(reading)
        same_estimate(found, c.status, track.estimate)


def test_readings_of_a_combination(tmp_path):
    track, rng = CASES["combination"](), np.random.default_rng(3)
    c = sdpgrind.export(track, tmp_path / "thing").controller()
    assert list(c.reads) == ["reading", "start_row", "slope_row", "bend_row"]
    for k in range(40):
        row, reading = rng.normal(size=3) * [1.0, k % 3, 1.0], np.nan if k % 5 == 4 else rng.normal()
        found = c.step(**dict(zip(c.reads, [reading, *row.tolist()], strict=True)))
        track.update(reading, row)
        same_estimate(found, c.status, track.estimate)


def same_estimate(found, status, wanted):
    assert [found[one] for one in wanted.names] == wanted.value.tolist()
    assert [found[f"{one}_sd"] for one in wanted.names] == wanted.sd.tolist()
    assert (status == 0) == wanted.ok


def test_what_was_taken_before_does_not_count(tmp_path):
    rls, track = CASES["residuals"](), CASES["combination"]()
    fresh = rls.__export__().fingerprint, track.__export__().fingerprint
    rls.update([1.0, 0.0, 2.0], 3.0)
    track.update(1.0, [1.0, 0.0, 2.0])
    assert (rls.__export__().fingerprint, track.__export__().fingerprint) == fresh


def test_what_is_not_exported(tmp_path):
    with pytest.raises(ValueError, match="method must be 'square_root': the other one ends by eigenvalues"):
        sdpgrind.export(squares(prior=PRIOR, noise_sd=0.1, method="covariance"), tmp_path / "thing")
    many = identify.RecursiveLeastSquares(tuple(f"v{k}" for k in range(9)))
    with pytest.raises(ValueError, match="names must be at most 8 in an export; got 9"):
        sdpgrind.export(many, tmp_path / "thing")
    with pytest.raises(ValueError, match="an identifier of C"):
        sdpgrind.export(walk(("a gap",), 0.2), tmp_path / "thing")


def test_a_residual_beyond_numbers_is_said():
    rls = identify.RecursiveLeastSquares(("level",))
    rls.update([1.0], 0.0)
    with pytest.raises(OverflowError, match="target is too far from what the values predict: 1e\\+200"):
        rls.update([1.0], 1e200)


def test_a_kernel_and_a_table_of_one_name_have_two_in_c(tmp_path):
    from codegen_kernels import doubled

    recipe = sdpgrind.codegen.Recipe("c", doubled, {"x": ""}, {"y": ""}, law=([1.0, 2.0, 3.0],))
    made = sdpgrind.export(recipe, tmp_path / "thing")
    assert made.controller().step(x=1.0) == {"y": 8.0}
