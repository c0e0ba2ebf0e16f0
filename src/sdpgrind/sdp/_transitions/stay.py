"""Stay: only the mode changes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows


@dataclass(frozen=True)
class Stay:
    """Transition that keeps all coordinates (any unit).

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> sdp.Move("go", {"to": [0, 1]}, sdp.Stay(), into=["up", "down"]).choices
    2
    """

    def rows(
        self, menu: Menu, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Ints, level: Floats
    ) -> Rows:
        """Return the one-step distribution from P points with one control each."""
        node, part = menu.grid.corners([menu.grid.index(k, p) for k, p in enumerate(points)])
        size, corners = choice.size, len(node)
        at = np.broadcast_to(np.arange(size), (corners, size)).ravel()
        cells = np.broadcast_to(node.reshape(corners, -1), (corners, size)).ravel()
        weights = np.broadcast_to(part.reshape(corners, -1), (corners, size)).ravel()
        matrix = sparse.csr_array((weights, (at, cells)), shape=(size, menu.grid.size))
        charge = np.broadcast_to(
            menu.penalty(menu.state(points, mode, stage), menu.controls(choice, level)), (size,)
        ).astype(float)
        arrival = mode if menu.into is None else menu.into[choice]
        return Rows(
            matrix,
            np.broadcast_to(0 if arrival is None else arrival, (size,)).astype(int),
            charge,
            np.zeros(size),
        )

    def sample(
        self,
        menu: Menu,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Ints,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], Any]:
        """Return the coordinates unchanged."""
        return points, 0.0
