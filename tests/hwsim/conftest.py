"""What several files of this folder use."""

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest
from hwsim_forked import forked


@pytest.fixture(scope="session")
def processes():
    """Another process, which shares nothing with this one: forked from where commands are."""
    with ProcessPoolExecutor(1, mp_context=forked()) as executor:
        yield executor


def _empty(figure):
    """Let a figure become an empty file."""
    figure.savefig = lambda path, **options: Path(path).touch()


@pytest.fixture(scope="module")
def sketched(sketched):
    """Pictures of pages as empty frames, and those of a folder as empty files: test_areas draws such."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hwsim.command._run_folder.pictures", SimpleNamespace(lay_out=_empty))
        yield
