"""Pages of logs: the worst part is on top, a difference from the plan has a reason, a changed digit is found."""

import copy
import hashlib
import json
import math
import re
import sys

import html5lib
import numpy as np
import pytest
from scipy import stats

import hwsim
import sdpgrind
from hwsim._log.fingerprint import fingerprint
from hwsim._report.charged import charged_names, least_of, likeness, worst_parts
from hwsim._report.job import made_again
from hwsim._report.log_page import _judged
from hwsim._report.remade import refuse_unable
from hwsim._report.statistics import Promise, counted_share, mean
from hwsim._report.worst import worst_part
from hwsim.cli import main
from sdpgrind import plunge, weldbead
from sdpgrind.base import stored
from sdpgrind.base.sheets import seal
from sdpgrind.base.sheets.amounts import Interval
from sdpgrind.base.sheets.record_page import arrays_digest

PROBLEM = weldbead.preset("P1")


class OnePass:
    """One pass of a duration, then stop."""

    period = None

    def __init__(self, duration=20.0):
        self.duration = duration

    def reset(self):
        self.begun = False

    def step(self, **measured):
        begun, self.begun = self.begun, True
        return {"stop": 1.0} if begun else {"duration": self.duration, "normal_force": 40.0}


def beads(parts, rng=0):
    return hwsim.run(hwsim.WeldBeadStand(PROBLEM), OnePass(), parts=parts, rng=rng)


@pytest.fixture(scope="module")
def cycle():
    return plunge.plan(plunge.preset("simulation"))


@pytest.fixture(scope="module")
def ground(cycle):
    problem = cycle.problem
    controller = plunge.CycleController(problem)
    return hwsim.run(
        hwsim.PlungeGrinder(problem), controller, parts=12, rng=7, adapt=plunge.adaptation(problem)
    )


