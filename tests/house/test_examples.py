"""Every example runs by itself, without a warning, and says something: ``pytest -m gallery``, some three minutes.
Building the pages executes them, too, and keeps what they say; .ci/run leaves that out.
"""

import runpy
import sys

import pytest
from house_names import ROOT

FOLDERS = ("docs/commissioning", "docs/examples", "docs/reproductions")
SHARED = "published"  # the table of all reproductions
EXAMPLES = sorted(path for folder in FOLDERS for path in (ROOT / folder).glob("*.py") if path.stem != SHARED)


@pytest.fixture
def pyplot(monkeypatch, tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.chdir(tmp_path)
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")
    pyplot.rcdefaults()


@pytest.mark.gallery
@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_runs(path, pyplot, capfd, tmp_path, monkeypatch):
    (tmp_path / "tests").symlink_to(ROOT / "tests")  # sample files of the commissioning pages
    monkeypatch.syspath_prepend(path.parent)  # as where a script is run from the command line
    runpy.run_path(str(path), run_name="__main__")
    assert capfd.readouterr().out or pyplot.get_fignums()
    assert [path.name for path in tmp_path.iterdir()] == ["tests"], "an example leaves files behind"


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_is_a_page(path):
    """A title, underlined, in the docstring; then text in blocks."""
    title, line = path.read_text().split('"""')[1].strip().splitlines()[:2]
    assert set(line) == {"="} and len(line) >= len(title)


def test_the_guided_tour_is_complete():
    numbered = [path.stem[:2] for path in EXAMPLES if path.stem[:2].isdigit()]
    assert numbered == [f"{k + 1:02d}" for k in range(len(numbered))]
    assert numbered


def test_the_picture_of_the_readme_can_be_drawn(pyplot, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make.py", str(tmp_path)])
    runpy.run_path(str(ROOT / "docs/pictures/make.py"), run_name="__main__")
    assert [path.name for path in tmp_path.iterdir()] == [
        path.name for path in (ROOT / "docs/pictures").glob("*.png")
    ]
