"""Specimens of a designed experiment: cell, path, motion and controller of each setting."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hwsim._log.log import Log
from hwsim._loop.loop import run
from sdpgrind.base import checks
from sdpgrind.base.rng import Seed

if TYPE_CHECKING:
    from hwsim.plants._finishing.plant import FinishingCell
    from sdpgrind import finishing


class Bench:
    """Makes cell, motion and controller of a setting; caches paths and motions."""

    def __init__(
        self, cell: "FinishingCell", pitch: float | None, kind: str, method: str, folder: Path | None
    ) -> None:
        from hwsim.plants._finishing.plant import FinishingCell

        self._cell, self._kind, self._method = checks.kind("cell", cell, FinishingCell), kind, method
        self._pitch = cell.problem.path.pitch if pitch is None else checks.positive("pitch", pitch, "mm")
        self._paths: dict[str, Any] = {}
        self._motions: dict[tuple[str, float], Any] = {}
        self._folder = folder
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)

    def refuse_unknown(self, pattern: str) -> None:
        """Refuse a path that the roughness model does not know."""
        model = self._cell.problem.model
        model.median(pattern, model.tool_diameter_range[0], model.normal_force_range[0])

    def finish(self, setting: Mapping[str, Any], parts: int, rng: Seed, name: str) -> Log:
        """Finish specimens at a setting."""
        from sdpgrind import finishing

        force = setting["normal_force"]
        cell = self._cell.replace(problem=self._problem(setting), target_force=force)
        controller = finishing.TorqueController(
            cell.torque_axis, self._motion(setting), normal_force=force, kind=self._kind
        )
        journal = None if self._folder is None else self._folder / f"{name}.db"
        return run(cell, controller, parts=parts, rng=rng, journal=journal)

    def _problem(self, setting: Mapping[str, Any]) -> Any:
        changes = {name: setting[name] for name in ("tool_diameter", "feed_rate")}
        return self._cell.problem.replace(path=self._path(setting["pattern"]), **changes)

    def _motion(self, setting: Mapping[str, Any]) -> Any:
        from sdpgrind import finishing

        key = setting["pattern"], setting["feed_rate"]
        if key not in self._motions:
            self._motions[key] = finishing.plan(self._problem(setting), method=self._method)
        return self._motions[key]

    def _path(self, pattern: str) -> Any:
        if pattern not in self._paths:
            self._paths[pattern] = _path(self._cell.problem, pattern, self._pitch)
        return self._paths[pattern]


def _path(problem: "finishing.FinishingProblem", pattern: str, pitch: float) -> Any:
    """Path of a pattern on the surface of a problem."""
    from sdpgrind import finishing

    if pattern == "zigzag":
        return finishing.zigzag(problem.surface, pitch)
    mapping = problem.path.mapping if problem.path.mapping in ("equal_area", "parametric") else "equal_area"
    return finishing.hilbert(problem.surface, int(pattern.removeprefix("hilbert")), mapping=mapping)
