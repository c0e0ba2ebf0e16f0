"""Copies of controllers: own state, shared plan and law."""

from copy import copy, deepcopy
from typing import Any, ClassVar, Self


class Stateful:
    """Base of controllers; the loop copies them for parallel parts."""

    _changing: ClassVar[tuple[str, ...]] = ()
    """Attributes to copy: mutable ones that change in a run; they may be missing."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = copy(self)
        for name in self._changing:
            if name in self.__dict__:
                twin.__dict__[name] = deepcopy(self.__dict__[name], memo)
        return twin
