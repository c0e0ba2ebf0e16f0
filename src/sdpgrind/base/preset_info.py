"""Description of a preset: content, source of its numbers, those chosen here."""

from typing import NamedTuple


class PresetInfo(NamedTuple):
    """Description of a preset (mm, s, N, W): name, content, source of its numbers, and those chosen here."""

    name: str
    about: str
    source: str
    calibrated: str
