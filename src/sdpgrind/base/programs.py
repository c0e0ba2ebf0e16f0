"""Programs for controls of machines: text that is read back before it is written."""

import os
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from sdpgrind.base.whole_files import whole_file

_ROUNDING = 1e-9  # derived: greatest distances of equal courses differ by less, relative


class ProgramCheck(NamedTuple):
    """What a program does, read back from its text.

    Attributes
    ----------
    deviation : float
        Greatest distance from the plan, mm.
    time : float
        Time at which the program ends, s.
    """

    deviation: float
    time: float


class Checked(Protocol):
    """What the check of a program finds, at least."""

    @property
    def deviation(self) -> float:
        """Greatest distance from the plan, mm."""
        ...


@dataclass(frozen=True, repr=False)
class Program(ABC):
    """Program of a control; immutable.

    Attributes
    ----------
    text : str
        The program, ASCII.
    deviation : float
        Greatest distance from the plan that the program states, mm.
    """

    text: str
    deviation: float

    @abstractmethod
    def check(self) -> Checked:
        """Read the text back and follow it: greatest distance from the plan, mm."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Check the program and write it at `path`, complete or not at all.

        Parameters
        ----------
        path : str or path
            File in an existing folder.

        Raises
        ------
        ValueError
            If the text read back is farther from the plan than stated, mm.
        """
        self._refuse_faulty()
        with whole_file(path) as temporary:
            temporary.write_bytes(self.text.encode("ascii"))

    def _refuse_faulty(self) -> None:
        """Refuse to write a program whose text does something else than the plan."""
        if fault := self._fault(self.check()):
            raise ValueError(f"{fault}, and nothing is written")

    def _fault(self, found: Any) -> str:
        """Return what is wrong in the text read back; "": nothing."""
        if found.deviation <= self.deviation * (1 + _ROUNDING):
            return ""
        return (
            f"text must stay within the stated {self.deviation:g} of the plan (mm); read back, it is"
            f" {found.deviation:.4g} away"
        )

    def __repr__(self) -> str:
        lines = self.text.count("\n")
        return f"{type(self).__name__}({lines} lines, within {self.deviation:g} mm of the plan)"
