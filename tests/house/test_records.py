"""Files give back what was put in."""

import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import sdpgrind
from sdpgrind.base import records
from sdpgrind.base.whole_files import whole_file

DTYPES = st.sampled_from(["bool", "int8", "int16", "int32", "int64", "uint8", "float32", "float64"])


@settings(max_examples=40, deadline=None)
@given(array=DTYPES.flatmap(lambda d: hnp.arrays(d, st.integers(1, 5), elements=_within(d))))
def test_round_trip_keeps_bits_dtypes_and_attributes(array, tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "file.nc"
    names = ("k", np.array([f"part {k}" for k in range(array.size)]))
    data = xr.Dataset(
        {"x": ("k", array, {"units": "mm"})}, {"k": names, "t": ("k", array, {"units": "s"})}, {"note": "n"}
    )
    records.write(data, path, "test")
    back = records.read(path)
    for name in ("x", "t"):
        assert back[name].dtype == array.dtype
        np.testing.assert_array_equal(back[name].values, array)
        assert back[name].attrs == data[name].attrs
    np.testing.assert_array_equal(back["k"].values, data["k"].values)
    assert back.attrs["note"] == "n"


def _within(dtype):
    if dtype == "int64":
        return st.integers(-(2**52), 2**52)
    return hnp.from_dtype(np.dtype(dtype), allow_infinity=True)


def test_a_failed_write_leaves_nothing_behind(tmp_path):
    target = tmp_path / "file.nc"
    target.write_text("before")
    with pytest.raises(RuntimeError), whole_file(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert target.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["file.nc"]


def test_whole_numbers_that_no_float_holds_are_refused(tmp_path):
    data = xr.Dataset({"x": ("k", np.array([2**53 + 1]))})
    with pytest.raises(ValueError, match="must fit float64"):
        records.write(data, tmp_path / "file.nc", "test")


@pytest.mark.parametrize("name", ["format", "integrity"])
def test_attributes_that_the_file_needs_are_refused_and_nothing_is_written(tmp_path, name):
    data = xr.Dataset({"x": ("k", [1.0])}, attrs={name: "mine"})
    with pytest.raises(ValueError, match=f"must not be called '{name}', .*; got 'mine'"):
        records.write(data, tmp_path / "file.nc", "test")
    assert not list(tmp_path.iterdir())


def test_what_is_left_of_a_journal_is_known_by_its_tables_or_as_a_part_of_its_first_page():
    head = b"SQLite format 3\0"
    page = head + (4096).to_bytes(2, "big")
    assert records.was_journal(page + bytes(4096 - len(page) - 1))
    assert not records.was_journal(page + bytes(4096 - len(page)))  # a whole page without a table
    assert records.was_journal(head + bytes(511 - len(head)))  # pages have 512 bytes at least
    assert not records.was_journal(head + bytes(512 - len(head)))
    assert not records.was_journal(bytes(30)) and not records.was_journal(b"")
    assert records.was_journal(b"x" * 5000 + records.JOURNAL_TABLES[0].encode())


def test_a_plan_is_no_journal_whatever_it_holds_and_a_journal_without_its_head_is_one(tmp_path):
    table = records.JOURNAL_TABLES[0].encode()
    for k, (content, told) in enumerate(
        [(b"CDF\1 " + table, False), (b"x" * 40 + table, True), (b"x" * 40, False)]
    ):
        path = tmp_path / f"{k}.db"
        path.write_bytes(content)
        assert records.is_journal(path) is told


@pytest.mark.parametrize(
    ("array", "stored"),
    [
        (np.array([True, False]), "int8"),
        (np.array([1, -(2**31)]), "int32"),
        (np.array([2**31, 2**52]), "float64"),
        (np.array([1, 255], "uint8"), "int32"),
        (np.array([1.5], "float32"), "float32"),
    ],
)
def test_dtypes_that_the_format_lacks_are_noted_and_come_back(tmp_path, array, stored):
    data = xr.Dataset({"x": ("k", array, {"units": "s", "scale_factor": 2.0})}, attrs={"note": "n"})
    records.write(data, tmp_path / "file.nc", "test")
    plain = {"decode_times": False, "mask_and_scale": False}
    with xr.open_dataset(tmp_path / "file.nc", engine="scipy", **plain) as raw:
        assert raw["x"].dtype.newbyteorder("=") == stored
        assert raw.attrs["format"] == 2 and raw.attrs["kind"] == "test"
    back = records.read(tmp_path / "file.nc")
    assert back["x"].dtype == array.dtype and np.array_equal(back["x"], array)
    assert back["x"].attrs == {"units": "s", "scale_factor": 2.0} and "format" not in back.attrs


def test_a_file_in_memory_keeps_its_content_when_it_is_closed():
    kept = records._Kept()
    kept.write(b"abc")
    assert kept.content == b"abc"
    kept.close()
    kept.close()
    assert kept.content == b"abc" and kept.closed


def test_load_refuses_what_is_not_ours(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"existing file; got .*nothing\.nc"):
        sdpgrind.load(tmp_path / "nothing.nc")
    other = tmp_path / "other.nc"
    other.write_bytes(b"something")
    with pytest.raises(ValueError, match="saved by this library"):
        sdpgrind.load(other)
    xr.Dataset({"x": 1}).to_netcdf(other, engine="scipy")
    with pytest.raises(ValueError, match="saved by this library"):
        sdpgrind.load(other)


def test_a_device_is_no_file_and_a_link_stays_one(tmp_path):
    fifo = tmp_path / "pipe"
    os.mkfifo(fifo)
    for target in (fifo, tmp_path):
        with pytest.raises(ValueError, match="path must be a file; got "), whole_file(target):
            pass
    (tmp_path / "there.nc").write_text("before")
    (tmp_path / "link.nc").symlink_to(tmp_path / "there.nc")
    with whole_file(tmp_path / "link.nc") as temporary:
        temporary.write_text("after")
    assert (tmp_path / "link.nc").is_symlink()
    assert (tmp_path / "there.nc").read_text() == "after"


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="the system does not list open files")
def test_a_saved_and_loaded_file_is_closed(tmp_path):
    data = xr.Dataset({"x": ("k", [1.0])})
    records.write(data, tmp_path / "file.nc", "test")
    before = sorted(Path("/proc/self/fd").iterdir())
    for _ in range(3):
        records.write(data, tmp_path / "file.nc", "test")
        records.read(tmp_path / "file.nc")
    assert sorted(Path("/proc/self/fd").iterdir()) == before
