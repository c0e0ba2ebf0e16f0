"""Numbers and tables as text."""

from collections.abc import Iterable, Sequence

NOT_AVAILABLE = "not available"


def aligned(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table: first column left-aligned, others right-aligned, two blanks between."""
    table = [tuple(head), *(tuple(row) for row in rows)]
    width = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines = (
        "  ".join(
            cell.rjust(w) if k else cell.ljust(w) for k, (cell, w) in enumerate(zip(row, width, strict=True))
        )
        for row in table
    )
    return "\n".join(line.rstrip() for line in lines)


def percent(share: float) -> str:
    """Share in percent."""
    return f"{100 * share:.1f} %"


def number(value: float | None, form: str = ".5g") -> str:
    """Number, or "not available" for None."""
    return NOT_AVAILABLE if value is None else format(value, form)


def level(value: object) -> str:
    """Level of a factor: short number or name."""
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def labelled(name: str, unit: str) -> str:
    """Name, with its unit in brackets if it has one."""
    return f"{name} [{unit}]" if unit else name


def amount(value: float, unit: str) -> str:
    """Response with its unit; lengths below 0.1 mm in µm."""
    if unit == "mm" and abs(value) < 0.1:
        return f"{1e3 * value:.4g} µm"
    return f"{value:.4g} {unit}".rstrip()
