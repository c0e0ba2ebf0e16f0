"""A warning that points at the user's own line, however many of ours lie between."""

import sys
import warnings

_OURS = {"sdpgrind", "centering", "hwsim", "dataclasses"}


def warn(text: str) -> None:
    """Give a UserWarning at the first line outwards that is in no module of ours: `replace` lies deeper than a call."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in _OURS:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, stacklevel=level)