@pytest.fixture(scope="module")
def page(ground, cycle, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "job.html"
    assert ground.report(path, plan=cycle) == str(path)
    return path


def data_of(path, name):
    return json.loads(re.search(rf'id="{name}">(.*?)</script>', path.read_text("utf-8"), re.S)[1])


def test_the_page_is_html_that_needs_nothing_else(page):
    text = page.read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert "://" not in re.sub(r'xmlns(?::\w+)?="[^"]*"', "", text) and len(text) < 1_500_000
    names = re.findall(r'\bid="([^"]+)"', text)
    assert len(names) == len(set(names)) and text.count("<svg") == 3  # worst parts, all parts, plan
    assert 'application/json" id="problem"' in text and "12 parts on PlungeGrinder" in text


def test_sections_stand_in_order(ground, cycle):
    text = ground.report(plan=cycle)
    wanted = ["Worst parts", "Planned and realised", "Pictures", "Every part", "Problem and model", "Origin"]
    places = [text.index(f"\n{head}\n") for head in wanted]
    assert places == sorted(places) and "time 12." in text[: places[0]]


def test_the_worst_part_is_named_and_a_difference_explained(ground, cycle):
    text, time = ground.report(plan=cycle), ground.outcome.time.values
    assert f"worst {time.max():.2f} s, part {time.argmax()}" in text
    rough = np.argsort(-ground.outcome.roundness.values, kind="stable")[:3]
    assert re.search(rf"^roundness \[µm\] .* {', '.join(map(str, rough))} ", text, re.M)
    assert re.search(r"^time \[s\] .* differs$", text, re.M) and "before it had learned" in text
    assert "burned: none (burn threshold taken as exactly known)" in text


def test_the_job_can_be_run_again_from_its_page(page, ground, cycle):
    job, problem = data_of(page, "job"), data_of(page, "problem")
    assert stored.decode(json.dumps(problem)) == cycle.problem
    assert (job["seed"], job["parts"], job["controller"]["name"]) == (7, 12, "CycleController")
    again = {name: made_again(job[name]["made_of"]) for name in ("plant", "controller")}
    assert all(fingerprint(thing) == job[name]["fingerprint"] for name, thing in again.items())
    made = hwsim.run(**again, parts=12, rng=job["seed"], adapt=plunge.adaptation(again["controller"].problem))
    assert arrays_digest(made.outcome) == job["log"]["outcome"] != arrays_digest(beads(2).outcome)
    assert arrays_digest(cycle.dataset) == job["plan"]["arrays"]


def test_the_same_log_makes_the_same_page(page, ground, cycle, tmp_path):
    ground.report(tmp_path / "again.html", plan=cycle)
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


@pytest.mark.usefixtures("sketch")
def test_a_controller_that_holds_a_socket_has_a_page(tmp_path):
    controller = OnePass()
    log = beads(2)
    controller.line = sys.stdout  # no process can copy it
    log.made_of = log.made_of | {"controller": controller}
    log.report(tmp_path / "job.html")
    told = data_of(tmp_path / "job.html", "job")["controller"]
    assert told == {"name": "OnePass", "fingerprint": None, "made_of": None}


def test_a_page_makes_nothing_but_ours():
    with pytest.raises(ValueError, match="classes of this library; got 'subprocess:Popen'"):
        made_again({"class": "subprocess:Popen", "fields": {"args": "true"}})
    with pytest.raises(ValueError, match="got 'hwsim:run'"):
        made_again({"class": "hwsim:run", "fields": {}})


@pytest.mark.parametrize("section", ["<h1>", 'id="page"', 'id="job"', 'id="problem"'])
def test_verify_finds_a_changed_digit(page, tmp_path, capsys, section):
    text, other = page.read_text("utf-8"), tmp_path / "other.html"
    place = re.compile(r"\d").search(text, text.index(section) + 12).start()
    other.write_text(f"{text[:place]}{9 - int(text[place])}{text[place + 1 :]}", "utf-8")
    assert main(["verify", str(page)]) == 0 and "as it was written" in capsys.readouterr().out
    assert main(["verify", str(other)]) == 1 and str(other) in capsys.readouterr().out


def test_verify_refuses_another_file(tmp_path, capsys):
    (tmp_path / "run.html").write_bytes(b"CDF\xff\xfe")
    assert main(["verify", str(tmp_path / "run.html")]) == 2 == main(["verify", str(tmp_path / "none.html")])
    assert "must be a report" in (told := capsys.readouterr().err) and "existing file" in told
    (tmp_path / "notes.txt").write_text("a text")
    assert main(["verify", str(tmp_path / "notes.txt")]) == 2 == main(["verify", str(tmp_path / "none.nc")])
    assert "saved by this library" in (told := capsys.readouterr().err) and "existing file" in told
    table = tmp_path / "doubts.csv"
    table.write_text("value,believed\n")
    assert main(["verify", str(table)]) == 2
    assert "doubts.csv' holds none: a table or a text has no digest" in capsys.readouterr().err


def test_names_from_files_are_escaped(tmp_path):
    table = {"t [s]": np.arange(20.0), "<script>alert(1)</script> [W]": np.arange(20.0) + 100.0}
    log = hwsim.Log.read(table, time="t", grinding_power="<script>alert(1)</script>")
    log.report(tmp_path / "job.html")
    text = (tmp_path / "job.html").read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert "<script>alert" not in text and "&lt;script&gt;alert(1)" in text
    assert not seal.changes(text)


def test_many_parts_are_cut_and_counted(tmp_path):
    log = beads(600)
    log.report(tmp_path / "job.html")
    text = (tmp_path / "job.html").read_text("utf-8")
    assert "The first 500 of 600 parts" in text and len(text.encode()) < 1_500_000
    assert f"part {int(np.argmax(log.outcome.penalty.values))}" in text


def test_a_comparison_has_a_page(tmp_path):
    stand = hwsim.WeldBeadStand(PROBLEM)
    log = hwsim.compare(stand, {"fast": OnePass(10.0), "slow": OnePass(20.0)}, parts=5)
    log.report(tmp_path / "both.html")
    text = (tmp_path / "both.html").read_text("utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert "slow minus fast" in text and not seal.changes(text)
    told = log.report()
    assert told.startswith("fast and slow compared: 5 parts on WeldBeadStand\n")
    assert (
        re.search(r"^time \[s\] +10 in every part$", told, re.M)
        and "same 5 parts on WeldBeadStand by fast" in told
    )
    assert re.search(r"^seed +0$", told, re.M) and "by each of fast, slow" in repr(log)
    with pytest.raises(ValueError, match="the OnePass of this one cannot be told by values"):
        refuse_unable({"job": data_of(tmp_path / "both.html", "job")})


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("centering.profile", "a measured profile cannot be made again"),
        ("centering.roundness", "a sheet of a measured ring cannot be made again"),
        ("identify.doubts", "a page of doubts on measured data cannot be made again"),
        ("sdp.policy", "this one is of a plan of its own kind, sdp.policy"),
    ],
)
def test_what_cannot_be_made_again_is_named(kind, told):
    with pytest.raises(ValueError, match=told):
        refuse_unable({"plan": {"kind": kind, "arrays": ""}})


