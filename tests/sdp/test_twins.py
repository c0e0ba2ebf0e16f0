"""The solver against plain loops (twins.py), over every combination of what a problem may have."""

import numpy as np
import pytest
from twins import Twin, compare, compare_forever, outcomes

from sdpgrind import sdp

CHARGE = sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0))
SIDES = {
    "linear": CHARGE,
    "tolerance": sdp.Charge(under=sdp.Linear(2.0, tolerance=0.13), over=sdp.Linear(10.0, tolerance=0.07)),
    "quadratic": sdp.Charge(under=sdp.Quadratic(2.0, tolerance=0.1), over=sdp.Quadratic(20.0)),
    "constant": sdp.Charge(under=sdp.Constant(1.0, tolerance=0.11), over=sdp.Constant(3.0, tolerance=0.2)),
}


def discrete_cut(s, c):
    return sdp.Discrete(np.asarray(c.cut)[..., None] * np.array([0.7, 1.0, 1.37]), [0.25, 0.5, 0.25])


def rayleigh_cut(s, c):
    return sdp.Rayleigh(c.cut, 0.2 * c.cut)


def bead(law=discrete_cut, axis=None, charge=CHARGE, moves=None, stages=None, **more):
    """A falling height with passes of two durations."""
    axis = axis or sdp.Axis("height", 0.0, 1.0, 21, "mm", below="stop")
    cuts = sdp.Levels(0.05, 0.6, 7, (0.31,), search=False)
    moves = moves or [
        sdp.Move("fast", {"cut": cuts}, sdp.Shift("height", law), duration=2, charge=0.01),
        sdp.Move(
            "slow", {"cut": sdp.Levels(0.3, 0.9, 4, search=False)}, sdp.Shift("height", law), duration=3
        ),
    ]
    return sdp.Problem([axis], moves, [sdp.Stop("stop", charge)], stages or sdp.Stages(8, 1.0), **more)


LAWS = {
    "rayleigh": lambda c: sdp.Rayleigh(c, 0.2 * c),
    "scaled rayleigh": lambda c: sdp.Rayleigh(c, 0.8 * c),
    "lognormal": lambda c: sdp.LogNormal(c, 0.4 * c),
    "normal": lambda c: sdp.Normal(c - 0.2, 0.1 + 0.1 * c),
    "discrete": lambda c: sdp.Discrete(np.asarray(c)[..., None] * np.array([-0.4, 0.3, 1.0, 2.0])),
    "point": lambda c: sdp.Point(c),
}


def one_move(law, below, above, charge=CHARGE, nodes=17):
    axis = sdp.Axis("x", -0.5, 1.3, nodes, below=below, above=above)
    stop = sdp.Stop("stop", charge if "stop" in (below, above) else lambda s: np.abs(s.x) * np.exp(s.x))
    shift = sdp.Shift("x", lambda s, c: law(c.c))
    move = sdp.Move("go", {"c": sdp.Levels(0.1, 0.7, 4, search=False)}, shift, charge=-9.0)
    return sdp.Problem([axis], [move], [stop], sdp.Stages(2, 1.0, "left"))


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(
    ("below", "above"),
    [("hold", "hold"), ("stop", "hold"), ("stop", "stop"), ("hold", 1.5), (0.7, "stop"), (-0.3, 2.0)],
)
def test_expectation_of_a_shift_against_quadrature(name, below, above):
    # The move is paid for (-9 $), so that it is always chosen: the table holds its expectation twice over.
    # Accuracy:
    # second differences of G over cells h = 0.11 lose eps/h; quadrature in pieces of at most sd/2 is exact to
    # rounding.
    compare(one_move(LAWS[name], below, above), tolerance=3e-12 if name != "lognormal" else 1e-11)


def test_a_tail_charge_with_kinks_and_jumps_beyond_the_end():
    for name in ("tolerance", "quadratic", "constant"):
        compare(one_move(LAWS["normal"], "stop", "stop", SIDES[name]), tolerance=1e-11)


