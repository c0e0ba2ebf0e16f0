"""How late a loaded slide follows: the following error of Mears' Table 3.2, calibrated."""

import numpy as np

from sdpgrind.base.checks import Floats

# Table 3.2: speed (mm/min), greatest following error (µm) with 0.8 kg and with 18.9 kg before the tip.
FOLLOWING: tuple[tuple[float, float, float], ...] = (
    (100.0, 2.0, 10.0),
    (500.0, 8.0, 26.0),
    (1000.0, 2.0, 39.0),
    (2000.0, 14.0, 76.0),
    (3000.0, 11.0, 101.0),
    (4000.0, 14.0, 158.0),
    (5000.0, 20.0, 230.0),
)
MASSES = (0.8, 18.9)  # kg


def lag_times() -> Floats:
    """Lag (s) for each of the two masses: the straight line through the origin, least squares.

    An error proportional to speed is that of a first-order lag of this time constant.
    """
    table = np.array(FOLLOWING)
    speed, error = table[:, 0] / 60.0, table[:, 1:] / 1000.0  # mm/s, mm
    return np.asarray(speed @ error / (speed @ speed))


def lag_time(mass: float) -> float:
    """Lag (s) of a slide that pushes a mass (kg): linear between the masses of the table and beyond, never negative."""
    light, heavy = (float(each) for each in lag_times())
    share = (mass - MASSES[0]) / (MASSES[1] - MASSES[0])
    return max(light + share * (heavy - light), 0.0)
