"""For every test: one thread of linear algebra, as in the library's own work, since two wait for each other.

Kernels that compile longest are compiled before the first test. No example of a property has a deadline: the
first one may compile.
"""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("sdpgrind", deadline=None)
settings.load_profile("sdpgrind")

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before numpy is loaded; programs that tests start inherit it


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Trace a locus where its kernels are not on disk yet: that takes the better part of a minute, once."""
    import sdpgrind

    kept = (
        Path(sdpgrind.__file__)
        .with_name("locus")
        .joinpath("_trace", "__pycache__")
        .glob("*trace_kernels.follow*.nbc")
    )
    if not any(kept):
        sdpgrind.warm("locus")
