"""The page of an interface that is listed by hand holds every public name, and each once."""

import re
from pathlib import Path

import centering

PAGE = Path(__file__).parents[2] / "docs" / "api" / "centering.rst"


def test_every_name_stands_exactly_once():
    listed = re.findall(r"^\.\. auto(?:class|function|data):: centering\.(\w+)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(centering.__all__)
