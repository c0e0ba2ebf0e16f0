"""Every kind of plan and record has a page, valid and whole, that says its figures."""

from functools import cache

import html5lib
import numpy as np
import pytest

import centering
from centering.monitoring import ControlChart, DriftTrack
from centering.setup import Changeover, Stock
from sdpgrind import finishing, locus, plunge, units, weldbead
from sdpgrind.base.sheets import seal
from sdpgrind.weldbead import passes


@cache
def policy():
    return weldbead.plan(weldbead.preset("P1"), tolerance=1e-2)


@cache
def bead_pass():
    process = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
    disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
    bead = passes.Contour([0, 75, 150], [1.0, 1.3, 1.0])
    return passes.plan(passes.PassProblem(disc, bead, mean_cut=0.2, feed_rate=20.0))


def changeover():
    stock = Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004)
    return Changeover(
        stock, finish_radius=35.0, gap=0.010, approach_rate=0.026, largest_radius=35.16, radius_sd=0.0005
    )


def chart():
    rng = np.random.default_rng(1)
    made = ControlChart({"roundness": 0.010 + 0.001 * rng.standard_normal(50)})
    made.update(roundness=0.0101)
    return made


def drift():
    track = DriftTrack({"stroke_offset": 0.002})
    for _ in range(5):
        track.update(stroke_offset=0.150)
    return track


def push():
    return centering.plan_push(
        centering.preset("printed"), offset=1.0, spindle_speed=units.rpm(20), push_speed=10.0, direction="end"
    )


def ring():
    angle = np.arange(4 * 360) * 2 * np.pi / 360
    noise = 1e-5 * np.random.default_rng(0).normal(size=angle.size)
    return centering.Profile(angle, 65.69 + 2e-4 * np.cos(3 * angle) + noise)


MADE = {
    "policy": (policy, "First pass with 60 s left"),
    "pass": (bead_pass, "burn margin"),
    "cycle": (lambda: plunge.plan(plunge.preset("simulation")), "12.0195 ± "),
    "curve": (lambda: locus.plan(locus.preset("grinding")), "Best points along the curve"),
    "motion": (lambda: finishing.plan(finishing.preset("nominal")), "mean feed rate"),
    "changeover": (changeover, "population position"),
    "chart": (chart, "Centering chart"),
    "drift": (drift, "Centering drift"),
    "push": (push, "lead angle"),
    "ring": (ring, "Largest undulations"),
}


@pytest.mark.filterwarnings("ignore::UserWarning")  # of plans that are coarse
@pytest.mark.parametrize("name", MADE)
def test_it_has_a_page(name, tmp_path):
    make, said = MADE[name]
    plan = make()
    plan.report(tmp_path / "plan.html")
    text = (tmp_path / "plan.html").read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert not seal.changes(text) and text.count("<svg") >= 1 and "left out" not in text
    assert said in text and said in plan.report() and len(text) < 1_500_000


def test_a_limit_is_accepted_rejected_or_not_decided():
    profile = ring()
    for limit, found in ((0.001, "accepted"), (0.00037, "rejected"), (0.00046, "not decided")):
        assert f"µm: {found}" in profile.report(limits={"RONt": limit}).splitlines()[5]
    with pytest.raises(ValueError, match="limits must be one of RONt"):
        profile.report(limits={"RONz": 0.001})
    with pytest.raises(ValueError, match=r"limits\['RONt'\] must be > 0 \(mm\)"):
        profile.report(limits={"RONt": 0.0})


def test_a_study_keeps_its_text_and_has_a_page(tmp_path):
    study = finishing.study.Study.published("wang-2001")
    assert study.report().startswith("roughness R_a: 18 runs")
    assert study.report(tmp_path / "study.html") == str(tmp_path / "study.html")
    assert "best levels: tool_diameter 4 mm, " in (tmp_path / "study.html").read_text("utf-8")
    text = (tmp_path / "study.html").read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert not seal.changes(text) and "Mean ratio at each level" in text


def test_a_notebook_shows_the_tables_of_the_page_and_no_internals():
    shown = policy()._repr_html_()
    html5lib.HTMLParser(strict=True).parse("<!DOCTYPE html><title>t</title>" + shown)
    assert "First pass with 60 s left" in shown and "normal force [N]" in shown
    assert not any(word in shown for word in ("line_start", "kink", "line_cost"))


def test_the_first_line_of_a_page_is_no_code():
    assert drift().report().splitlines()[3] == "stroke_offset over 5 parts: no alarm"
    assert chart().report().splitlines()[3] == "roundness over 1 part: in control"
    assert "overcut [mm^3] 0 exact" in " ".join(bead_pass().report().split())
