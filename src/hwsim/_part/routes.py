"""Routes between tiers: a command that the plant does not accept is a set-point of a lower tier."""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MethodType
from typing import Any

from hwsim._part.motions import is_of_rows
from hwsim.protocols import Controller, Plant


@dataclass(frozen=True)
class Route:
    """Set-points (name -> unit) that a tier sends to lower tiers, and takes from higher ones."""

    sends: Mapping[str, str]
    takes: Mapping[str, str]


def controllers(controller: Controller) -> dict[str, Controller]:
    """Name -> controller of one part; the first has priority."""
    tiers = getattr(controller, "tiers", None)
    return dict(tiers) if tiers is not None else {getattr(controller, "tier", "controller"): controller}


def reads_of(controller: Any) -> Mapping[str, str | None]:
    """Measurements that a controller reads: name -> unit, None: undeclared."""
    said: Mapping[str, str] = getattr(controller, "reads", {})
    return dict.fromkeys(_needed(controller)) | dict(said)


def commands_of(controller: Any) -> Mapping[str, str]:
    """Commands that a controller declares: name -> unit."""
    return dict(getattr(controller, "commands", {}))


def routes(plant: Plant, tiers: Mapping[str, Controller]) -> dict[str, Route]:
    """Find the set-points between the tiers of one part."""
    each = list(tiers.values())
    return {name: Route(_sent(plant, each, k), _taken(plant, each, k)) for k, name in enumerate(tiers)}


def set_points(plant: Plant, controller: Controller) -> dict[str, str]:
    """All set-points of one part: name -> unit."""
    sent: dict[str, str] = {}
    for route in routes(plant, controllers(controller)).values():
        sent |= route.sends
    return sent


def ambiguous(plant: Plant, tiers: Mapping[str, Controller]) -> Iterator[str]:
    """Faults: a set-point of two tiers, one that is also measured, a colon in the name of a tier."""
    senders: dict[str, str] = {}
    for tier, route in routes(plant, tiers).items():
        if is_of_rows(tier):
            yield f"tier {tier!r} must have a name without a colon"
        for name in route.sends:
            if name in senders:
                yield f"set-point {name} is commanded by {senders[name]} and by {tier}; one tier must"
            elif name in plant.measures:
                yield (
                    f"set-point {name} commanded by {tier} is also measured by the plant; "
                    "it needs a name of its own"
                )
            senders.setdefault(name, tier)


def _sent(plant: Plant, tiers: Sequence[Controller], k: int) -> dict[str, str]:
    below = {name for tier in tiers[k + 1 :] for name in reads_of(tier)}
    return {
        name: unit
        for name, unit in commands_of(tiers[k]).items()
        if name not in plant.accepts and name in below
    }


def _taken(plant: Plant, tiers: Sequence[Controller], k: int) -> dict[str, str]:
    above: dict[str, str] = {}
    for tier in tiers[:k]:
        above |= commands_of(tier)
    return {name: above[name] for name in reads_of(tiers[k]) if name in above and name not in plant.accepts}


def _needed(controller: Any) -> list[str]:
    """Required arguments of `step`."""
    step = getattr(controller, "step", None)
    if isinstance(step, MethodType):
        return _required_of_method(step.__func__)
    return _required(step) if callable(step) else []


@lru_cache(maxsize=64)  # each part has a copy of its controller, of the same function
def _required_of_method(function: Callable[..., Any]) -> list[str]:
    return _required(MethodType(function, object()))


def _required(step: Callable[..., Any]) -> list[str]:
    parameters = inspect.signature(step).parameters.values()
    named = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
    return [p.name for p in parameters if p.default is p.empty and p.kind in named]
