"""Length of the self-test's long run: short in files whose tests do not run it."""

import pytest

from sdpgrind.codegen._files import vectors

BLOCKS = vectors.BLOCKS


@pytest.fixture(scope="module")
def few_blocks():
    """Exports with 2 of the digests of the long run; whole ones are built and run by `test_export_files`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vectors, "BLOCKS", 2)
        yield


@pytest.fixture
def few_blocks_here(monkeypatch):
    """The same for one test of a file that runs the long run."""
    monkeypatch.setattr(vectors, "BLOCKS", 2)


@pytest.fixture
def all_blocks(few_blocks, monkeypatch):
    """The long run as users have it."""
    monkeypatch.setattr(vectors, "BLOCKS", BLOCKS)
