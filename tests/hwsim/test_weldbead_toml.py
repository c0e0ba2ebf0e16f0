"""Jobs as TOML: the shipped example, every table, and one clear line for every fault."""

from pathlib import Path

import numpy as np
import pytest
from cli_fakes import without_news

import hwsim
from hwsim.cli import main
from hwsim.command._weldbead.toml import read
from sdpgrind import sdp, units, weldbead
from sdpgrind.weldbead import passes

pytestmark = pytest.mark.usefixtures("sketched")
EXAMPLE = Path(__file__).parents[2] / "examples" / "weldbead.toml"

P1 = """
bead_length = 50.0
reset_time = "2 s"
durations = [6, 8, "10 s", 12, 14, 16, 18, 20]
force_max = "0.05 kN"
height_max = 2.0
horizon = "1 min"
stage = 2
[process]
specific_energy = "10 J/mm^3"
idle_power = "0.1 kW"
friction_ratio = "30 %"
disk_radius = "8.5 cm"
free_speed = 500.0
speed_droop = 0.0
bead_width = 12.5
[scatter]
attribution = "C1"
relative_sd = 0.15
[height_charge]
under = { linear = 2.0 }
over = { linear = "10 $/mm" }
"""


@pytest.fixture
def job(tmp_path):
    """Write a changed P1 and give its path."""

    def write(old="", new="", more=""):
        assert old in P1
        path = tmp_path / "job.toml"
        path.write_text(P1.replace(old, new, 1) + more if old else P1 + more)
        return path

    return write


def test_p1_as_a_file_is_p1(job):
    assert read(job(), simple=True).stand == hwsim.WeldBeadStand(weldbead.preset("P1"))


def test_the_example_is_section_6_5_of_the_source():
    stand = read(EXAMPLE, simple=True)
    process = stand.problem.model
    assert (process.specific_energy, process.idle_power, process.bead_width) == (12.8, 114.0, 12.7)
    assert 0.30 <= process.friction_ratio <= 0.37
    assert (process.disk_radius, stand.problem.bead_length, process.free_speed) == (88.9, 150.0, 500.0)
    assert stand.problem.durations == (12, 16, 20, 24, 28, 32, 36, 40)


def test_every_table(job):
    more = """
[lateness_charge]
quadratic = "0.01 $/s^2"
[finish_charge]
charge = 0.4
reference_rate = "12.5 mm/s"
[burn_limit]
kind = "force"
burn_coefficient = 16.0
[stand]
height = 1.2
time = "20 s"
[stand.simple]
height_noise = "10 um"
[stand.truth]
specific_energy = "14 J/mm^3"
[stand.truth.scatter]
attribution = ["K1", "mu"]
relative_sd = [0.1, "5 %"]
law = "lognormal"
"""
    stand = read(
        job("[process]", "pass_charge = 0.03\nmin_cut = '0.02 mm'\n[process]", more), simple=True
    ).stand
    p1 = weldbead.preset("P1")
    problem = p1.replace(
        lateness_charge=sdp.Quadratic(0.01),
        finish_charge=weldbead.FinishCharge(0.4, reference_rate=12.5),
        burn_limit=weldbead.ForceBurnLimit(16.0),
        pass_charge=0.03,
        min_cut=0.02,
    )
    truth = problem.replace(
        specific_energy=14.0, scatter=weldbead.Scatter(("K1", "mu"), (0.1, 0.05), "lognormal")
    )
    assert stand == hwsim.WeldBeadStand(problem, truth=truth, height=1.2, time=20.0, height_noise=0.01)


def test_the_force_table(job):
    more = """
[disc]
relaxed_angle = "25 deg"
rotational_stiffness = "500 N m/rad"
[loop]
crossover = "2 Hz"
[stand]
height = "1.2 mm"
time = 20
wave = "50 um"
wave_length = "1 cm"
runout = 0.2
motor = "air"
[stand.pass_scatter]
specific_energy = "12 %"
[stand.bead_scatter]
friction_ratio = 0.05
[stand.truth]
specific_energy = "14 J/mm^3"
"""
    got = read(job(more=more))
    p1 = weldbead.preset("P1")
    disc = passes.TiltedDisc(p1.model, relaxed_angle=units.deg(25), rotational_stiffness=5e5)
    assert got.crossover == pytest.approx(units.hz(2.0), rel=1e-12)
    stand = got.stand
    assert stand.problem.disc.rotational_stiffness == 5e5
    assert stand.problem.disc.relaxed_angle == pytest.approx(disc.relaxed_angle, rel=1e-12)
    assert stand.truth == stand.problem.disc.replace(specific_energy=14.0)
    assert (stand.motor, stand.runout, stand.time, stand.sequence) == (hwsim.Motor.air(), 0.2, 20.0, p1)
    assert stand.pass_scatter == hwsim.CoefficientScatter(specific_energy=0.12)
    assert stand.bead_scatter.friction_ratio == 0.05
    bead = stand.problem.bead
    assert (bead.length, bead.mean) == (50.0, pytest.approx(1.2, abs=1e-12))
    assert np.ptp(bead.z) == pytest.approx(0.1, rel=1e-3)


