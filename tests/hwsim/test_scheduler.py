"""The scheduler against a twin that goes nanosecond by nanosecond, response-time analysis, and what must
always hold.
"""

import copy
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from functools import partial
from math import ceil, floor

import numpy as np
import pytest
from hwsim_inside import DRAWN, Kind, release_time
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hwsim import Schedule, Scheduler, Task
from sdpgrind.base.parallel import execute
from sdpgrind.base.rng import children

NS = 1_000_000_000
LOOPS = Scheduler(
    [
        Task("control", 0.01, priority=1, execution_time=(0.001, 0.0002), jitter=0.0005),
        Task("data", 1 / 60, priority=2, execution_time=0.0005),
        Task("model", angle_step=np.deg2rad(5.0), priority=3, execution_time=(0.003, 0.002), jitter=0.001),
        Task("communication", 0.1, priority=4, execution_time=(0.01, 0.003)),
    ],
    spindle_speed_max=10.5,
)
TURNING = [(0.5, 0.0, 10.0), (0.7, 5.0, 5.0), (0.4, 8.5, -4.0), (5.0, 6.9, 0.0)]


def loops(seed):
    return LOOPS.run(2.0, seed, spindle=TURNING)


def twin(tasks, releases, end):
    """One nanosecond after the other; `releases`: for each task a list of (time, execution)."""
    trace, jobs, running = [], {}, None
    due = [{} for _ in tasks]
    for place, each in enumerate(releases):
        for number, (time, execution) in enumerate(each):
            due[place].setdefault(time, []).append((number, execution))
    for now in range(end):
        if running is not None and jobs[running]["left"] == 0:
            trace.append((now, Kind.COMPLETE, running, jobs.pop(running)["number"]))
            running = None
        for place in sorted(range(len(tasks)), key=lambda p: (tasks[p].priority, p)):
            for number, execution in due[place].get(now, []):
                trace.append((now, Kind.OVERRUN if place in jobs else Kind.RELEASE, place, number))
                if place not in jobs:
                    jobs[place] = {"number": number, "left": execution, "release": now, "begun": False}
        while jobs:
            best = min(jobs, key=lambda p: (tasks[p].priority, p != running, jobs[p]["release"], p))
            if running is None or tasks[best].priority < tasks[running].priority:
                if running is not None:
                    trace.append((now, Kind.PREEMPT, running, jobs[running]["number"]))
                trace.append(
                    (now, Kind.RESUME if jobs[best]["begun"] else Kind.START, best, jobs[best]["number"])
                )
                jobs[best]["begun"], running = True, best
            if jobs[running]["left"]:
                break
            trace.append((now, Kind.COMPLETE, running, jobs.pop(running)["number"]))
            running = None
        if running is not None:
            jobs[running]["left"] -= 1
    return np.array(trace, dtype=np.int64).reshape(-1, 4)


def drawn(task, rng, end):
    """Releases of a periodic task as `Task` says, with exact fractions, and what each draws, block by block."""
    listed, number = [], 0
    period = Fraction(task.period).limit_denominator(10**12)
    while (nominal := floor(number * period * NS + Fraction(1, 2))) < end:
        listed.append(nominal)
        number += 1
    drawn = []
    while len(drawn) < number:
        late = rng.uniform(0.0, task.jitter, DRAWN) if task.jitter else np.zeros(DRAWN)
        seconds = (
            rng.gamma((task.mean / task.sd) ** 2, task.sd**2 / task.mean, DRAWN)
            if task.sd
            else [task.mean] * DRAWN
        )
        drawn += [(int(wait * NS), round(long * NS)) for wait, long in zip(late, seconds, strict=True)]
    return [(due + wait, long) for due, (wait, long) in zip(listed, drawn, strict=False)]