@pytest.mark.parametrize("sides", SIDES)
def test_durations_breaks_and_charges_of_the_end(sides):
    compare(bead(charge=SIDES[sides]))


def test_continuous_law_over_several_stages():
    compare(bead(rayleigh_cut, stages=sdp.Stages(4, 1.0)))


def test_lists_and_levels_together_with_masks():
    move = sdp.Move(
        "grind",
        {
            "cut": sdp.Levels(0.05, 0.5, 5, search=False),
            "spread": [0.1, 0.3, 0.6],
            "price": [0.05, 0.02, 0.0],
        },
        sdp.Shift(
            "height",
            lambda s, c: sdp.Discrete(
                np.asarray(c.cut)[..., None]
                + 0.05 * np.asarray(c.spread)[..., None] * np.array([-1.0, 0.0, 1.0])
            ),
        ),
        charge=lambda s, c: c.price + 0.1 * c.cut * s.height,
        allowed=lambda s, c: (c.cut < s.height + 0.2) & (c.spread + s.height > 0.35),
    )
    stop = sdp.Stop("stop", CHARGE)
    problem = sdp.Problem(
        [sdp.Axis("height", 0.0, 1.0, 17, below="stop")], [move], [stop], sdp.Stages(4, 1.0)
    )
    compare(problem)


def test_several_stops_by_state_and_mode_and_stage():
    stops = [
        sdp.Stop("keep", lambda s: (s.x - 0.4) ** 2, extra=lambda s: 0.05 * s.mode),
        sdp.Stop("sell", lambda s: 0.3 - 0.1 * s.x, allowed=lambda s: s.x > 0.5),
        sdp.Stop("wait", lambda s: 0.02 * s.left, allowed=lambda s: (s.mode == 1) & (s.x < 0.8)),
    ]
    moves = [
        sdp.Move("turn", {}, sdp.Stay(), into="b", charge=0.01),
        sdp.Move(
            "cut",
            {"d": [0.1, 0.25]},
            sdp.Shift("x", lambda s, c: sdp.Point(c.d)),
            into=["a", "b"],
            charge=lambda s, c: 0.02 * c.d,
        ),
        sdp.Move(
            "back",
            {"d": [0.05, 0.2]},
            sdp.Shift("x", lambda s, c: sdp.Discrete(np.stack([-c.d, 0 * c.d], -1))),
            charge=lambda s, c: 0.01 * (1 + s.mode),
            duration=2,
        ),
    ]
    compare(
        sdp.Problem(
            [sdp.Axis("x", 0.0, 1.0, 13, below="hold", above="hold")],
            moves,
            stops,
            sdp.Stages(6, 0.5, "left"),
            ("a", "b"),
        )
    )


def by_mode(s, c):
    return sdp.Discrete((np.asarray(c.cut) * (1 + 0.3 * s.mode))[..., None] * np.array([0.8, 1.2]))


@pytest.mark.parametrize("into", [None, "b", ["c", "a"]])
@pytest.mark.parametrize("law", [discrete_cut, by_mode], ids=["shared", "by mode"])
def test_modes_of_a_shift(into, law):
    moves = [
        sdp.Move(
            "one",
            {"cut": sdp.Levels(0.1, 0.5, 4, search=False), "n": [0, 1]},
            sdp.Shift("height", law),
            into=into,
            charge=lambda s, c: 0.01 * c.n,
        ),
        sdp.Move("two", {"cut": [0.05]}, sdp.Shift("height", law), duration=2, into="c"),
    ]
    finish = np.array([0.0, 0.2, 0.05])
    stop = sdp.Stop("stop", CHARGE, extra=lambda s: finish[np.asarray(s.mode)])
    compare(
        sdp.Problem(
            [sdp.Axis("height", 0.0, 1.0, 15, below="stop")],
            moves,
            [stop],
            sdp.Stages(5, 1.0),
            ("a", "b", "c"),
        )
    )


