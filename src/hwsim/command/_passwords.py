"""Passwords of the command line: never an argument, which other users of the computer can see."""

import getpass
import os
import sys


def password_of(user: str) -> str:
    """Return the password of a user from the environment, or ask for it."""
    name = f"HWSIM_PASSWORD_{user.upper()}"
    if found := os.environ.get(name):
        return found
    if sys.stdin is None or not sys.stdin.isatty():
        raise ValueError(f"the password of {user} must be in the environment variable {name}")
    return getpass.getpass(f"password of {user}: ")


def known(user: str) -> bool:
    """Whether the environment has a password of a user."""
    return bool(os.environ.get(f"HWSIM_PASSWORD_{user.upper()}"))
