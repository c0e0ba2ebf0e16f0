"""Files of sheets for operators: a page, text, or CSV."""

import os
from typing import Any

from sdpgrind.base import checks
from sdpgrind.base.whole_files import whole_file


def ending_of(path: str | os.PathLike[str]) -> str:
    """Return the ending of a file's name; refuse those that no table has."""
    ending: str = checks.one_of("ending of path", checks.path("path", path).suffix, (".csv", ".txt", ".html"))
    return ending


def write_sheet(sheet: Any, path: str | os.PathLike[str]) -> None:
    """Write a sheet, complete or not at all: its blocks as a page, its words, or its lines as CSV."""
    if ending_of(path) == ".html":
        from sdpgrind.base.sheets.page import report

        report("Operator table", sheet._blocks(), path)
        return
    text = str(sheet) if ending_of(path) == ".txt" else "\n".join(sheet._lines()) + "\n"
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
