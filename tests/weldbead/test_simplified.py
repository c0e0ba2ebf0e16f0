"""Plans in few bands: exact loss, fewest intervals, sheets that are read back, refusals."""

import numpy as np
import pytest
from bead_plans import plain
from stand_job import BOTH

import hwsim
from sdpgrind import sdp, weldbead
from sdpgrind.weldbead.sequence import _simplified, operator_table

NAMES = ("P1", "P4")


@pytest.fixture(scope="module", params=NAMES)
def simple(request):
    return plain(request.param).simplified(loss=0.003, force_step=1.0)


class Followed(sdp.Policy):
    """The bands of a simplified policy as actions of the solver's table."""

    def __init__(self, simple, nodes):
        policy = sdp.plan(weldbead.sequence.sdp_problem(simple.problem, nodes))
        super().__init__(policy.problem, policy.layout, policy.table, policy.error)
        self._simple = simple
        self._numbers = {float(move.name.removesuffix(" s")): k for k, move in enumerate(policy.layout.moves)}

    def act(self, place):
        height, left = place.points[0], (place.row + self.countdown.first) * self.layout.step
        found = [self._simple.action(x, t) for x, t in zip(height.tolist(), left.tolist(), strict=True)]
        best = np.array([-1 if each.stop else self._numbers[each.duration] for each in found])
        force = np.array([each.normal_force for each in found])
        return best, np.zeros(best.shape, dtype=int), force, np.zeros(best.shape)


def test_the_loss_is_that_of_the_solvers_forward_recursion(simple):
    """The same bands as moves of `sdp`, on the same heights, from some of them."""
    nodes = np.linspace(0.0, simple.problem.height_max, _simplified.HEIGHTS)
    told = Followed(simple, _simplified.HEIGHTS)
    for height, left in ((0.1, 8.0), (0.5, 18.0), (1.0, 30.0), (2.0, 60.0)):
        mean = told.distribution(nodes=nodes, height=height, time_left=left).mean
        assert float(simple.value(height, left)) == pytest.approx(mean, abs=1e-9)


def test_few_intervals_lose_no_more_than_is_allowed(simple):
    problem = simple.problem
    rows = _simplified._grid(problem, 0.05, _simplified.HEIGHTS)
    stop = np.asarray(problem.height_charge(np.linspace(0.0, problem.height_max, _simplified.HEIGHTS)))
    stages = round(problem.horizon / problem.stage) + 1
    best = _simplified._followed(rows, stop, stages, _simplified._best)
    assert simple.intervals <= 0.6 * _simplified.intervals_of(best.rows, best.choice)
    assert 0 < simple.mean_loss < simple.loss <= 0.003 * (1 + 1e-12)


def test_between_the_ends_of_bands_more_is_lost_and_told(simple):
    """A height just above a band's end is ground as the next end: the sheet costs what it says there, too."""
    assert simple.loss < simple.loss_between < 0.05
    told = Followed(simple, 801)
    nodes = np.linspace(0.0, simple.problem.height_max, 801)
    mean = told.distribution(nodes=nodes, height=0.5025, time_left=18.0).mean
    assert float(simple._between[0][9, 201]) == pytest.approx(mean, abs=1e-9)
    worst = max(sentence.count(f"{simple.loss_between:.2g} $") for sentence in simple._sentences)
    assert worst == 1


def test_bands_cover_all_heights_and_forces_are_set_as_told(simple):
    for line in simple.bands:
        assert [band.above for band in line] == [0.0, *(band.up_to for band in line[:-1])]
        assert line[-1].up_to == simple.problem.height_max
        for band in line:
            if band.duration > 0:
                low, high = simple.problem.force_interval(band.duration)
                assert low < band.normal_force <= high
                assert band.normal_force % 1.0 == 0.0 or high - band.normal_force < 0.01


def test_a_sheet_is_read_back_to_the_bit(simple, tmp_path):
    sheet = simple.operator_table(tmp_path / "bead.csv")
    read = operator_table(tmp_path / "bead.csv")
    read.save(tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "bead.csv").read_bytes()
    followed = simple.policy.following(read)
    assert followed.loss == pytest.approx(simple.loss, abs=1e-12)
    for height, left in ((0.013, 6.0), (0.5, 31.9), (2.0, 60.0), (1.0, 0.0)):
        action = simple.action(height, left)
        expected = (0.0, np.nan) if action.stop else (action.duration, action.normal_force)
        np.testing.assert_equal(read.action(height, left), expected)
        np.testing.assert_equal(sheet.action(height, left), expected)


def test_three_durations_are_enough_for_p4():
    """{6, 8, 10} s lose nothing: the plan with them is that of all eight at every node."""
    chosen = plain("P4").simplified(loss=0.003, durations=3)
    assert {band.duration for line in chosen.bands for band in line} <= {0.0, 6.0, 8.0, 10.0}
    few = weldbead.plan(weldbead.preset("P4").replace(durations=(6, 8, 10)), tolerance=None, nodes=401)
    np.testing.assert_allclose(few.table.table.value, plain("P4").table.table.value, atol=1e-9)


