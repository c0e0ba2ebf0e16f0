"""Pictures: units stand in one form, nothing hides what matters, axes of counts count."""

import re
import types

import numpy as np
import pytest
from house_names import ROOT

import hwsim
from sdpgrind import finishing, locus, units, weldbead
from sdpgrind.weldbead import force, passes

P1 = weldbead.preset("P1")
FOLDERS = ("src", "docs/commissioning", "docs/examples", "docs/reproductions", "docs/pictures")
LABELLED = [
    path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py") if "label" in path.read_text()
]
LABEL = re.compile(r'(?:label\w*|title)[=(]r?f?"([^"]*)"')
IN_PARENTHESES = re.compile(r"\((?:mm|[uµ]m|s|N|W|rad|J|1/mm|\\?\$)[^ )]*\)")


@pytest.fixture
def pyplot():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    yield pyplot
    pyplot.close("all")


@pytest.mark.parametrize("path", LABELLED, ids=lambda path: path.stem)
def test_units_stand_in_brackets(path):
    wrong = [label for label in LABEL.findall(path.read_text()) if IN_PARENTHESES.search(label)]
    assert not wrong


@pytest.mark.parametrize("path", LABELLED, ids=lambda path: path.stem)
def test_micrometres_have_one_sign(path):
    """As roundness instruments and drawings write them; ``units.um`` and the files of the command line keep
    to ASCII.
    """
    assert not [
        label
        for label in LABEL.findall(path.read_text())
        if re.search(r"(?<!units\.)\bum\b|\N{GREEK SMALL LETTER MU}m", label)
    ]


def test_units_in_parentheses_would_be_found():
    (label,) = LABEL.findall('axis.set_ylabel("height (mm)")')
    assert IN_PARENTHESES.search(label) and not IN_PARENTHESES.search("height [mm], as f(x) says")


def record(runs=1):
    plan = types.SimpleNamespace(
        time=[0.0, 1.0, 5.0], normal_force=[30.0, 30.0, 45.0], fly_height=[10.0, 10.0, 9.8]
    )
    controller = force.ForceController(plan, force.PI.design(crossover=units.hz(3.0)))
    return force.simulate_loop(controller, duration=1.5, runs=runs, rng=1)


def test_picture_of_a_force_loop(pyplot):
    done = record()
    top, low = done.plot().axes
    lines = {line.get_label(): line for line in top.lines}
    np.testing.assert_array_equal(lines["planned"].get_ydata(), done.planned)
    np.testing.assert_array_equal(lines["at the contact"].get_ydata(), done.force[0])
    np.testing.assert_array_equal(lines["read"].get_ydata(), done.reading[0])
    (command,) = low.lines
    np.testing.assert_array_equal(command.get_ydata(), done.command[0])
    np.testing.assert_allclose(
        np.diff(command.get_xdata()), done.time[-1] / done.command.shape[1], rtol=1e-12
    )
    labels = top.get_ylabel(), low.get_ylabel(), low.get_xlabel()
    assert labels == ("normal force [N]", "platform command [mm]", "time [s]")
    assert top.figure.get_suptitle() == f"1 run: force {done.error_rms()[0]:.3g} N rms off the plan"


def test_picture_of_many_force_loops_names_each_line_once(pyplot):
    figure = record(runs=25).plot()
    top, low = figure.axes
    assert len(low.lines) == 20 and figure.get_suptitle().startswith("25 runs, the first 20 drawn: ")
    assert sorted(text.get_text() for text in top.get_legend().get_texts()) == [
        "at the contact",
        "planned",
        "read",
    ]


class Passes:
    """So many passes of 40 N, then no more."""

    period = None

    def __init__(self, number=1, force=40.0):
        self.number, self.force = number, force
        self.reset()

    def reset(self):
        self.left = self.number

    def step(self, **measured):
        self.left -= 1
        return {"stop": 1.0} if self.left < 0 else {"duration": 10.0, "normal_force": self.force}


