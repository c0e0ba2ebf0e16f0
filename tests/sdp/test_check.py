"""What `sdp.check` says of each kind of mistake: one readable line that names the part and the remedy."""

from dataclasses import replace

import numpy as np
import pytest
from executor_problems import dulling

from sdpgrind import sdp

CHARGE = sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0))


def cut(s, c):
    return sdp.Point(c.cut)


def half(s, c, e):
    return (0.5 * s.x,)


def bead(law=cut, stop=None, **more):
    axis = sdp.Axis("height", 0.0, 1.0, 11, "mm", below="stop")
    move = sdp.Move("grind", {"cut": [0.1, 0.2]}, sdp.Shift("height", law), **more)
    return sdp.Problem([axis], [move], [stop or sdp.Stop("stop", CHARGE)], sdp.Stages(3, 1.0))


def ring(step=half, stops=(), noise=None, **more):
    axis = sdp.Axis("x", 0.1, 1.0, 11, "mm", below=0.0)
    step = sdp.Sampled(step, noise or {}, **more)
    return sdp.Problem([axis], [sdp.Move("push", {"f": [0.5]}, step, charge=1.0)], stops, sdp.Forever())


def branch(s, c, e):
    return (0.5 * s.x if s.x > 0.3 else 0.2 * s.x,)


def outward(s, c, e):
    return (2 * s.x,)


def bounce(s, c, e):
    return (np.maximum(0.5 * s.x, 0.2),)


WRONG = {
    "a misspelt coordinate": (
        bead(charge=lambda s, c: s.heigth),
        "move 'grind': s has no field 'heigth'; its fields are height",
    ),
    "a misspelt control": (
        bead(law=lambda s, c: sdp.Point(c.cutt)),
        "move 'grind': c has no field 'cutt'; its fields are cut",
    ),
    "the falling coordinate": (
        bead(law=lambda s, c: sdp.Point(s.height)),
        "move 'grind': s has no field 'height'; its fields are none",
    ),
    "a misspelt noise": (
        ring(lambda s, c, e: (s.x * e.eat,), noise={"eta": sdp.Discrete([0.5])}),
        "move 'push': e has no field 'eat'; its fields are eta",
    ),
    "the stage in a move that is not timed": (
        bead(charge=lambda s, c: s.time_left),
        "move 'grind': s has no field 'time_left'; its fields are height",
    ),
    "too many coordinates": (
        ring(lambda s, c, e: (s.x, s.x)),
        "move 'push': step must return a tuple of 1 coordinates; got a tuple of 2",
    ),
    "no tuple": (
        ring(lambda s, c, e: 0.5 * s.x),
        "move 'push': step must return a tuple of 1 coordinates; got ndarray",
    ),
    "a charge that is no number": (
        bead(charge=lambda s, c: np.where(s.height > 0.5, 1.0, np.nan)),
        "move 'grind': charge must be a number ($), infinite where it is not allowed; got NaN",
    ),
    "a step that is no number": (
        ring(lambda s, c, e: (s.x * np.nan,)),
        "move 'push': step must give numbers (mm); got NaN for x",
    ),
    "a charge of the next place that is no number": (
        ring(charge=lambda s, c, n: np.where(n.x > 0.3, 1.0, np.nan)),
        "move 'push': charge of the next coordinates must be a number ($); got NaN",
    ),
    "a stop that is no number": (
        bead(stop=sdp.Stop("s", CHARGE, extra=lambda s: np.nan)),
        "stop 's': its charge must be a number everywhere ($); got NaN",
    ),
    "an if": (
        ring(branch),
        "move 'push': callbacks must be written elementwise: operators and numpy functions such as np.where, no if",
    ),
    "an if in a stop": (
        ring(stops=[sdp.Stop("s", lambda s: 0.0 if s.x > 1 else 1.0)]),
        "stop 's': callbacks must be written elementwise",
    ),
    "no way out": (
        ring(bounce),
        "stages: the process never ends from x = 0.1 mm: no policy reaches a stop from there",
    ),
    "leaving an axis": (
        ring(outward),
        "move 'push' must keep x in [0.1, 1] (mm), or the axis needs another edge than 'refuse'; got 2",
    ),
    "leaving an axis by a shift": (
        bead(law=lambda s, c: sdp.Normal(c.cut, 0.05)),
        "move 'grind' must not leave the axis above 1",
    ),
    "an axis that is none": (
        replace(bead(), moves=[sdp.Move("g", {}, sdp.Shift("high", cut))]),
        "move 'g': Shift.axis must be one of height; got 'high'",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_each_mistake_gets_one_line(name):
    problem, expected = WRONG[name]
    report = sdp.check(problem)
    assert not report.ok
    assert len(report.problems) == 1 and "\n" not in report.problems[0]
    assert report.problems[0].startswith(expected)
    assert str(report).startswith("wrong: ")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: bead(duration=-1), "move 'grind': duration must be >= 1; got -1"),
        (lambda: bead(duration=1.5), "move 'grind': duration must be a whole number; got 1.5"),
        (lambda: bead(into="b"), "move 'grind': into must be one of"),
        (lambda: sdp.Move("m", {"a": [1, 2], "b": [1]}, sdp.Stay()), "lists of controls must be of equal length"),
        (lambda: sdp.Move("m", {"a": sdp.Levels(0, 1), "b": sdp.Levels(0, 1)}, sdp.Stay()), "at most one Levels"),
        (lambda: sdp.Axis("x", 1.0, 0.0, 5, "mm"), "x.high must be > low .mm.; got 0.0 and 1.0"),
        (lambda: sdp.Axis("x", 0.0, 1.0, 2), "x.nodes must be >= 3; got 2"),
        (lambda: sdp.Axis("x", 0.0, 1.0, 5, scale="log"), "x.low must be > 0"),
        (lambda: sdp.Axis("x", 0.0, 1.0, 5, below="stopp"), "one of refuse, hold, stop; got 'stopp'"),
        (lambda: sdp.Levels(2.0, 1.0), "Levels.high must be >= low; got 1.0 and 2.0"),
        (lambda: replace(bead(timed=True), stages=sdp.Forever()), "timed must be False"),
    ],
)  # fmt: skip
def test_what_is_refused_at_the_door(make, message):
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def test_a_good_problem_has_nothing_to_say_and_lambdas_are_noted():
    assert str(sdp.check(dulling())) == "nothing is wrong"
    report = sdp.check(bead(law=lambda s, c: sdp.Point(c.cut), charge=lambda s, c: 0.0))
    assert report.ok
    assert [note.split(" does")[0] for note in report.notes] == ["move 'grind': charge", "move 'grind': law"]
    assert all("not on executors of processes" in note for note in report.notes)


