"""Programs of a planned cycle: followed by a parser of this file and by LinuxCNC's own, against the plan.

LinuxCNC's interpreter is found as ``rs274`` on the path, or by the variable RS274; without it those tests are
skipped. It is part of Debian's package linuxcnc-uspace.
"""

import os
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plunge_inside import AxisCourse, blocks_of, exact, limits_of, read_ngc
from scipy.optimize import linprog

import sdpgrind
from sdpgrind import plunge, units

SIMULATION, EXPERIMENT = plunge.preset("simulation"), plunge.preset("experiment")
PRINTED = 5e-5  # mm: the interpreter prints four decimals
NONE = dict.fromkeys(("sharpness_sd", "deflection_sd", "contact_zero_sd"), 0.0)
DECLARED = SIMULATION.replace(
    uncertainty=plunge.Uncertainty(
        burning_sd=0.03, diffusivity_sd=0.05, sharpness_sd=0.1, deflection_sd=0.1, contact_zero_sd=0.01
    ),
    drive=plunge.Drive(feed_lag=0.05, feed_delay=0.04, power_lag=0.1),
)


def blind(problem, confidence, **doubts):
    return problem.replace(**doubts), {"confidence": confidence, "gauge": False}


PLANS = {
    "nominal": (SIMULATION, {}),
    "margin": (SIMULATION, {"safety_margin": 0.005}),
    "very round": (SIMULATION.replace(roundness_max=0.0017), {}),
    "loose": (SIMULATION.replace(roundness_max=0.008), {}),
    "slow": (SIMULATION.replace(command_rate_max=0.02), {}),
    "more stock": (SIMULATION.replace(stock=0.5), {}),
    "experiment": (EXPERIMENT, {}),
    "linear": (SIMULATION.replace(linear_time_constant=1.9), {}),
    "stages": (SIMULATION, {"method": "dp"}),
    "experiment, doubted": blind(EXPERIMENT, 0.999),
    "B 1 %": blind(SIMULATION, 0.999, **NONE, burning_sd=0.01),
    "B 2 %": blind(SIMULATION, 0.999, **NONE, burning_sd=0.02),
    "B 3 %": blind(SIMULATION, 0.99, **NONE, burning_sd=0.03),
    "B 4.5 %": blind(SIMULATION, 0.999, **NONE, burning_sd=0.045),
    "B, diffusivity": blind(SIMULATION, 0.999, **NONE, burning_sd=0.02, diffusivity_sd=0.05),
    "contact 2 um": blind(SIMULATION, 0.999, **NONE | {"contact_zero_sd": 0.002}, burning_sd=0.01),
    "deflection": blind(SIMULATION, 0.99, **NONE | {"deflection_sd": 0.05}, burning_sd=0.01),
    "default doubts": blind(SIMULATION, 0.999),
    "declared": blind(DECLARED, 0.999),
    "worn wheel": blind(DECLARED, 0.9, grinding_ratio=60.0),
}  # twenty


@cache
def planned(name):
    problem, options = PLANS[name]
    return plunge.plan(problem, **options)


def certain(plan):
    return {"certain": plan.confidence is None}


@cache
def written(name, deviation=1e-4):
    plan = planned(name)
    return plan.program("ngc", deviation=deviation, **certain(plan))


@cache
def dense(name):
    """Time (s) and position (mm) of the plan, with 25 times as many samples."""
    plan = planned(name)
    if plan.solution is None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(exact, "SAMPLES", 25 * exact.SAMPLES)
            course = exact.fastest(limits_of(plan.problem, plan._safety))[2]
        time, left, y = course.time, course.remaining, course.y + plan.problem.model.core.K0
        y[0] = 0.0
    else:
        course = plan.trajectory
        time, left, y = (course[name].values for name in ("time", "remaining", "deflection"))
    worn = plan.problem.model.work_diameter / plan.problem.model.wheel_diameter
    return time, (left[0] - left) * (1 + worn / plan.problem.model.grinding_ratio) + y


