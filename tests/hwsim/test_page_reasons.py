"""Reasons on a page of a log: a mean is called a mean, the least value is that of the worst part."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from hwsim._report import centering, locus, plunge
from hwsim._report.charged import charges_of, meanings_of
from hwsim._report.log_page import _count
from hwsim._report.worst import mean_and_worst
from hwsim.command._weldbead import report as terminal
from sdpgrind.plunge import preset


def log_of(outcomes, controller=None, **more):
    parts = {name: ("part", np.asarray(values, dtype=float)) for name, values in outcomes.items()}
    outcome = xarray.Dataset({**parts, **more}, attrs={"stock": 0.3})
    made = None if controller is None else {"controller": controller}
    return SimpleNamespace(outcome=outcome, made_of=made)


class Parts(SimpleNamespace):
    def __len__(self):
        return self.outcome.sizes["part"]


def test_the_least_slack_of_a_page_is_that_of_the_worst_part():
    rates = {"true_infeed_rate": (("part", "t"), np.full((3, 2), 0.010))}
    rates |= {"best_infeed_rate": (("part", "t"), np.full((3, 2), 0.011))}
    values = {"slack": [1.2, 0.3234, 1.3], "convergence_time": [4.0, 5.0, 6.0], "timed_out": np.zeros(3)}
    told = locus.reasons(log_of(values, SimpleNamespace(margin=6.0), **rates), None)
    assert not any("at least" in each for each in told.values())
    assert told["slack"] == (
        "the least distance to burning was 0.941 W on average, 0.323 W in part 1, the worst, where 6 W were "
        "planned"
    )
    bare = locus.reasons(log_of(values, **rates), None)  # as of a log from a file
    assert "planned" not in bare["slack"] and bare["time"].endswith(bare["slack"])
    assert locus.planned(log_of(values, SimpleNamespace(margin=6.0), **rates), None)["slack"].value == 6.0
    assert "slack" not in locus.planned(log_of(values, SimpleNamespace(margin="designed"), **rates), None)


def test_a_part_that_was_broken_off_is_in_no_mean_of_a_locus_page():
    """Part 0 was broken off at once, part 1 never came to the best point."""
    rates = {"true_infeed_rate": (("part", "t"), np.array([[0.5] * 2, [0.010] * 2, [0.012] * 2]))}
    rates |= {"best_infeed_rate": (("part", "t"), np.full((3, 2), 0.011))}
    values = {"slack": [9.0, 1.0, 1.2], "convergence_time": [0.1, np.nan, 6.0], "timed_out": [1.0, 0.0, 0.0]}
    told = locus.reasons(log_of(values, **rates), None)["time"]
    assert (
        "reaches it after 6 s on average (part 2 after 6 s): mean infeed rate 11 µm/s, best 11 µm/s" in told
    )


def test_legs_of_a_centering_page_are_those_of_finished_parts():
    """Touches at 1 and 2 s, the end at 2.5 s; the other part was broken off after 9 s without a push."""
    table = xarray.Dataset(
        {
            "part": ("row", [0, 0, 0, 0, 1, 1]),
            "time": ("row", [0.0, 1.0, 1.5, 2.0, 0.0, 8.0]),
            "pushing": ("row", [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]),
        }
    )

    class Log(Parts):
        tiers = ("controller",)

        def __getitem__(self, tier):
            return table

    plane = np.zeros((2, 1))
    outcome = log_of(
        {"time": [2.5, 9.0], "offset": [1e-3, 3.0], "pushes": [2, 0], "timed_out": [0, 1]}
    ).outcome
    outcome = outcome.assign(
        center_x=(("part", "t"), plane + 1.0),
        center_y=(("part", "t"), plane),
        true_mu_kinetic=("part", [0.2, 0.9]),
    )
    outcome.attrs["plant"] = "CenteringMachine"
    runs = SimpleNamespace(pushes=np.full(400, 2), offset=np.full(400, 1e-3), last=np.full(400, 0.3))
    plan = SimpleNamespace(
        problem=SimpleNamespace(offset_max=5.0, model=SimpleNamespace(mu_kinetic=0.2)),
        finish=2e-3,
        simulate=lambda **more: runs,
        start_time=lambda offset: 0.9,
        cycle_time=lambda offset: 2.2,
    )
    told = centering.reasons(Log(outcome=outcome, made_of=None), plan)
    legs = "1.000 s up to the first push (planned 0.900), 1.000 s from push to push (1.000), 0.500 s after"
    assert told["time"].startswith(legs) and "friction" not in told["time"]
    assert told["offset"].startswith("0.0 % of the parts ended above 2 µm")
    plan.cycle_time = lambda offset: 2.2 if offset else 0.0
    outcome["center_x"][1] = 0.0
    promised = charges_of(Log(outcome=outcome, made_of=None), plan).planned["time"]
    assert promised.mean.value == 2.2


def test_the_slack_of_a_plunge_page_names_its_least():
    table = xarray.Dataset({"part": ("row", [0, 1]), "infeed_rate_planned": ("row", [0.002, 0.003])})

    class Log(SimpleNamespace):
        tiers = ("controller",)

        def __getitem__(self, tier):
            return table

        def __len__(self):
            return 2

    outcome = log_of({"part_slack": [0.0058, 0.0023], "time": [12.0, 13.0]}).outcome
    trajectory = SimpleNamespace(infeed_rate=[0.0026])
    plan = SimpleNamespace(safety_margin=0.0, trajectory=trajectory, problem=preset("simulation"))
    told = plunge.reasons(Log(outcome=outcome, made_of=None), plan)
    assert told["time"].endswith("and reads size and power with noise")
    assert "4.05 µm on average, 2.3 µm in part 1, the worst, where 0 µm were planned" in told["part_slack"]
    assert "2.5 µm/s on average by the controller" in told["roundness"]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ([np.nan, np.nan], "not known"),
        ([2.0], "2 W"),
        ([2.0, 2.0], "2 W in every part"),
        ([3.0, np.nan, 1.0], "2 W on average, 1 W in part 2, the worst"),
    ],
)
def test_mean_and_worst(values, told):
    assert mean_and_worst("slack", np.array(values), "W") == told


def test_ground_below_in_places_and_on_average_are_told_apart():
    """On the terminal and on the page: of three beads two are below somewhere, one as a whole."""
    below = {"height": [-0.001, 0.02, 0.03], "overground": [0.01, 0.002, 0.0], "overground_worst": [0.1] * 3}
    other = {name: [1.0, 1.0, 1.0] for name in ("penalty", "passes", "lateness", "time")}
    log = log_of(below | other)
    risk = SimpleNamespace(passes=1.0, overground=0.25)
    lines = {line[:24].strip(): line[24:].split() for line in terminal._summary(log.outcome, risk, None)}
    assert lines["mean overground (%)"][:2] == ["25.0", "33.3"]
    assert lines["overground in places (%)"][0] == "66.7"
    assert (
        _count(Parts(outcome=log.outcome), "overground", burns=True) == "2 of 3 (on average over the bead: 1)"
    )
    level = Parts(outcome=log.outcome.drop_vars("overground_worst"))
    assert _count(level, "overground", burns=True) == "2 of 3"
    assert "overground (%)" in "\n".join(terminal._summary(level.outcome, risk, None))


def test_columns_without_a_unit_are_explained():
    log = log_of({"time": [1.0], "reserve": [0.1]})
    log.outcome.attrs["plant"] = "PlungeGrinder"
    (told,) = meanings_of(log)
    assert told.startswith("reserve: logarithm of the temperature of damage over the greatest")
    assert not meanings_of(log_of({"reserve": [0.1]}))
