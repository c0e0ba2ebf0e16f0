"""Directives: ``job-tables``, the keys of a job file (`job_keys`); ``column-names``, those of a user's file."""

import re
from typing import Any

import column_names
from job_keys import noted
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def page(command: str) -> str:
    """Return the tables of a command as reStructuredText."""
    lines = []
    for table, keys in sorted(noted(command).items(), key=lambda each: each[0] != ""):
        lines += [f".. rubric:: {f'[{table}]' if table else 'The file itself'}", ""]
        lines += [".. list-table::", "   :header-rows: 1", "   :widths: 22 12 14 20 32", ""]
        lines += _row("key", "unit", "default", "must be", "meaning")
        for key, entry in keys.items():
            lines += _row(f"``{key}``", entry.unit, entry.default, entry.must, entry.meaning)
        lines.append("")
    return "\n".join(lines)


def _row(*cells: str) -> list[str]:
    """Row of a table; stars and bars are no markup."""
    first, *others = (cell if cell.startswith("``") else _plain(cell) for cell in cells)
    return [f"   * - {first}".rstrip(), *(f"     - {cell}".rstrip() for cell in others)]


def _plain(text: str) -> str:
    return re.sub(r"([*|`_\\])", r"\\\1", text.replace("``", "").replace("`", ""))


class JobTables(SphinxDirective):
    """Tables of the keys of a command's job file."""

    required_arguments = 1

    def run(self) -> list[Any]:
        """Return the nodes of the tables."""
        return self.parse_text_to_nodes(page(self.arguments[0]))


class ColumnNames(SphinxDirective):
    """Table of the names that columns of a user's file are read by."""

    def run(self) -> list[Any]:
        """Return the nodes of the table."""
        return self.parse_text_to_nodes(column_names.page())


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directives."""
    app.add_directive("job-tables", JobTables)
    app.add_directive("column-names", ColumnNames)
    return {"parallel_read_safe": True}
