"""The cycle as an operator keys it in: replayed as printed, switched by the stock, it keeps all limits."""

import itertools
import re

import pytest
from plunge_inside import DeflectionLaw, Safety, burn_depth, core_at, rate, stages_of

from sdpgrind import plunge

SIMULATION = plunge.preset("simulation")
PLANS = {
    "simulation": lambda: plunge.plan(SIMULATION),
    "experiment": lambda: plunge.plan(plunge.preset("experiment")),
    "margin": lambda: plunge.plan(SIMULATION, safety_margin=0.005),
    "very round": lambda: plunge.plan(SIMULATION.replace(roundness_max=0.0017)),
    "linear": lambda: plunge.plan(SIMULATION.replace(linear_time_constant=1.9)),
    "wear": lambda: plunge.plan(SIMULATION.replace(wear=plunge.Wear(0.02)), method="dp"),
    "doubts": lambda: plunge.plan(SIMULATION.replace(burning_sd=0.03), confidence=0.999),
}


@pytest.fixture(scope="module", params=PLANS)
def plan(request):
    return PLANS[request.param]()


def printed(plan):
    """Rates (mm/s) and the stock (mm) at which each ends, as the table shows them."""
    table = plan._control_table()[0]
    cells = {amounts.name: amounts.values for amounts in table.amounts}
    rates = [float(cell) / 60 for cell in cells["infeed rate [mm/min]"]]
    return rates, [float(cell) for cell in cells["to stock [mm]"]]


def test_no_stage_of_no_stock_and_a_rising_rate_is_told():
    """Without a gauge the safe rate is constant below some stock, with a kink where it begins to be."""
    doubted = SIMULATION.replace(burning_sd=0.02, sharpness_sd=0.03, contact_zero_sd=0.003)
    table, told = plunge.plan(doubted, confidence=0.999, gauge=False)._control_table()
    cells = {amounts.name: amounts.values for amounts in table.amounts}
    assert "0.00" not in cells["takes [s]"]
    assert all(a > b for a, b in zip(cells["from stock [mm]"], cells["to stock [mm]"], strict=True))
    rates = [float(cell) for cell in cells["infeed rate [mm/min]"]]
    (k,) = [k for k in range(1, len(rates)) if rates[k] > rates[k - 1]]
    assert any(sentence.startswith(f"Stage {k + 1} feeds faster than stage {k}") for sentence in told.lines)
    assert not any("feeds faster" in s for s in plunge.plan(SIMULATION)._control_table()[1].lines)


def test_stages_join(plan):
    each = plan._stages.each
    assert each[0].begin == 0.0 and each[-1].stock_end == 0.0
    assert each[0].stock_begin == pytest.approx(plan.problem.stock)
    for before, after in itertools.pairwise(each):
        assert (before.end, before.stock_end) == (after.begin, after.stock_begin)


def test_the_printed_table_by_an_integrator_of_its_own(plan):
    """Euler's rule, 0.5 ms: time, damage within its limit, roundness of the part."""
    problem, now, y, left = plan.problem, 0.0, 0.0, plan.problem.stock
    model, most, h, deepest = problem.model, problem.command_rate_max, 5e-4, 0.0
    growth = 0.0 if model.wear is None else model.wear.growth
    for command, end in zip(*printed(plan), strict=True):
        while left > end and now < 40.0:
            core = core_at(model, area=model.wear_flat_area + growth * (problem.stock - left))
            v = rate(y, DeflectionLaw(core.K1, core.K2, core.p))
            if v > 2.0 * model.burn_onset[0] and plan.confidence is None:
                deepest = max(deepest, float(burn_depth(v, core)) - max(left - plan.safety_margin, 0.0))
            y, left, now = y + h * (command - v), left - h * v, now + h
    assert left < 1e-6 and now + model.core.K0 / most == pytest.approx(plan._stages.time, rel=2e-3)
    assert deepest < 5e-5 and float(model.roundness(v)) < problem.roundness_max + 1e-5
    assert plan._kept(plan._stages) == "all limits are kept"


def test_it_costs_little(plan):
    assert plan._stages.time < 1.03 * plan.time


def test_a_changing_rate_is_cut_finer_where_damage_goes_too_deep():
    plan = plunge.plan(SIMULATION)
    given = plan.problem, plan.trajectory, plan.switches, Safety()
    coarse, fine = stages_of(*given, 5e-4), stages_of(*given, 4e-6)
    assert len(coarse.each) < len(fine.each) and fine.excess < coarse.excess
    assert fine.each[1].rate > fine.each[-2].rate > 0.0


def test_a_chosen_rotation_is_shown():
    turned = plunge.plan(SIMULATION, method="collocation", work_rotation_range=(10.0, 60.0), steps=40)
    assert "work [rev/min]" in str(turned) and re.search(r"\b573\.0\b", str(turned))
    assert "work [rev/min]" not in str(plunge.plan(SIMULATION))


def test_print_page_and_notebook_show_one_table(plan):
    heads = ("infeed rate [mm/s]", "infeed rate [mm/min]", "from stock [mm]", "to stock [mm]", "takes [s]")
    first = plan._stages.each[0]
    row = f"{first.rate:.5f}", f"{60 * first.rate:.3f}", f"{first.stock_begin:.4f}", f"{first.stock_end:.4f}"
    for text in (str(plan), plan.report(), plan._repr_html_()):
        assert all(head in text for head in heads) and "spark-out" in text
        assert re.search(r"\D+".join(map(re.escape, row)), text)
        assert f"(the plan {plan.time:.2f} s)" in text
