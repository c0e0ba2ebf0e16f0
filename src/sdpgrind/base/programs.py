"""Programs for controls of machines: text that is read back before it is written."""

import os
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

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
    def check(self) -> ProgramCheck:
        """Read the text back and follow it: greatest distance from the plan (mm), and time of the end (s)."""

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
        found = self.check().deviation
        if found > self.deviation * (1 + _ROUNDING):
            raise ValueError(
                f"text must stay within the stated {self.deviation:g} of the plan (mm); read back, it is"
                f" {found:.4g} away, and nothing is written"
            )
        with whole_file(path) as temporary:
            temporary.write_bytes(self.text.encode("ascii"))

    def __repr__(self) -> str:
        lines = self.text.count("\n")
        return f"{type(self).__name__}({lines} lines, within {self.deviation:g} mm of the plan)"
