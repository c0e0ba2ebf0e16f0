"""Directive ``entries``: tables of what a page of the reference documents, by section, with links.

It reads the source of its page, so that each name is written once: sections, the ``auto...`` directives below
them, and the packages of a toctree.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from page_sections import sections
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def _tables(text: str) -> Iterator[str]:
    for title, names in sections(text).items():
        shown = "" if title == "Packages" else "~"
        yield f".. rubric:: {title}\n\n.. autosummary::\n   :nosignatures:\n"
        yield from (f"   {shown}{name}" for name in names)
        yield ""


class Entries(SphinxDirective):
    """Tables of the entries of a page."""

    def run(self) -> list[Any]:
        """Return the nodes of the tables."""
        text = Path(self.env.doc2path(self.env.docname)).read_text(encoding="utf-8")
        return self.parse_text_to_nodes("\n".join(_tables(text)))


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("entries", Entries)
    return {"parallel_read_safe": True}
