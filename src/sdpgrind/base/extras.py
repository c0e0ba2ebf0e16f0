"""Optional packages, imported where they are used, with an error that says what to install."""

from importlib import import_module
from types import ModuleType


def need(module: str, extra: str) -> ModuleType:
    """Import `module`; where it is missing, say which extra of this package brings it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(f"{module} is not installed: pip install 'sdpgrind[{extra}]'") from error