def followed(text, axis="X"):
    """Corners of a program: the parser of this file, which knows only what a program may hold."""
    body = [line for line in text.splitlines() if not line.startswith("(")]
    assert body[0] == "G21 G90 G94" and body[-1] == "M2" and all(line.isascii() for line in body)
    time, position = [0.0], [0.0]
    for line in body[1:-1]:
        if pause := re.fullmatch(r"G4 P(\d+\.\d{4,7})", line):
            time.append(time[-1] + float(pause[1]))
            position.append(position[-1])
        else:
            move = re.fullmatch(rf"G1 {axis}(\d+\.\d{{4,7}}) F(\d+\.\d{{4,7}})", line)
            time.append(time[-1] + (float(move[1]) - position[-1]) / (float(move[2]) / 60))
            position.append(float(move[1]))
    return np.array(time), np.array(position)


def away(name, corners):
    """Greatest distance (mm) from the plan at samples and corners; both hold their ends."""
    time, position = dense(name)
    every = np.union1d(time, corners[0])
    return np.max(np.abs(np.interp(every, time, position) - np.interp(every, *corners)))


@pytest.mark.parametrize("name", PLANS)
def test_is_within_the_stated_deviation_at_all_times(name):
    program = written(name)
    corners, found = followed(program.text), program.check()
    assert away(name, corners) <= 1e-4 * (1 + 1e-9)
    # the plan's samples are straight lines for `check`, which leave the denser ones by some nanometres
    assert found.deviation == pytest.approx(away(name, corners), abs=2e-8)
    assert found.time == pytest.approx(corners[0][-1], abs=1e-9)
    assert corners[0][-1] == pytest.approx(planned(name).time, abs=2.1e-3)


@settings(max_examples=60)
@given(
    steps=st.lists(
        st.tuples(st.floats(1e-3, 1.0), st.one_of(st.just(0.0), st.floats(1e-5, 0.1))),
        min_size=1,
        max_size=40,
    ),
    deviation=st.floats(1e-4, 1e-2),
)
def test_blocks_of_any_course(steps, deviation):
    """Rates (mm/s) held for some time (s), in any order: each block of four decimals stays within."""
    held, rates = np.array(steps).T
    time, position = (np.concatenate([[0.0], np.cumsum(part)]) for part in (held, held * rates))
    blocks = blocks_of(AxisCourse(time, position, 0.0), deviation, 4)
    ends, joined = (np.array([0.0, *(getattr(b, name) for b in blocks)]) for name in ("end", "position"))
    every = np.union1d(time, ends)
    far = np.abs(np.interp(every, time, position) - np.interp(every, ends, joined))
    assert np.max(far) <= deviation * (1 + 1e-9) and abs(ends[-1] - time[-1]) <= 2e-3
    assert all(round(b.position, 4) == b.position and round(b.feed, 4) == b.feed for b in blocks)


def test_too_few_decimals_are_told():
    moment = AxisCourse(np.array([0.0, 1e-5]), np.zeros(2), 0.0)
    with pytest.raises(
        ValueError, match=r"deviation must be greater for blocks of 4 decimals \(mm\); got 0\.001"
    ):
        blocks_of(moment, 1e-3, 4)


@pytest.mark.parametrize(("deviation", "blocks"), [(1.0, 3), (0.1, 4), (0.05, 4), (0.02, 5)])
def test_blocks_of_the_nominal_plan(deviation, blocks):
    """Deviations in µm and blocks of the project's derivation."""
    program = written("nominal", units.um(deviation))
    corners = followed(program.text)
    assert len(corners[0]) - 1 == blocks
    assert away("nominal", corners) <= units.um(deviation) * (1 + 1e-9)


def fewest(name, tolerance):
    """Least number of lines within the tolerance (mm), joined or not: from each sample the longest that fits.

    A straight line fits samples where the least greatest distance of a line is within the tolerance. Some 500
    of the samples are taken: fewer conditions need no more lines.
    """
    time, position = dense(name)
    kept = np.unique(np.linspace(0, time.size - 1, 500).astype(int))
    time, position = time[kept], position[kept]

    def fits(first, last):
        t, p = time[first:last] - time[first], position[first:last]
        rows = np.column_stack([t, np.ones_like(t)])
        limits = np.concatenate([p, -p])
        both = np.column_stack([np.concatenate([rows, -rows]), -np.ones(limits.size)])
        best = linprog([0, 0, 1], A_ub=both, b_ub=limits, bounds=[(None, None)] * 3)
        return best.fun <= tolerance

    count, first = 0, 0
    while first < time.size:
        low, high = first + 1, time.size
        while low < high:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if fits(first, middle) else (low, middle - 1)
        count, first = count + 1, low
    return count


