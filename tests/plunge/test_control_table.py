"""The cycle as an operator keys it in: the rates feed what the plan feeds, and the model bears them."""

import itertools
import re

import numpy as np
import pytest

from sdpgrind import plunge
from sdpgrind.plunge._plan.control_table import stages_of


@pytest.fixture(scope="module", params=["simulation", "experiment"])
def plan(request):
    return plunge.plan(plunge.preset(request.param))


def test_stages_join_and_feed_what_the_plan_feeds(plan):
    each, course = plan._stages.each, plan.trajectory
    assert each[0].begin == 0.0 and each[-1].end == pytest.approx(plan.time)
    assert each[0].stock_begin == pytest.approx(plan.problem.stock) and each[-1].stock_end < 1e-12
    for before, after in itertools.pairwise(each):
        assert (before.end, before.stock_end) == (after.begin, after.stock_begin)
    travel = sum(stage.rate * (stage.end - stage.begin) for stage in each)
    command, time = course.command_rate.values, course.time.values
    assert travel == pytest.approx(np.sum(0.5 * (command[1:] + command[:-1]) * np.diff(time)), rel=1e-4)
    assert travel == pytest.approx(each[-1].fed, rel=1e-4)
    assert each[0].rate == pytest.approx(plan.problem.command_rate_max) and each[-1].rate == 0.0


def test_the_model_bears_them(plan):
    assert plan._stages.excess <= 5e-4 and plan._stages.time == pytest.approx(plan.time, rel=5e-3)


def test_a_changing_rate_is_cut_finer_where_damage_goes_too_deep():
    plan = plunge.plan(plunge.preset("simulation"))
    given = plan.problem, plan.trajectory, plan.switches, plan.safety_margin
    coarse, fine = stages_of(*given, 5e-4), stages_of(*given, 4e-5)
    assert len(coarse.each) == 3 < len(fine.each) and fine.excess < coarse.excess
    assert fine.each[1].rate > fine.each[-2].rate > 0.0


def test_print_page_and_notebook_show_one_table(plan):
    heads = ("infeed rate [mm/s]", "infeed rate [mm/min]", "from stock [mm]", "to stock [mm]", "takes [s]")
    first = plan._stages.each[0]
    row = f"{first.rate:.5f}", f"{60 * first.rate:.3f}", f"{first.stock_begin:.4f}", f"{first.stock_end:.4f}"
    for text in (str(plan), plan.report(), plan._repr_html_()):
        assert all(head in text for head in heads) and "spark-out" in text
        assert re.search(r"\D+".join(map(re.escape, row)), text)
        assert f"(the plan {plan.time:.2f} s)" in text
