"""The push of a centering strategy as C: bits of its kernels, choices and times of `Strategy`, what is refused."""

import shutil

import numpy as np
import pytest

import sdpgrind
from centering import Strategy, preset
from centering.cycle import OutcomeTable, PushKind

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
KINDS = (PushKind("trapezoid", 20.0, True), PushKind("gentle", 10.0, True), PushKind("trapezoid", 5.0, False))
PUSHES, OFFSETS, FRICTIONS = 3, 16, 4


@pytest.fixture(scope="module")
def strategy():
    """Made up, so that nothing is planned: strokes that move parts less the more friction there is."""
    rng, strokes = np.random.default_rng(1), 0.01 * 1.05 ** np.arange(120)
    scales = 1.0 + 0.25 * np.sinh(-1.6 + np.arange(62) / 15.0)
    travel = np.maximum(0.0, strokes[:, None] - 0.03 * scales) * np.array([1.0, 0.9, 0.5])[:, None, None]
    last = np.array([110, 119, 100])
    outcomes = OutcomeTable(KINDS, 0.01, 1.05, travel, np.ones((3, 120)), last)
    shape = PUSHES, OFFSETS, FRICTIONS
    table = rng.uniform(1.0, 9.0, shape), rng.integers(0, 3, shape), rng.uniform(0.6, 1.5, shape)
    return Strategy(preset("printed"), outcomes, np.linspace(9.0, 3.0, OFFSETS), table)


@pytest.fixture(scope="module")
def made(strategy, tmp_path_factory):
    return sdpgrind.export(strategy, tmp_path_factory.mktemp("out") / "push")


def test_the_same_bits(made):
    found = made.check(3000, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    assert made.manifest["stack"] >= max(found.stack.values()) > 0
    assert "exp, log and asinh" in made.promise and made.manifest["math"] == "libm"


def test_choices_are_those_of_the_strategy(strategy, made):
    c, rng, kinds = made.controller(), np.random.default_rng(2), set()
    for _ in range(200):
        place = {
            "offset": float(np.exp(rng.uniform(np.log(1.01 * strategy.finish), np.log(strategy.offset_max)))),
            "friction": rng.normal(1.0, 0.3),
            "evidence": rng.uniform(0.0, 4.0),
        }
        got, wanted = c.step(**place), strategy.push(**place)
        how = "aim", "stroke", "push_speed", "spindle_speed", "kind"
        assert [got[name] for name in how] == [getattr(wanted, name) for name in how] and c.status == 0
        assert (got["gentle"], got["retract"]) == (wanted.shape == "gentle", wanted.retract)
        assert got["expected_time"] == strategy.value(**place)
        kinds.add(wanted.kind)
    assert kinds == {0, 1, 2}


def test_friction_and_evidence_of_a_part_that_nothing_is_known_of(strategy, made):
    got, wanted = made.controller().step(offset=0.5), strategy.push(offset=0.5)
    assert (got["stroke"], got["spindle_speed"]) == (wanted.stroke, wanted.spindle_speed)


def test_endless_evidence_counts_as_the_most(strategy):
    most = {"offset": 0.5, "evidence": 1e9}, {"offset": 0.5, "evidence": np.inf}
    assert strategy.push(**most[0]) == strategy.push(**most[1])
    assert strategy.value(**most[0]) == strategy.value(**most[1])


def test_a_centred_part(strategy, made):
    c = made.controller()
    for offset in (0.0, strategy.finish):
        got = c.step(offset=offset)
        assert c.status == 1 and got["kind"] == -1.0
        assert got["stroke"] == got["push_speed"] == got["expected_time"] == 0.0 < got["spindle_speed"]


@pytest.mark.parametrize(
    "place",
    [{"offset": np.nan}, {"friction": np.nan}, {"evidence": np.nan}, {"evidence": -1.0}, {"offset": 99.0}],
)
def test_what_has_no_place_in_the_tables_is_refused(strategy, made, place):
    (name,) = place
    asked = {"offset": 0.5, "friction": 1.0, "evidence": 0.0, **place}
    with pytest.raises(ValueError, match="status -1"):
        made.controller().step(**asked)
    for look in (strategy.push, strategy.value):
        with pytest.raises(ValueError, match=f"{name} must be"):
            look(**asked)
