"""Names of a problem's fields in version 0.1.0: `arm`, now `robot`, and `wrist_radius`, now the arm's."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import wraps
from typing import Any, TypeVar

from sdpgrind.base import checks
from sdpgrind.base.warned import warn
from sdpgrind.finishing.arm._arm import Arm

Made = TypeVar("Made")
_FORMER = ("arm", "wrist_radius")


def takes_former_fields(cls: type[Made]) -> type[Made]:
    """Let the constructor of a class take the former names, with a warning."""
    made: Callable[..., None] = vars(cls)["__init__"]

    @wraps(made)
    def begin(self: Any, *args: Any, **given: Any) -> None:
        made(self, *args, **current(given))

    type.__setattr__(cls, "__init__", begin)
    return cls


def current(given: Mapping[str, Any], robot: Any = None, *, quiet: bool = False) -> dict[str, Any]:
    """Return fields by their names of today; `robot`: that of the wrist radius. Default: a generic arm."""
    out = dict(given)
    for name in () if quiet else _FORMER:
        if name in out:
            meant = "robot" if name == "arm" else "robot=arm.replace(wrist_radius=...)"
            warn(f"FinishingProblem({name}=) is now {meant}", DeprecationWarning)
    if "arm" in out:
        if "robot" in out:
            raise ValueError("robot must be given once; got arm= as well")
        out["robot"] = out.pop("arm")
    if "wrist_radius" in out:
        held = out.get("robot", robot if robot is not None else Arm.generic())
        kept = checks.kind("robot", held, Arm, " where wrist_radius is given")
        out["robot"] = kept.replace(wrist_radius=out.pop("wrist_radius"))
    return out


def former(problem: Any) -> list[tuple[str, Any]]:
    """Return fields and values as version 0.1.0 had them: an arm, and its wrist radius after the diameter."""
    found = []
    for field in fields(problem):
        name = field.name
        if name in problem._younger and getattr(problem, name) == field.default:
            continue
        found.append(("arm" if name == "robot" else name, getattr(problem, name)))
        if name == "tool_diameter" and isinstance(problem.robot, Arm):
            found.append(("wrist_radius", problem.robot.wrist_radius))
    return found
