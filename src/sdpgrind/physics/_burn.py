"""Energy that burns the work: Malkin's law as Brown (1988) prints it, with its units made metric."""

from typing import Any

INCH = 25.4  # mm
INCH_POUND = 0.0254 * 4.4482216152605  # J


def malkin_burn_energy(cut_depth: Any, feed_rate: Any, diameter: Any, u0: Any, B: Any) -> Any:
    """Return the energy for each area of work at which it burns (J/mm^2): u0 d + B (D d)^(1/4) V^(-1/2), Brown (4.3).

    Parameters
    ----------
    cut_depth : float or array
        Depth of the cut d, mm.
    feed_rate : float or array
        Feed along the work V, mm/s.
    diameter : float or array
        Diameter of the wheel D, mm.
    u0 : float or array
        Energy that leaves with the chips, J/mm^3.
    B : float or array
        Heat that the surface stands, J/(mm^2 s^(1/2)).

    Examples
    --------
    >>> malkin_burn_energy(1.0, 4.0, 16.0, u0=6.0, B=7.0)
    13.0
    """
    return u0 * cut_depth + B * (diameter * cut_depth) ** 0.25 / feed_rate**0.5


def malkin_burn_coefficients() -> tuple[float, float]:
    """Return Malkin's published u0 (J/mm^3) and B (J/(mm^2 s^(1/2))), from 9.0e5 and 4.1e4 in inch, pound, second.

    The powers of the inch in (D d)^(1/4) V^(-1/2) cancel.

    Examples
    --------
    >>> u0, B = malkin_burn_coefficients()
    >>> round(u0, 4), round(B, 4)
    (6.2053, 7.1802)
    """
    return 9.0e5 * INCH_POUND / INCH**3, 4.1e4 * INCH_POUND / INCH**2
