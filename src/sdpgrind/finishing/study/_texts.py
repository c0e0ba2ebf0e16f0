"""Numbers and tables as text."""

from collections.abc import Iterable, Sequence

NOT_AVAILABLE = "not available"


def aligned(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table: the first column to the left, the others to the right, two blanks between."""
    table = [tuple(head), *(tuple(row) for row in rows)]
    width = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines = (
        "  ".join(
            cell.rjust(w) if k else cell.ljust(w) for k, (cell, w) in enumerate(zip(row, width, strict=True))
        )
        for row in table
    )
    return "\n".join(line.rstrip() for line in lines)


def percent(share: float, digits: int = 1) -> str:
    """A share of 1 in percent."""
    return f"{100 * share:.{digits}f} %"


def number(value: float | None, form: str = ".5g") -> str:
    """A number, or that there is none."""
    return NOT_AVAILABLE if value is None else format(value, form)


def level(value: object) -> str:
    """A level of a factor: a short number, or its name."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def labelled(name: str, unit: str) -> str:
    """A name with its unit in brackets, where it has one."""
    return f"{name} [{unit}]" if unit else name


def amount(value: float, unit: str) -> str:
    """A response with its unit; lengths below 0.1 mm in micrometres."""
    if unit == "mm" and abs(value) < 0.1:
        return f"{1e3 * value:.4g} µm"
    return f"{value:.4g} {unit}".rstrip()