def halved(s, c, e):
    return (0.5 * np.asarray(s.x).astype(float),)  # a number has no `astype` in compiled code


def test_a_step_that_does_not_compile_is_a_note_unless_it_must():
    report = sdp.check(ring(halved))
    assert report.ok and report.notes[0].startswith("move 'push': step does not compile")
    report = sdp.check(ring(halved, compiled=True))
    assert report.problems[0].startswith("move 'push': step does not compile; pass compiled=False")
    assert sdp.check(ring(halved, compiled=False)).notes == ()


@pytest.mark.parametrize("verb", [sdp.plan, sdp.check])
def test_a_problem_of_another_kind(verb):
    with pytest.raises(TypeError, match=r"problem must be a Problem of this package, .*; got 'P1'"):
        verb("P1")


@pytest.mark.parametrize("noise", [sdp.Normal(0.0, 1.0), {"e": 1.0}])
def test_noise_is_laws_by_name(noise):
    with pytest.raises(TypeError, match="noise must be laws by name, such as"):
        sdp.Sampled(lambda s, c, e: (s.x,), noise)


def test_a_charge_that_is_no_number_is_refused():
    """It would look like a move that is never taken."""
    move = sdp.Move(
        "go",
        {"by": [0.1, 0.2]},
        sdp.Sampled(lambda s, c, e: (s.x - c.by,)),
        charge=lambda s, c: np.nan * c.by,
    )
    problem = sdp.Problem(
        [sdp.Axis("x", 0.0, 1.0, 11, below="hold")],
        [move],
        [sdp.Stop("done", lambda s: np.abs(s.x))],
        sdp.Stages(3, 1.0),
    )
    with pytest.raises(ValueError, match="move 'go': charge must be a number"):
        sdp.plan(problem)
    assert any("charge must be a number" in line for line in sdp.check(problem).problems)


def test_an_edge_that_is_no_number_is_refused():
    with pytest.raises(
        ValueError, match=r"x.below and .above must be a word or a value-to-go \(\$\); got nan"
    ):
        sdp.Axis("x", 0.0, 1.0, 11, below=float("nan"))
