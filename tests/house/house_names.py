"""Everything public: packages, what they export, and the public methods and properties of exported classes."""

import importlib
import inspect
from enum import Enum
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
PACKAGES = (
    "sdpgrind",
    "sdpgrind.codegen",
    "sdpgrind.control",
    "sdpgrind.finishing",
    "sdpgrind.finishing.arm",
    "sdpgrind.finishing.path",
    "sdpgrind.finishing.placement",
    "sdpgrind.finishing.roughness",
    "sdpgrind.finishing.study",
    "sdpgrind.finishing.surface",
    "sdpgrind.finishing.timing",
    "sdpgrind.finishing.torque",
    "sdpgrind.identify",
    "sdpgrind.locus",
    "sdpgrind.locus.gains",
    "sdpgrind.locus.processes",
    "sdpgrind.physics",
    "sdpgrind.plunge",
    "sdpgrind.plunge.learning",
    "sdpgrind.sdp",
    "sdpgrind.units",
    "sdpgrind.weldbead",
    "sdpgrind.weldbead.force",
    "sdpgrind.weldbead.passes",
    "sdpgrind.weldbead.sequence",
    "centering",
    "centering.circle",
    "centering.cycle",
    "centering.friction",
    "centering.monitoring",
    "centering.push",
    "centering.push.turning",
    "centering.roundness",
    "centering.setup",
    "hwsim",
    "hwsim.devices",
    "hwsim.faults",
    "hwsim.opcua",
    "hwsim.protocols",
)
"""Public packages. `test_every_public_package_is_here` keeps the list whole."""
MADE_HERE = (
    "Area", "Columns", "Distribution", "Locus", "Log", "Moments", "Motion", "Policy", "PresetInfo", "Risk", "Runs",
    "SequenceAction",
)  # fmt: skip
"""Results: made by the library, never by its users; their attributes are documented, not their constructors."""


class Public(NamedTuple):
    """One public name."""

    name: str
    thing: Any
    owner: type | None

    @property
    def doc(self) -> str:
        """Its docstring; a class method without one inherits it, as documentation shows it."""
        bound = isinstance(self.thing, classmethod) and self.owner is not None
        thing = getattr(self.owner, self.name.rpartition(".")[2]) if bound else _underlying(self.thing)
        return inspect.getdoc(thing) or ""

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters that a caller may give."""
        thing = _underlying(self.thing)
        if isinstance(self.thing, property | cached_property) or not callable(thing):
            return []
        if inspect.isclass(thing) and (
            getattr(thing, "_is_protocol", False) or issubclass(thing, str | Enum)
        ):
            return []
        if inspect.isclass(thing) and thing.__name__ in MADE_HERE:
            return []
        names = inspect.signature(thing).parameters
        skip = 1 if self.owner is not None and not isinstance(self.thing, staticmethod) else 0
        return [name for name in list(names)[skip:] if not name.startswith("_")]


@cache
def package(name: str) -> Any:
    """Import a package, or the module that is exported under a name (`sdpgrind.units`)."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        parent, _, last = name.rpartition(".")
        return getattr(importlib.import_module(parent), last)


@cache
def modules() -> tuple[str, ...]:
    """Every module of the source tree, private ones too, but not their tests or caches."""
    paths = sorted(path.relative_to(SOURCE) for path in SOURCE.rglob("*.py"))
    return tuple(".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in paths)


@cache
def everything() -> tuple[Public, ...]:
    """Every public name once."""
    found: dict[str, Public] = {}
    for where in PACKAGES:
        home = package(where)
        for name in home.__all__:
            thing = getattr(home, name)
            if inspect.ismodule(thing) or isinstance(thing, int | float | str):
                continue  # modules have a line of their own above; constants are documented where they stand
            found[f"{where}.{name}"] = Public(f"{where}.{name}", thing, None)
            if inspect.isclass(thing):
                found |= {each.name: each for each in _members(f"{where}.{name}", thing)}
    return tuple(found.values())


def _members(name: str, cls: type) -> list[Public]:
    out = []
    for base in cls.__mro__:
        if not base.__module__.startswith(("sdpgrind", "hwsim", "centering")):
            continue
        for key, thing in vars(base).items():
            ours = inspect.isfunction(thing) or isinstance(
                thing, property | cached_property | staticmethod | classmethod
            )
            if not key.startswith("_") and ours and all(each.name != f"{name}.{key}" for each in out):
                out.append(Public(f"{name}.{key}", thing, cls))
    return out


def _underlying(thing: Any) -> Any:
    if isinstance(thing, property):
        return thing.fget
    if isinstance(thing, cached_property):
        return thing.func
    return thing.__func__ if isinstance(thing, staticmethod | classmethod) else thing
