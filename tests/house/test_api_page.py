"""The page of an interface that is listed by hand holds every public name, and each once."""

import re

from house_names import PACKAGES, ROOT, package

PAGE = ROOT / "docs" / "api" / "centering.rst"
LISTED = re.compile(r"^\.\. auto(?:class|function|data):: (centering[\w.]*)\.(\w+)$", re.MULTILINE)


def test_every_name_stands_exactly_once():
    listed = LISTED.findall(PAGE.read_text(encoding="utf-8"))
    faces = [name for name in PACKAGES if name.startswith("centering")]
    public = {name for face in faces for name in package(face).__all__ if f"centering.{name}" not in faces}
    assert sorted(name for _, name in listed) == sorted(public - {"turning"})
    assert all(name in package(face).__all__ for face, name in listed)