def test_beads_that_differ(job):
    several = (
        '[scatter]\nattribution = ["K1", "K2", "mu"]\nrelative_sd = [0.1, 0.1, 0.1]\nlaw = "lognormal"\n'
        "[bead_scatter]\nspecific_energy = '20 %'\nidle_power = 0.0\n"
        "correlation = [[1, 0, -0.5], [0, 1, 0], [-0.5, 0, 1]]\n"
    )
    path = job()
    text = path.read_text()
    begin = text.index("[scatter]")
    end = text.index("[", begin + 1)
    path.write_text(text[:begin] + several + text[end:])
    problem = read(path).stand.sequence
    rho = ((1.0, 0.0, -0.5), (0.0, 1.0, 0.0), (-0.5, 0.0, 1.0))
    assert problem.bead_scatter == weldbead.CoefficientScatter(0.2, 0.0, 0.15, correlation=rho)
    assert problem.pass_scatter == weldbead.CoefficientScatter(0.1, 0.1, 0.1)


def test_a_low_bead_is_less_wavy_and_has_metal_everywhere(job):
    bead = read(job(more="[stand]\nheight = '0.05 mm'\n")).stand.problem.bead
    assert bead.mean == pytest.approx(0.05, abs=1e-12) and min(bead.z) > 0
    assert np.ptp(bead.z) == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("kind = 'power'\nburn_coefficient = 204", weldbead.PowerBurnLimit(204.0)),
        ("kind = 'malkin'\ndiameter = '17 cm'", weldbead.MalkinBurnLimit.published(170.0)),
        ("kind = 'malkin'\ndiameter = 170\nu0 = 6\nB = 10", weldbead.MalkinBurnLimit(6.0, 10.0, 170.0)),
    ],
)
def test_burn_limits(job, text, limit):
    # an idle power that leaves a force to Malkin's limit
    assert read(job("0.1 kW", "10 W", f"[burn_limit]\n{text}\n")).problem.burn_limit == limit


def test_charges_of_every_kind(job):
    path = job("under = { linear = 2.0 }", "under = { constant = '3 $', tolerance = '0.05 mm' }")
    assert read(path).problem.height_charge.under == sdp.Constant(3.0, 0.05)
    path = job("linear = 2.0", "quadratic = '2 $/mm^2'")
    assert read(path).problem.height_charge.under == sdp.Quadratic(2.0)


