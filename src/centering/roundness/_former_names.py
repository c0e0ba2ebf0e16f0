"""Names of a profile's steps and of a circle's spread in version 0.1; they warn."""

from functools import cached_property
from typing import Any

from centering.roundness._sensitivity import NoiseEffect, noise_effect
from sdpgrind.base.checks import Floats
from sdpgrind.base.warned import warn


class FormerNames:
    """What was `spectrum`, `runout`, `remove_runout`."""

    def __getattr__(self, name: str) -> Any:
        if (new := _NEW.get(name)) is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        warn(f"Profile.{name} is now Profile.{new}", DeprecationWarning)
        return getattr(self, new)


_NEW = {"spectrum": "harmonics", "runout": "roller_error", "remove_runout": "remove_roller_error"}


class FormerSpread:
    """`value_sd` and `value_bias` of a circle, which are `interval` now."""

    kind: str
    points: Floats
    center: Floats
    noise_sd: Floats
    noise_upr: Floats

    @property
    def value_sd(self) -> float | None:
        """Deprecated: standard deviation of `value`, mm; `interval` says what it leaves out."""
        warn("Roundness.value_sd is deprecated: interval() holds the truth", DeprecationWarning)
        return None if self._noise_effect is None else self._noise_effect.sd

    @property
    def value_bias(self) -> float | None:
        """Deprecated: increase of `value` by noise, about, mm; `interval` takes it off."""
        warn("Roundness.value_bias is deprecated: interval() takes it off", DeprecationWarning)
        return None if self._noise_effect is None else self._noise_effect.bias

    @cached_property
    def _noise_effect(self) -> NoiseEffect | None:
        """Effect of noise on the value."""
        if not self.noise_sd.size:
            return None
        return noise_effect(self.kind, self.points - self.center, self.noise_sd, self.noise_upr)
