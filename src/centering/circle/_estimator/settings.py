"""Settings of a streaming estimator, written into its state array; errors of invalid readings."""

from functools import lru_cache
from math import log1p

import numpy as np
from scipy.special import ndtri, stdtrit

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import COARSE_STEPS, NOT_FINITE, NOT_POSITIVE, TOO_FAR
from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats


def empty_state(lobes: Floats, known: Floats) -> Floats:
    """Return a state with assumed lobes (upr, mm) and known harmonics (upr, mm, mm), and zeros elsewhere."""
    begin, middle, arrays = at.lobes_at(len(known), len(lobes))
    state = np.zeros(arrays + at.ARRAYS * at.width(len(lobes)))
    state[begin:middle], state[middle:arrays] = lobes.ravel(), known.ravel()
    state[at.FORMS], state[at.KNOWN] = len(lobes), len(known)
    named = set(lobes[:, 0])
    above = [n for n in range(6, 10 + len(named)) if n not in named]
    state[at.WAVES_AT : at.WAVES_AT + at.WAVES] = [2, 3, 4, 5, *above[:4]]
    state[at.FORM_GATE] = 2.0 * lobes[:, 1].sum()  # the lobe itself, and its effect on the fitted curve
    return state


def write_quantiles(state: Floats, confidence: float) -> None:
    """Write the quantiles of a two-sided confidence."""
    state[at.BEYOND], state[at.NORMAL] = log1p(-confidence), ndtri(0.5 + confidence / 2)
    state[at.STUDENT : at.STUDENT + at.TABLE] = _student_table(confidence)


@lru_cache(maxsize=8)
def _student_table(confidence: float) -> Floats:
    """Two-sided Student quantiles of 1, 2, ... degrees of freedom; kept: they are most of a new estimator."""
    return lasting(stdtrit(np.arange(1.0, at.TABLE + 1), 0.5 + confidence / 2))


def refusal(code: int, angle: float, reading: float) -> ValueError:
    """Return the error of an invalid reading."""
    degrees = "of degrees? then units.deg(angle)"
    hint = f"readings in the order of time, by less than a turn from the one before; {degrees}"
    return {
        NOT_FINITE: checks.refuse("angle and reading", "finite", (angle, reading), "rad, mm"),
        NOT_POSITIVE: checks.refuse(
            "reading", "> 0 with the exact curve; zero-mean readings want model='limacon'", reading, "mm"
        ),
        TOO_FAR: checks.refuse("angle", hint, angle, "rad"),
        COARSE_STEPS: checks.refuse("angle", f"read more often than 8 times a turn; {degrees}", angle, "rad"),
    }[code]
