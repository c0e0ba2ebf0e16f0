"""Warnings that point at the user's own line."""

import sys
import warnings
from types import FrameType

_OURS = {"sdpgrind", "centering", "hwsim", "dataclasses"}
_IMPORT = "importlib._bootstrap"  # its frames are not counted by `warnings`, either


def warn(text: str, category: type[Warning] = UserWarning) -> None:
    """Give a warning at the first frame outside this library."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and (
        (name := _module(frame)) == _IMPORT or name.partition(".")[0] in _OURS
    ):
        level, frame = level + (name != _IMPORT), frame.f_back
    warnings.warn(text, category, stacklevel=level)


def _module(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", ""))
