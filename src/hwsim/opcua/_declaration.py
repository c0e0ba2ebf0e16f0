"""What a served plant tells about itself, as one text: names, units, ranges, part and machine."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from hwsim.faults._plant import class_name
from hwsim.protocols import Plant
from sdpgrind.base import stored

VERSION = 1  # chosen: a server of another version is refused


@dataclass(frozen=True)
class Declaration:
    """Declarations of a plant; `speed` None: lockstep."""

    plant: str
    measures: Mapping[str, str]
    accepts: Mapping[str, str]
    outcomes: Mapping[str, str | tuple[str, str]]
    description: Mapping[str, float | str]
    job: Mapping[str, object]
    tick: float  # s
    ranges: Mapping[str, tuple[float, float]]  # of commands
    speed: float | None
    timeout: float  # of the machine's watchdog, s; 0: not known
    own: bool  # its own control commands it
    changes: bool  # each part leaves it changed (``after``)
    safe: Mapping[str, float] = field(default_factory=dict)  # its own safe command; empty: not told

    def to_json(self) -> str:
        """Return JSON that `from_json` reads."""
        return json.dumps({**asdict(self), "version": VERSION, "job": _written(self.job)})

    @classmethod
    def from_json(cls, text: str) -> "Declaration":
        """Read the JSON of `to_json`."""
        told = json.loads(text)
        if told.pop("version") != VERSION:
            raise ValueError(f"the server must be of this version of hwsim, {VERSION}")
        told["job"] = {name: stored.decode(value) for name, value in told["job"].items()}
        told["outcomes"] = {name: _pair(unit) for name, unit in told["outcomes"].items()}
        told["ranges"] = {name: _pair(ends) for name, ends in told["ranges"].items()}
        return cls(**told)


def declared(plant: Plant, *, speed: float | None, timeout: float, own: bool) -> Declaration:
    """Collect the declarations of a plant."""
    return Declaration(
        class_name(plant),
        dict(plant.measures),
        dict(plant.accepts),
        dict(getattr(plant, "outcomes", {})),
        dict(getattr(plant, "description", {})),
        dict(getattr(plant, "job", {})),
        plant.tick,
        dict(getattr(plant, "ranges", {})),
        speed,
        timeout,
        own,
        hasattr(plant, "after"),
        dict(getattr(plant, "safe", None) or {}),
    )


def _written(job: Mapping[str, object]) -> dict[str, str]:
    """Entries as texts; what has no text cannot be compared over a wire and is left out."""
    texts = {}
    for name, value in job.items():
        try:
            texts[name] = stored.encode(value)
        except TypeError:
            continue
    return texts


def _pair(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