@pytest.mark.parametrize("name", ["nominal", "very round", "B 4.5 %", "default doubts", "declared"])
def test_few_blocks(name):
    """One more than lines need that need not join, or none."""
    assert len(followed(written(name).text)[0]) - 1 <= fewest(name, 1e-4) + 1


RS274 = os.environ.get("RS274") or shutil.which("rs274")


def interpreted(text, folder):
    """Corners of a program by LinuxCNC's interpreter: canonical commands, with four decimals."""
    (folder / "tool.tbl").touch()
    (folder / "cycle.ngc").write_text(text)
    call = [RS274, "-g", "-t", "tool.tbl", "-v", "rs.var", "cycle.ngc"]
    told = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=True).stdout
    assert "PROGRAM_END()" in told and "USE_LENGTH_UNITS(CANON_UNITS_MM)" in told
    time, position, feed = [0.0], [0.0], 0.0
    for name, values in re.findall(r"(SET_FEED_RATE|STRAIGHT_FEED|DWELL)\(([^)]*)\)", told):
        x = float(values.split(",")[0])
        if name == "SET_FEED_RATE":
            feed = x
            continue
        took = x if name == "DWELL" else (x - position[-1]) / (feed / 60)
        time.append(time[-1] + took)
        position.append(position[-1] if name == "DWELL" else x)
    return np.array(time), np.array(position)


@pytest.mark.skipif(RS274 is None, reason="LinuxCNC's rs274 is not installed")
@pytest.mark.parametrize("name", PLANS)
def test_linuxcnc_accepts_it(name, tmp_path):
    corners = interpreted(written(name).text, tmp_path)
    assert away(name, corners) <= 1e-4 + PRINTED
    assert corners[0][-1] == pytest.approx(planned(name).time, abs=0.02)


@pytest.mark.skipif(RS274 is None, reason="LinuxCNC's rs274 is not installed")
@pytest.mark.parametrize("deviation", [1.0, 0.05, 0.02])
def test_linuxcnc_at_other_deviations(deviation, tmp_path):
    corners = interpreted(written("nominal", units.um(deviation)).text, tmp_path)
    assert away("nominal", corners) <= units.um(deviation) + PRINTED
    assert corners[0][-1] == pytest.approx(planned("nominal").time, abs=0.02)


def test_diameter_and_axis():
    plan = planned("nominal")
    words = {"deviation": 1e-4, "certain": True}
    radius, double = plan.program(**words), plan.program(axis="U", diameter=True, **words)
    (time, position), (same, twice) = followed(radius.text), followed(double.text, "U")
    np.testing.assert_allclose(same, time, rtol=1e-12)
    np.testing.assert_allclose(twice, 2 * position, rtol=1e-12)
    assert double.check() == pytest.approx(radius.check(), rel=1e-9)
    assert "(U: diameter, twice the radial infeed" in double.text


@pytest.mark.parametrize("name", ["nominal", "worn wheel", "stages"])
def test_table_at_the_sample_time(name):
    plan = planned(name)
    program = plan.program("csv", deviation=1e-4, **certain(plan))
    first, *rows = program.text.splitlines()
    assert first == "time_s,position_mm"
    time, position = np.array([[float(cell) for cell in row.split(",")] for row in rows]).T
    np.testing.assert_allclose(time, np.arange(time.size) * plan.problem.sample_time, rtol=0, atol=1e-9)
    assert 0 <= time[-1] - plan.time < plan.problem.sample_time
    np.testing.assert_allclose(position, np.interp(time, *dense(name)), rtol=0, atol=5.1e-7)
    assert program.check().deviation <= 5e-7 * (1 + 1e-6) and program.check().time == time[-1]


@pytest.mark.parametrize("target", ["ngc", "csv"])
def test_is_read_back_before_it_is_written(target, tmp_path):
    plan = planned("nominal")
    program, path = plan.program(target, deviation=1e-4, certain=True), tmp_path / "cycle"
    program.save(path)
    assert path.read_bytes() == program.text.encode("ascii")
    last = re.findall(r"0\.298\d+", program.text)[-1]
    wrong = replace(program, text=program.text.replace(last, "0.2989"))
    assert wrong.check().deviation == pytest.approx(0.2989 - dense("nominal")[1][-1], rel=1e-2)
    with pytest.raises(
        ValueError, match=r"text must stay within the stated 0\.0001 of the plan \(mm\); read"
    ):
        wrong.save(path)
    assert path.read_text() == program.text and len(list(tmp_path.iterdir())) == 1


