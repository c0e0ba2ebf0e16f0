"""Folder of a run: plan, log, journal and pictures; a folder of another run is refused."""

import contextlib
import dataclasses
import errno
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from hwsim._log.fingerprint import fingerprint
from hwsim.command._lock import locked
from sdpgrind.base import pictures
from sdpgrind.base.extras import need
from sdpgrind.base.whole_files import remove_leftovers, whole_file

if TYPE_CHECKING:
    from hwsim._log.log import Log


PAGE = "report.html"
"""Name of the page in a folder."""
_DPI = 150  # of pictures, pixels per inch; chosen: sharp in print at half a page's width


class RunFolder:
    """Folder of a run: ``<word>.nc``, ``run.nc``, ``run.db`` and pictures; `load` opens a plan."""

    def __init__(self, path: Path, word: str, load: Callable[[Path], Any]) -> None:
        self.path, self.word, self._load = path, word, load
        self._held, self._locked = contextlib.ExitStack(), False
        refuse_no_folder(path)

    def __enter__(self) -> Self:
        if self.path.exists():
            self._lock()
        return self  # another folder is made, and locked, once there is a plan

    def __exit__(self, *error: object) -> None:
        self._held.close()

    def _lock(self) -> None:
        if not self._locked:
            self._held.enter_context(locked(self.path))
            remove_leftovers(self.path)
            self._locked = True

    def __str__(self) -> str:
        return str(self.path)

    @property
    def journal(self) -> Path:
        """Journal file."""
        return self.path / "run.db"

    @property
    def plan(self) -> Any:
        """Plan in this folder, or None."""
        return self._load(self._plan_file) if self._plan_file.exists() else None

    @property
    def _plan_file(self) -> Path:
        return self.path / f"{self.word}.nc"

    @property
    def finished(self) -> int:
        """Number of parts in the journal."""
        from hwsim._log.journal import Journal

        if not self.journal.exists():
            return 0
        with Journal(self.journal) as journal:
            return journal.parts

    def refuse_other_plan(self, problem: Any, given: Any) -> None:
        """Refuse a folder with a plan of another problem, or other than the given plan."""
        kept = self.plan
        if kept is None:
            return
        if kept.problem != problem:
            changed = differences(kept.problem, problem)
            raise ValueError(
                f"--out {self} holds a run of another problem ({changed} differs): choose another folder"
            )
        if given is not None and fingerprint(given) != fingerprint(kept):
            raise ValueError(f"--out {self} holds a run of another {self.word}: choose another folder")

    def refuse_other_run(self, **ingredients: Any) -> None:
        """Refuse a folder with the journal of another run."""
        from hwsim._log.journal import Journal

        if self.journal.exists():
            with Journal(self.journal) as journal:
                journal.refuse_other(ingredients)

    def begin(self, plan: Any) -> None:
        """Make the folder and write the plan, unless they exist."""
        self.path.mkdir(parents=True, exist_ok=True)
        self._lock()
        if not self._plan_file.exists():
            plan.save(self._plan_file)

    def keep(self, log: "Log", pictures: Mapping[str, Any]) -> list[str]:
        """Write log and pictures (file name -> object with ``plot``); return the names of all files."""
        log.save(self.path / "run.nc")
        names = drawn(self.path, pictures) if pictures else []
        return [self._plan_file.name, "run.nc", "run.db", *names]


def refuse_no_folder(path: Path | None) -> None:
    """Refuse a path that is, or lies in, a file or what may not be written; later, a plan would be lost."""
    if path is None:
        return
    there = next(each for each in (path, *path.absolute().parents) if each.exists())
    if not there.is_dir():
        raise ValueError(f"--out must be a folder; {there} is a file")
    if not os.access(there, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(there))


def with_kept(text: str, folder: Path | RunFolder, names: Iterable[str]) -> str:
    """Add a line with the files in the folder to a text."""
    return f"{text}\n\nkept in {folder}: {', '.join(names)}"


def drawn(folder: Path, things: Mapping[str, Any]) -> list[str]:
    """Draw `things` into a folder and return their names; without matplotlib, a text that says so."""
    try:
        pyplot = need("matplotlib.pyplot", "plot")
    except ImportError as error:
        return [f"no pictures ({error})"]
    pyplot.switch_backend("agg")
    for name, thing in things.items():
        figure = thing.plot()
        figure.set_dpi(_DPI)
        pictures.lay_out(figure)
        with whole_file(folder / name) as temporary:
            figure.savefig(temporary, format="png", dpi=_DPI)
        pyplot.close(figure)
    return list(things)


def paged(folder: Path, write: Callable[[Path], str]) -> list[str]:
    """Write the page of a folder and return its name; without jinja2, a text that says so."""
    try:
        write(folder / PAGE)
    except ImportError as error:
        return [f"no page ({error})"]
    return [PAGE]


def differences(one: Any, other: Any) -> str:
    """Names of the fields in which two problems differ."""
    names = [field.name for field in dataclasses.fields(one)]
    return ", ".join(name for name in names if getattr(one, name) != getattr(other, name))
