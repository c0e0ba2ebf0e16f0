"""What several files of this folder use."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest


@pytest.fixture(scope="session")
def processes():
    """Another process, begun anew: what it imports is imported once for all files of a worker."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        yield executor
