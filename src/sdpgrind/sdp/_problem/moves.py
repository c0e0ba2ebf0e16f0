"""What a problem may do in a state: a move, with its transition and its levels, or a stop."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.coordinates import Callback, Levels


class Transition(Protocol):
    """Change of the coordinates by a move: `Shift`, `Sampled`, `Stay`, or a class with these two methods.

    Both get P points, with an entry of the move's lists and a value of its continuous control for each;
    `menu.state` and `menu.controls` make ``s`` and ``c`` of them.
    """

    def rows(
        self, menu: Any, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Any, level: Floats
    ) -> Any:
        """Return the exact one-step distribution, in-path charges ($) included.

        Parameters
        ----------
        menu : object
            Provides ``state``, ``controls``, ``penalty``, ``grid``.
        points : tuple of array
            Coordinates, one array (P,) for each axis, in its unit.
        mode, stage : array or None
            Mode and stage coordinate of each point; mode None: the problem has only one.
        choice, level : array
            Entry of the move's lists, and value of its continuous control, of each point.
        """

    def sample(
        self,
        menu: Any,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Any,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], Any]:
        """Draw next coordinates, and charges ($) besides the move's own charge.

        Parameters
        ----------
        menu, points, mode, stage, choice, level
            As in `rows`.
        rng : numpy Generator
            Source of randomness.
        """


@dataclass(frozen=True)
class Move:
    """Action that changes the state.

    Parameters
    ----------
    name : str
        Name in the policy.
    controls : mapping
        At most one `Levels`; all others are lists of equal length, combined entry by entry.
    to : Transition
        Change of the coordinates.
    duration : int
        Number of stages, >= 1.
    charge : float or callable(s, c)
        In-path charge, $.
    allowed : callable(s, c), optional
        Whether the move is allowed.
    into : str or sequence of str, optional
        Mode on arrival: one, or one for each entry of the lists. None: unchanged.
    timed : bool
        True: ``s`` has the stage coordinate, and the move is evaluated anew at every stage.
    """

    name: str
    controls: Mapping[str, Levels | npt.ArrayLike]
    to: Transition
    duration: int = 1
    charge: float | Callback = 0.0
    allowed: Callback | None = None
    into: str | Sequence[str] | None = None
    timed: bool = False

    def __post_init__(self) -> None:
        checks.count(f"move {self.name!r}: duration", self.duration, at_least=1)
        if not callable(self.charge):
            checks.number(f"move {self.name!r}: charge", self.charge, "$, or a function of s and c")
        levels = [name for name, control in self.controls.items() if isinstance(control, Levels)]
        if len(levels) > 1:
            raise ValueError(f"move {self.name!r}: controls must have at most one Levels; got {levels}")
        lengths = {
            name: np.size(np.asarray(entry)) for name, entry in self.controls.items() if name not in levels
        }
        if len(set(lengths.values())) > 1:
            raise ValueError(f"move {self.name!r}: lists of controls must be of equal length; got {lengths}")
        if 0 in lengths.values():
            raise ValueError(f"move {self.name!r}: lists of controls must not be empty; got {lengths}")

    @property
    def level_name(self) -> str | None:
        """Name of the continuous control, or None."""
        return next((name for name, control in self.controls.items() if isinstance(control, Levels)), None)

    @property
    def levels(self) -> Levels | None:
        """The continuous control, or None."""
        return next((control for control in self.controls.values() if isinstance(control, Levels)), None)

    @property
    def lists(self) -> dict[str, Floats]:
        """Listed controls, as arrays of equal length."""
        return {k: np.ravel(np.asarray(v)) for k, v in self.controls.items() if not isinstance(v, Levels)}

    @property
    def choices(self) -> int:
        """Number of entries of the lists; 1 without lists."""
        return next((entry.size for entry in self.lists.values()), 1)


@dataclass(frozen=True)
class Stop:
    """Action that ends the process.

    Parameters
    ----------
    name : str
        Name in the policy.
    charge : Charge or callable(s)
        Charge, $. A `Charge` is applied to the coordinate of the one axis; an edge "stop" requires it.
    extra : callable(s), optional
        Further charge ($) by mode, also beyond a stopping edge.
    allowed : callable(s), optional
        Whether stopping is allowed.
    """

    name: str
    charge: Charge | Callback
    extra: Callback | None = None
    allowed: Callback | None = None
