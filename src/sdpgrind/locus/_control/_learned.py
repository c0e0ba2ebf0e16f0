"""The learned start: a part begins where the last one ended."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.locus._control.controller import LocusController


class LearnedStart:
    """Begin each part at the last point of the part before: Koren (1989), section 6.

    A point from which nothing was learned, as no part was long enough, is not taken.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import locus
    >>> problem = locus.preset("grinding")
    >>> controller = locus.LocusController(locus.plan(problem), along="infeed_rate")
    >>> log = hwsim.run(hwsim.AdaptiveGrinder(problem), controller, parts=2, adapt=locus.LearnedStart())
    >>> first, second = log.outcome.time.values  # s
    >>> bool(second < first)
    True
    """

    def next(self, controller: LocusController, part_log: Any) -> LocusController:
        """Return the controller of the next part, with another start (in the unit of its coordinate).

        Parameters
        ----------
        controller : LocusController
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        checks.kind("controller", controller, LocusController)
        places = np.asarray(part_log.column("controller", "coordinate_planned"))
        last = places[np.isfinite(places)]
        return controller.replace(start=float(last[-1])) if last.size else controller
