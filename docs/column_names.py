"""Names that a file's columns are read by, from the table of the reader itself."""

from math import inf

from sdpgrind.base.columns.table import KNOWN, Meant


def rows() -> list[tuple[str, str, str]]:
    """Return name, unit and usual magnitude of each quantity that `hwsim.Log.read` takes."""
    return [(name, meant.unit or "1", _range(meant)) for name, meant in sorted(KNOWN.items())]


def page() -> str:
    """Return them as a table of reStructuredText."""
    lines = [".. list-table::", "   :header-rows: 1", "   :widths: 40 20 40", ""]
    for name, unit, usual in [
        ("name", "unit", "refused outside"),
        *((f"``{n}``", u, r) for n, u, r in rows()),
    ]:
        lines += [f"   * - {name}", f"     - {unit}", f"     - {usual}".rstrip()]
    return "\n".join(lines)


def _range(meant: Meant) -> str:
    if meant.greatest == inf:
        return f"{meant.least:g} and more" if meant.least else ""
    return f"{meant.least:g} ... {meant.greatest:g}"
