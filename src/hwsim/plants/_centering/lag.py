"""Lag of a loaded slide, from the following errors of Mears (2006), Table 3.2."""

import numpy as np

from sdpgrind.base.checks import Floats

# source: Mears (2006), Table 3.2: speed (mm/min), largest following error (µm) with 0.8 kg and with 18.9 kg
FOLLOWING: tuple[tuple[float, float, float], ...] = (
    (100.0, 2.0, 10.0),
    (500.0, 8.0, 26.0),
    (1000.0, 2.0, 39.0),
    (2000.0, 14.0, 76.0),
    (3000.0, 11.0, 101.0),
    (4000.0, 14.0, 158.0),
    (5000.0, 20.0, 230.0),
)
MASSES = (0.8, 18.9)  # kg; source: Mears (2006), Table 3.2


def lag_times() -> Floats:
    """Lags (s) for both masses: least-squares lines through the origin.

    An error proportional to speed is that of a first-order lag of this time constant.
    """
    table = np.array(FOLLOWING)
    speed, error = table[:, 0] / 60.0, table[:, 1:] / 1000.0  # mm/s, mm
    return np.asarray(speed @ error / (speed @ speed))


def lag_time(mass: float) -> float:
    """Lag (s) of a slide that pushes a mass (kg): linear in mass through both calibrated ones, >= 0."""
    light, heavy = (float(each) for each in lag_times())
    share = (mass - MASSES[0]) / (MASSES[1] - MASSES[0])
    return max(light + share * (heavy - light), 0.0)