def test_a_comparison_tells_scrap_in_its_verdict(cycle):
    problem = cycle.problem
    careful = plunge.CycleController(problem)
    sharper = problem.replace(wear_flat_area=0.02, sharpness_sd=0.0, deflection_sd=0.0)
    bold = plunge.CycleController(sharper, online=False)
    log = hwsim.compare(hwsim.PlungeGrinder(problem), {"careful": careful, "bold": bold}, parts=4, rng=3)
    burned = log.outcome.burned.values.sum(axis=1).astype(int)
    assert burned[0] == 0 < burned[1]
    told = log.report()
    verdict = told[: told.index("Worst part of each controller")]
    assert f"burned: none by careful, {burned[1]} by bold" in verdict
    assert re.search(rf"^burned +0 of 4 \(0 to 60.2 %\) +{burned[1]} of 4 \(", told, re.M)


def test_flags_are_counted_with_the_interval_of_their_share():
    """Two ways: scipy's exact binomial test."""
    for count, n in ((0, 5), (1, 5), (19, 20), (20, 20)):
        flags = np.arange(n) < count
        low, high = stats.binomtest(count, n).proportion_ci(method="exact")
        assert counted_share(flags.astype(float)) == f"{count} of {n} ({100 * low:.2g} to {100 * high:.3g} %)"
    assert counted_share(np.array([np.nan])) == "not known"


def test_a_mean_of_what_cannot_be_negative_has_no_negative_interval():
    seldom = np.array([0.0, 0.0, 0.0, 0.8])
    assert mean(seldom, least_of("overground")).shown(1.0) == "0.20 (0 to 0.84)"
    assert mean(seldom, least_of("slack")).shown(1.0) == "0.20 ± 0.64"
    log = beads(4)
    log.outcome["lateness"] = ("part", seldom, {"units": "s"})
    assert re.search(r"^lateness \[s\] .* 0.20 \(0 to 0.84\)$", log.report(), re.M)


@pytest.mark.parametrize("noun", ["Part", "Parts"])
def test_the_picture_of_the_worst_parts_names_the_part_it_shows(page, ground, noun):
    text, worst = page.read_text("utf-8"), worst_parts(ground, charged_names(ground), 3)
    assert set(worst) <= set(np.flatnonzero(ground.outcome.time >= np.sort(ground.outcome.time)[-3]))
    pictures = re.findall(r"<svg\b.*?</svg>", text, re.S)
    shown = {"Part": f"Part {worst[0]}", "Parts": f"Parts {', '.join(map(str, worst[::-1]))}"}[noun]
    assert f">{shown}<" in pictures[0] and "The last part" not in text
    assert f"The 3 worst parts (by time, then part slack), worst first: {', '.join(map(str, worst))}" in text
    assert f">Part {len(ground) - 1}, the last<" in pictures[1]