def test_stop_beyond_the_edge_is_charged_by_the_mode_of_arrival():
    # One certain pass through the bottom: 10 * 0.3 over, and the finish of the mode it leads into, in both
    # ways of
    # evaluation.
    for step in (
        sdp.Shift("height", lambda s, c: sdp.Point(c.cut)),
        sdp.Sampled(lambda s, c, e: (s.height - c.cut,)),
    ):
        stop = sdp.Stop("stop", CHARGE, extra=lambda s: np.array([1.0, 7.0])[np.asarray(s.mode)])
        move = sdp.Move("go", {"cut": [1.3]}, step, into="b", charge=-50.0)
        policy = sdp.plan(
            sdp.Problem(
                [sdp.Axis("height", 0.0, 1.0, 11, below="stop")],
                [move],
                [stop],
                sdp.Stages(1, 1.0),
                ("a", "b"),
            )
        )
        assert policy.value(height=1.0, time_left=1) == pytest.approx(-50 + 3 + 7, abs=1e-12)


LATE = {
    "linear": (sdp.Linear(0.03), 40),
    "expensive": (sdp.Linear(3.0), 10),
    "tolerance": (sdp.Linear(0.05, tolerance=1.5), 40),
    "quadratic": (sdp.Quadratic(0.01), 40),
    "quadratic tolerance": (sdp.Quadratic(0.02, tolerance=2.5), 40),
}


@pytest.mark.parametrize(
    ("name", "modes"), [*((name, False) for name in LATE), ("linear", True), ("quadratic", True)]
)
def test_late_charges(name, modes):

    late, depth = LATE[name]
    cuts = sdp.Levels(0.1, 0.5, 3, search=False)
    moves = [
        sdp.Move(
            n,
            {"cut": cuts},
            sdp.Shift("height", discrete_cut),
            duration=d,
            into=n if modes else None,
            charge=0.002,
        )
        for n, d in (("fast", 1), ("slow", 3))
    ]
    extra = (lambda s: np.array([0.0, 0.1, 0.02])[np.asarray(s.mode)]) if modes else None
    problem = sdp.Problem(
        [sdp.Axis("height", 0.0, 1.0, 9, below="stop")], moves, [sdp.Stop("stop", CHARGE, extra=extra)],
        sdp.Stages(5, 1.0, late=late), ("new", "fast", "slow") if modes else ("",),
    )  # fmt: skip
    policy, values = compare(problem, depth)
    # Late look-ups come from the same equations, as far as the twin's own end is far away.
    height = np.linspace(0, 1, 9)
    for stage in range(-8, 0):
        np.testing.assert_allclose(
            policy.value(height=height, time_left=float(stage)), values[stage][0], atol=1e-10
        )


def test_a_late_window_that_is_given_and_a_charge_that_is_concave():
    late = sdp.Constant(0.2)
    problem = bead(stages=sdp.Stages(4, 1.0, late=late, late_window=6.0))
    compare(problem, 6)
    with pytest.raises(ValueError, match="late must be convex and not nothing, or late_window be given"):
        sdp.plan(bead(stages=sdp.Stages(4, 1.0, late=late)))


def test_late_with_sampled_and_stop_edge():
    step = sdp.Sampled(
        lambda s, c, e: (s.height - c.cut * (1 + e.eta),), {"eta": sdp.Discrete([-0.3, 0.0, 0.4])}
    )
    move = sdp.Move("grind", {"cut": [0.1, 0.3, 0.5]}, step)
    compare(bead(moves=[move], stages=sdp.Stages(3, 1.0, late=sdp.Linear(0.05))), 40)


