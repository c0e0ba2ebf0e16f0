"""Command ``hwsim`` before its imports, numpy the longest: a signal in between ends it silently."""

import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)


def main() -> int:
    """Import the command and carry it out."""
    from hwsim.cli import main as carried_out

    return carried_out()
