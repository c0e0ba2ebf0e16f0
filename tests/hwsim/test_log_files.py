"""Logs that were read: out again to the bit, saved, drawn, replayed; light to import."""

import subprocess
import sys

import numpy as np
import pytest
from hwsim_inside import same
from hypothesis import given, settings
from hypothesis import strategies as st

import hwsim
import sdpgrind
from sdpgrind import weldbead

ANY = st.floats(allow_nan=True, allow_infinity=False, width=64)


@settings(max_examples=40)
@given(st.lists(st.tuples(ANY, ANY), min_size=2, max_size=12), st.floats(1e-6, 1e3))
@pytest.mark.filterwarnings("ignore:.*has no reading")
def test_written_and_read_is_equal_to_the_bit(tmp_path_factory, rows, period):
    path = tmp_path_factory.getbasetemp() / "log.csv"
    height, offset = (np.array(column) for column in zip(*rows, strict=True))
    asked = {"height": "height", "offset": "offset", "plausible": False}
    log = hwsim.Log.read({"height [mm]": height, "offset [mm]": offset}, period=period, **asked)
    log.to_csv(path)
    if np.all(np.isnan(height)) or np.all(np.isnan(offset)):
        return
    back = hwsim.Log.read(path, time="time", part="part", **asked)["data"]
    for name in ("height", "offset", "time"):
        assert back[name].values.tobytes() == log["data"][name].values.tobytes()


def sample():
    """Log of two parts with words, a command and a missing reading."""
    table = {
        "n": ["b", "b", "a", "a"], "t [s]": [0.0, 0.1, 0.0, 0.1], "X [um]": [0.0, 12.0, 0.0, 12.5],
        "v [mm/s]": [0.12, 0.12, 0.12, 0.0], "p": ["zigzag", "zigzag", "hilbert", ""],
    }  # fmt: skip
    return hwsim.Log.read(
        table, time="t", part="n", size="X", command_rate="v", pattern=("p",), plausible=False
    )


@pytest.mark.filterwarnings("ignore:.*pattern has no reading")
def test_saved_and_loaded_is_equal(tmp_path):
    log = sample()
    log.save(tmp_path / "log.nc")
    loaded = sdpgrind.load(tmp_path / "log.nc")
    assert same(log, loaded) and loaded.source == log.source and str(loaded.source) == str(log.source)
    assert loaded["data"].attrs["labels"] == ["b", "a"] and len(loaded) == 2
    assert repr(loaded) == "<hwsim.Log: 2 parts on the mapping, tables data>"


@pytest.mark.filterwarnings("ignore:.*pattern has no reading")
def test_drawn():
    pytest.importorskip("matplotlib")
    assert [axis.get_ylabel() for axis in sample().plot().axes] == [
        "size [µm]",
        "command rate [mm/s]",
    ]


def test_replayed():
    log = hwsim.Log.read(
        {"X [um]": [0.0, 4.0, 8.0], "v [mm/s]": [0.04, 0.04, 0.0]}, period=0.1, size="X", command_rate="v"
    )
    recording = hwsim.Recording(log)
    assert dict(recording.measures)["size"] == "mm" and "command_rate" in recording.accepts

    class Same:
        period = 0.1
        tier = "data"

        def reset(self):
            self.rates = [0.04, 0.04, 0.0]

        def step(self, **measured):
            return {"command_rate": self.rates.pop(0)}

    assert hwsim.run(recording, Same()).outcome.same.values.tolist() == [1.0]


def test_outcome_and_arrays_are_written(tmp_path):
    problem = weldbead.preset("P1")

    class OnePass:
        period, tier = None, "sequence"

        def reset(self):
            self.passes = 0

        def step(self, **measured):
            self.passes += 1
            return {"stop": 1.0} if self.passes > 1 else {"duration": 20.0, "normal_force": 40.0}

    log = hwsim.compare(hwsim.WeldBeadStand(problem), {"one": OnePass(), "two": OnePass()}, parts=2, rng=0)
    log.to_csv(tmp_path / "outcome.csv", table="outcome")
    header, *rows = (tmp_path / "outcome.csv").read_text().splitlines()
    assert header.startswith("controller,part,") and "height [mm]" in header and len(rows) == 4
    log.to_csv(tmp_path / "sequence.csv", table="sequence")
    assert (tmp_path / "sequence.csv").read_text().startswith("controller,part,time [s],")
    with pytest.raises(KeyError, match="tier must be one of sequence"):
        log.to_csv(tmp_path / "x.csv", table="none")
    assert log.source is None and not (tmp_path / "x.csv").exists()


def test_the_class_is_light():
    told = "import hwsim; hwsim.Log; import sys; print(*sys.modules)"
    loaded = set(
        subprocess.run(
            [sys.executable, "-c", told], capture_output=True, text=True, check=True
        ).stdout.split()
    )
    assert not loaded & {"numba", "scipy", "xarray", "pandas", "matplotlib", "casadi"}
