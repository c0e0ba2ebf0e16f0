"""Presets of problems: friction and contact as Mears prints them, and as fitted to his tables."""

from centering._problem.model import Part, PushModel
from centering._problem.problem import CenteringProblem
from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo

_PART = Part(mass=18.9, radius=89.5)  # source: Mears (2006), Table 5.3, part 4

_PRESETS = {
    "printed": (
        PushModel(
            _PART,
            contact_stiffness=1200.0,
            contact_damping=1.0,
            mu_static=0.2,
            mu_kinetic=0.15,
            viscous_coefficient=0.1,
        ),
        "an 18.9 kg ring with the friction and the contact that the source prints",
        "Mears (2006), parameters of (5.27), restitution (3.14), part 4 of Table 5.3",
        "mu_static, which he does not print: mu_kinetic/0.75; scatter of the pushes",
    ),
    "identified": (
        PushModel(
            _PART,
            contact_stiffness=729.0,
            contact_damping=0.527,
            mu_static=0.238,
            mu_kinetic=0.0992,
            viscous_coefficient=0.286,
        ),
        "the same ring with friction and contact that come nearest to the modelled columns of"
        " the source's tables",
        "Mears (2006), Tables 5.1 and 6.1 (modelled), which the printed parameters do not reproduce",
        "friction and contact: fitted to both tables together, 18.9 kg only;"
        " a description, not a measurement",
    ),
}


def preset(name: str) -> CenteringProblem:
    """Return a problem ready to use: an 18.9 kg ring of 89.5 mm radius, tolerance 2.5 µm.

    ``"printed"``: friction and contact as the source prints them; the static coefficient, which it does not
    print, is *chosen*. ``"identified"``: *fitted* to its tables 5.1 and 6.1, which the printed values do not
    reproduce.

    Parameters
    ----------
    name : {"printed", "identified"}
        Name of the preset. Units of the problem: mm, s, N, kg, rad.

    Raises
    ------
    ValueError
        When there is no such preset.

    Examples
    --------
    >>> preset("printed").model.mu_kinetic, preset("identified").model.contact_stiffness  # 1, N/mm
    (0.15, 729.0)
    """
    return CenteringProblem(model=_PRESETS[checks.one_of("name", name, _PRESETS)][0])


def presets() -> tuple[PresetInfo, ...]:
    """Return name, content, source and calibration of every preset (units: mm, s, N, kg, rad).

    Examples
    --------
    >>> [info.name for info in presets()]
    ['printed', 'identified']
    """
    return tuple(PresetInfo(name, *words) for name, (_, *words) in _PRESETS.items())
