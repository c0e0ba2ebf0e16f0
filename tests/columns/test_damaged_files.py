"""Sample files with bytes changed, lost and doubled: data, or one sentence; never a fault of another library."""

import json
from pathlib import Path

import numpy as np
import pytest

import centering
import hwsim

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
CASES = json.loads((SAMPLES / "truth.json").read_text(encoding="utf-8"))
DAMAGES = 25  # chosen: of each file, some 4 s; 3800 of two other seeds gave no other error
LONGEST = 1000  # letters of a sentence


def damaged(raw, rng):
    """Bytes with an end cut off, up to eight changed, some lost, or some twice."""
    data, place = bytearray(raw), int(rng.integers(len(raw)))
    match int(rng.integers(5)):
        case 0:
            return bytes(data[:place])
        case 1 | 2:
            for k in rng.integers(len(raw), size=1 + int(rng.integers(8))):
                data[k] = int(rng.integers(256))
        case 3:
            del data[place : place + 1 + int(rng.integers(40))]
        case _:
            data[place:place] = data[place : place + 200]
    return bytes(data)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_damage_is_told_in_a_sentence(case, tmp_path):
    rng = np.random.default_rng(3)
    raw = (SAMPLES / case["name"]).read_bytes()
    call = {name: tuple(value) if isinstance(value, list) else value for name, value in case["read"].items()}
    door = centering.Profile.read if case["kind"] == "profile" else hwsim.Log.read
    refused = 0
    for _ in range(DAMAGES):
        (tmp_path / case["name"]).write_bytes(damaged(raw, rng))
        try:
            assert door(tmp_path / case["name"], **call) is not None
        except ValueError as error:
            refused += 1
            assert type(error) is ValueError and len(str(error)) < LONGEST
            assert "\n" not in str(error)
    assert refused


ROW = "t [s];X [um];P [W]\n0;0;100\n0,5;12,5;101\n1;25;102\n"
TORN = {
    "a digit that is a letter": (ROW + "1,5;3x,5;103\n", r"size must be numbers; got '3x,5' in line 5"),
    "a first digit that is a letter": (ROW + "1,x;37,5;103\n", r"got '1,x' in line 5"),
    "a lost separator": (ROW + "1,537,5;103\n", "line 5 has 2: '1,537,5;103'"),
    "a lost end of line": (ROW + "1,5;37,5;1032;50;104\n", "line 5 has 5"),
    "a lost cell, no end": (ROW + "1,5;37,5", "must be whole; line 5, its last, has 2 cells instead of 3"),
    "an empty cell, no end": (ROW + "1,5;37,5;", "must be whole; line 5, its last, has 2 cells instead of 3"),
    "half a number, no end": (ROW + "1,5;37,5;103,", "must be whole; line 5"),
}


@pytest.mark.parametrize("torn", TORN)
def test_torn_rows_at_the_end_are_no_foot(torn, tmp_path):
    text, told = TORN[torn]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ValueError, match=told):
        hwsim.Log.read(tmp_path / "a.csv", time="t", size="X", grinding_power="P")