def whole(axis, which):
    """Whether the ticks of an axis are whole numbers."""
    axis.figure.draw_without_rendering()
    ticks = getattr(axis, f"{which}axis").get_majorticklocs()
    return bool(np.all(ticks == np.round(ticks)))


@pytest.mark.parametrize("parts", [1, 2, 7])
def test_beads_are_counted_in_whole_numbers(pyplot, parts):
    log = hwsim.run(hwsim.WeldBeadStand(P1), Passes(), parts=parts)
    (cost,) = (axis for axis in log.plot().axes if axis.get_ylabel() == "beads")
    assert whole(cost, "y")


class Platform:
    """Two tiers of one part: a pass of nothing, and a force that is demanded."""

    period, tier = 1 / 60, "force"
    reports = {"force_demand": "N"}  # noqa: RUF012

    def reset(self):
        pass

    def step(self, *, force, **measured):
        return {"stop": 1.0}

    def report(self):
        return {"force_demand": 20.0}


def test_force_is_drawn_over_its_demand(pyplot):
    disc = passes.TiltedDisc(P1.model, relaxed_angle=units.deg(20.0), rotational_stiffness=6e5)
    problem = passes.PassProblem(disc, passes.Contour([0, 50], [1.0, 1.0]), mean_cut=0.0, feed_rate=5.0)
    figure = hwsim.run(hwsim.ForceTableStand(problem), Platform()).plot()
    drawn = [line.get_label() for line in figure.axes[0].lines]
    assert drawn.index("demanded") < drawn.index("read")
    (left,) = (axis for axis in figure.axes if axis.get_xlabel() == "bead")
    assert whole(left, "x") and len(left.get_xticks()) >= 1


def test_what_a_pass_leaves_is_drawn_over_its_target(pyplot):
    disc = passes.TiltedDisc(P1.model, relaxed_angle=units.deg(20.0), rotational_stiffness=6e5)
    bead = passes.Contour([0, 25, 50], [1.0, 1.2, 1.0])
    figure = passes.plan(passes.PassProblem(disc, bead, mean_cut=0.1, feed_rate=5.0)).plot()
    drawn = [line.get_label() for line in figure.axes[0].lines]
    assert drawn.index("target") < drawn.index("after")


def test_long_names_of_controllers_stand_aslant_and_once_a_column(pyplot):
    many = {f"a controller of {n} passes": Passes(n) for n in (1, 2, 3)}
    figure = hwsim.compare(hwsim.WeldBeadStand(P1), many, parts=3).plot()
    assert all(
        "less that of a controller of 1 passes" in " ".join(axis.get_title().split()) for axis in figure.axes
    )
    figure.canvas.draw()
    # it would lie on the title
    assert not any(axis.yaxis.get_offset_text().get_text() for axis in figure.axes)
    named = [axis for axis in figure.axes if axis.xaxis.get_tick_params()["labelbottom"]]
    assert len(named) == min(3, len(figure.axes)) and len(figure.axes) > 3
    assert {label.get_rotation() for axis in named for label in axis.get_xticklabels()} == {30.0}
    few = hwsim.compare(hwsim.WeldBeadStand(P1), {"one": Passes(1), "two": Passes(2)}, parts=3).plot()
    assert {label.get_rotation() for label in few.axes[-1].get_xticklabels()} == {0.0}


def test_controllers_that_did_the_same_leave_nothing_to_draw(pyplot):
    log = hwsim.compare(hwsim.WeldBeadStand(P1), {"one": Passes(), "other": Passes()}, parts=2)
    with pytest.raises(ValueError, match="nothing to draw: every controller made the same of every part"):
        log.plot()


