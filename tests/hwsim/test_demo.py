"""``hwsim demo``: the whole way, in a folder."""

import contextlib
import io
from pathlib import Path

import html5lib
import pytest

import sdpgrind
from hwsim.cli import main
from hwsim.command._demo.command import BORE

SAMPLE = Path(__file__).parents[1] / "data/samples/plunge_brackets.csv"


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "here"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLBACKEND", "agg")
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            assert main(["demo", "--out", str(out)]) == 0
    return out, said.getvalue()


def test_it_ends_with_what_it_found(shown):
    out, text = shown
    last = text.splitlines()[-8:]
    assert last[0].startswith("file     bore.csv: 245 readings")
    assert "time constant 1.403 s" in last[1] and "believed 1.933 s" in last[1]
    run = sdpgrind.load(out / "run.nc").outcome
    assert (
        f"{run.time.values.mean():.2f} s on average" in last[3]
        and "none burned, none out of round" in last[3]
    )
    assert not run.burned.values.any() and not run.out_of_round.values.any()
    plan = sdpgrind.load(out / "cycle.nc")
    assert f"plan     {plan.time:.2f} s a part" in last[2]
    why = "reads the size alone, and sharpness and deflection stay known to 0.1 and 0.1 of their value"
    assert why in (out / "report.html").read_text(encoding="utf-8")  # of the time beyond the plan


def test_the_readme_shows_its_last_lines(shown):
    out, text = shown
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    assert text[text.index("file     bore.csv") :].replace(str(out), "demo").strip() in readme


def test_everything_it_names_is_there_and_whole(shown, capsys):
    out, text = shown
    names = text.split("\nkept in ")[1].splitlines()[0].split(": ")[1].split(", ")
    assert sorted(names) == sorted(path.name for path in out.iterdir())
    for page in "plan.html", "report.html":
        html5lib.HTMLParser(strict=True).parse((out / page).read_text(encoding="utf-8"))
        assert main(["verify", str(out / page)]) == 0
    assert (out / BORE.name).read_bytes() == BORE.read_bytes()


def test_its_file_is_the_sample(shown):
    assert BORE.read_bytes() == SAMPLE.read_bytes()


def test_a_file_in_the_way_is_refused(tmp_path, capsys):
    (tmp_path / "here").touch()
    assert main(["demo", "--out", str(tmp_path / "here")]) == 2
    assert "--out must be a folder" in capsys.readouterr().err
