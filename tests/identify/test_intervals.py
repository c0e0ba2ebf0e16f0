"""Coverage of 95 % intervals: some files of the studies of benchmarks/intervals.py, which draws 2000 of each."""

import importlib.util
from pathlib import Path

import pytest

_SPEC = importlib.util.spec_from_file_location(
    "intervals", Path(__file__).parents[2] / "benchmarks" / "intervals.py"
)
FILES = {"power": 150, "circle": 100, "load_torque": 200, "contact_zero": 20, "wear_flat_area": 12}
CASES = [
    *((name, noise) for name in ("circle", "load_torque") for noise in ("white", "steps", "alike 0.8")),
    *(("power", noise) for noise in ("white", "steps")),
    *((name, "alike 0.8") for name in ("contact_zero", "wear_flat_area")),
]


@pytest.fixture(scope="module")
def intervals():
    module = importlib.util.module_from_spec(_SPEC)
    _SPEC.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def studies(intervals):
    return intervals.studies()


@pytest.mark.parametrize(("name", "noise"), CASES)
def test_intervals_hold(intervals, studies, name, noise):
    """Within 93 to 97 % and two standard deviations of so few files; hardly a file is refused."""
    files = FILES[name]
    tolerance = 2.0 + 210 * (0.95 * 0.05 / files) ** 0.5
    for row in intervals.covered(name, studies[name], noise, files):
        assert row.files >= 0.97 * files
        assert row.coverage == pytest.approx(95.0, abs=tolerance), row
