"""Results of roundness on disk: what is loaded equals what was saved, kind of circle included."""

import json
import warnings

import numpy as np
import pytest
from measured_rings import turn

import sdpgrind
from centering.roundness import Harmonics, Profile, RoundnessInterval, Sections, SpindleError
from sdpgrind import units
from sdpgrind.base import records

ANGLE = turn(1, 360)
NOISE = 1e-4 * np.random.default_rng(0).normal(size=ANGLE.size)
RING = Profile(ANGLE, 30.0 + 1e-3 * np.cos(3 * ANGLE) + NOISE)
ROLLED = turn(3, 360)
ROLLER = Profile(ROLLED, 62.0 + 1e-3 * np.cos(61.94 / 3.75 * ROLLED - 1.0), tip_radius=3.75)
SPINDLE = SpindleError(Harmonics([2, 5], [1e-4, 6e-5], [1.9, 0.3], [1e-6, 1e-6]), np.array([36, 72]))

RESULTS = {
    "raw": lambda: RING.roundness("MIC"),
    "LSC": lambda: RING.correct(SPINDLE).filter(upr=15).roundness("LSC"),
    "MZC": lambda: RING.filter(upr=15).roundness("MZC"),
    "interval": lambda: RoundnessInterval(0.0019, 0.0021, 0.002, 0.95, "calibrated"),
    "cylinder": lambda: Sections([RING, RING, RING], [0.0, 10.0, 20.0]).cylinder("MZC"),
    "harmonics": lambda: RING.harmonics(upr_max=15),
    "spindle": lambda: SPINDLE,
    "roller": lambda: ROLLER.remove_roller_error().roller_error,
    "slope": lambda: RING.slope(units.deg(30)),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_is_loaded_as_it_was(name, tmp_path):
    result = RESULTS[name]()
    result.save(tmp_path / "result.nc")
    again = sdpgrind.load(tmp_path / "result.nc")
    assert type(again) is type(result) and again == result and repr(again) == repr(result)


def test_a_circle_keeps_its_kind_beside_that_of_the_file(tmp_path):
    zone = RESULTS["MZC"]()
    zone.save(tmp_path / "zone.nc")
    again = sdpgrind.load(tmp_path / "zone.nc")
    assert (again.kind, records.read(tmp_path / "zone.nc").attrs["kind"]) == ("MZC", "centering.roundness")
    assert again.interval() == zone.interval()
    assert again.origin == zone.origin and again.origin.high == 15.0
    with pytest.raises(ValueError, match="read-only"):
        again.points[0, 0] = 0.0


def test_a_file_has_arrays_with_units(tmp_path):
    RESULTS["MZC"]().save(tmp_path / "zone.nc")
    data = records.read(tmp_path / "zone.nc")
    assert data["points"].attrs["units"] == data["noise_sd"].attrs["units"] == "mm"
    assert data["points"].shape == (360, 2)


def test_a_corrected_profile_tells_what_of_its_noise_is_the_spindles():
    found = RESULTS["LSC"]().origin
    assert found.lost == (36, 72)
    assert found.separated[2] == pytest.approx(1e-6 * np.exp2(-((2 / 15) ** 2)))
    assert found.sd[2] > found.separated[2] and found.separated[3] == 0.0


@pytest.mark.parametrize("tip", [0.0, 1.0])
def test_a_bore_of_an_earlier_version_is_told(tip):
    """Its file lacks the side: the sign of a tip tells it, a point tip does not, and that is said once."""
    bore = Profile(RING.angle, RING.reading, tip_radius=tip, internal=True)
    for found in (bore.roundness("MCC"), Sections([bore] * 3, [0.0, 10.0, 20.0]).cylinder("MCC")):
        data = found._written()
        fields = json.loads(data.attrs["fields"])
        assert type(found).restored(data) == found and fields.pop("internal")
        older = data.assign_attrs(fields=json.dumps(fields))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            again = type(found).restored(older)
        assert [str(each.message)[:41] for each in told] == ["the file does not tell whether a bore was"] * (
            not tip
        )
        assert (again if tip else again.replace(internal=True)) == found
