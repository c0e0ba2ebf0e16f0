"""``hwsim finishing`` searches where the work lies."""

from cli_fakes import only_news, without_news

import sdpgrind
from hwsim.cli import main

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
    assert only_news(capsys.readouterr().err)
    problem = sdpgrind.load(tmp_path / "out" / "motion.nc").problem
    assert problem.placement[:3] == (650.0, -25.0, 100.0) and len(problem.placement) == 4
    for change, told in {
        'placement = "serch"': "tool.placement must be one of search; got 'serch'",
        "placement_box = [[0, 0, 0], [1, 1, 1]]": 'tool.placement_box must be left out unless placement = "search"',
        'placement = "search"\nplacement_box = [[9000, 0, 0], [9001, 0, 0]]': "searched: Placement(there is none: reach",
        'placement = "search"\nplacement_box = [[0, 0, 0]]': "box must be two corners, (2, 3) (mm); got (1, 3)",
    }.items():
        job.write_text(JOB.replace('placement = "search"', change))
        assert main(["finishing", str(job), "--program", "csv", "--out", str(tmp_path / "other")]) == 2
        assert told in without_news(capsys.readouterr().err)
