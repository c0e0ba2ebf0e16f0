"""Every entry of the page of equations leads somewhere."""

import importlib
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "equations.rst"
NAMES = re.findall(r":obj:`([\w.]+)`", PAGE.read_text(encoding="utf-8"))


def find(name):
    """Import as much of a dotted name as is a module, then take attributes."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for part in parts[k:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_there_and_documented(name):
    assert len(NAMES) > 20
    assert find(name).__doc__
