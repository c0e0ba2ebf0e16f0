"""Copies of controllers: each has a state of its own, and shares plan, law and all else that never changes."""

from copy import copy, deepcopy
from typing import Any, ClassVar, Self


class Stateful:
    """Base of controllers; the loop copies them for parts that run side by side."""

    _changing: ClassVar[tuple[str, ...]] = ()
    """Attributes that change in a run and are no plain values; one that is made at first use may be missing."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = copy(self)
        for name in self._changing:
            if name in self.__dict__:
                twin.__dict__[name] = deepcopy(self.__dict__[name], memo)
        return twin
