"""Optional packages, imported at their use, with an error that says what to install."""

from importlib import import_module
from types import ModuleType


def need(module: str, extra: str) -> ModuleType:
    """Import `module`; when it is missing, name the extra that installs it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(f"{module} is not installed: pip install 'sdpgrind[{extra}]'") from error
