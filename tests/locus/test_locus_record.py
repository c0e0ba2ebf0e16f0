"""Plans of a locus in files: the same look-ups bit for bit, also for functions of one's own."""

import numpy as np
import pytest
from hard_problems import PROBLEMS

import sdpgrind
from sdpgrind import locus

NAMES = ["koren-example", "turning", "milling", "grinding", "motor"]
OWN = ["koren", "jump", "swap", "four-controls", "trig", "tiny-state", "pitchfork"]


def of(name):
    return PROBLEMS[name] if name in PROBLEMS else locus.preset(name)


@pytest.mark.parametrize("name", NAMES + OWN)
def test_look_ups_are_the_same_bit_for_bit(name, tmp_path):
    curve = locus.plan(of(name))
    curve.save(tmp_path / "curve.nc")
    again = sdpgrind.load(tmp_path / "curve.nc")
    assert type(again) is locus.Locus
    assert repr(again) == repr(curve)
    assert again.events == curve.events
    assert [repr(piece) for piece in again.pieces] == [repr(piece) for piece in curve.pieces]
    low, high = curve.range
    for x in low + (high - low) * np.linspace(0, 1, 7):
        assert again.at(**{curve.hidden_name: x}) == curve.at(**{curve.hidden_name: x})
    first, second = curve.table(), again.table()
    if name != "jump":
        np.testing.assert_array_equal(first.packed, second.packed)
    for column in locus.Columns.__dataclass_fields__:
        for one, other in zip(curve.pieces, again.pieces, strict=True):
            np.testing.assert_array_equal(getattr(one.table, column), getattr(other.table, column))


@pytest.mark.parametrize("name", ["koren", "turning", "four-controls"])
def test_what_was_loaded_can_be_planned_anew_and_saved_anew(name, tmp_path):
    curve = locus.plan(of(name))
    curve.save(tmp_path / "curve.nc")
    loaded = sdpgrind.load(tmp_path / "curve.nc")
    again = locus.plan(loaded.problem)
    low, high = curve.range
    x = {curve.hidden_name: 0.3 * low + 0.7 * high}
    assert again.at(**x).controls == pytest.approx(curve.at(**x).controls, rel=1e-12)
    loaded.save(tmp_path / "again.nc")
    assert sdpgrind.load(tmp_path / "again.nc").at(**x) == curve.at(**x)
    narrow = loaded.problem.replace(hidden={curve.hidden_name: (low, 0.5 * (low + high))})
    assert locus.plan(narrow).range[1] == pytest.approx(0.5 * (low + high))


def test_units_go_with_it(tmp_path):
    own = PROBLEMS["koren"].replace(units={"u": "mm/s", "x": "mm"})
    locus.plan(own).save(tmp_path / "curve.nc")
    loaded = sdpgrind.load(tmp_path / "curve.nc")
    assert [loaded.problem.unit(name) for name in ("u", "v", "x")] == ["mm/s", "", "mm"]
    assert loaded.dataset["x"].attrs["units"] == "mm"


def test_a_degenerate_locus_comes_back_degenerate(tmp_path):
    flat = locus.Problem(
        controls={"u": (0.1, 2.0), "v": (0.1, 2.0)},
        hidden={"x": (0.5, 1.0)},
        cost=lambda s, c: -c.u * c.v,
        constraints=[
            locus.Varying(name="cap", response=lambda s, c: c.u * c.v, limit=lambda s, c: 0.5 + 0 * c.u),
            locus.Varying(
                name="heat",
                response=lambda s, c: s.x * (c.u**2 + 0.5 * c.v**2),
                limit=lambda s, c: 2 + 0 * c.u,
            ),
        ],
    )
    curve = locus.plan(flat)
    assert curve.degenerate
    curve.save(tmp_path / "curve.nc")
    loaded = sdpgrind.load(tmp_path / "curve.nc")
    assert loaded.degenerate
    assert loaded.at(x=0.77) == curve.at(x=0.77)
    u, v = curve.at(x=0.77).controls.values()
    assert u * v == pytest.approx(0.5, abs=1e-6)
    # of all with u v = 1/2, the least heat, so the most slack
    assert v**2 == pytest.approx(2 * u**2, rel=1e-5)
