"""Uncertainty of a plunge cycle: what a user does not know, as standard deviations."""

from sdpgrind.base.quantities import Described, described, quantity

_MOST = 0.5  # chosen: relative standard deviation beyond which a percentage is meant
_HINT = " (0.03 for 3 %)"


@described("plunge.uncertainty")
class Uncertainty(Described):
    """Standard deviations of what is believed of wheel, work, machine and gauges.

    Those of B, diffusivity, wear flat area and force ratio are of the logarithm: 0.03 is 3 percent.

    Parameters
    ----------
    burning_sd : float, optional
        Burn threshold B, unit 1: coolant, steel, gain of the thermal model. None: taken as exactly known.
    diffusivity_sd : float
        Thermal diffusivity of the work, unit 1.
    sharpness_sd : float
        Wear flat area, unit 1.
    sharpness_change_sd : float
        Change of the wear flat area within a part, over the whole stock, that `wear` of the model does not
        tell, unit 1. 0: a wheel once learned is taken to stay as it is.
    deflection_sd : float
        Normal force ratio over stiffness, unit 1.
    contact_zero_sd : float
        Place of the first contact, mm.
    size_sd : float
        Noise of the size gauge, mm.
    power_sd : float
        Noise of the power monitor, relative, unit 1.
    power_gain_sd : float
        Gain of the power monitor, relative, unit 1. It covers the idle power too: with its doubt over the
        power at the end of the cycle, 5 W of 500 W as 0.01.
    wheel_wear_sd : float
        Radial wheel wear over radial stock, unit 1.
    threshold_scatter : float
        Scatter of the burn threshold from part to part, unit 1.

    Raises
    ------
    ValueError
        If a value is negative, or above 0.5 where it is relative: probably a percentage.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> plunge.Uncertainty(burning_sd=0.03)
    Uncertainty(burning_sd=0.03)
    """

    burning_sd: float | None = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=None)
    diffusivity_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.0)
    sharpness_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.1)
    # chosen: wheels that dull by 2 % in a part, undeclared, burn 13 of 4000 parts at samples of 40 ms and
    # 1 at 10 ms (with 0.0013, 14 of 150 and 31 of 60), for 0.05 % of the time
    sharpness_change_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.01)
    deflection_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.1)
    contact_zero_sd: float = quantity("mm", at_least=0, usual=(0.0, 1.0), typical=0.01, default=0.01)
    size_sd: float = quantity("mm", at_least=0, usual=(0.0, 0.1), typical=5e-4, default=5e-4)
    power_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.01)
    power_gain_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.0)
    wheel_wear_sd: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.0)
    threshold_scatter: float = quantity("1", at_least=0, at_most=_MOST, hint=_HINT, default=0.005)

    @property
    def burn_threshold(self) -> str:
        """How well the burn threshold B is known, in words; its doubt is relative, unit 1."""
        if self.burning_sd is None:
            return "taken as exactly known"
        return f"doubted by {100.0 * self.burning_sd:.3g} %" if self.burning_sd else "declared exactly known"
