"""Files saved by 0.1.0 (`tests/data/saved-0.1.0`) still load, tell the same, and are saved as they were."""

import re
import subprocess
import sys

import pytest
from house_names import ROOT, SOURCE

import hwsim
import sdpgrind
from sdpgrind.base import records

FOLDER = ROOT / "tests/data/saved-0.1.0"
FILES = {path.name: path for path in sorted(FOLDER.glob("*.nc"))}
TOLD = dict(line.split(": ", 1) for line in (FOLDER / "reprs.txt").read_text().splitlines())


@pytest.mark.parametrize("name", FILES)
def test_a_saved_file_loads_and_is_saved_as_it_was(name, tmp_path):
    thing = sdpgrind.load(FILES[name])
    assert repr(thing) == TOLD[name]
    thing.save(tmp_path / name)
    before, after = (records.read(path) for path in (FILES[name], tmp_path / name))
    assert before.attrs.pop("version") == "0.1.0" and after.attrs.pop("version") == sdpgrind.__version__
    assert after.identical(before)
    assert {key: value.dtype for key, value in after.variables.items()} == {
        key: value.dtype for key, value in before.variables.items()
    }


def test_a_saved_journal_opens():
    with sdpgrind.load(FOLDER / "hwsim.journal.db") as journal:
        assert isinstance(journal, hwsim.Journal) and journal.parts == 2
        assert journal.log().outcome.equals(sdpgrind.load(FILES["hwsim.log.nc"]).outcome)


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
