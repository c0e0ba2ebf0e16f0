"""The examples in docstrings and on pages run, and give what they say."""

import doctest
import importlib

import pytest
from house_names import ROOT, modules

FLAGS = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
PAGES = sorted(
    path
    for path in (ROOT / "docs").rglob("*.rst")
    if ">>>" in path.read_text() and "gallery" not in path.parts
)


def _found(name):
    module = importlib.import_module(name)
    return [test for test in doctest.DocTestFinder(exclude_empty=True).find(module, name) if test.examples]


def _runs(test):
    said: list[str] = []
    result = doctest.DocTestRunner(optionflags=FLAGS, verbose=False).run(test, out=said.append)
    assert result.failed == 0, "".join(said)


@pytest.mark.parametrize("name", [name for name in modules() if "_kernels" not in name])
def test_docstrings(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for test in _found(name):
        _runs(test)
    assert not list(tmp_path.iterdir()), "a docstring leaves files behind"


@pytest.mark.parametrize("path", PAGES, ids=[path.stem for path in PAGES])
def test_pages(path):
    _runs(doctest.DocTestParser().get_doctest(path.read_text(), {}, path.stem, str(path), 0))


def test_there_are_some():
    assert sum(len(_found(name)) for name in modules() if "_kernels" not in name) > 50
    assert PAGES