def test_the_picture_of_the_worst_parts_says_what_spoiled_the_first_of_them(ground):
    """A part out of round is worse than any slower one: the time alone would rank it last."""
    spoiled = copy.deepcopy(ground)
    best = int(np.argmin(spoiled.outcome.time.values))
    spoiled.outcome["out_of_round"] = ("part", 1.0 * (np.arange(len(spoiled)) == best), {"units": "1"})
    assert worst_parts(spoiled, charged_names(spoiled), 1) == [best]
    told = rf"The 3 worst parts \(by out of round, then time\), worst first: {best}, .*\]"
    assert re.search(told, spoiled.report())


def test_several_pages_are_checked_together(page, tmp_path, capsys):
    good, bad = tmp_path / "good.html", tmp_path / "bad.html"
    text = page.read_text("utf-8")
    good.write_text(text, "utf-8")
    bad.write_text(text.replace("12 parts on", "13 parts on", 1), "utf-8")
    assert main(["verify", str(page), str(good)]) == 0
    assert capsys.readouterr().out.count("as it was written") == 2
    assert main(["verify", str(bad), str(good)]) == 1 == main(["verify", str(good), str(bad)])
    assert main(["verify", str(tmp_path / "none.html"), str(good)]) == 2
    told = capsys.readouterr().out
    assert "none.html: not checked" in told and told.count(f"{good}: as it was written") == 3
    assert main(["verify", str(good), str(bad), "--rerun", str(tmp_path / "again")]) == 2
    assert "--rerun makes one page again; got 2" in capsys.readouterr().err


def test_without_learning_no_reason_tells_of_it(ground, cycle):
    log = hwsim.run(hwsim.PlungeGrinder(cycle.problem), plunge.CycleController(cycle.problem), parts=4, rng=1)
    assert "margins were learned" not in log.report(plan=cycle)