def test_late_at_no_charge():
    # Time is worth nothing once one is late, but passes are: the same as without end.
    problem = bead(
        stages=sdp.Stages(3, 1.0, late=sdp.Linear(0.0)),
        moves=[sdp.Move("one", {"cut": [0.1, 0.3]}, sdp.Shift("height", discrete_cut), charge=0.02)],
    )
    policy, _ = compare(problem, 40)
    forever = sdp.plan(sdp.Problem(problem.axes, problem.moves, problem.stops, sdp.Forever()))
    np.testing.assert_allclose(
        policy.value(height=np.linspace(0, 1, 21), time_left=0.0), forever.table.value[0, 0], atol=1e-10
    )


def test_what_has_no_late_side_is_refused():
    stages = sdp.Stages(3, 1.0, late=sdp.Quadratic(0.01))
    with pytest.raises(
        ValueError, match="ends of the axis 'height' must not be numbers beside a late charge"
    ):
        bead(axis=sdp.Axis("height", 0.0, 1.0, 9, below=0.3), stages=stages)
    masked = sdp.Problem(
        bead().axes, bead().moves, [sdp.Stop("stop", CHARGE, allowed=lambda s: s.height < 0.5)], stages
    )
    with pytest.raises(ValueError, match="late must be None where one may not stop everywhere"):
        sdp.plan(masked)
    timed = [sdp.Move("one", {"cut": [0.1]}, sdp.Shift("height", discrete_cut), timed=True)]
    with pytest.raises(ValueError, match=r"late_window must be given .* where moves are timed"):
        sdp.plan(bead(moves=timed, stages=sdp.Stages(3, 1.0, late=sdp.Linear(1.0))))


def ring_step(s, c, e):
    x = c.aim * s.offset * (1 + e.travel)
    return (np.sqrt(s.offset**2 + x**2 - 2 * s.offset * x * np.cos(e.direction)),)


NOISE = {
    "travel": sdp.Discrete([-0.12, 0.0, 0.12], [0.25, 0.5, 0.25]),
    "direction": sdp.Discrete([-0.03, 0.03]),
}


@pytest.mark.parametrize("compiled", [False, True, None], ids=["numpy", "compiled", "table"])
def test_sampled_on_a_log_axis_until_done(compiled):
    move = sdp.Move(
        "push", {"aim": [0.7, 0.9, 1.0]}, sdp.Sampled(ring_step, NOISE, compiled=compiled), charge=2.0
    )
    problem = sdp.Problem(
        [sdp.Axis("offset", 0.01, 3.0, 15, "mm", scale="log", below=0.0)], [move], [], sdp.Forever()
    )
    compare_forever(problem)


def step_2d(s, c, e):
    return s.x - c.d * (1 + e.eta), np.sqrt(s.y * s.y + c.d * e.nu)


def arrival_charge(s, c, n):
    return 0.1 * (s.x - n.x) ** 2 + 0.05 * n.y


def charge_2d(s):
    return (s.x - 0.2) ** 2 + 0.3 * s.y


@pytest.mark.parametrize("compiled", [False, True, None], ids=["numpy", "compiled", "table"])
def test_sampled_in_two_dimensions_with_a_charge_of_arrival(compiled, monkeypatch):
    if compiled is False:
        monkeypatch.setattr("sdpgrind.sdp._solve.point_backup.KEEP", 0)
    noise = {"eta": sdp.Discrete([-0.2, 0.2]), "nu": sdp.Discrete([0.3, 0.6, 0.9])}
    move = sdp.Move(
        "go",
        {"d": sdp.Levels(0.0, 0.4, 5, search=False)},
        sdp.Sampled(step_2d, noise, charge=arrival_charge, compiled=compiled),
        charge=-0.02,
    )
    axes = [
        sdp.Axis("x", 0.0, 1.0, 6, below="hold", above="hold"),
        sdp.Axis("y", 0.1, 1.0, 5, scale="log", above=0.4),
    ]
    compare(sdp.Problem(axes, [move], [sdp.Stop("end", charge_2d)], sdp.Stages(3, 1.0)))


