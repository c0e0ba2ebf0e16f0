"""Push at constant speed without the frequencies of stick and slip: a band-stop filter of the speed."""

from math import ceil, pi, sin

import numpy as np

from centering.push._profile.profile import TipProfile
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_BAND = (25.0, 40.0)  # Hz; source: Mears' lag of 47 µm at 10 mm/s is that of 25-40 Hz; his text says 5-40 Hz
_ROUNDING = 1e-9  # chosen: relative; far above rounding, far below a sample or a speed


def band_stop_profile(
    speed: float,
    duration: float,
    *,
    band: tuple[float, float] = _BAND,
    order: int = 3,
    sample_rate: float = 1000.0,
    allow_reverse: bool = False,
) -> TipProfile:
    """Return a push whose speed is a Butterworth band-stop filtered step, Mears (5.33) to (5.47).

    The filter starts at rest at first touch. Straight lines join its samples, so that the tip touches with
    the first sample instead of the whole speed. The tip ends up `band_stop_lag` behind an unfiltered one.

    Parameters
    ----------
    speed : float
        Height of the step, to which the filtered speed settles, mm/s.
    duration : float
        Duration of the push, s; the last sample is cut to it.
    band : pair of float
        Lower and upper edge of the stop band, Hz (1/s), at half the power. The source prints 5-40 Hz in its
        text, which would draw the pusher back, 20-40 Hz in a caption, and a lag that belongs to 25-40 Hz.
    order : int
        Order of the low-pass prototype; the band-stop has twice as many poles.
    sample_rate : float
        Sample rate, 1/s.
    allow_reverse : bool
        Whether the filtered speed may be negative, which draws the pusher back.

    Raises
    ------
    ValueError
        When the edges are not 0 < f1 < f2 < sample_rate/2, a value is not > 0, or the filtered speed is
        negative without `allow_reverse`.

    Examples
    --------
    >>> from centering import preset, simulate_push
    >>> profile = band_stop_profile(10.0, 0.4)  # mm/s, s
    >>> round(1000 * (10.0 * 0.4 - profile.stroke), 1)  # µm behind a constant speed
    47.4
    >>> round(simulate_push(preset("printed").model, profile).peak_force, 1)  # N; 69.6 at constant speed
    48.8
    """
    v, total = checks.positive("speed", speed, "mm/s"), checks.positive("duration", duration, "s")
    rate = checks.positive("sample_rate", sample_rate, "1/s")
    edges = _edges(band, rate / 2.0)
    count = max(ceil(total * rate * (1.0 - _ROUNDING)), 1)
    share = _step_response(edges, checks.count("order", order), rate, count + 1)
    if not allow_reverse and share.min() < -_ROUNDING:
        rule = (
            "such that the filtered speed is never negative, unless allow_reverse=True"
            f" ({v * share.min():.3g} mm/s here)"
        )
        raise checks.refuse("band", rule, band, "Hz")
    lasting = np.full(count, 1.0 / rate)
    lasting[-1] = total - (count - 1) / rate
    return TipProfile(lasting, v * share[:-1], v * rate * np.diff(share))


def band_stop_lag(speed: float, *, band: tuple[float, float] = _BAND, order: int = 3) -> float:
    """Return the lag of a filtered push, mm: speed times group delay at frequency 0.

    That is v (f2 - f1)/(2 pi f1 f2) / sin(pi/(2 n)): a factor of 1, sqrt 2 and 2 for orders 1, 2 and 3. It
    holds for the analog filter; sampled at 1 kHz the lag is within 1 % of it. A filtered push takes lag/speed
    longer, so trigger it earlier by that time.

    Parameters
    ----------
    speed : float
        Speed of the push, mm/s.
    band : pair of float
        Edges of the stop band, Hz (1/s).
    order : int
        Order n of the low-pass prototype.

    Raises
    ------
    ValueError
        When the edges are not 0 < f1 < f2, or speed or order is not > 0.

    Examples
    --------
    >>> [round(1000 * band_stop_lag(10.0, band=(low, 40.0)), 3) for low in (25.0, 20.0, 5.0)]  # µm
    [47.746, 79.577, 557.042]
    """
    v, n = checks.positive("speed", speed, "mm/s"), checks.count("order", order)
    low, high = _edges(band, None)
    return v * (high - low) / (2.0 * pi * low * high) / sin(pi / (2.0 * n))


def _edges(band: tuple[float, float], nyquist: float | None) -> tuple[float, float]:
    """Check the edges of a band."""
    values = checks.finite_array("band", band, "Hz")
    above = np.inf if nyquist is None else nyquist
    if values.shape != (2,) or not 0.0 < values[0] < values[1] < above:
        rule = "two frequencies, 0 < f1 < f2" + ("" if nyquist is None else f" < sample_rate/2 = {nyquist:g}")
        raise checks.refuse("band", rule, band, "Hz")
    return float(values[0]), float(values[1])


def _step_response(edges: tuple[float, float], order: int, rate: float, count: int) -> Floats:
    """First samples of the step response; second-order sections, since the product form loses digits."""
    from scipy import signal  # only who filters pays for it

    sections = signal.butter(order, edges, btype="bandstop", fs=rate, output="sos")
    return np.asarray(signal.sosfilt(sections, np.ones(count)))