def test_what_the_head_says():
    text = written("default doubts").text
    head = [line for line in text.splitlines() if line.startswith("(")]
    assert text.isascii() and max(map(len, head)) < 256  # LinuxCNC's longest line
    assert all(line.endswith(")") and "(" not in line[1:] and ")" not in line[:-1] for line in head)
    for words in (
        "(open loop: no gauge, so every doubt of contact and deflection counts in full)",
        "(confidence: 0.999 that no finished surface is burned)",
        "(burn threshold taken as exactly known)",
        "(doubt: contact_zero_sd = 0.01 mm)",
        "(deviation: within 0.0001 mm of the planned infeed at all times, rounding included)",
        "(problem: radial stock 0.282 mm, infeed at most 0.0448 mm/s)",
        "(X0 is first contact of wheel and work, where the program begins)",
    ):
        assert words in head
    assert "taken as exactly known" not in written("declared").text
    assert "(certain: all values are taken as exact" in written("nominal").text
    assert "(burn threshold taken as exactly known)" in written("nominal").text
    assert "(safety margin: 0.005 mm)" in written("margin").text
    assert "(wheel wear is fed in addition: 0.00658 mm of radius)" in written("worn wheel").text


def test_of_a_saved_plan(tmp_path):
    plan = planned("declared")
    plan.save(tmp_path / "plan.nc")
    again = sdpgrind.load(tmp_path / "plan.nc").program("ngc", deviation=1e-4)
    assert again.text == written("declared").text


def ground(model, time, position, contact=0.0, step=0.01):
    """Rate (mm/s) and metal removed (mm) of a truth under an axis: Heun's rule, contact later by `contact`."""
    every = np.arange(0.0, time[-1] + step, step)
    axis, core, q = np.interp(every, time, position), model.core, 0.0
    rates, removed = np.zeros(every.size), np.zeros(every.size)

    def rate(fed, q):
        deflection = fed - contact - (1 + model.wheel_wear) * q
        return float(model.infeed_rate(deflection)) if deflection > core.K0 else 0.0

    for k in range(1, every.size):
        before = rate(axis[k - 1], q)
        q += 0.5 * step * (before + rate(axis[k], q + step * before))
        rates[k], removed[k] = rate(axis[k], q), q
    return rates, removed


@pytest.mark.parametrize("name", ["nominal", "declared", "worn wheel"])
def test_ends_at_size(name):
    """The program under the believed model: 0.1 µm off all along leaves 0.1 µm at most."""
    plan = planned(name)
    rates, removed = ground(plan.problem.model, *followed(written(name).text))
    assert removed[-1] == pytest.approx(plan.problem.stock, abs=1.5e-4)
    assert rates[-1] <= plan.problem.final_rate + 1e-4 / plan.problem.time_constant


def burned(plan, parts):
    """Parts of drawn truths under the plan's axis that show damage at size."""
    corners, rng, count = dense_of(plan), np.random.default_rng(8), 0
    for model in (plan.problem.draw(rng) for _ in range(parts)):
        contact = plan.problem.uncertainty.contact_zero_sd * rng.standard_normal()
        rates, removed = ground(model, *corners, contact, step=0.04)
        hot = rates > 2 * model.burn_onset[0]
        depth = np.where(hot, model.burn_depth(np.where(hot, rates, 1.0)), 0.0)
        count += bool(np.any(depth > np.maximum(plan.problem.stock - removed, 0.0) + 1e-6))
    return count


def dense_of(plan):
    t = plan.trajectory
    return t.time.values, (t.remaining[0] - t.remaining + t.deflection).values


def test_without_a_gauge_the_confidence_is_kept():
    """At 0.9 of 60 parts 6 may burn, 13 by chance (3 sd); the plan with a gauge, run blind, burns more."""
    kept, lost = (plunge.plan(DECLARED, confidence=0.9, gauge=gauge) for gauge in (False, True))
    assert burned(kept, 60) <= 13 < burned(lost, 60)


