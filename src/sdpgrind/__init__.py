"""Planning and control of grinding, finishing and precision centering under uncertainty.

Physics and its uncertainty go in; a plan that can be looked at, saved and looked up in microseconds comes out; a
controller follows it on a machine, real or simulated; what was measured improves the physics.

Packages are imported when they are first used: `sdpgrind.weldbead`, `sdpgrind.plunge`, `sdpgrind.locus`,
`sdpgrind.finishing`, and what they stand on.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sdpgrind.base import units

if TYPE_CHECKING:
    from sdpgrind import control, finishing, identify, locus, physics, plunge, sdp, weldbead
    from sdpgrind.base.records import load

__version__ = "0.1.0"
__all__ = ["control", "finishing", "identify", "load", "locus", "physics", "plunge", "sdp", "units", "weldbead"]


def __getattr__(name: str) -> Any:
    if name == "load":  # records stand on xarray, which takes most of a second to import
        return import_module("sdpgrind.base.records").load
    if name in __all__:
        return import_module(f"sdpgrind.{name}")
    raise AttributeError(f"module 'sdpgrind' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
