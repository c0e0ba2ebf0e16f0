"""Start of a separation: whether the turns separate runout from form and determine its ratio."""

import dataclasses
from math import ceil, sqrt

import numpy as np
from scipy.linalg import cho_solve

from centering.roundness._roller import RollerError
from centering.roundness._roller_rows import Basis, condition, harmonic_rows
from centering.roundness._roller_task import SeparationTask
from centering.roundness._samples import CONDITION_MAX
from centering.roundness._sampling import widest_gap
from sdpgrind.base.checks import Floats

REACH = 5e-3  # chosen: relative range of a refined ratio; beyond it the tip radius is wrong
SEEN = 5.0  # chosen: amplitude in standard deviations below which a runout has no measurable ratio
_TELLING = 0.3  # chosen: largest sd of a refined ratio, over the reach
_UNSURE, _INFLATED = 0.1, 4.0
"""The ratio is kept where the amplitude's sd is above this share of it, and this multiple of that at the
given ratio; chosen: smaller ones keep a wrong ratio, larger ones lose the amplitude."""
_APART = 0.25  # chosen: step of tried ratios times the turns; a peak is 2 wide
_SINGULAR = 1e-14  # chosen: squares left over those of a row where harmonics replace it, rounding
# chosen: additional turns that an error proposes
_LATER = (0, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)


@dataclasses.dataclass(frozen=True, eq=False)
class SeparationState:
    """Circle, tip radius, ratio, and cosine and sine of the runout: the values moved by a step."""

    circle: Floats
    tip_radius: float
    ratio: float
    tone: Floats

    def runout_rows(self, part_angle: Floats, refine: bool) -> Floats:
        """Two rows of the runout and, for a refined ratio, the derivative by it."""
        rows = RollerError(np.array([*self.tone, self.ratio]), np.zeros((3, 3))).derivatives(part_angle).T
        return rows if refine else rows[:2]


def start(task: SeparationTask, nominal: float) -> tuple[SeparationState, bool]:
    """First state, and whether the ratio can be refined."""
    samples = task.samples
    state = SeparationState(samples.circle, samples.tip_radius, nominal, np.zeros(2))
    part_angle, deviation = samples.about(state.circle, state.tip_radius)
    basis = Basis.of(part_angle, task.upr_max)
    _refuse_ill(task, condition(basis.bordered(state.runout_rows(part_angle, False))), nominal)
    if not task.refine:
        return state, False
    left = basis.beyond(deviation[np.newaxis])[0]
    found = _first_runout(task, basis, left, part_angle, nominal)
    if found is None:
        return state, False
    better = dataclasses.replace(state, ratio=found[0], tone=found[1])
    return (better, True) if _determines_ratio(basis, better, left, part_angle, nominal) else (state, False)


def _determines_ratio(
    basis: Basis, state: SeparationState, left: Floats, part_angle: Floats, nominal: float
) -> bool:
    """Whether the samples determine the ratio better than its reach and refining keeps the amplitude certain.

    Over one turn the harmonics replace the runout; near a whole number ratio and amplitude are correlated.
    """
    rows = state.runout_rows(part_angle, True)
    own = basis.beyond(rows)
    gram, size = own @ own.T, np.sqrt(np.sum(rows**2, axis=1))
    freedom = left.size - len(basis.rows) - len(own)
    if freedom <= 0 or np.linalg.eigvalsh(gram / np.outer(size, size))[0] <= _SINGULAR:
        return False
    noise_sd = float(np.linalg.norm(left - np.linalg.solve(gram, own @ left) @ own)) / sqrt(freedom)
    if noise_sd * sqrt(np.linalg.inv(gram)[-1, -1]) >= _TELLING * REACH * state.ratio:
        return False
    at_nominal = basis.beyond(dataclasses.replace(state, ratio=nominal).runout_rows(part_angle, True))
    return not any(_unsettled(each, state.tone, noise_sd) for each in (gram, at_nominal @ at_nominal.T))


def _unsettled(gram: Floats, tone: Floats, noise_sd: float) -> bool:
    """Whether refining the ratio, the last row, makes the amplitude uncertain."""
    amplitude = float(np.hypot(*tone))
    spreads = np.linalg.inv(gram[:2, :2]), np.linalg.inv(gram)[:2, :2]
    sure, unsure = (noise_sd * sqrt(max(float(tone @ spread @ tone), 0.0)) / amplitude for spread in spreads)
    return unsure > max(_UNSURE * amplitude, _INFLATED * sure)


def _first_runout(
    task: SeparationTask, basis: Basis, left: Floats, part_angle: Floats, nominal: float
) -> tuple[float, Floats] | None:
    """Ratio within reach and runout that explain most of the residuals of the harmonics; None below noise."""
    count = 2 * ceil(REACH * nominal * task.samples.turns / _APART) + 3
    ratios = nominal * (1 + np.linspace(-REACH, REACH, count))
    gains, tones = zip(*(_explained(basis, left, part_angle, ratio) for ratio in ratios), strict=True)
    best = int(np.argmax(gains))
    freedom = left.size - len(basis.rows) - 3
    seen = freedom > 0 and gains[best] * freedom > SEEN**2 * (left @ left - gains[best])
    return (float(ratios[best]), tones[best]) if seen else None


def _explained(basis: Basis, left: Floats, part_angle: Floats, ratio: float) -> tuple[float, Floats]:
    """Sum of squares explained beyond the harmonics by a runout of this ratio, and the runout."""
    tone = np.stack([np.cos(ratio * part_angle), np.sin(ratio * part_angle)])
    shared = basis.rows @ tone.T
    gram = tone @ tone.T - shared.T @ cho_solve(basis.factor, shared)
    found = np.linalg.solve(gram, tone @ left)
    return float(left @ tone.T @ found), found


def _refuse_ill(task: SeparationTask, found: float, ratio: float) -> None:
    if found <= CONDITION_MAX:
        return
    raise ValueError(
        f"angle must cover enough turns to tell runout at {ratio:.6g} upr from {task.upr_max} harmonics:"
        f" the condition must be <= {CONDITION_MAX:g}; got {found:.3g} with {task.samples.turns:.3g} turns;"
        f" {_advice(task, ratio)}"
    )


def _advice(task: SeparationTask, ratio: float) -> str:
    """Sentence on a remedy: more turns, on an even grid, or samples in a gap."""
    more = _more_turns(ratio, task.upr_max, task.samples.turns)
    if more == 0:
        gap = widest_gap(task.samples.angle)
        bare = f"a gap of {np.degrees(gap):.3g} degrees or the offset leaves part of the turn bare"
        return f"{bare}: upr_max must be lower"
    return "no number of turns will do" if more is None else f"about {more:g} turns more are needed"


def _more_turns(ratio: float, upr_max: int, turns: float) -> float | None:
    """Additional turns that separate the two, on an even grid; None if none does."""
    for more in _LATER:
        part_angle = (
            2
            * np.pi
            * (turns + more)
            * np.linspace(0, 1, ceil((turns + more) * (2 * upr_max + 6)), endpoint=False)
        )
        rows = np.vstack(
            [harmonic_rows(part_angle, upr_max), np.cos(ratio * part_angle), np.sin(ratio * part_angle)]
        )
        if condition(rows @ rows.T) <= CONDITION_MAX:
            return more
    return None