def test_a_hidden_range_of_decades_has_plain_ticks_and_its_limit_is_seen(pyplot):
    """1, 2 and 5 of each decade and no minor labels; the limit lies over the response that meets it, and is
    dashed.
    """
    problem = locus.Problem(
        controls={"f": (0.05, 0.6), "v": (40.0, 260.0)},
        hidden={"w": (0.02, 0.5)},
        cost=lambda s, c: -c.f * c.v,
        constraints=[
            locus.Varying(
                response=lambda s, c: (1.6 + 2.2 * s.w) * c.v, limit=lambda s, c: 95.0 - 0.25 * c.v, name="p"
            )
        ],
    )
    figure = locus.plan(problem).plot()
    figure.canvas.draw()
    *upper, lowest = (axis for axis in figure.axes if axis.get_xscale() == "log")
    low, high = lowest.get_xlim()
    shown = [
        t.get_text()
        for x, t in zip(lowest.get_xticks(), lowest.get_xticklabels(), strict=True)
        if low <= x <= high
    ]
    assert shown[:4] == ["0.02", "0.05", "0.1", "0.2"]
    assert not any(
        label.get_text() for axis in (*upper, lowest) for label in axis.get_xticklabels(minor=True)
    )
    (limit,) = (line for line in lowest.lines if line.get_label() == "limit")
    assert limit.get_linestyle() == "--" and limit.get_zorder() >= max(
        line.get_zorder() for line in lowest.lines
    )


def test_colours_of_a_policy_tell_small_penalties_apart(pyplot):
    """One in fifty may be the lowest colour, and then the bar has an arrow."""
    policy = weldbead.plan(P1.replace(lateness_charge=None), tolerance=1e-3)
    image = policy.plot().axes[0].collections[0]
    values = np.asarray(image.get_array()).ravel()
    below = np.mean(values[values > 0] < image.norm.vmin)
    assert below <= 0.02 or image.norm.vmin <= 1e-6 * values.max()
    assert image.colorbar.extend == ("min" if values.min() < image.norm.vmin else "neither")


def test_time_left_falls_to_the_right(pyplot):
    """As it passes; a clock of the machine, which counts from 0, runs to the right."""
    plan = weldbead.plan(P1, tolerance=1e-2)
    pictures = (plan.plot(), plan.table.plot())
    for figure in pictures:
        axes = [axis for axis in figure.axes if re.search(r"time.left", axis.get_xlabel())]
        assert axes and all(left > right for left, right in (axis.get_xlim() for axis in axes))


def empty(figure):
    """Share of a figure that no panel fills: outside of the box around what each panel draws."""
    figure.canvas.draw()
    shown = (np.asarray(figure.canvas.buffer_rgba())[::-1, :, :3] < 250).any(axis=2)
    filled = np.zeros_like(shown)
    for axis in figure.axes:
        x0, y0, x1, y1 = np.clip(axis.get_tightbbox().extents, 0, None).astype(int)
        y, x = np.nonzero(shown[y0 : y1 + 1, x0 : x1 + 1])
        filled[y0 + y.min() : y0 + y.max() + 1, x0 + x.min() : x0 + x.max() + 1] = True
    return 1 - filled.mean()


FLAT, BALL = finishing.surface.flat_surface(10.0), finishing.surface.sphere_surface(20.0)


@pytest.mark.parametrize(
    "surface", [FLAT, BALL, finishing.surface.nominal_surface()], ids=["flat", "ball", "nominal"]
)
def test_pictures_of_surfaces_and_paths_are_full(pyplot, surface):
    assert empty(surface.plot()) <= 1 / 3
    assert empty(finishing.hilbert(surface, order=2).plot()) <= 1 / 3


def test_the_picture_of_a_motion_is_full(pyplot):
    path = finishing.hilbert(finishing.surface.nominal_surface(), order=1)
    problem = finishing.FinishingProblem(
        path,
        robot=finishing.Arm.generic(),
        contact_angle=units.deg(30),
        lever_arm=95.0,
        feed_rate=25.0,
        heading="fixed",
    )
    assert empty(finishing.plan(problem).plot()) <= 1 / 3


def test_an_empty_picture_would_be_found(pyplot):
    figure = pyplot.figure(figsize=(6, 4))
    figure.add_axes((0.1, 0.6, 0.8, 0.3)).plot([0, 1])
    assert empty(figure) > 1 / 3