FAULTS = [
    ("bead_length", "bead_lenght", "", "bead_length is missing; is it meant by bead_lenght?"),
    ("bead_width = 12.5\n", "", "", "process.bead_width is missing"),
    (
        "stage = 2\n",
        "stage = 2\ncolour = 1\n",
        "",
        "colour is not a key; keys here are bead_length, bead_scatter, burn_limit",
    ),
    (
        "idle_power",
        "tip_power = 3\nidle_power",
        "",
        "process.tip_power is not a key; is process.idle_power meant?",
    ),
    ('"0.05 kN"', '"50 mm"', "", "force_max must have a unit like N; got '50 mm'"),
    (
        '"0.05 kN"',
        '"50 kilofoot"',
        "",
        "force_max must have a unit like N; got '50 kilofoot': 'kilofoot' is no unit known",
    ),
    ('"10 s"', '"10 mm"', "", "durations[2] must have a unit like s; got '10 mm'"),
    ("[6, 8", "6 #", "", "durations must be a list of numbers (s); got 6"),
    ('"0.05 kN"', "-3", "", "force_max must be > 0 (N); got -3.0"),
    ('"0.05 kN"', "true", "", "force_max must be a number (N); got True"),
    ('"0.05 kN"', "5", "", "force_max must be > the threshold force 7.84314 N"),
    ("stage = 2", "stage = 2.5", "", "durations[0] must be a multiple of the stage, 2.5 s (s); got 6.0"),
    ('"C1"', '"C4"', "", "[scatter] attribution must be one of C1, K1, K2, mu; got 'C4'"),
    ("relative_sd = 0.15", "relative_sd = []", "", "[scatter] relative_sd must be a number; got ()"),
    (
        "relative_sd = 0.15",
        "relative_sd = [0.15, 0.1]",
        "",
        "[scatter] relative_sd must be a number; got (0.15, 0.1)",
    ),
    ("relative_sd = 0.15", "relative_sd = -0.15", "", "[scatter] relative_sd must be >= 0; got -0.15"),
    (
        "{ linear = 2.0 }",
        "2.0",
        "",
        "height_charge.under must be a table of linear, quadratic or constant (one of them), and tolerance,"
        " as { linear = 2.0 }; got 2.0",
    ),
    (
        "speed_droop = 0.0\nbead_width = 12.5",
        "bead_widht = 12.5",
        "",
        "process.speed_droop and process.bead_width are missing; is process.bead_width meant by process.bead_widht?",
    ),
    (
        'attribution = "C1"\nrelative_sd = 0.15',
        "",
        "",
        "scatter.attribution and scatter.relative_sd are missing",
    ),
    (
        P1,
        'stage = 2\nreset_time = "2 s"',
        "",
        "process, durations, scatter, height_charge, bead_length, force_max, height_max and horizon are missing",
    ),
    (
        "{ linear = 2.0 }",
        "{ cubic = 2.0 }",
        "",
        "height_charge.under.cubic is not a key; keys here are constant",
    ),
    (
        "{ linear = 2.0 }",
        "{}",
        "",
        "height_charge.under must have one of linear, quadratic, constant; got none",
    ),
    (
        "linear = 2.0",
        "linear = '2 $/s'",
        "",
        "height_charge.under.linear must have a unit like $/mm; got '2 $/s'",
    ),
    ('"10 J/mm^3"', "-10", "", "[process] specific_energy must be > 0 (J/mm^3); got -10.0"),
    (
        '"10 J/mm^3"',
        '"11 J/cm3"',
        "",
        "[process] specific_energy must be some 10 J/mm^3; got '11 J/cm3'\n",
    ),
    (
        "free_speed = 500.0",
        "free_speed = 5000",
        "",
        "[process] free_speed must be in rad/s, some 500; the rim of a disc of 85 mm would run at 425 m/s, 125 at"
        ' most; "... rpm" for rev/min; got 5000.0\n',
    ),
    (
        "free_speed = 500.0",
        'free_speed = "5000"',
        "",
        "[process] free_speed must be in rad/s, some 500; the rim of a disc of 85 mm would run at 425 m/s, 125 at"
        " most; \"... rpm\" for rev/min; got 5000.0, from '5000'\n",
    ),
    (
        "bead_length = 50.0",
        "bead_length = 0.24",
        "",
        'bead_length must be in mm, some 150; "... m" for metres; got 0.24\n',
    ),
    (
        "",
        "",
        "[disc]\nrelaxed_angle = 30\n",
        '[disc] relaxed_angle must be in (0, 1.3] (rad); "20 deg" for degrees',
    ),
    (
        "speed_droop = 0.0",
        "speed_droop = 0.55",
        "",
        "[disc] process.idle_power must be below the 90.91 W that the grinder may use",
    ),
    ('"0.05 kN"', '"50 kN"', "", "force_max must be in N, some 50; got 50000.0, from '50 kN'\n"),
    (
        "",
        "",
        "[stand.truth]\nspecific_energy = 12800\n",
        "[stand.truth] specific_energy must be in J/mm^3, some 10; multiply by 0.001 for J/cm^3; got 12800.0\n",
    ),
    (
        "linear = 2.0",
        "linear = -2.0",
        "",
        "height_charge.under.linear must be >= 0 ($/mm); got -2.0",
    ),
    (
        "",
        "",
        "[burn_limit]\nkind = 'hot'\n",
        "burn_limit.kind must be one of force, power, malkin; got 'hot'",
    ),
    ("", "", "[stand]\nheigth = 1\n", "stand.heigth is not a key; is stand.height meant?"),
    (
        "",
        "",
        "[stand.simple]\nheight_noise = -1\n",
        "[stand.simple] height_noise must be >= 0 (mm); got -1.0",
    ),
    ("", "", "[disc]\nrelaxed_angle = 20\n", "[disc] relaxed_angle must be"),
    (
        "",
        "",
        "[stand.pass_scatter]\ncorrelation = 'none'\n",
        "stand.pass_scatter.correlation must be rows of a matrix, as [[1, 0], [0, 1]]; got 'none'",
    ),
    (
        "",
        "",
        "[stand.pass_scatter]\ncorrelation = [[1, 0, 'a'], [0, 1, 0], [0, 0, 1]]\n",
        "stand.pass_scatter.correlation[0][2] must be a number (1) or a text",
    ),
    ("", "", "[loop]\ncrossover = '3 s'\n", "loop.crossover must have a unit like rad/s; got '3 s'"),
    ("", "", "[stand]\nmotor = 'steam'\n", "stand.motor must be one of process, air; got 'steam'"),
    (
        "",
        "",
        "[stand.pass_scatter]\nK1 = 0.1\n",
        "stand.pass_scatter.K1 is not a key; keys here are correlation, friction_ratio",
    ),
    (
        "",
        "",
        "[stand.truth]\ncolour = 3\n",
        "stand.truth.colour is not a key; keys here are bead_width, disk_radius",
    ),
    ("", "", "[stand]\nheight = 2.1\n", "stand.height must be > 0 and <= height_max = 2 (mm); got 2.1"),
    ("", "", "[stand]\nheight = 0\n", "stand.height must be > 0 and <= height_max = 2 (mm); got 0.0"),
    ("", "", "[stand]\ntime = '61 s'\n", "stand.time must be >= 0 and <= horizon = 60 (s); got 61.0"),
    ("", "", "[stand]\ntime = -1\n", "stand.time must be >= 0 and <= horizon = 60 (s); got -1.0"),
    ("", "", "[stand]\nwave = -0.1\n", "[stand] wave must be >= 0 (mm); got -0.1"),
    (
        "",
        "",
        "[stand]\nwave = 5\n",
        "[stand] wave must be small enough to leave metal everywhere on a bead of 1.5 mm",
    ),
    ("", "", "[stand]\nwave_length = 0\n", "[stand] wave_length must be >= 1 (mm); got 0.0"),
    (
        "",
        "",
        "[stand]\ntime = '1.5 h'\n",
        "stand.time must be >= 0 and <= horizon = 60 (s); got 5400.0, from '1.5 h'\n",
    ),
    ("", "", "[stand]\nwave = '-1 cm'\n", "[stand] wave must be >= 0 (mm); got -10.0, from '-1 cm'\n"),
    ("30 %", "high", "", 'process.friction_ratio must be a number (1) or a text such as "3 %"; got'),
    (
        "stage = 2",
        "stage = = 2",
        "",
        "line 8, 'stage = = 2': no number, no true or false, and no text in quotes\n",
    ),
    ("stage = 2", "stage = 2\nstage = 4", "", "line 9, 'stage = 4': the key is there twice\n"),
    ("[process]", "[process", "", "line 9, '[process': Expected ']' at the end of a table declaration\n"),
]


def test_an_idle_power_in_kilowatts_warns(job):
    with pytest.warns(UserWarning, match="idle_power is 0.1 W"):
        read(job('"0.1 kW"', "0.1"))


def test_what_no_stand_tells_is_assumed(tmp_path):
    path, starts = tmp_path / "job.toml", {"height": "1.2", "time": "40.0"}
    for told in ((), ("height",), ("time",), ("height", "time")):
        lines = [f"{name} = {starts[name]}" for name in told]
        path.write_text("\n".join([P1, "[stand]" * bool(told), *lines]))
        missing = tuple(name for name in starts if name not in told)
        assert read(path).assumed == read(path, simple=True).assumed == missing


@pytest.mark.parametrize(("old", "new", "more", "line"), FAULTS)
def test_one_clear_line_and_nothing_written(job, tmp_path, capsys, old, new, more, line):
    path = job(old, new, more)
    assert main(["weldbead", str(path), "--out", str(tmp_path / "out")]) == 2
    out, error = capsys.readouterr()
    error = without_news(error)
    assert out == "" and error.count("\n") == 1
    assert error.startswith(f"hwsim: {path}: {line}")
    assert [file.name for file in tmp_path.iterdir()] == ["job.toml"]
