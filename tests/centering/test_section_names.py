"""Names of sections: those of a file's column or of the files are kept, saved and shown on the page."""

import numpy as np
import pytest

import sdpgrind
from centering.roundness import Profile, Sections

ANGLE = np.arange(0.0, 360.0, 2.0)


def table(words):
    """Three sections of a shaft whose words do not stand in the order of the heights."""
    rows = {"angle (deg)": np.tile(ANGLE, 3), "z (mm)": np.repeat([10.0, 0.0, 5.0], ANGLE.size)}
    return rows | {"dev (um)": np.tile(np.cos(np.radians(3 * ANGLE)), 3), "nr": np.repeat(words, ANGLE.size)}


@pytest.mark.parametrize("words", [["collar", "seat", "groove"], [3, 1, 2]])
def test_words_of_the_column_are_kept_saved_and_shown(tmp_path, words):
    columns = {"angle": "angle", "deviation": "dev", "height": "z", "radius": 25.0}
    shaft = Sections.read(table(words), section="nr", **columns)
    names = tuple(map(str, (words[1], words[2], words[0])))
    assert shaft.names == names and shaft.heights.tolist() == [0.0, 5.0, 10.0]
    shaft.save(tmp_path / "shaft.nc")
    assert (
        sdpgrind.load(tmp_path / "shaft.nc") == shaft and sdpgrind.load(tmp_path / "shaft.nc").names == names
    )
    rows = [line.split()[:2] for line in shaft.report().splitlines()]
    assert all([name, f"{height:g}"] in rows for name, height in zip(names, shaft.heights, strict=True))
    filtered = Sections([each.filter(upr=15) for each in shaft.profiles], shaft.heights, shaft.names)
    assert f"section {names[1]}, height 5 mm, step: Gaussian" in filtered.report()
    assert Sections.read(table(words), **columns).names == ()
    assert Sections.from_points([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0], [9.0] * 4).names == ()


def test_sections_of_files_have_their_names(tmp_path):
    profiles = []
    for name in ("top.csv", "middle.csv", "bottom.csv"):
        rows = [f"{angle:g};{np.cos(np.radians(3 * angle)):.4f}" for angle in ANGLE]
        (tmp_path / name).write_text("\n".join(["phi (deg);dev (um)", *rows]))
        profiles.append(Profile.read(tmp_path / name, angle="phi", deviation="dev", radius=25.0))
    shaft = Sections(profiles, [20.0, 10.0, 0.0])
    assert shaft.names == ("top.csv", "middle.csv", "bottom.csv") and "middle.csv" in shaft.report()
    assert Sections([each.filter(upr=15) for each in profiles], [20.0, 10.0, 0.0]).names == shaft.names
    assert Sections(profiles[:1] * 3, [20.0, 10.0, 0.0]).names == ()


def test_what_is_refused():
    ring = Profile(25.0 + 1e-3 * np.cos(3 * np.radians(ANGLE)))
    with pytest.raises(ValueError, match="names must be one for each of 3 profiles; got 2"):
        Sections([ring] * 3, [0.0, 1.0, 2.0], ["a", "b"])
    with pytest.raises(TypeError, match="names must be a text for each of the profiles; got 'abc'"):
        Sections([ring] * 3, [0.0, 1.0, 2.0], "abc")
