"""What an area tells of its presets."""

from typing import NamedTuple


class PresetInfo(NamedTuple):
    """What `presets` tells of a preset (mm, s, N, W): name, content, where its numbers come from, which were chosen here."""

    name: str
    about: str
    source: str
    calibrated: str
