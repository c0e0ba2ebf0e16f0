"""Functions called by name, so that a class need not import its pictures, pages and identification."""

from importlib import import_module
from typing import Any


def called(function: str, *given: Any, **options: Any) -> Any:
    """Return what the function named ``"package.module:function"`` gives."""
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)(*given, **options)