PROBLEM_CALL = r"plunge\.plan\(problem, confidence=0\.999, gauge=False\)"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, f"certain must be True for a plan that takes all values as exact; {PROBLEM_CALL}"),
        ({"certain": 1}, "certain must be a bool; got 1"),
        ({"target": "gcode"}, "target must be one of ngc, csv; got 'gcode'"),
        ({"deviation": 0.0}, r"deviation must be > 0 \(mm\); got 0.0"),
        ({"deviation": -1e-4}, r"deviation must be > 0 \(mm\)"),
        (
            {"deviation": 0.1},
            r"deviation must be in mm, some 0.0001; units.um\(...\) for micrometres; got 0.1",
        ),
        ({"deviation": 1e-7}, r"deviation must be in mm, some 0.0001; units.m\(...\) for metres; got 1e-07"),
        ({"deviation": "fine"}, r"deviation must be a number \(mm\); got 'fine'"),
        ({"axis": "x"}, "axis must be one of X, Y, Z, U, V, W; got 'x'"),
        ({"diameter": 2}, "diameter must be a bool; got 2"),
    ],
)
def test_refused(options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        planned("nominal").program(**{"deviation": 1e-4} | options)


def test_refused_plans():
    gauged = plunge.plan(SIMULATION, confidence=0.99)
    call = r"plunge\.plan\(problem, confidence=0\.99, gauge=False\); got True"
    with pytest.raises(ValueError, match="gauge must be False in a plan for a program, .*" + call):
        gauged.program(deviation=1e-4)
    with pytest.raises(ValueError, match="certain must be False for a plan with a confidence"):
        planned("declared").program(deviation=1e-4, certain=True)
    stages = planned("stages")
    lame = plunge.CyclePlan(
        SIMULATION, 0.0, np.inf, stages.switches, stages.trajectory, "dp",
        plunge.CycleSolution(200, 0, 0.0, 0.0, 0.1, "solved"),
    )  # fmt: skip
    with pytest.raises(
        ValueError, match="plan must be solved before it becomes a program; it was solved, but"
    ):
        lame.program(deviation=1e-4, certain=True)
    turning = stages.trajectory.copy()
    turning["work_rotation"] = turning.work_rotation + np.linspace(0, 1, turning.time.size)
    free = plunge.CyclePlan(SIMULATION, 0.0, 0.1, stages.switches, turning, "dp", stages.solution)
    with pytest.raises(
        ValueError, match=r"plan must have one rotation of the work \(rad/s\), .* 31.42 to 32.42"
    ):
        free.program(deviation=1e-4, certain=True)


def test_a_deviation_below_four_decimals_is_warned():
    with pytest.warns(
        UserWarning, match="deviation = 5e-06 mm is lost in a control that takes four decimals"
    ):
        program = planned("nominal").program(deviation=5e-6, certain=True)
    assert away("nominal", followed(program.text)) <= 5e-6 * (1 + 1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("G20 G90 G94\nG1 X1 F60\nM2\n", "line 1 is 'G20 G90 G94'"),
        ("G21 G90 G94\nG2 X1 F60\nM2\n", "line 2 is 'G2 X1 F60'"),
        ("G21 G90\nG1 X1 F60\nM2\n", "line 2 is 'G1 X1 F60'"),
        ("G21 G90 G94\nG1 X1\nM2\n", "line 2 is 'G1 X1'"),
        ("G21 G90 G94\nG1 Y1 F60\nM2\n", "line 2 is 'G1 Y1 F60'"),
        ("G21 G90 G94\nG1 X1.2.3 F60\nM2\n", "words of a letter and a number; line 2"),
        ("G21 G90 G94\nG1 X1 F60\n", "ends by M2"),
    ],
)
def test_a_text_of_something_else_is_not_followed(text, message):
    with pytest.raises(ValueError, match=message):
        read_ngc(text, "X")


def test_the_reader_knows_modal_feeds_and_comments():
    path = read_ngc("(a; b)\n\nG21 G90 (c)\nG94 ; d\nG1 X1 F60\nG1 X2\nG4 P1.5 (e)\nM2\n", "X")
    np.testing.assert_allclose(path.time, [0, 1, 2, 3.5])
    np.testing.assert_allclose(path.position, [0, 1, 2, 2])
