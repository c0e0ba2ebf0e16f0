"""Names and units of everything in a log, as plain values that need no code of the run."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from hwsim._part.routes import controllers, set_points
from hwsim.faults._plant import class_name
from hwsim.protocols import Controller, Plant

LIVE_COLUMNS: Final = {"release_delay": "s", "step_time": "s", "sample_age": "s", "overrun": ""}
"""Name -> unit of the columns that a run against the clock adds to each table."""
LIVE_OUTCOMES: Final = {
    "begun": "",
    "overruns": "",
    "longest_step": "s",
    "aborted": "",
    "abort_reason": "",
    "safe_delay": "s",
    "safe_by": "",
}
"""Name -> unit of the outcomes that it adds."""
LIVE_PREFIX: Final = "live_"
"""Before the name of one that the plant has, too."""


def aborted(outcome: Mapping[str, Any]) -> bool:
    """Whether a part was made safe before its end."""
    return any(outcome.get(name, 0.0) == 1.0 for name in ("aborted", f"{LIVE_PREFIX}aborted"))


@dataclass(frozen=True)
class Labels:
    """Names and units that label the parts of one run."""

    plant: str
    controller: str
    measures: Mapping[str, str]
    accepts: Mapping[str, str]
    reports: Mapping[str, str]
    outcomes: Mapping[str, tuple[str, str]]  # name -> (unit, dimension of arrays)
    description: Mapping[str, float | str]
    set_points: Mapping[str, str] = field(default_factory=dict)  # commands that another tier reads

    @classmethod
    def of(cls, plant: Plant, controller: Controller) -> "Labels":
        """Collect the labels of a plant and a controller."""
        reports: dict[str, str] = {}
        for each in controllers(controller).values():
            reports |= getattr(each, "reports", {})
        outcomes = {
            name: _with_dimension(name, unit) for name, unit in getattr(plant, "outcomes", {}).items()
        }
        described: dict[str, float | str] = {}
        for said in (*controllers(controller).values(), plant):
            described |= getattr(said, "description", {})
        names = class_name(plant), getattr(controller, "stands_for", type(controller).__name__)
        between = set_points(plant, controller)
        return cls(*names, dict(plant.measures), dict(plant.accepts), reports, outcomes, described, between)

    def to_json(self) -> str:
        """Return JSON that `from_json` reads."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Labels":
        """Read the JSON of `to_json`."""
        return cls(**json.loads(text))

    def column(self, name: str) -> dict[str, str]:
        """Attributes of a column of a table."""
        read = {**self.set_points, **self.measures, **LIVE_COLUMNS}
        if name in read:
            return _attributes(name, read[name])
        if name.endswith("_command"):
            bare, units = name.removesuffix("_command"), {**self.set_points, **self.accepts}
            return _attributes(f"{bare} commanded", units.get(bare, units.get(name, "")))
        return self._planned(name)

    def outcome(self, name: str) -> tuple[str, dict[str, str]]:
        """Dimension (of an array) and attributes of an outcome."""
        if name in self.outcomes:
            unit, dimension = self.outcomes[name]
            return dimension, _attributes(name, unit)
        if (bare := name.removeprefix(LIVE_PREFIX)) in LIVE_OUTCOMES:
            return "", _attributes(name, LIVE_OUTCOMES[bare])
        return f"{name}_index", self._planned(name)

    def _planned(self, name: str) -> dict[str, str]:
        bare = name.removesuffix("_planned")
        return _attributes(f"{bare} planned" if bare != name else name, self.reports.get(bare, ""))


def _with_dimension(name: str, unit: Any) -> tuple[str, str]:
    return (unit, f"{name}_index") if isinstance(unit, str) else (str(unit[0]), str(unit[1]))


def _attributes(name: str, unit: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": name.replace("_", " ")}
