"""Units of FMI: exponents of SI's base units, and the factor to them."""

from sdpgrind.base import unit_text

_BASE = ("m", "s", "kg", "rad", None, "A")  # source: FMI 2.0.4, 2.2.2; it has no unit of money


def base_unit(unit: str) -> dict[str, str] | None:
    """Return the attributes of a ``BaseUnit``; None where FMI cannot say the unit.

    Examples
    --------
    >>> base_unit("N mm")
    {'m': '2', 's': '-2', 'kg': '1', 'factor': '0.001'}
    >>> base_unit("$/mm")
    """
    try:
        read = unit_text.parse(unit)
        factor = float(read.factor)
    except (ValueError, OverflowError):
        return None
    powers = {base: power for base, power in zip(_BASE, read.exponents, strict=True) if power}
    if None in powers or any(power.denominator > 1 for power in powers.values()):
        return None
    found = {str(base): str(power.numerator) for base, power in powers.items()}
    return found if factor == 1.0 else {**found, "factor": repr(factor)}
