"""Finishing jobs ready to use."""

from collections.abc import Callable

from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo as PresetInfo
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.path._hilbert import hilbert
from sdpgrind.finishing.surface._presets import flat_surface, nominal_surface

# mm, derived: side at which a Hilbert path of order 5 has the 0.2 mm pitch of the source's zigzag
SPECIMEN = 6.4


def _nominal() -> FinishingProblem:
    return FinishingProblem(hilbert(nominal_surface(), 5, mapping="equal_area"))


def _specimen() -> FinishingProblem:
    return FinishingProblem(hilbert(flat_surface(SPECIMEN), 5, mapping="parametric"))


_OURS = "arm, heading, friction ratio, acceleration: assumptions, to be replaced by those of your robot"
_PRESETS: dict[str, tuple[Callable[[], FinishingProblem], str, str, str]] = {
    "nominal": (
        _nominal,
        "a die of 50 mm by 50 mm with one ridge, Hilbert path of order 5 with cells of equal area",
        "Wang and Jan (2001): lever arm, feed; the surface is ours, as the source's figures give no numbers",
        _OURS,
    ),
    "specimen": (
        _specimen,
        "a flat specimen of 6.4 mm, Hilbert path of order 5: the pitch is the 0.2 mm of the source's zigzag",
        "Wang and Jan (2001): lever arm, feed, pitch of the zigzag;"
        " the side is ours, as the source gives none",
        _OURS,
    ),
}


def preset(name: str) -> FinishingProblem:
    """Return a problem ready to use.

    ``"nominal"``: a curved die of 50 mm by 50 mm. ``"specimen"``: a flat square of 6.4 mm, small enough for
    whole experiments on the simulated cell. The source gives no numbers of arm, surface or specimen; they are
    chosen here, the side of the specimen so that its Hilbert path has the 0.2 mm pitch of the source's
    zigzag.

    Parameters
    ----------
    name : {"nominal", "specimen"}
        Name of the preset. Units of the problem: mm, s, N, rad.

    Raises
    ------
    ValueError
        When there is no such preset.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> finishing.preset("nominal").path.pattern
    'hilbert5'
    """
    return _PRESETS[checks.one_of("name", name, _PRESETS)][0]()


def presets() -> tuple[PresetInfo, ...]:
    """Return name, content, source and assumptions of every preset (units of the problems: mm, s, N, rad).

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> [info.name for info in finishing.presets()]
    ['nominal', 'specimen']
    """
    return tuple(PresetInfo(name, *words) for name, (_, *words) in _PRESETS.items())
