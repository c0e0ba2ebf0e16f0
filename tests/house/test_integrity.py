"""The digest of a file: its value, every flipped bit of a small file, each verdict, what is refused at saving."""

import os
import pickle
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from house_names import ROOT, SOURCE

import sdpgrind
from sdpgrind.base import integrity, records
from sdpgrind.base.integrity import Verdict, sealed, verdict

sys.path.insert(0, str(ROOT / "benchmarks"))
import damage

BLANK = b"CDF\x01 head blake2b-256:" + b"0" * 64 + b" tail"
DIGEST = b"5c3a493650e9534d227c9425bd197d01652ea3ea28b2c888fadd9ca3530a6b61"
SEALED = BLANK.replace(b"0" * 64, DIGEST)


def seal(path):
    """Write a file once more, with its digest."""
    path.write_bytes(b"".join(sealed(path.read_bytes())))


@pytest.fixture
def small(tmp_path):
    """A sealed file of a kind that any version knows."""
    path = tmp_path / "small.nc"
    data = xr.Dataset({"x": ("k", np.arange(3.0), {"units": "mm"})}, attrs={"note": "n"})
    records.write(data, path, "test.kind")
    return path


def test_the_digest_is_that_of_the_bytes_with_zeros(tmp_path):
    (tmp_path / "file").write_bytes(BLANK)
    seal(tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == SEALED
    assert verdict(SEALED) is Verdict.WHOLE


def test_a_mark_at_the_very_begin_is_one():
    raw = b"".join(sealed(b"blake2b-256:" + b"0" * 64 + b" tail"))
    assert verdict(raw) is Verdict.WHOLE
    assert verdict(raw[:-1]) is Verdict.WRONG


def flipped(raw):
    """Each place of a bit, and the bytes with that bit flipped."""
    for place in range(8 * len(raw)):
        changed = bytearray(raw)
        changed[place // 8] ^= 1 << place % 8
        yield place // 8, bytes(changed)


def test_every_flipped_bit_of_a_saved_file_is_damage(small):
    raw = small.read_bytes()
    assert verdict(raw) is Verdict.WHOLE
    for _, changed in flipped(raw):
        small.write_bytes(changed)
        with pytest.raises(sdpgrind.DamagedFileError):
            records.read(small)


def test_every_flipped_bit_of_sealed_bytes_is_seen():
    """Those of the mark, too: without the other attribute such bytes are those of a file without a digest."""
    mark = range(SEALED.index(b"blake2b-256:"), SEALED.index(DIGEST))
    for byte, changed in flipped(SEALED):
        assert verdict(changed) is (Verdict.UNSEALED if byte in mark else Verdict.WRONG)


def test_a_mark_that_cannot_be_read_is_damage_and_none_at_all_is_an_old_file(small):
    raw = small.read_bytes()
    unmarked = raw.replace(b"blake2b-256:", b"blake2b-255:")
    unformatted = raw.replace(b"format\0\0", b"formaT\0\0")
    assert verdict(unmarked) is Verdict.ILLEGIBLE
    assert verdict(unformatted) is Verdict.WRONG
    assert verdict(unmarked.replace(b"format\0\0", b"formaT\0\0")) is Verdict.UNSEALED
    for changed in (unmarked, unformatted):
        small.write_bytes(changed)
        with pytest.raises(sdpgrind.DamagedFileError, match=r"small\.nc' is damaged: its digest"):
            records.read(small)


def test_digits_that_are_lost_are_damage():
    for cut in range(len(SEALED) - len(b" tail") - 64, len(SEALED)):
        assert verdict(SEALED[:cut]) is Verdict.WRONG


def test_any_reader_of_netcdf_opens_it(small):
    with xr.open_dataset(small, engine="scipy") as opened:
        assert opened.attrs["format"] == 2 and opened.x.values.tolist() == [0.0, 1.0, 2.0]
        assert opened.attrs["integrity"] == "blake2b-256:" + opened.attrs["integrity"][-64:]
        assert next(iter(opened.attrs)) == "format" and list(opened.attrs)[-1] == "integrity"
    assert records.read(small).attrs.keys() == {"note", "kind", "version"}


@pytest.mark.parametrize("place", ["attribute", "array", "name"])
def test_a_text_that_holds_the_mark_is_refused(tmp_path, place):
    text = "of blake2b-256: digests"
    data = {
        "attribute": xr.Dataset({"x": ("k", [1.0])}, attrs={"note": text}),
        "array": xr.Dataset({"x": ("k", np.array([text, "b"]))}),
        "name": xr.Dataset({text: ("k", [1.0])}),
    }[place]
    with pytest.raises(
        ValueError, match=r"no text to be saved must hold 'blake2b-256:'; it stands in 1 place"
    ):
        records.write(data, tmp_path / "file.nc", "test")
    assert not list(tmp_path.iterdir())


def test_no_parser_sees_damaged_bytes(small, monkeypatch):
    monkeypatch.setattr(records, "_parsed", lambda *_: pytest.fail("parsed"))
    small.write_bytes(small.read_bytes()[:-1])
    with pytest.raises(sdpgrind.DamagedFileError):
        records.read(small)


def test_a_later_format_is_refused_by_its_number(small):
    """Its digest is right: it is no damage."""
    raw = small.read_bytes().replace(b"\0\0\0\x01\0\0\0\x02", b"\0\0\0\x01\0\0\0\x03", 1)
    start = raw.index(integrity.MARK) + len(integrity.MARK)
    small.write_bytes(raw[:start] + b"0" * 64 + raw[start + 64 :])
    seal(small)
    with pytest.raises(
        ValueError, match=r"of format 2 or of version 0\.1\.0; .*small\.nc' is of format 3"
    ) as told:
        records.read(small)
    assert not isinstance(told.value, sdpgrind.DamagedFileError)


@pytest.mark.parametrize("raw", [b"", b"C", b"CDF", b"CDF\x01", b"SQLite form"])
def test_a_file_that_ends_before_it_tells_what_it_is(tmp_path, raw):
    (tmp_path / "stump.nc").write_bytes(raw)
    with pytest.raises(
        sdpgrind.DamagedFileError, match=rf"stump\.nc' is damaged: it ends after {len(raw)} bytes; "
    ):
        sdpgrind.load(tmp_path / "stump.nc")


def test_a_file_of_before_warns_once_and_tells_every_error_as_damage(tmp_path):
    old = (ROOT / "tests/data/saved-0.1.0/centering.chart.nc").read_bytes()
    path = tmp_path / "chart.nc"
    path.write_bytes(old)
    with pytest.warns(
        sdpgrind.OldFileWarning, match=r"chart\.nc' is of version 0\.1\.0 and has no digest"
    ) as told:
        chart = sdpgrind.load(path)
    assert len(told) == 1
    chart.save(path)
    assert sdpgrind.load(path) is not None  # and now it has a digest: no warning
    path.write_bytes(old[: len(old) // 2])
    with pytest.raises(sdpgrind.DamagedFileError, match=r"chart\.nc' is damaged: it cannot be read \("):
        sdpgrind.load(path)
    path.write_bytes(old.replace(b"sigmas", b"sigmaz"))
    with (
        pytest.warns(sdpgrind.OldFileWarning),
        pytest.raises(sdpgrind.DamagedFileError, match=r"its centering\.chart cannot be made \("),
    ):
        sdpgrind.load(path)


def test_a_file_with_a_digest_is_no_damage_where_its_class_refuses_it(tmp_path, monkeypatch):
    path = tmp_path / "chart.nc"
    damage.write("centering.chart", path)

    def refuse(dataset):
        raise ValueError("of a later version")

    monkeypatch.setattr("centering.ControlChart.restored", refuse)
    with pytest.raises(ValueError, match=r"^of a later version$"):
        sdpgrind.load(path)


def test_the_error_goes_through_pickle():
    error = sdpgrind.DamagedFileError(Path("a.nc"), "wrong", "nothing")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "'a.nc' is damaged: wrong; nothing"
    assert (again.path, again.wrong, again.salvage) == ("a.nc", "wrong", "nothing")


def test_bytes_are_on_the_disk_before_the_name_and_the_name_at_the_end(tmp_path, monkeypatch):
    """Folder and file by their number: what is synced is what is written."""
    done = []
    monkeypatch.setattr(os, "fsync", lambda handle: done.append(os.fstat(handle).st_ino))
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda self, target: done.append("renamed") or replace(self, target))
    records.write(xr.Dataset({"x": ("k", [1.0])}), tmp_path / "file.nc", "test")
    assert done == [(tmp_path / "file.nc").stat().st_ino, "renamed", tmp_path.stat().st_ino]


QUICK = [
    kind
    for kind in damage.kinds()
    if kind not in damage.MAKERS or kind in ("centering.spectrum", "centering.slope")
]


@pytest.mark.parametrize("kind", QUICK)
def test_a_damaged_file_of_any_kind_never_loads_as_another(tmp_path, kind):
    """A small share of ``benchmarks/damage.py``."""
    path = tmp_path / "file.nc"
    damage.write(kind, path)
    found = damage.attack(path, 0.03, np.random.default_rng(5))
    assert damage.faults(found) == 0, found
    assert sum(each["told"] for each in found.values()) >= (10 if kind == "hwsim.journal" else 36)


def test_the_damage_of_the_benchmark_is_seen_where_it_is_not_told(tmp_path):
    """Without its check of digests the library loads other content: the benchmark would say so."""
    path = tmp_path / "file.nc"
    damage.write("centering.push_trace", path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(integrity, "verdict", lambda raw: Verdict.WHOLE)
        found = damage.attack(path, 0.03, np.random.default_rng(5))
    assert damage.faults(found) > 20 and found["flips"]["silent"] > 0


def test_kinds_of_the_benchmark_are_all_kinds():
    saved = {path.stem for path in damage.SAVED.glob("*.nc")}
    assert set(damage.kinds()) == saved | set(damage.MAKERS) | {"hwsim.journal"}


OPENS = re.compile(
    r"\b(open_dataset|load_dataset|to_netcdf|ScipyDataStore|netcdf_file|sqlite3\.connect|h5netcdf)\b"
)


def test_no_other_module_opens_the_files_of_records():
    found = {
        path.relative_to(SOURCE).as_posix() for path in SOURCE.rglob("*.py") if OPENS.search(path.read_text())
    }
    assert found == {"sdpgrind/base/records.py", "hwsim/_log/journal_file.py"}


def test_another_file_is_not_called_damaged(tmp_path):
    import sqlite3

    foreign = tmp_path / "foreign.nc"
    xr.Dataset({"x": ("k", [1.0])}).to_netcdf(foreign, engine="scipy")
    text = tmp_path / "notes.txt"
    text.write_text("a text")
    other = tmp_path / "other.db"
    sqlite3.connect(other).execute("CREATE TABLE t (x)").connection.close()
    for path in (foreign, text, other):
        with warnings.catch_warnings(action="error"), pytest.raises(ValueError, match="must be") as told:
            sdpgrind.load(path)
        assert not isinstance(told.value, sdpgrind.DamagedFileError)
