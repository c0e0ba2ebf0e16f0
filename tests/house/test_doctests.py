"""The examples in docstrings and on pages run, and give what they say."""

import doctest
import importlib
from functools import cache

import pytest
from house_names import ROOT, SOURCE, modules

pytestmark = pytest.mark.usefixtures("nothing_collected")

FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
PAGES = sorted(
    path
    for path in (ROOT / "docs").rglob("*.rst")
    if ">>>" in path.read_text() and "gallery" not in path.parts
)


def _shows(name):
    """Whether there is an example in the text of a module."""
    place = SOURCE.joinpath(*name.split("."))
    path = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return ">>>" in path.read_text(encoding="utf-8")


NAMES = [name for name in modules() if "_kernels" not in name and _shows(name)]


@cache
def _found(name):
    module = importlib.import_module(name)
    return [test for test in doctest.DocTestFinder(exclude_empty=True).find(module, name) if test.examples]


def _runs(test):
    said: list[str] = []
    result = doctest.DocTestRunner(optionflags=FLAGS, verbose=False).run(test, out=said.append)
    assert result.failed == 0, "".join(said)


@pytest.mark.parametrize("name", NAMES)
def test_docstrings(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for test in _found(name):
        _runs(test)
    assert not list(tmp_path.iterdir()), "a docstring leaves files behind"


def test_every_module_can_be_imported():
    """Those without examples, too."""
    for name in modules():
        if "_kernels" not in name:
            importlib.import_module(name)


@pytest.mark.parametrize("path", PAGES, ids=[path.stem for path in PAGES])
def test_pages(path):
    _runs(doctest.DocTestParser().get_doctest(path.read_text(), {}, path.stem, str(path), 0))


def test_there_are_some():
    assert sum(len(_found(name)) for name in NAMES) > 50
    assert PAGES
