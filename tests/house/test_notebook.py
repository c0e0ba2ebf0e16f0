"""What notebooks show: valid tables of at most 30 rows, escaped, with units."""

import dataclasses

import html5lib
import numpy as np
import pytest
import xarray as xr

import centering
import hwsim
from sdpgrind import finishing, locus, plunge, sdp, weldbead
from sdpgrind.base import notebook
from sdpgrind.base.quantities import Described, custom, described, part, quantity, text
from sdpgrind.identify import Estimate

BAD = "<script>alert('x')</script> & \"y\""


def rows(html):
    """Texts of the cells, row by row; a fault of the page is raised."""
    parser = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False)
    tree = parser.parse("<!DOCTYPE html><title>t</title>" + html)
    assert not tree.findall(".//script")
    return [["".join(cell.itertext()) for cell in row] for row in tree.iter("tr")]


@described()
class Inner(Described):
    """A part."""

    speed: float = quantity("mm/s", above=0)


@described()
class Outer(Described):
    """A problem."""

    name: str = text()
    inner: Inner = part(Inner)
    ratio: float = quantity("1", default=0.5)
    curve: object = custom(default=None)


def test_fields_of_parts_units_and_defaults_are_shown():
    assert rows(Outer("a", Inner(3.0))._repr_html_()) == [
        ["field", "value", "unit"],
        ["name", "'a'", ""],
        ["inner.speed", "3", "mm/s"],
        ["ratio", "0.5", ""],
        ["curve", "None", ""],
    ]


def test_names_and_values_are_escaped():
    assert rows(Outer(BAD, Inner(1.0))._repr_html_())[1][1] == repr(BAD)
    assert rows(notebook.table(BAD, [BAD], [[BAD]])) == [[BAD], [BAD]]
    assert rows(Estimate((BAD,), [1.0], [[4.0]], message=BAD, units=(BAD,))._repr_html_())[1][0] == BAD
    dataset = xr.Dataset({BAD: ("row", [1.0, 2.0], {"units": BAD})})
    assert rows(notebook.columns(BAD, dataset))[1][:2] == [BAD, BAD]


@pytest.mark.parametrize("count", [0, 1, 29, 30, 31, 500])
def test_a_table_has_at_most_thirty_rows(count):
    head, *body = rows(notebook.table("t", ["number", "twice"], [[str(k), str(2 * k)] for k in range(count)]))
    assert head == ["number", "twice"] and len(body) == min(count, 30)
    if count > 30:
        assert body[-1] == [f"… {count - 29} more", ""] and body[-2] == ["28", "56"]


def test_columns_have_their_least_median_and_greatest():
    dataset = xr.Dataset(
        {
            "size": ("row", [0.25, np.nan, 0.75, 0.5], {"units": "mm"}),
            "mode": ("row", list("abcd")),
            "none": ("row", np.full(4, np.nan), {"units": "N"}),
        }
    )
    assert rows(notebook.columns("log", dataset))[1:] == [
        ["size", "mm", "4", "0.25", "0.5", "0.75"],
        ["mode", "", "4", "", "", ""],
        ["none", "N", "4", "", "", ""],
    ]


def test_an_estimate_has_its_interval():
    shown = Estimate(
        ("time_constant", "ratio"), [1.5, 0.3], np.diag([0.01, 0.0]), units=("s", "1"), freedom=10.0
    )
    head, first, second = rows(shown._repr_html_())
    low, high = shown.interval()[0]
    assert head[-1] == "unit" and first == ["time_constant", "1.5", "0.1", f"{low:.6g} to {high:.6g}", "s"]
    assert second[3:] == ["0.3 to 0.3", ""]


PROBLEMS = {
    "weld bead": weldbead.preset("P1"),
    "plunge": plunge.preset("simulation"),
    "locus": locus.preset("koren-example"),
    "finishing": finishing.preset("specimen"),
    "centering": centering.preset("printed"),
    "solver": weldbead.sequence.sdp_problem(weldbead.preset("P1"), 11),
}


@pytest.mark.parametrize("area", PROBLEMS)
def test_problems_are_shown(area):
    head, *body = rows(PROBLEMS[area]._repr_html_())
    assert 3 <= len(body) <= 30 and all(len(row) == len(head) for row in body)


def test_a_plan_and_a_log_are_shown():
    problem = PROBLEMS["plunge"]
    best = plunge.plan(problem)
    log = hwsim.run(hwsim.PlungeGrinder(problem, noise=None), plunge.CycleController(problem), parts=2)
    found = {row[0]: row for row in rows(log._repr_html_())}
    assert found["time"][1] == "s" and float(found["time"][5]) == pytest.approx(12.0, abs=0.1)
    planned = {row[0]: row for row in rows(best._repr_html_())}
    assert planned["time [s]"][1].startswith("12.0195 ± ") and planned["1 full rate"][2] == "2.688"


def test_every_problem_and_plan_has_a_table():
    from sdpgrind.base.plans import Plan

    def below(cls):
        return {cls, *(each for sub in cls.__subclasses__() for each in below(sub))}

    assert all("_repr_html_" in dir(cls) for cls in below(Plan) | {type(each) for each in PROBLEMS.values()})
    assert dataclasses.is_dataclass(sdp.Problem) and "_repr_html_" in dir(hwsim.Log)
