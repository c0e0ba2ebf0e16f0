"""A verb of a class, named as its result on an instance: `Surface.fit(points)`, `surface.fit.error`."""

from collections.abc import Callable
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

Given = ParamSpec("Given")
Made = TypeVar("Made")
Result = TypeVar("Result")


class ClassVerb(Generic[Given, Made, Result]):
    """Descriptor: of the class, a class method that makes an instance; of that instance, the `result`.

    The verb leaves its result by `leave`. It is no field: copies with other values have none, equality does
    not ask for it, and files do not hold it.
    """

    def __init__(
        self, function: Callable[Concatenate[Any, Given], Made], result: type[Result], missing: str
    ) -> None:
        self._function, self._missing = function, missing
        self.result = result
        self.__doc__ = function.__doc__

    @overload
    def __get__(self, instance: None, owner: type) -> Callable[Given, Made]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Result: ...
    def __get__(self, instance: object | None, owner: type) -> Any:
        if instance is None:
            return MethodType(self._function, owner)
        raise AttributeError(self._missing)  # an instance with a result has it in its `__dict__`


def leave(instance: Made, verb: str, result: object) -> Made:
    """Return `instance` with the result of its verb."""
    vars(instance)[verb] = result
    return instance