def drift(s, c, e):
    return (s.x + c.d * e.eta,)


@pytest.mark.parametrize("compiled", [True, None], ids=["compiled", "table"])
@pytest.mark.parametrize("sides", SIDES)
def test_sampled_beyond_a_stop_edge(compiled, sides):
    step = sdp.Sampled(drift, {"eta": sdp.Normal(-0.3, 1.0)}, points=5, compiled=compiled)
    problem = sdp.Problem(
        [sdp.Axis("x", -0.5, 1.0, 12, below="stop", above="stop")], [sdp.Move("go", {"d": [0.3, 0.8]}, step)],
        [sdp.Stop("end", SIDES[sides])], sdp.Stages(3, 1.0),
    )  # fmt: skip
    compare(problem)


@pytest.mark.parametrize("compiled", [True, None], ids=["compiled", "table"])
def test_sampled_reads_mode_and_stage(compiled):
    step = sdp.Sampled(lambda s, c, e: (s.x * (0.8 + 0.1 * s.mode) + 0.01 * s.left * c.d,), compiled=compiled)
    moves = [
        sdp.Move("go", {"d": [0.0, 1.0]}, step, timed=True, into=["b", "a"]),
        sdp.Move("keep", {"d": [2.0]}, step, timed=True, duration=2),
    ]
    problem = sdp.Problem(
        [sdp.Axis("x", 0.0, 1.0, 9, above="hold")],
        moves,
        [sdp.Stop("end", lambda s: s.x**2 + 0.1 * s.mode)],
        sdp.Stages(5, 0.5, "left"),
        ("a", "b"),
    )
    compare(problem)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("modes", [False, True])
