"""For every test: one thread of linear algebra, as in the library's own work; two of them wait for each
other.

And what takes longest to compile is compiled before the first test, which has no time for it.
"""

import os
from pathlib import Path

import pytest

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