@pytest.mark.usefixtures("sketch")
def test_a_page_is_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "job.html"
    path.write_text("before")
    monkeypatch.setattr(seal, "sealed", lambda page: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        beads(2).report(path)
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


def test_a_command_leaves_a_page_and_names_the_worst(tmp_path, capsys):
    line = ["weldbead", "--preset", "P1", "--simple", "--tolerance", "0.01", "--parts", "14", "--no-pictures"]
    assert main([*line, "--out", str(tmp_path / "run")]) == 0
    told, log = capsys.readouterr().out, __import__("sdpgrind").load(tmp_path / "run" / "run.nc")
    penalty = log.outcome.penalty.values
    worst, of = (row.split() for row in told.splitlines() if row.startswith(("worst", "in ")))
    assert float(worst[-1]) == pytest.approx(penalty.max(), abs=1e-4) and int(of[-1]) == penalty.argmax()
    assert "report.html" in told and main(["verify", str(tmp_path / "run" / "report.html")]) == 0
    job = data_of(tmp_path / "run" / "report.html", "job")
    assert job["command"]["preset"] == "P1" and job["command"]["simple"] and job["seed"] == 0


def test_without_jinja_the_command_says_so(tmp_path, capsys, monkeypatch):
    from sdpgrind.base.sheets import page as pages

    pages._template.cache_clear()
    monkeypatch.setitem(sys.modules, "jinja2", None)
    line = [
        "plunge",
        "--preset",
        "simulation",
        "--parts",
        "1",
        "--no-pictures",
        "--out",
        str(tmp_path / "run"),
    ]
    assert main(line) == 0
    assert "no page (a page needs jinja2: pip install 'sdpgrind[report]'" in capsys.readouterr().out


def test_worst_by_its_direction():
    assert worst_part("time", np.array([1.0, 3.0, 2.0])) == 1
    assert worst_part("part_slack", np.array([1.0, math.nan, 0.5])) == 2
    assert worst_part("height", np.array([0.1, -0.2, 0.0])) == 1
    assert worst_part("time", np.array([2.0, 2.0])) is None is worst_part("true_mu", np.array([1.0, 2.0]))
    log = beads(8)
    assert worst_parts(log, ("penalty",), 3)[0] == int(np.argmax(log.outcome.penalty.values))


def test_of_parts_alike_the_next_figure_tells_the_worst():
    log = beads(4)
    for name, values in (("time", [11.04, 11.04 + 1e-14, 11.04, 11.04]), ("slack", [3.0, 1.0, 2.0, 1.0])):
        log.outcome[name] = ("part", np.array(values), {})
    assert worst_parts(log, ("time",), 3) == [0, 1, 2] and worst_parts(log, ("time", "slack"), 3) == [1, 3, 2]
    log.outcome["time"] = ("part", np.array([11.0, 12.0, 11.0, 12.0]), {})
    log.outcome["slack"] = ("part", np.array([1.0, 2.0, 3.0, 1.0]), {})
    assert worst_parts(log, ("time", "slack"), 4) == [3, 1, 0, 2]


def test_intervals_and_differences():
    values = np.array([1.0, 2.0, 3.0, 4.0])
    found = mean(values)
    assert found.value == 2.5 and found.half == pytest.approx(3.182446 * math.sqrt(5 / 3) / 2, rel=1e-6)
    near, far = Promise(Interval(0.5, 0.0)), Promise(Interval(0.4, 0.0))  # half of the interval is 2.054
    assert not near.differs(values) and far.differs(values)
    assert Promise(values - np.array([0.1, 0.1, 0.1, 0.11])).differs(values)  # part by part
    assert math.isnan(mean(values[:1]).half) and mean(np.ones(3)).half == 0.0
    assert mean(np.full(20, 10.44)).shown(1.0) == "10.44 in every part"
    assert Promise(Interval(10.4, 0.0)).difference(np.full(20, 10.44)).shown(1.0) == "0.04 in every part"


@pytest.mark.parametrize("planned", np.linspace(-0.5, 1.5, 21))
def test_the_verdict_on_a_difference_is_that_of_its_interval(planned):
    values = np.random.default_rng(4).normal(0.5, 0.7, 20)
    promise = Promise(Interval(planned, 0.05))
    off = promise.difference(values)
    assert promise.differs(values) == (abs(off.value) > off.half)


def test_an_interval_as_wide_as_the_plan_tells_nothing():
    """Two parts: Student's t of one degree of freedom is 12.7, 0.14 +- 0.28 N on a planned 0.2 N."""
    force = np.array([0.3130, 0.3576])
    promise = Promise(Interval(0.2, 0.0))
    assert promise.difference(force).half == pytest.approx(12.706 * 0.0223, rel=1e-3)
    assert not promise.differs(force) and not promise.told(force)
    assert _judged(promise, force) == "not told by 2 parts"
    near = np.array([0.19, 0.20, 0.21, 0.20])
    assert promise.told(near) and _judged(promise, near) == "as planned"
    assert promise.told(10 * force) and _judged(promise, np.array([0.4, 0.41, 0.4])) == "differs"
    assert Promise(Interval(0.0, 0.0)).told(force - 0.33) and _judged(promise, force[:1]) == "one value"


def test_a_hidden_truth_that_explains_is_named():
    log = beads(20)
    true = [name for name in log.outcome if str(name).startswith("true_")]
    log.outcome["true_knob"] = ("part", log.outcome.penalty.values * -2.0)
    assert "true knob (correlation -1.00)" in likeness(log, "penalty") and "true_knob" not in true


def test_doubts_have_a_page_and_stand_on_that_of_their_log(tmp_path):
    time = np.arange(200) * 0.05
    rate = np.where(time < 4.0, 0.04, 0.0)
    lag = 0.06 * (np.exp(-np.maximum(time - 4.0, 0.0) / 1.5) - np.exp(-time / 1.5))
    size = 0.04 * np.minimum(time, 4.0) - lag + np.random.default_rng(0).normal(0.0, 3e-4, 200)
    table = {"t [s]": time, "X [mm]": size, "v [mm/s]": rate}
    log = hwsim.Log.read(table, time="t", size="X", command_rate="v")
    problem = plunge.preset("simulation")
    doubts = problem.doubts(log)
    assert doubts.report(tmp_path / "doubts.html") == str(tmp_path / "doubts.html")
    log.report(tmp_path / "log.html", problem=problem, doubts=doubts)
    for name in ("doubts.html", "log.html"):
        text = (tmp_path / name).read_text("utf-8")
        html5lib.HTMLParser(strict=True).parse(text)
        assert "time constant [s]" in text and "differs (by chance" in text and "Not told by the data" in text
        assert seal.changes(text) == []
    assert doubts.report().startswith("Doubts\n") and str(log.source) in log.report(problem=problem)
    assert "<td>time_constant [s]</td>" in doubts._repr_html_()
    html5lib.HTMLParser(strict=True).parse("<!DOCTYPE html><title>t</title>" + doubts._repr_html_())


def test_doubts_name_file_digest_and_parts(tmp_path):
    time = np.arange(60) * 0.05
    rows = [f"{part};{t:.2f};{0.04 * t:.5f};0.04" for part in ("W-1", "W-2", "W-3") for t in time]
    path = tmp_path / "shaft.csv"
    path.write_text("\n".join(["Teil;t [s];X [mm];v [mm/s]", *rows]) + "\n")
    log = hwsim.Log.read(path, time="t", part="Teil", size="X", command_rate="v")
    table, digest = log["data"], hashlib.sha256(path.read_bytes()).hexdigest()
    whole = plunge.preset("simulation").doubts(log)
    one = plunge.preset("simulation").doubts(table.isel(row=np.flatnonzero(table.part.values == 1)))
    assert f"\nData: shaft.csv, SHA-256 {digest}\nParts: W-1, W-2, W-3\n" in str(whole)
    assert f"\nData: shaft.csv, SHA-256 {digest}\nPart: W-2\n" in one.report()
    assert one.report().startswith("Doubts: shaft.csv\n")
    one.save(tmp_path / "doubts.nc")
    assert str(sdpgrind.load(tmp_path / "doubts.nc")) == str(one)


def test_the_page_of_a_file_tells_what_was_read_and_invents_no_verdict():
    table = {"t [s]": np.arange(20.0), "P [kW]": np.linspace(1.0, 2.0, 20), "n": np.repeat([1, 2], 10)}
    one = hwsim.Log.read({name: table[name] for name in ("t [s]", "P [kW]")}, time="t", grinding_power="P")
    told = one.report()
    assert "20 rows of 1 part read from the mapping, 19 s in all" in told
    assert re.search(r"^grinding power \[W\] +20 +1000 +1500 +2000$", told, re.M)
    assert not any(words in told for words in (" by :", "finished", "Worst parts", "Every part", "1 parts"))
    rates = {"t [s]": np.arange(20.0), "X [mm]": 0.04 * np.arange(20.0), "v [mm/s]": np.full(20, 0.04)}
    fed = hwsim.Log.read(rates, time="t", size="X", command_rate="v")
    assert re.search(r"^command rate \[µm/s\] +20 +40.00 +40.00 +40.00$", fed.report(), re.M)
    axes = fed.plot().axes  # in the units of the table
    assert [axis.get_ylabel() for axis in axes] == ["size [mm]", "command rate [µm/s]"]
    assert axes[1].lines[0].get_ydata()[0] == pytest.approx(40.0)
    two = hwsim.Log.read(table, time="t", grinding_power="P", part="n")
    assert "20 rows of 2 parts" in (told := two.report()) and "Every part" in told
