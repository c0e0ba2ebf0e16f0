"""Files saved by 0.1.0 (`tests/data/saved-0.1.0`) still load, tell the same, and are saved as they were."""

import json
import re
import subprocess
import sys

import pytest
import xarray
from house_names import ROOT, SOURCE

import hwsim
import sdpgrind
from sdpgrind.base import records

FOLDER = ROOT / "tests/data/saved-0.1.0"
FILES = {path.name: path for path in sorted(FOLDER.glob("*.nc"))}
TOLD = dict(line.split(": ", 1) for line in (FOLDER / "reprs.txt").read_text().splitlines())
# Some numbers are computed again when a file is opened (angles, points of an area): on another processor
# their last bits differ, by up to 6e-14 of a cost of 1.
ROUNDED = {"rtol": 1e-13, "atol": 1e-15}


def parsed(text):
    """An attribute as JSON where it is that; arrays as lists."""
    if hasattr(text, "tolist"):
        return text.tolist()
    try:
        return json.loads(text)
    except (TypeError, ValueError):
        return text


def holds(after, before):
    """Whether everything saved before is there, and unchanged; later versions may add fields."""
    if isinstance(before, dict):
        return isinstance(after, dict) and all(k in after and holds(after[k], before[k]) for k in before)
    if isinstance(before, list):
        return len(after) == len(before) and all(map(holds, after, before))
    return after == (
        pytest.approx(before, rel=1e-13, abs=0, nan_ok=True) if isinstance(before, float) else before
    )


REWORDED = dict.fromkeys(  # labels in better English since; all others are as they were
    [("centering.push.nc", "start"), ("centering.optimal_push.nc", "start")],
    "position of the slide at the start, from first touch",
)


def as_written_now(name, key, value):
    """An attribute of version 0.1.0 as this version writes it: fields of a motion that have another name since."""
    if name != "finishing.motion.nc" or key not in ("problem", "posture"):
        return value
    if key == "posture":
        radius, branch, placement = value
        return {"branch": branch, "placement": placement, "free": {"wrist_radius": radius}}
    radius = value.pop("wrist_radius")
    value["robot"] = {**value.pop("arm"), "wrist_radius": radius}
    return value


@pytest.mark.parametrize("name", FILES)
def test_a_saved_file_loads_and_is_saved_as_it_was(name, tmp_path):
    with pytest.warns(sdpgrind.OldFileWarning) as told:
        thing = sdpgrind.load(FILES[name])
    assert len(told) == 1 and name in str(told[0].message) and told[0].filename == __file__
    assert repr(thing) == TOLD[name]
    thing.save(tmp_path / name)
    with pytest.warns(sdpgrind.OldFileWarning):
        before = records.read(FILES[name])
    after = records.read(tmp_path / name)
    assert before.attrs.pop("version") == "0.1.0" and after.attrs.pop("version") == sdpgrind.__version__
    assert after.attrs.keys() == before.attrs.keys()
    assert all(
        holds(parsed(after.attrs[key]), as_written_now(name, key, parsed(before.attrs[key])))
        for key in before.attrs
    )
    xarray.testing.assert_allclose(after.drop_attrs(deep=False), before.drop_attrs(deep=False), **ROUNDED)
    for key, variable in before.variables.items():
        known = variable.attrs | ({"long_name": label} if (label := REWORDED.get((name, key))) else {})
        assert after[key].attrs == known
    assert {key: value.dtype for key, value in after.variables.items()} == {
        key: value.dtype for key, value in before.variables.items()
    }


def test_a_saved_journal_opens():
    with pytest.warns(sdpgrind.OldFileWarning) as told:
        journal = sdpgrind.load(FOLDER / "hwsim.journal.db")
        log = sdpgrind.load(FILES["hwsim.log.nc"])
    assert len(told) == 2  # one each
    with journal:
        assert isinstance(journal, hwsim.Journal) and journal.parts == 2
        assert journal.log().outcome.equals(log.outcome)


def test_every_kind_but_those_of_minutes_is_here():
    assert TOLD.keys() == FILES.keys() and len(FILES) >= 17
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 1_000_000


FRESH = """
import json, sys
from sdpgrind.base.stored import decode
for name in sys.argv[1:]:
    try:
        decode(json.dumps({"stored": name}))
    except ValueError as error:
        assert "does not know" not in str(error), name
    except TypeError:
        pass  # the class is found, its fields are missing
"""


def test_every_stored_class_is_found_in_a_process_that_has_imported_nothing():
    text = "".join(path.read_text() for path in SOURCE.rglob("*.py"))
    names = sorted(set(re.findall(r'^@(?:described|stored)\("([a-z_.]+)"', text, re.MULTILINE)))
    assert len(names) > 70
    subprocess.run([sys.executable, "-c", FRESH, *names], check=True)
