"""Names of a profile's steps in version 0.1; they warn."""

from typing import Any

from sdpgrind.base.warned import warn


class FormerNames:
    """What was `spectrum`, `runout`, `remove_runout`."""

    def __getattr__(self, name: str) -> Any:
        if (new := _NEW.get(name)) is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        warn(f"Profile.{name} is now Profile.{new}", DeprecationWarning)
        return getattr(self, new)


_NEW = {"spectrum": "harmonics", "runout": "roller_error", "remove_runout": "remove_roller_error"}
