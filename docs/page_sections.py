"""What a page of the reference documents, by section, from its source; without Sphinx, for a test, too."""

import re

_ENTRY = re.compile(r"\.\. auto(?:class|data|exception|function):: (\S+)")
_PACKAGE = re.compile(r"   ((?:sdpgrind|centering|hwsim)\.\S+)")


def sections(text: str) -> dict[str, list[str]]:
    """Return the documented names of a page by section; those of its toctree as "Packages"."""
    found: dict[str, list[str]] = {}
    title, packages = "", []
    lines = text.splitlines()
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if line and set(below) == {"-"}:
            title = line
        elif entry := _ENTRY.fullmatch(line):
            found.setdefault(title, []).append(entry[1])
        elif package := _PACKAGE.fullmatch(line):
            packages.append(package[1])
    return found | ({"Packages": packages} if packages else {})