def test_shift_in_two_dimensions(first, modes):
    axes = [sdp.Axis("height", 0.0, 1.0, 9, below="stop"), sdp.Axis("dull", 0.0, 2.0, 7, above="hold")]

    def law(s, c):
        blunt = 1 + 0.2 * s.dull + (0.1 * s.mode if modes else 0.0)
        return sdp.Discrete(np.asarray(c.cut / blunt)[..., None] * np.array([0.8, 1.2]))

    moves = [
        sdp.Move(
            "grind",
            {"cut": sdp.Levels(0.1, 0.6, 4, search=False)},
            sdp.Shift("height", law, lambda s, c: (s.dull + 0.7 * c.cut,)),
            charge=lambda s, c: 0.01 * s.dull * (1 + s.height),
        ),
        sdp.Move(
            "dress",
            {},
            sdp.Sampled(lambda s, c, e: (s.height, 0.0 * s.dull))
            if first
            else sdp.Sampled(lambda s, c, e: (0.0 * s.dull, s.height)),
            charge=0.05,
            into="b" if modes else None,
        ),
    ]
    stop = sdp.Stop("stop", CHARGE, extra=(lambda s: 0.03 * np.asarray(s.mode)) if modes else None)
    compare(
        sdp.Problem(
            axes if first else axes[::-1], moves, [stop], sdp.Stages(4, 1.0), ("a", "b") if modes else ("",)
        )
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shift_in_three_dimensions(axis):
    falling, wear, heat = (
        sdp.Axis("height", 0.0, 1.0, 6, below="hold"),
        sdp.Axis("wear", 0.1, 1.0, 4, scale="log", above="hold"),
        sdp.Axis("heat", 0.0, 1.0, 4, above="hold"),
    )
    axes = [wear, heat]
    axes.insert(axis, falling)

    def law(s, c):
        mean = c.cut * (1 - 0.4 * s.wear) * (1 - 0.2 * s.heat)
        return sdp.Discrete(np.asarray(mean)[..., None] * np.array([0.7, 1.1, 1.2]))

    move = sdp.Move(
        "grind",
        {"cut": np.array([0.2, 0.4])},
        sdp.Shift("height", law, lambda s, c: (s.wear * (1 + c.cut), 0.5 * s.heat + c.cut)),
    )
    stop = sdp.Stop("stop", lambda s: s.height + 0.3 * s.wear**2 + 0.1 * s.heat)
    compare(sdp.Problem(axes, [move], [stop], sdp.Stages(3, 1.0)))


@pytest.mark.parametrize("rule", ["refuse", "hold"])
def test_a_deterministic_coordinate_that_leaves_its_axis(rule):
    axes = [sdp.Axis("x", 0.0, 1.0, 5, below="hold"), sdp.Axis("y", 0.0, 1.0, 5, above=rule)]
    move = sdp.Move(
        "go",
        {"d": [0.25]},
        sdp.Shift("x", lambda s, c: sdp.Point(c.d), lambda s, c: (s.y + c.d,)),
        allowed=lambda s, c: s.y < 0.76,
    )
    problem = sdp.Problem(axes, [move], [sdp.Stop("stop", lambda s: s.x + s.y)], sdp.Stages(2, 1.0))
    # A move is never made where it is not allowed: what it would lead to there is of no account.
    policy, _ = compare(problem)
    assert policy.action(x=1.0, y=0.9, time_left=1).stop


@pytest.mark.parametrize("compiled", [False, True, None], ids=["numpy", "compiled", "table"])
def test_a_masked_sampled_move_may_lead_anywhere(compiled, monkeypatch):
    if compiled is False:
        monkeypatch.setattr("sdpgrind.sdp._solve.point_backup.KEEP", 0)
    step = sdp.Sampled(lambda s, c, e: (s.x - c.d,), compiled=compiled)
    move = sdp.Move("go", {"d": [0.25, 0.5]}, step, allowed=lambda s, c: s.x >= c.d - 1e-9, into="b")
    stop = sdp.Stop("stop", lambda s: s.x**2 + 0.01 * np.asarray(s.mode))
    policy, _ = compare(
        sdp.Problem([sdp.Axis("x", 0.0, 1.0, 9)], [move], [stop], sdp.Stages(2, 1.0), ("a", "b"))
    )
    assert policy.action(x=np.linspace(0, 1, 30), time_left=1).gap.min() >= 0


@pytest.mark.parametrize("compiled", [False, True, None], ids=["numpy", "compiled", "table"])
def test_a_step_that_gives_no_number_is_refused(compiled, monkeypatch):
    if compiled is False:
        monkeypatch.setattr("sdpgrind.sdp._solve.point_backup.KEEP", 0)
    step = sdp.Sampled(lambda s, c, e: (s.x * np.nan,), compiled=compiled)
    axis = sdp.Axis("x", 0.0, 1.0, 9, below="hold", above="hold")
    problem = sdp.Problem(
        [axis], [sdp.Move("go", {}, step)], [sdp.Stop("stop", lambda s: s.x)], sdp.Stages(2, 1.0)
    )
    with pytest.raises(ValueError, match="move 'go': step must give numbers"):
        sdp.plan(problem)


def test_a_masked_shift_may_lead_anywhere():
    move = sdp.Move(
        "go",
        {"d": [0.25, 0.5]},
        sdp.Shift("x", lambda s, c: sdp.Point(c.d)),
        allowed=lambda s, c: s.x >= c.d - 1e-9,
        into="b",
    )
    stop = sdp.Stop("stop", lambda s: s.x**2 + 0.01 * np.asarray(s.mode))
    policy, _ = compare(
        sdp.Problem([sdp.Axis("x", 0.0, 1.0, 9)], [move], [stop], sdp.Stages(2, 1.0), ("a", "b"))
    )
    # Between the last node where one must stop and the first where one may go, the edge of the mask is
    # respected.
    assert policy.action(x=np.linspace(0, 1, 30), time_left=1).gap.min() >= 0


def test_timed_shifts_read_the_stage():

    def law(s, c):
        return sdp.Discrete((np.asarray(c.cut) * (1 + 0.1 * s.left))[..., None] * np.array([0.9, 1.1]))

    moves = [
        sdp.Move(
            "one",
            {"cut": sdp.Levels(0.1, 0.4, 4, search=False)},
            sdp.Shift("height", law),
            timed=True,
            charge=lambda s, c: 0.01 * s.left,
            allowed=lambda s, c: s.left > 1.5,
        ),
        sdp.Move("two", {"cut": [0.2]}, sdp.Shift("height", discrete_cut), duration=2),
    ]
    axis = sdp.Axis("height", 0.0, 1.0, 9, below="stop")
    compare(sdp.Problem([axis], moves, [sdp.Stop("stop", CHARGE)], sdp.Stages(5, 1.0, "left")))


def test_timed_moves_beside_a_late_charge():
    move = sdp.Move(
        "one",
        {"cut": [0.1, 0.3]},
        sdp.Shift("height", lambda s, c: sdp.Point(c.cut + 0.0 * s.left)),
        timed=True,
    )
    axis = sdp.Axis("height", 0.0, 1.0, 9, below="stop")
    compare(
        sdp.Problem(
            [axis], [move], [sdp.Stop("stop", CHARGE)], sdp.Stages(3, 1.0, "left", late=sdp.Quadratic(0.02))
        ),
        40,
    )


def test_shift_without_end_with_modes():
    moves = [
        sdp.Move(
            "one",
            {"cut": sdp.Levels(0.1, 0.4, 4, search=False)},
            sdp.Shift("height", by_mode),
            charge=0.02,
            into="b",
        ),
        sdp.Move("rest", {}, sdp.Stay(), charge=0.01, into="a"),
    ]
    stop = sdp.Stop("stop", CHARGE, extra=lambda s: 0.1 * np.asarray(s.mode))
    compare_forever(
        sdp.Problem([sdp.Axis("height", 0.0, 1.0, 9, below="stop")], moves, [stop], sdp.Forever(), ("a", "b"))
    )


def test_modes_alone():
    length = np.array([[9.0, 2.0, 7.0], [9.0, 9.0, 1.0], [9.0, 9.0, 9.0]])
    go = sdp.Move(
        "go", {"to": [0, 1, 2]}, sdp.Stay(), into=["a", "b", "c"], charge=lambda s, c: length[s.mode, c.to]
    )
    stop = sdp.Stop("home", lambda s: 0.0 * s.mode, allowed=lambda s: s.mode == 2)
    policy, value = compare_forever(sdp.Problem([], [go], [stop], sdp.Forever(), ("a", "b", "c")))
    assert value.tolist() == [3.0, 1.0, 0.0]
    assert policy.action(mode="a").to == 1.0


def test_the_twin_itself_knows_a_case_that_can_be_done_by_hand():
    # From 1.0 a pass of 0.5 or 1.5 with equal odds; then stop: (2 * 0.5 + 10 * 0.5)/2 = 3 > 2 = stop at once.
    move = sdp.Move(
        "go",
        {"cut": [1.0]},
        sdp.Shift("height", lambda s, c: sdp.Discrete(np.stack([0.5 * c.cut, 1.5 * c.cut], -1))),
    )
    twin = Twin(
        sdp.Problem(
            [sdp.Axis("height", 0.0, 1.0, 3, below="stop")],
            [move],
            [sdp.Stop("stop", CHARGE)],
            sdp.Stages(1, 1.0),
        )
    )
    found, _ = twin.move_cost(move, (2,), [1.0], 0, 1, np.array([[0.0, 1.0, 2.0]]), 0.0)
    assert found == pytest.approx(3.0)
    values, weights = outcomes(sdp.Normal(0.3, 0.1))
    assert weights.sum() == pytest.approx(1, abs=1e-13) and weights @ values**2 == pytest.approx(
        0.1, abs=1e-13
    )