def all_draws(task, rng, number):
    """What the first jobs draw, block after block."""
    return [draw for _ in range(-(-number // DRAWN)) for draw in task.draws(rng)]


@st.composite
def small_tasks(draw):
    number = draw(st.integers(1, 4))
    tasks = []
    for k in range(number):
        period = draw(st.integers(8, 90))
        mean = draw(st.integers(0, max(1, period // number)))
        sd = draw(st.sampled_from([0.0, 0.3, 1.5])) * mean
        late = draw(st.sampled_from([0.0, 0.2, 0.9])) * period
        times = (mean / NS, sd / NS) if sd else mean / NS
        tasks.append(
            Task(
                f"t{k}", period / NS, priority=draw(st.integers(1, 3)), execution_time=times, jitter=late / NS
            )
        )
    assume(sum(task.share() for task in tasks) <= 1)
    return tasks


@given(small_tasks(), st.integers(0, 2**32))
@settings(max_examples=150, deadline=None)
def test_as_the_twin_that_goes_nanosecond_by_nanosecond(tasks, seed):
    end = 600
    releases = [drawn(task, rng, end) for task, rng in zip(tasks, children(seed, len(tasks)), strict=True)]
    schedule = Scheduler(tasks).run(end / NS, seed)
    np.testing.assert_array_equal(schedule.trace, twin(tasks, releases, end))


def response(tasks, k):
    """Joseph & Pandya (1986): the smallest R = C_k + sum of ceil(R/T_i) C_i over the more urgent tasks, in
    ns.
    """
    above = [task for task in tasks if task.priority < tasks[k].priority]
    own, answer = round(tasks[k].mean * NS), 0
    while answer <= 10 * round(tasks[k].period * NS):
        longer = own + sum(ceil(Fraction(answer, round(t.period * NS))) * round(t.mean * NS) for t in above)
        if longer == answer:
            return answer
        answer = longer
    return answer


@given(st.lists(st.tuples(st.integers(2, 60), st.floats(0.02, 0.6)), min_size=1, max_size=5))
@settings(max_examples=150, deadline=None)
def test_worst_response_is_that_of_the_analysis(rows):
    rows = sorted(rows)  # rate monotonic: the shorter the period, the more urgent
    tasks = [
        Task(f"t{k}", ms / 1000, priority=k + 1, execution_time=max(1, round(ms * share * 1000)) / 1e6)
        for k, (ms, share) in enumerate(rows)
    ]
    assume(sum(task.share() for task in tasks) <= 1)
    report = Scheduler(tasks).run(0.5).report
    for k, task in enumerate(tasks):
        expected = response(tasks, k)
        if expected > round(task.period * NS):
            assert report[task.name].overruns > 0
            break  # what is missed above takes load off the tasks below
        assert report[task.name].overruns == 0
        assert report[task.name].worst_response == expected / NS


def test_what_liu_and_layland_print():
    """Two tasks that use the whole processor: 2 of 4 and 4 of 8 ms; the completion falls on the next release."""
    schedule = Scheduler(
        [
            Task("a", 0.004, priority=1, execution_time=0.002),
            Task("b", 0.008, priority=2, execution_time=0.004),
        ]
    )
    report = schedule.run(0.8).report
    assert schedule.utilisation == 1.0
    assert (report["a"].worst_response, report["b"].worst_response) == (0.002, 0.008)
    assert (report["a"].overruns, report["b"].overruns, report["b"].preemptions) == (0, 0, 100)
    assert report["a"].utilisation + report["b"].utilisation == pytest.approx(1.0, abs=1e-12)


@given(st.integers(0, 2**32), st.floats(0.2, 1.9))
@settings(max_examples=25, deadline=None)
def test_one_at_a_time_the_most_urgent_first_and_nothing_lost(seed, duration):
    schedule = LOOPS.run(duration, seed, spindle=TURNING)
    slices, tasks = schedule.slices, schedule.tasks
    assert np.all(np.diff(schedule.trace[:, 0]) >= 0)
    assert np.all(slices[:, 2] <= slices[:, 3]) and np.all(slices[1:, 2] >= slices[:-1, 3])
    for place, task in enumerate(tasks):
        work = slices[slices[:, 0] == place]
        draws = all_draws(task, children(seed, len(tasks))[place], 400)
        for number, release, start, completion in schedule.jobs(task.name):
            own = work[work[:, 1] == number]
            assert (own[:, 3] - own[:, 2]).sum() == draws[number].execution
            assert release <= start == own[0, 2] and completion == own[-1, 3]
            waits = slices[(slices[:, 2] < completion) & (slices[:, 3] > release)]
            less_urgent = [row for row in waits if tasks[row[0]].priority > task.priority]
            assert not less_urgent


@given(st.integers(0, 2**32), st.lists(st.floats(0.0, 1.0), max_size=12), st.booleans())
@settings(max_examples=40, deadline=None)
def test_how_time_is_cut_changes_nothing(seed, cuts, by_events):
    periodic = Scheduler([task for task in LOOPS.tasks if task.period])
    whole, cut = periodic.start(seed), periodic.start(seed)
    jobs = whole.advance(NS)
    times = [*sorted(round(each * NS) for each in cuts), NS]
    events, listed = [], []
    for to in times:
        if by_events:
            while event := cut.next_event(to):
                events.append(event)
        else:
            listed += cut.advance(to)
        assert cut.now == to
    assert cut.schedule == whole.schedule
    if by_events:
        names = [task.name for task in periodic.tasks]
        assert [(e.time, e.kind, names.index(e.task), e.job) for e in events] == list(
            map(tuple, whole.schedule.trace.tolist())
        )
    else:
        assert listed == jobs


def test_a_job_waits_for_the_one_before_of_its_own_level():
    equal = Scheduler([Task("a", 0.01, execution_time=0.004), Task("b", 0.007, execution_time=0.003)])
    trace = equal.run(0.02).trace
    assert not np.any(trace[:, 1] == Kind.PREEMPT)
    np.testing.assert_array_equal(equal.run(0.02).jobs("b")[:, 2], [4_000_000, 7_000_000, 14_000_000])


def test_an_overrun_is_missed_and_the_phase_kept():
    tasks = [
        Task("urgent", 0.1, priority=1, execution_time=0.025),
        Task("often", 0.01, priority=2, execution_time=0.002),
    ]
    schedule = Scheduler(tasks).run(0.1)
    report = schedule.report["often"]
    assert (report.releases, report.overruns, report.completed) == (10, 2, 8)
    jobs = schedule.jobs("often")
    np.testing.assert_array_equal(jobs[:, 0], [0, 3, 4, 5, 6, 7, 8, 9])  # 1 and 2 came while 0 waited
    np.testing.assert_array_equal(jobs[1:, 1], jobs[1:, 0] * 10_000_000)
    assert report.worst_response == 0.027
    missed = schedule.trace[schedule.trace[:, 1] == Kind.OVERRUN]
    np.testing.assert_array_equal(missed[:, [0, 3]], [[10_000_000, 1], [20_000_000, 2]])
    assert "overruns: often 2" in repr(schedule)


def test_what_takes_no_time_is_sampled_and_complete_at_once():
    tasks = [Task("control", 0.01, priority=1), Task("model", 0.02, priority=2, execution_time=0.012)]
    schedule = Scheduler(tasks).run(0.04)
    np.testing.assert_array_equal(
        schedule.jobs("control")[:, 1:], np.outer(np.arange(4) * 10_000_000, [1, 1, 1])
    )
    assert schedule.report["model"].preemptions == 2 and schedule.report["model"].worst_response == 0.012


def test_60_hz_does_not_drift():
    releases = Scheduler([Task("camera", 1 / 60)]).run(100.0).jobs("camera")[:, 1]
    exact = [floor(Fraction(k * NS, 60) + Fraction(1, 2)) for k in range(6000)]
    np.testing.assert_array_equal(releases, exact)
    assert release_time(Fraction(1, 60), 60 * 86400 * 365) == 86400 * 365 * NS  # a year later


@pytest.mark.parametrize("start", [0.0, 0.3, -7.1])
def test_releases_by_angle_lie_on_the_multiples(start):
    step = np.deg2rad(5.0)
    schedule = Scheduler([Task("model", angle_step=step)], spindle_speed_max=20.0).run(
        2.0, spindle=TURNING, start_angle=start
    )
    seconds = schedule.jobs("model")[:, 1] / NS
    grid = np.linspace(0.0, 2.0, 2_000_001)  # the slow way: where the angle is on a fine grid of time
    angle, begun = np.full_like(grid, start), 0.0
    for span, speed, acceleration in TURNING:
        t = np.clip(grid - begun, 0.0, span)
        angle += speed * t + 0.5 * acceleration * t**2
        begun += span
    passed = np.floor(angle / step + 1e-9)
    expected = grid[1:][np.diff(passed) > 0]
    first = [0.0] if start == 0.0 else []
    np.testing.assert_allclose(seconds, [*first, *expected], rtol=0, atol=1.1e-6)
    at = np.interp(seconds, grid, angle)
    # 10.5 rad/s for a nanosecond
    np.testing.assert_allclose(at, step * np.round(at / step), rtol=0, atol=2e-8)


def test_a_spindle_that_turns_back_releases_each_multiple_once():
    # from 0.04 to 0.29, back to -0.21, on to 1.04
    rows = [(1.0, 1.0, -2.0), (1.0, -1.0, 2.0), (1.0, 1.0, 0.0)]
    schedule = Scheduler([Task("model", angle_step=0.1)], spindle_speed_max=2.0).run(
        3.0, spindle=rows, start_angle=0.04
    )
    seconds = schedule.jobs("model")[:, 1] / NS
    # 0.1 and 0.2 on the way out, 0.3 ... 1.0 in the last second; never again what was passed
    out = [(1 - np.sqrt(1 - 4 * (angle - 0.04))) / 2 for angle in (0.1, 0.2)]
    back = [2.0 + (angle - 0.04) for angle in np.arange(3, 11) * 0.1]
    np.testing.assert_allclose(seconds, [*out, *back], rtol=0, atol=1e-9)


def test_a_new_speed_moves_the_next_release_but_not_a_late_one():
    task = Task("model", angle_step=1.0, jitter=0.4)
    late = task.draws(children(3, 1)[0])[0].late
    scheduler = Scheduler([task], spindle_speed_max=2.0)
    core = scheduler.start(3, angle=0.5)
    assert core.advance(400_000_000, 0.5, 1.0) == []
    assert core.advance(460_000_000, 0.9, 2.0) == []  # reached at 0.45 s rather than at 0.5 s
    (job,) = core.advance(900_000_000, 1.02, 0.0)  # it stands, but what was reached is released
    assert job.release == 450_000_000 + late and late > 10_000_000


def test_what_is_passed_while_a_late_release_waits_comes_at_once():
    task = Task("model", angle_step=0.1, jitter=0.35)
    late = [draw.late for draw in all_draws(task, children(1, 1)[0], 30)]
    schedule = Scheduler([task], spindle_speed_max=1.0).run(2.0, 1, spindle=[(2.0, 1.0, 0.0)])
    releases = schedule.trace[schedule.trace[:, 1] <= Kind.OVERRUN, 0]
    expected, last = [], 0
    for k, each in enumerate(late):
        last = max(last, k * 100_000_000 + each)
        expected.append(last)
    np.testing.assert_allclose(releases, expected[: releases.size], rtol=0, atol=1)
    assert np.any(np.diff(releases) == 0) and releases.size >= 17
    # two at one instant: the second is missed
    assert schedule.report["model"].overruns == np.sum(np.diff(releases) == 0)


def test_a_spindle_that_reverses_within_a_segment():
    schedule = Scheduler([Task("model", angle_step=1.0)], spindle_speed_max=9.0).run(
        4.0, spindle=[(4.0, -1.0, 2.0)], start_angle=0.5
    )
    # -t + t^2 = k - 0.5
    np.testing.assert_allclose(
        schedule.jobs("model")[:, 1] / NS,
        [(1 + np.sqrt(1 + 4 * (k - 0.5))) / 2 for k in range(1, 13)],
        rtol=0,
        atol=1e-9,
    )


@pytest.mark.parametrize("speed", [1e-305, 1e-12])
def test_a_spindle_that_all_but_stands_releases_nothing(speed):
    """The next multiple is 1e303 s, or 1600 years, away; beyond 2^62 ns nothing is expected."""
    core = Scheduler([Task("model", angle_step=0.1)], spindle_speed_max=1.0).start(0, angle=0.05)
    assert core.next_event(NS, 0.05, speed) is None and core.now == NS
    assert core.advance(2 * NS, 0.05, speed) == [] and core.schedule.trace.shape == (0, 4)
    (job,) = core.advance(3 * NS, 0.05, 0.1)  # it turns again
    assert job.release == 2_500_000_000


@given(st.integers(0, 2**32))
@settings(max_examples=15, deadline=None)
def test_only_what_was_asked_for_is_told(seed):
    periodic = Scheduler([task for task in LOOPS.tasks if task.period])
    asked = {("control", Kind.START), ("communication", Kind.COMPLETE), ("data", Kind.OVERRUN)}
    every, some = periodic.start(seed), periodic.start(seed, told=asked)
    events = [list(iter(lambda core=core: core.next_event(NS), None)) for core in (every, some)]
    assert events[1] == [event for event in events[0] if (event.task, event.kind) in asked]
    assert some.schedule == every.schedule
    assert some.advance(2 * NS) == every.advance(2 * NS)


def test_draws_of_one_task_do_not_change_another():
    more = LOOPS.replace(tasks=[*LOOPS.tasks, Task("watch", 0.05, priority=9, execution_time=(0.001, 0.001))])
    a, b = loops(5), more.run(2.0, 5, spindle=TURNING)
    np.testing.assert_array_equal(a.jobs("control"), b.jobs("control"))
    np.testing.assert_array_equal(a.jobs("communication"), b.jobs("communication"))


def test_execution_times_have_the_mean_and_deviation_asked_for():
    schedule = Scheduler([Task("a", 0.01, execution_time=(0.002, 0.001))]).run(100.0)
    jobs = schedule.jobs("a")
    times = (jobs[:, 3] - jobs[:, 2]) / NS
    assert times.mean() == pytest.approx(0.002, abs=4 * 1e-5)  # four standard errors of 10 000 draws
    assert times.std() == pytest.approx(0.001, abs=4 * 1.4e-5)


def test_the_same_seed_gives_the_same_bytes_on_any_number_of_workers(processes):
    serial = execute(loops, range(6))
    assert len({each.trace.tobytes() for each in serial}) == 6
    with ThreadPoolExecutor(3) as threads:
        for executor in (processes, threads):
            for one, other in zip(serial, execute(loops, range(6), executor), strict=True):
                assert one == other and one.trace.tobytes() == other.trace.tobytes()


def test_copies_are_independent():
    core = LOOPS.start(1)
    core.advance(300_000_000, 0.0, 8.0)
    core.next_event(NS, 2.4, 8.0)
    twin_core = copy.deepcopy(core)
    now = core.now
    assert core.advance(NS, 8.0 * now / NS, 8.0) == twin_core.advance(NS, 8.0 * now / NS, 8.0)
    assert core.schedule == twin_core.schedule
    core.advance(2 * NS, 8.0, 8.0)
    assert twin_core.now == NS and core.schedule != twin_core.schedule


def test_saved_and_read(tmp_path):
    schedule = loops(1)
    schedule.save(tmp_path / "schedule.nc")
    back = Schedule.from_file(tmp_path / "schedule.nc")
    assert back == schedule and hash(back) == hash(schedule) and back.trace.dtype == np.int64
    assert back.report == schedule.report and back != loops(2)
    with pytest.raises(ValueError, match="read-only"):
        back.trace[0, 0] = 1


def test_an_empty_beginning_can_be_reported():
    schedule = Scheduler([Task("model", angle_step=1.0, execution_time=0.1)], spindle_speed_max=1.0).run(
        1.0, start_angle=0.5
    )
    assert schedule.trace.shape == (0, 4)
    report = schedule.report["model"]
    assert (report.releases, report.worst_response, report.utilisation) == (0, 0.0, 0.0)


def test_the_picture_shows_all_work_of_its_window():
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot

    figure = loops(0).plot(0.5, 0.8)
    (axis,) = figure.axes
    bars = [path for c in axis.collections if c.get_label() == "has the processor" for path in c.get_paths()]
    drawn_ms = sum(np.ptp(path.vertices[:, 0]) for path in bars)
    inside = np.clip(loops(0).slices[:, 2:], 0.5 * NS, 0.8 * NS)
    assert drawn_ms == pytest.approx(np.diff(inside).sum() / 1e6, rel=1e-9)
    assert axis.get_xlim() == (500.0, 800.0) and len(axis.get_yticks()) == 4
    assert loops(0).plot().axes[0].get_xlim()[1] < 400.0  # by itself no more than can be seen
    pyplot.close("all")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Task("a", 0.0), r"period of a must be > 0 \(s\); got 0.0"),
        (lambda: Task("a", -0.01), r"period of a must be > 0 \(s\); got -0.01"),
        (lambda: Task("a", float("nan")), r"period of a must be finite \(s\); got nan"),
        (lambda: Task("a", 1e-10), r"period of a must be at least a nanosecond \(s\); got 1e-10"),
        (lambda: Task("a", angle_step=0.0), r"angle_step of a must be > 0 \(rad\); got 0.0"),
        (lambda: Task("a"), r"a must have a period \(s\) or an angle_step \(rad\), one of them"),
        (
            lambda: Task("a", 0.1, angle_step=0.1),
            r"a must have a period \(s\) or an angle_step \(rad\), one of them",
        ),
        (lambda: Task("a", 0.1, priority=0), r"priority of a must be >= 1; got 0"),
        (lambda: Task("a", 0.1, execution_time=-1.0), r"execution_time of a must be >= 0 \(s\); got -1.0"),
        (
            lambda: Task("a", 0.1, execution_time=(0.0, 0.1)),
            r"execution_time of a must be of a mean > 0 where its sd is > 0",
        ),
        (
            lambda: Task("a", 0.1, execution_time=(0.1,)),
            r"execution_time of a must be a time or \(mean, sd\) \(s\); got \(0.1,\)",
        ),
        (lambda: Task("a", 0.1, jitter=0.1), r"jitter of a must be < its period, 0.1 \(s\); got 0.1"),
        (
            lambda: Scheduler([Task("a", 0.1, execution_time=0.08), Task("b", 0.1, execution_time=0.04)]),
            r"utilisation of the tasks must be <= 1 \(1\); got 1.2 \(a 0.8, b 0.4\)",
        ),
        (
            lambda: Scheduler([Task("m", angle_step=0.1, execution_time=0.02)], spindle_speed_max=10.0),
            r"utilisation of the tasks must be <= 1 \(1\); got 2 \(m 2\)",
        ),
        (
            lambda: Scheduler([Task("m", angle_step=0.1)]),
            r"spindle_speed_max must be given \(rad/s\), as m has an angle_step; got None",
        ),
        (
            lambda: Scheduler([Task("a", 0.1), Task("a", 0.2)]),
            r"names of tasks must be without repeats; got 'a' twice",
        ),
        (lambda: LOOPS.run(0.0), r"duration must be > 0 \(s\); got 0.0"),
        (
            lambda: LOOPS.run(1.0, spindle=[1.0, 2.0]),
            r"spindle must be of shape \(n, 3\) \(s, rad/s, rad/s\^2\); got \(2,\)",
        ),
        (lambda: LOOPS.run(1.0, spindle=[(0.0, 1.0, 0.0)]), r"spindle\[0, 0\] must be > 0 \(s\); got 0.0"),
        (lambda: advanced_back(), r"to must be >= now, 20 \(ns\); got 10"),
        (
            lambda: loops(0).jobs("contrl"),
            r"task must be one of control, data, model, communication; got 'contrl'",
        ),
        (lambda: loops(0).plot(3.0), r"first must be in \[0, 2\] \(s\); got 3.0"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def advanced_back():
    core = LOOPS.start()
    core.advance(20)
    core.advance(10)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Scheduler([]), "tasks must be a list of tasks"),
        (lambda: Scheduler([0.01]), r"tasks\[0\] must be a Task; got 0.01"),
        (lambda: LOOPS.start().advance(1.5), "to must be a whole number; got 1.5"),
        (lambda: LOOPS.run(1.0, rng=-1), "rng must be an int >= 0"),
    ],
)
def test_what_is_of_another_type(make, message):
    with pytest.raises(TypeError, match=message):
        make()


def test_partial_runs_pickle():
    assert partial(LOOPS.run, 0.1)(3) == LOOPS.run(0.1, 3)
