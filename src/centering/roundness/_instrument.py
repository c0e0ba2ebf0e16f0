"""A roundness tester as its maker or its calibration describes it."""

from sdpgrind.base.quantities import Described, described, quantity


@described("centering.instrument")
class Instrument(Described):
    """Errors of a roundness tester, for the budget of `Roundness.budget`; 0: none.

    Parameters
    ----------
    spindle_error : float
        Error of the spindle towards the probe from valley to peak, mm, under the filter of the drawing, at
        height 0.
    spindle_error_per_height : float
        Increase of that with the height above the table, mm per mm, unit 1.
    gain_sd : float
        Standard deviation of the probe's gain after calibration, relative.
    noise_sd : float, optional
        Standard deviation of one deviation by noise, mm, under the filter of the drawing; of use where a
        profile does not show its own. None: not known.
    probe_linearity : float
        Largest error of the probe over the range that is used, relative.
    column_straightness : float
        Largest error of the column from its line, mm. It does not enter a section, which is at one height.
    temperature_sd : float
        Standard deviation of the part's change of temperature in the course of a turn, K; the part is of
        steel.

    Raises
    ------
    ValueError
        For values outside their range, or in another unit.

    Examples
    --------
    >>> from sdpgrind import units
    >>> Instrument(spindle_error=units.um(0.05), spindle_error_per_height=3e-7, gain_sd=0.01)
    Instrument(spindle_error=5e-05 mm, spindle_error_per_height=3e-07, gain_sd=0.01 relative)
    >>> Instrument(spindle_error=0.05)
    Traceback (most recent call last):
    ValueError: spindle_error must be in mm, some 5e-05; units.um(...) for micrometres; got 0.05
    """

    spindle_error: float = quantity("mm", at_least=0, usual=(1e-7, 0.02), typical=5e-5, default=0.0)
    spindle_error_per_height: float = quantity("1", at_least=0, at_most=1e-4, default=0.0)
    gain_sd: float = quantity("relative", at_least=0, at_most=0.2, default=0.0)
    noise_sd: float | None = quantity("mm", above=0, usual=(1e-7, 0.02), typical=1e-5, default=None)
    probe_linearity: float = quantity("relative", at_least=0, at_most=0.2, default=0.0)
    column_straightness: float = quantity("mm", at_least=0, usual=(1e-6, 0.1), typical=3e-4, default=0.0)
    temperature_sd: float = quantity("K", at_least=0, at_most=10, default=0.0)
