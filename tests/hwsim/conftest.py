"""What several files of this folder use."""

from concurrent.futures import ProcessPoolExecutor

import pytest
from hwsim_forked import forked


@pytest.fixture(scope="session")
def processes():
    """Another process, which shares nothing with this one: forked from where commands are."""
    with ProcessPoolExecutor(1, mp_context=forked()) as executor:
        yield executor
