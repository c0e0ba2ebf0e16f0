"""``hwsim finishing`` searches where the work lies, and says where and what that is worth."""

import math
import re

import numpy as np
import pytest
from cli_fakes import only_news, without_news

import sdpgrind
from hwsim.cli import main
from hwsim.command._finishing.report import placement_lines
from hwsim.command._finishing.toml import read
from sdpgrind import finishing

pytestmark = pytest.mark.usefixtures("sketched")
JOB = """
method = "trapezoid"
[surface]
shape = "nominal"
[path]
pattern = "hilbert"
order = 1
[robot]
preset = "ur10"
tool_length = "150 mm"
[tool]
placement = "search"
"""


def test_a_placement_is_searched(capsys, tmp_path):
    """In a box, where one is given; then the program is that of the problem placed there."""
    job = tmp_path / "job.toml"
    job.write_text(f"{JOB}placement_box = [[650, -25, 100], [650, -25, 100]]\n")
    assert main(["finishing", str(job), "--program", "csv", "--out", str(tmp_path / "out")]) == 0
    out, error = capsys.readouterr()
    assert only_news(error) and "0 parts" not in error and "compiling, once" not in error
    problem = sdpgrind.load(tmp_path / "out" / "motion.nc").problem
    assert problem.placement[:3] == (650.0, -25.0, 100.0) and len(problem.placement) == 4
    told = re.search(
        r"placed at \(650, -25, 100\) mm, turned by (\S+) deg, azimuth of the tool (\S+) deg; ", out
    )
    turn, azimuth = (math.radians(float(each)) for each in told.groups())
    assert (turn, azimuth) == pytest.approx((problem.placement[3], problem.azimuth), abs=0.01)
    for change, told in {
        'placement = "serch"': "tool.placement must be one of search; got 'serch'",
        "placement_box = [[0, 0, 0], [1, 1, 1]]": 'tool.placement_box must be left out unless placement = "search"',
        'placement = "search"\nplacement_box = [[9000, 0, 0], [9001, 0, 0]]': "searched: Placement(there is none: reach",
        'placement = "search"\nplacement_box = [[0, 0, 0]]': "box must be two corners, (2, 3) (mm); got (1, 3)",
    }.items():
        job.write_text(JOB.replace('placement = "search"', change))
        assert main(["finishing", str(job), "--program", "csv", "--out", str(tmp_path / "other")]) == 2
        assert told in without_news(capsys.readouterr().err)


@pytest.mark.parametrize(
    ("program", "arguments", "told"),
    [
        ('deviation = "20 mm"', "rapid", "[program] deviation must be some 0.02 mm; got '20 mm'"),
        ('name = "end"', "krl", "[program] name must be a letter, then letters, digits and _, at most 24"),
        ("timing = true", "rapid", "[program] timing must be False for rapid"),
        ("", "rapid --parts 2", "--parts must be left out with --program, which finishes none; got 2"),
        ("", "rapid --study", "--program must be left out with --study; got rapid"),
    ],
)
def test_a_wrong_program_is_refused_before_a_search(program, arguments, told, capsys, monkeypatch, tmp_path):
    """Of the job's options the file is named."""
    monkeypatch.setattr(finishing, "place", lambda *given, **options: pytest.fail("searched"))
    job = tmp_path / "job.toml"
    job.write_text(f"{JOB}[program]\n{program}\n")
    named = f"{job}: {told}" if program else told
    given = ["--out", str(tmp_path / "out"), "--program", *arguments.split()]
    assert main(["finishing", str(job), *given]) == 2
    error = without_news(capsys.readouterr().err)
    assert error.startswith(f"hwsim: {named}") and "units." not in error


def test_a_given_placement_is_told_as_it_is(tmp_path):
    """With what it is worth, found again from the motion; nothing of a table's own place."""
    job = tmp_path / "job.toml"
    job.write_text(JOB.replace('"search"', "[650, -25, 100]"))
    problem = read(job).problem
    (line,) = placement_lines(problem)
    motion = finishing.plan(problem)
    low, high = (np.array(end) for end in (problem.robot.position_min, problem.robot.position_max))
    share = np.minimum(motion.joints - low, high - motion.joints) / (high - low)
    margin = min(float(share.min()), motion.worst_singularity.distance)
    assert line.startswith(
        "placed at (650, -25, 100) mm, azimuth of the tool 0 deg; least margin over the path "
    )
    assert float(re.search(r"path (\S+) %", line)[1]) == pytest.approx(100 * margin, rel=0.05)
    assert list(placement_lines(finishing.preset("nominal"))) == []