def test_steps_too_coarse_are_refused_with_one_that_is_not():
    with pytest.raises(
        ValueError, match=r"force_step must be <= 1 for a loss of 0.003 \$.*5 N loses.*got 5.0"
    ):
        plain("P1").simplified(loss=0.003, force_step=5.0)
    assert plain("P1").simplified(loss=0.003, force_step=1.0).loss <= 0.003
    with pytest.raises(ValueError, match=r"loss must be > .*got 0"):
        plain("P1").simplified(loss=0.0, force_step=1.0)


def test_a_controller_follows_the_bands(simple):
    controller = weldbead.SequenceController(simple)
    command = controller.step(height=1.0, time_left=30.0)
    assert command["normal_force"] == simple.action(1.0, 30.0).normal_force
    stand = hwsim.WeldBeadStand(simple.problem, height=1.0, time=30.0)
    outcome = hwsim.run(stand, controller, parts=200, rng=0).outcome
    half = 4 * float(outcome.penalty.std()) / np.sqrt(200)
    assert float(outcome.penalty.mean()) == pytest.approx(float(simple.value(1.0, 30.0)), abs=half)


def test_a_plan_that_learns_is_simplified_as_planned(tmp_path):
    simple = weldbead.plan(BOTH, tolerance=None, nodes=201).simplified(loss=0.003)
    assert simple.loss <= 0.003
    controller = weldbead.SequenceController(simple)  # what is printed stays: it does not learn
    told = {"normal_force": 50.0, "tangential_force": 18.0, "grinding_power": 800.0, "removal_rate": 60.0}
    controller.step(height=1.0, time_left=60.0)
    command = controller.step(height=0.6, time_left=44.0, **told)
    assert command["normal_force"] == simple.action(0.6, 44.0).normal_force
    log = hwsim.run(hwsim.WeldBeadStand(BOTH, height=1.0, time=60.0), controller, parts=2, rng=0)
    assert len(log) == 2  # its identity is that of the bands
    simple.operator_table(tmp_path / "bead.html")
    page = (tmp_path / "bead.html").read_text(encoding="utf-8")
    assert "up to height mm" in page and "Following the sheet costs" in page
    assert "Following the sheet costs" in str(simple.operator_table())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"loss": -1.0}, r"loss must be >= 0 \(\$\)"),
        ({"force_step": 0.0}, r"force_step must be > 0 \(N\)"),
        ({"durations": 0}, "durations must be"),
    ],
)
def test_wrong_options_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        plain("P4").simplified(**change)


@pytest.mark.parametrize(
    ("name", "charge"),
    [
        ("lateness_charge", sdp.Linear(0.02)),
        ("finish_charge", weldbead.FinishCharge(0.02, reference_rate=10.0)),
    ],
)
def test_charges_on_time_or_finish_are_refused(name, charge):
    policy = weldbead.plan(weldbead.preset("P1").replace(**{name: charge}), tolerance=None, nodes=21)
    with pytest.raises(ValueError, match=rf"problem\.{name} must be None for a simplified policy"):
        policy.simplified()


HEAD = "time_left [s],above [mm],up_to [mm],duration [s],normal_force [N]"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "first line of path must be time_left"),
        ("time_left,above,up_to,duration,normal_force\n0,0,1,0,", "first line of path must be time_left .s."),
        (HEAD, "at least one band"),
        (HEAD + "\n0,0,nan,0,", "line 2 of path must be five numbers >= 0"),
        (HEAD + "\n0,0,1,6", "line 2 of path must be five numbers"),
        (HEAD + "\n0,0,1,six,9", "line 2 of path must be five numbers"),
        (HEAD + "\n0,0,1,6,30\n0,1.1,2,0,", r"heights at 0 s must be bands from 0 up.*no gap, no overlap"),
        (HEAD + "\n0,0,1,6,30\n0,0.9,2,0,", "heights at 0 s"),
        (HEAD + "\n4,0,1,6,30\n0,0,2,0,", "time_left must be rising"),
    ],
)
def test_sheets_that_are_none_are_refused(tmp_path, text, words):
    (tmp_path / "bead.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=words):
        operator_table(tmp_path / "bead.csv")


def test_a_sheet_for_another_machine_is_refused(tmp_path):
    for line, words in (
        ("6,0,2,6,60", r"normal_force must be above .* and <= 50 in a pass of 6 s"),
        ("0,0,2,6,40", r"duration must be <= time_left, 0 s: the pass would end late"),
        ("9,0,2,9,40", "duration must be one of"),
    ):
        (tmp_path / "bead.csv").write_text(f"{HEAD}\n{line}\n", encoding="utf-8")
        sheet = operator_table(tmp_path / "bead.csv")
        with pytest.raises(ValueError, match=words):
            plain("P4").following(sheet)


def test_heights_beyond_the_plan_are_refused(simple):
    with pytest.raises(ValueError, match=r"height must be <= height_max, 2"):
        simple.value(3.0, 30.0)
    with pytest.raises(ValueError, match="height must be"):
        simple.action(np.nan, 30.0)
