"""Numbers and tables as text."""

from collections.abc import Iterable, Sequence

from sdpgrind.base import text_table

NOT_AVAILABLE = "not available"


def aligned(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table: first column left-aligned, others right-aligned, two blanks between."""
    return "\n".join(text_table.aligned([head, *rows], "<>"))


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
