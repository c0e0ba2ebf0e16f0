"""Base class of the commands of areas: how one reads a job, plans it and reports on it."""

import argparse
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from hwsim._log.log import Log


class Job(Protocol):
    """A stand, its problem, and the controller that follows the plan."""

    @property
    def stand(self) -> Any:
        """The plant."""

    @property
    def problem(self) -> Any:
        """The planned problem."""

    def controller(self, plan: Any) -> Any:
        """The controller that follows a plan."""


Stand = TypeVar("Stand")


@dataclass(frozen=True)
class StandJob(Generic[Stand]):
    """A stand and settings of its controller; an area adds ``controller`` and its planner."""

    stand: Stand
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def problem(self) -> Any:
        """The planned problem."""
        stand: Any = self.stand  # a type variable cannot declare ``problem``
        return stand.problem


class AreaCommand(ABC):
    """What differs between ``hwsim weldbead``, ``hwsim plunge``, ...

    Presets and plans come from its `library`; next to its module, ``toml`` has ``read(path)`` and ``report``
    has a `hwsim.command._report.CommandReport` of that name. Its module has light imports only, since ``hwsim
    --help`` imports each area.
    """

    name: ClassVar[str]  # name of the command
    about: ClassVar[str]  # one line for --help
    more: ClassVar[str] = ""  # end of the text of --help
    library: ClassVar[str] = ""  # package with ``preset`` and ``plan``: "sdpgrind.plunge"
    plans: ClassVar[str] = ""  # class of its plans there: "CyclePlan"
    made_for: ClassVar[str]  # "a weld bead"
    part: ClassVar[str] = "part"
    plan_word: ClassVar[str] = "plan"  # name of its option and its file
    presets: ClassVar[str]  # names, the first one an example: "P1 ... P5, C0"
    units: ClassVar[str] = "mm, s, N, J, W"  # units of the TOML file
    error_unit: ClassVar[str] = "$"  # unit of the error of a plan
    tolerance: ClassVar[str] = ""  # help of --tolerance; "": no such option
    switches: ClassVar[Mapping[str, str]] = {}  # own switches and their help
    counts: ClassVar[Mapping[str, str]] = {}  # own options of whole numbers >= 1 and their help
    choices: ClassVar[Mapping[str, tuple[str, ...]]] = {}  # own options of one word: help, then the words
    files: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Files that methods of the plan write, named as the options: help, then the endings."""

    def refuse(self, arguments: argparse.Namespace) -> None:
        """Refuse options that do not go together, before a job is read; ones not given are None."""
        return

    def read(self, path: Path, arguments: argparse.Namespace) -> Job:
        """Read the job in a TOML file (see `hwsim.command._toml.read`)."""
        job: Job = self._beside("toml").read(path)
        return job

    def preset(self, name: str) -> Any:
        """Return a problem by its name."""
        return import_module(self.library).preset(name)

    @abstractmethod
    def job_of(self, problem: Any, arguments: argparse.Namespace) -> Job:
        """Put a problem on a default stand."""

    def plan_class(self) -> type:
        """Class of its plans: with ``problem``, ``error``, ``plot`` and ``save``."""
        plans: type = getattr(import_module(self.library), self.plans)
        return plans

    def plan(self, job: Any, arguments: argparse.Namespace, progress: Any) -> Any:
        """Plan a job."""
        return import_module(self.library).plan(job.problem)

    def adaptation(self, job: Any, arguments: argparse.Namespace) -> Any:
        """Return the adaptation between parts; None: there is none."""
        return None

    def watched(self, controller: Any, job: Any, arguments: argparse.Namespace) -> Any:
        """Return the controller, or an equivalent that shows its reports."""
        return controller

    def more_pictures(self, log: "Log") -> Mapping[str, Any]:
        """Return further pictures of a log: file name -> object with ``plot``."""
        return {}

    def instead(self, title: str, job: Any, arguments: argparse.Namespace) -> str | None:
        """Do something other than a run where a switch asks for it, and return its report; None: run.

        Options that are not given (``arguments.parts``) are None.
        """
        return None

    def report(self, title: str, log: "Log", plan: Any, job: Any) -> str:
        """Return the report as text."""
        text: str = self._beside("report").report(title, log, plan, job)
        return text

    def _beside(self, module: str) -> Any:
        """Import a module from the folder of the area's module."""
        return import_module(f"{type(self).__module__.rpartition('.')[0]}.{module}")
