"""Terms of the roughness model, in which ln R_a is linear."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

PATTERNS = ("hilbert4", "hilbert5", "zigzag")  # the first has no term of its own
SETTINGS = ("pattern", "tool_diameter", "normal_force")
NAMES = ("intercept", "hilbert5", "zigzag", "tool_exponent", "force_slope", "force_bend")


class References(NamedTuple):
    """Settings at which the logarithms are 0."""

    tool_diameter: float = 3.5  # mm; derived: mean of the diameters of Wang and Jan (2001), Table 2
    normal_force: float = 1.111  # N; source: middle force of the same table


TERMS = References()


def checked_patterns(pattern: Any) -> npt.NDArray[Any]:
    """Names of patterns as an array; unknown ones are refused."""
    names = pattern if isinstance(pattern, np.ndarray) else np.asarray(pattern, dtype=object)
    for name in names.ravel().tolist():
        if not isinstance(name, str) or name not in PATTERNS:
            raise checks.refuse("pattern", f"one of {', '.join(PATTERNS)}", name)
    return names.astype(str)


def design(pattern: npt.NDArray[Any], tool_diameter: Floats, normal_force: Floats) -> Floats:
    """Rows (..., 6) of the model for patterns, diameters (mm) and forces (N) that broadcast."""
    x = np.log(normal_force / TERMS.normal_force)
    marks = [(pattern == name).astype(float) for name in PATTERNS[1:]]
    columns = np.broadcast_arrays(1.0, *marks, np.log(tool_diameter / TERMS.tool_diameter), x, x**2)
    return np.stack(columns, axis=-1)
