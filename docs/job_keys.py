"""Keys of a command's job file, as its own reader asks for them.

The reader reads the example (also with the lines that stand there as comments) while every question to a
table is noted: so no key of the page can be missing or gone. Meanings are those of the fields' docstrings,
else the comment beside the key in the example.
"""

import inspect
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from hwsim.command._finishing.toml import KIND, NORMAL_FORCE
from hwsim.command._in_words import as_text
from hwsim.command._toml import Table
from sdpgrind.base.quantities import Spec, specs

EXAMPLES = Path(__file__).parents[1] / "examples"
COMMANDS = ("weldbead", "plunge", "locus", "finishing", "centering")
_WRITTEN = re.compile(r"^#? ?(?:\[([\w.]+)\] *|(\w+) *=[^#]*)(?:# *(.*))?$")
_LEAST, _MOST = -1e300, 1e300  # chosen: beyond every range
TABLE = "a table"

# further jobs, as changes of the example: alternatives that it does not have; "": at its end
MORE = {
    "weldbead": [
        ("", """
[bead_scatter]
specific_energy = 0.15
[lateness_charge]
linear = 0.25
[finish_charge]
charge = 0.4
[burn_limit]
kind = "force"
burn_coefficient = 16.0
"""),
        ("", '[burn_limit]\nkind = "malkin"\ndiameter = 170\nu0 = 6.2\nB = 7.2\n'),
        ("[stand.simple]", "[stand.truth]\nspecific_energy = 14.0\n[stand.bead_scatter]\n[stand.simple]"),
    ],
    "plunge": [
        ("", "[model.wear]\ngrowth = 0.02\n"),
        ("", "[grinder.drive]\n[grinder.truth.wear]\ngrowth = 0.02\n"),
        ('sliding = "dong"', 'sliding = "malkin"'),
    ],
    "locus": [
        ('sliding = "malkin"', 'sliding = "dong"'),
        ("", '[grinder.truth.power]\nsliding = "malkin"\n'),
    ],
    "finishing": [
        ('pattern = "hilbert"', 'pattern = "zigzag"\nlift = {}\n#'),
        ("[tool]", '[robot]\nurdf = "robot.urdf"\nbase = "a"\ntip = "b"\nacceleration_max = 1.0\n[tool]'),
        ("[tool]", """
[robot]
preset = "ur10"
tool_length = "100 mm"
[robot.turntable]
origin = [600, 0, 0]
speed_max = 1.0
acceleration_max = 1.0
[tool]"""),
        ("[tool]", """
[robot]
preset = "ur10"
[robot.rail]
direction = [1, 0, 0]
travel = [0, 1000]
speed_max = 100.0
acceleration_max = 100.0
[tool]"""),
        ("", "[cell.truth]\n[cell.truth.axis]\n[cell.truth.table]\n[cell.truth.wave]\n"),
        ("[surface]", "[surface]\ncontrol_points = []"),
        ("[surface]", '[surface]\nfile = "part.stl"\nunit = "mm"\nregion = { crease = 0.5, seed = [0, 0, 0] }'),
    ],
    "centering": [
        ("[machine.truth]", "[machine.scatter]\n[machine.errors]\n[machine.truth]"),
    ],
}  # fmt: skip
# defaults that the readers set, not the fields: of a key, or of every key of a table that has one
DEFAULTS = {
    "weldbead.stand.truth": "that of the plan",
    "weldbead.height_charge.over": "must be given",
    "weldbead.burn_limit.u0": "as published, with B",
    "weldbead.burn_limit.B": "as published, with u0",
    "plunge.grinder.truth": "that of the plan",
    "locus.grinder.truth": "that of the plan",
    "locus.controls.infeed_rate": "must be given",
    "locus.controls.work_rotation": "must be given",
    "locus.hidden.wear_flat_area": "must be given",
    "finishing.method": "trapezoid",
    "finishing.surface.shape": "must be given, or a file, or control_points",
    "finishing.surface.side": 'must be given with "flat"',
    "finishing.path.pattern": "must be given",
    "finishing.path.order": 'must be given with "hilbert"',
    "finishing.path.pitch": 'must be given with "zigzag"',
    "finishing.robot.base": "must be given with a urdf",
    "finishing.robot.tip": "must be given with a urdf",
    "finishing.robot.acceleration_max": "must be given with a urdf",
    "finishing.controller.kind": KIND,
    "finishing.controller.normal_force": f"{NORMAL_FORCE:g}",
    "finishing.cell.truth": "that of the plan",
    "centering": "that of the preset",
    "centering.part": "that of the preset",
    "centering.model": "that of the preset",
    "centering.limits": "that of the preset",
    "centering.scatter": "that of the preset",
    "centering.spindle_speed": "scheduled",
    "centering.preset": "printed",
    "centering.machine.truth": "that of the plan",
    "centering.machine.scatter": "that of the plan",
    "centering.machine.errors.noise_sd": "0",
    "centering.machine.errors.runout": "0",
}
# units that the reader knows once it has the value
MONEY = {"linear": "$/{}", "quadratic": "$/{}^2", "constant": "$"}
_LAWS = {
    "coefficient": 'Coefficient C of "dong", N/mm^2.7.',
    "exponent": 'Exponent of the squared contact length of "dong", unit 1.',
    "pressure": 'Coefficient C2 of "malkin", N/mm^2.',
    "curvature_pressure": 'Coefficient C3 of "malkin", N/mm; its magnitude is doubtful: nothing should depend on it.',
}
_SIDES = ("lateness_charge", "height_charge.under", "height_charge.over")
# meanings of tables that no field declares
TABLES = {
    "truth": "Where the simulated machine is not what the plan thinks.",
    "controller": "Settings of the controller.", "process": "Process that is planned for.",
    "machine": "Simulated machine.", "grinder": "Simulated grinder.", "stand": "Simulated stand.",
}  # fmt: skip
# classes whose docstrings tell of keys that the reader asks for by name
CLASSES = {
    "weldbead.disc": "sdpgrind.weldbead.passes:TiltedDisc",
    "weldbead.stand": "hwsim:ForceTableStand",
    "weldbead.stand.simple": "hwsim:WeldBeadStand",
    "weldbead.burn_limit": "sdpgrind.weldbead:MalkinBurnLimit",
    "locus.grinder.power_gauge": "hwsim.devices:Gauge",
    "locus.controller": "sdpgrind.locus:LocusController",
    "finishing.path": "sdpgrind.finishing:zigzag",
    "finishing.surface.region": "sdpgrind.finishing:Region",
    "finishing.robot.turntable": "sdpgrind.finishing.arm:Turntable",
    "finishing.robot.rail": "sdpgrind.finishing.arm:LinearTable",
    "finishing.tool": "sdpgrind.finishing:FinishingProblem",
    "finishing.controller": "sdpgrind.finishing:TorqueController",
    "finishing.program": "sdpgrind.finishing:Motion.program",
    "centering.machine": "hwsim:CenteringMachine",
}
_SIDE = {
    "linear": "Charge for each unit beyond the tolerance.",
    "quadratic": "Charge for the square of what is beyond the tolerance.",
    "constant": "Charge for any excess, $.",
    "tolerance": "Excess that is not charged.",
}
_LEVELS = "Levels of the study, a list."
WORDS = {
    **{
        f"{table}.{key}": text
        for table in ("plunge.model.power", "locus.process.power", "locus.grinder.truth.power")
        for key, text in _LAWS.items()
    },
    **{
        f"weldbead.{table}.{key}": text
        for table in ("height_charge.under", "height_charge.over", "lateness_charge")
        for key, text in _SIDE.items()
    },
    "weldbead.stand.height": "Mean height of the bead at the start, mm. Assumed where it is left out, and marked.",
    "weldbead.stand.time": "Time to the deadline at the start, s. Assumed where it is left out, and marked.",
    "weldbead.stand.wave_length": "Length of the bead's waves, mm.",
    "weldbead.stand.simple.power_noise": "Standard deviation of the measured power, W.",
    "weldbead.stand.simple.force_noise": "Standard deviation of the measured forces, N.",
    "weldbead.disc.relaxed_angle": "Angle of the disc to the bead without load, rad.",
    "weldbead.disc.rotational_stiffness": "Stiffness of what lets the disc lean back, N mm/rad.",
    "weldbead.burn_limit": "Limit of force or power, or Malkin's, at which the bead burns.",
    "weldbead.burn_limit.burn_coefficient": "Limit over the root of the feed rate: N/(mm/s)^(1/2) of a force, W/(mm/s)^(1/2) of a power.",
    "weldbead.stand.truth.scatter": "Scatter that the machine draws by; keys as in [scatter].",
    "weldbead.bead_scatter.correlation": "Correlations of the three coefficients, rows of a matrix.",
    "weldbead.stand.bead_scatter.correlation": "Correlations of the three coefficients, rows of a matrix.",
    "weldbead.stand.pass_scatter.correlation": "Correlations of the three coefficients, rows of a matrix.",
    "weldbead.burn_limit.kind": "Law of the limit; its other keys follow.",
    "weldbead.loop.crossover": "Crossover of the force loop at 60 Hz, rad/s.",
    "locus.controls.infeed_rate": "Least and greatest value, a list of two.",
    "locus.controls.work_rotation": "Least and greatest value, a list of two.",
    "locus.hidden.wear_flat_area": "Least and greatest value, a list of two.",
    "locus.controller.wear_flat_area": "Range of the hidden state that is searched, a list of two.",
    "locus.controller.margin": "Power by which the controller stays below burning, W: for noise, dulling and a wrong model.",
    "locus.grinder.power_gauge": "Gauge of the power.",
    "finishing.program": "Options of --program.",
    "finishing.surface": "Surface: a flat, a preset, control points, or a face of a file.",
    "finishing.path": "Path over the surface.",
    "finishing.tool": "Tool and process.",
    "finishing.robot": "Robot that carries the tool; the generic arm where it is left out.",
    "finishing.axis": "Motor and encoder that press the tool.",
    "finishing.cell": "The simulated machine and how parts differ.",
    "finishing.cell.truth": "Where the cell is not what the plan thinks.",
    "finishing.cell.truth.axis": "True values of the axis: inertia, contact stiffness, torque constant.",
    "finishing.cell.truth.table": "Loop of the table that moves the work; false: one without error.",
    "finishing.cell.truth.wave": "A wave on the surface that the plan does not know.",
    "finishing.cell.truth.axis.inertia": "True inertia of motor and tool, kg m^2.",
    "finishing.cell.truth.axis.contact_angular_stiffness": "True contact stiffness at the motor, N m/rad.",
    "finishing.cell.truth.axis.torque_constant": "True torque constant, N m/A.",
    "finishing.cell.truth.wave.amplitude": "Amplitude of the wave, mm.",
    "finishing.cell.truth.wave.wavelength": "Length of the wave, mm.",
    "finishing.cell.truth.wave.phase": "Phase of the wave, rad.",
    "finishing.cell.truth.wave.direction": "Direction in which the wave runs, [x, y, z].",
    "finishing.surface.shape": "A flat square, or a preset: nominal, specimen.",
    "finishing.surface.side": "Side of the flat square, mm.",
    "finishing.path.pattern": "A Hilbert curve of an order, or a zigzag of a pitch.",
    "finishing.path.deviation": "Greatest distance of rounded corners from the path, mm. Left out: corners are sharp.",
    "finishing.tool.placement": 'Place of the work in the base, [x, y, z], mm, or "search". Left out: the middle of the table; searched for a robot without one.',
    "finishing.controller.observer": 'Observer of "pidff": "pid", or "state", its state form, which with the gains of the source hardly decays. "ideal" is refused: no cell measures the contact torque.',
    "finishing.program.deviation": "Greatest deviation of the points of the program from the path, mm.",
    "finishing.program.name": "Name of the program.",
    "finishing.program.date": "Date in the program, a text.",
    "finishing.program.timing": "Whether the program holds the times of the points.",
    "finishing.surface.file": "STEP file or scan, as seen from the folder of the job.",
    "finishing.surface.control_points": "Control points of a B-spline, rows of [x, y, z], mm.",
    "finishing.surface.degree": "Degrees of the B-spline along both directions.",
    "finishing.surface.face": "Number of the face, from 0, where the file holds several.",
    "finishing.surface.unit": "Unit of the file, where it does not tell.",
    "finishing.surface.region": "Part of a scan that is a face.",
    "finishing.path.order": "Order of the Hilbert curve.",
    "finishing.tool.wrist_radius": "Radius of the wrist of the generic arm, mm; not with [robot].",
    "finishing.tool.placement_box": 'Box in which a placement is searched; with placement = "search".',
    "finishing.study.tool_diameter": _LEVELS,
    "finishing.study.feed_rate": _LEVELS,
    "finishing.study.normal_force": _LEVELS,
    "finishing.study.pitch": "Pitch of the passes, mm.",
    "finishing.study.pattern": "Pattern of the passes.",
    "finishing.study.replicates": "Repetitions of each setting.",
    "finishing.robot.preset": "A robot of the library, instead of a urdf.",
    "finishing.robot.urdf": "URDF file, as seen from the folder of the job, instead of a preset.",
    "finishing.robot.base": "Link of the file that stands on the floor.",
    "finishing.robot.tip": "Link of the file that carries the tool.",
    "finishing.robot.acceleration_max": "Greatest acceleration of the joints, which a URDF does not hold, rad/s^2.",
    "finishing.robot.jerk_max": "Greatest jerk of the joints, rad/s^3.",
    "finishing.robot.tool_length": "Length of the tool in the flange, mm.",
    "finishing.robot.tool_tilt": "Tilt of the tool in the flange, rad.",
    "finishing.robot.tool_axis": "Axis of the flange along which the tool points.",
    "finishing.robot.turntable.speed_max": "Greatest speed, rad/s.",
    "finishing.robot.turntable.acceleration_max": "Greatest acceleration, rad/s^2.",
    "finishing.robot.turntable.jerk_max": "Greatest jerk, rad/s^3; none: no limit.",
    "finishing.robot.rail.speed_max": "Greatest speed, mm/s.",
    "finishing.robot.rail.acceleration_max": "Greatest acceleration, mm/s^2.",
    "finishing.robot.rail.jerk_max": "Greatest jerk, mm/s^3; none: no limit.",
    "finishing.robot.turntable.name": "Name of the joint; by default that of the table.",
    "finishing.robot.rail.name": "Name of the joint; by default that of the table.",
    "finishing.robot.turntable": "Turntable under the work.",
    "finishing.robot.rail": "Rail under the robot.",
    "centering.part": "The ring.",
    "centering.model": "Contact and friction.",
    "centering.limits": "What slide and table can do.",
    "centering.preset": "Machine that the rest is taken from; identified comes nearest to the tables of the source.",
    "centering.spindle_speed": 'Speed of the table, or "scheduled": by the offset.',
    "centering.machine.scheduler": "false: a computer without tasks, whose answers take no time.",
    "plunge.inspection": "What inspects the finished parts.",
}


@dataclass
class Key:
    """What is known of a key."""

    unit: str = ""
    default: str = ""
    meaning: str = ""
    must: str = ""
    words: tuple[str, ...] = ()


@dataclass
class Notes:
    """Keys by table."""

    tables: dict[str, dict[str, Key]] = field(default_factory=dict)

    def of(self, table: str, key: str) -> Key:
        """Note of a key."""
        return self.tables.setdefault(table, {}).setdefault(key, Key())


@contextmanager
def _noting(notes: Notes) -> Iterator[None]:
    """Note every question to a table within."""
    own = {
        name: getattr(Table, name)
        for name in ("has", "need", "values", "number", "list_of", "flag", "text", "given")
    }

    def has(self: Table, key: str) -> bool:
        notes.of(self.name, key)
        return bool(own["has"](self, key))

    def values(self: Table, cls: type, *, every: bool = True, skip: Any = ()) -> Any:
        skipped, words = tuple(skip), _meanings(cls)
        try:
            return own["values"](self, cls, every=every, skip=skipped)
        finally:
            for name, spec in specs(cls).items():
                if name not in skipped and name in notes.tables.get(self.name, {}):
                    _describe(notes.of(self.name, name), name, spec, words.get(name, ""), required=every)

    def need(self: Table, *keys: str, **options: Any) -> None:
        for key in keys:
            notes.of(self.name, key).default = "must be given"
        own["need"](self, *keys, **options)

    def given(self: Table, units: Mapping[str, str]) -> Any:
        for key, unit in units.items():
            notes.of(self.name, key).unit = unit
        return own["given"](self, units)

    def united(name: str) -> Callable[..., Any]:
        def read(self: Table, key: str, unit: str) -> Any:
            notes.of(self.name, key).unit = unit or "1"
            return own[name](self, key, unit)

        return read

    def flag(self: Table, key: str) -> bool:
        notes.of(self.name, key).must = "true or false"
        return bool(own["flag"](self, key))

    def text(self: Table, key: str, choices: Any) -> str:
        notes.of(self.name, key).must = "one of " + ", ".join(choices)
        return str(own["text"](self, key, choices))

    made = {
        "has": has, "need": need, "values": values, "given": given, "flag": flag, "text": text,
        "number": united("number"), "list_of": united("list_of"),
    }  # fmt: skip
    try:
        for name, method in made.items():
            setattr(Table, name, method)
        yield
    finally:
        for name, method in own.items():
            setattr(Table, name, method)


def _describe(key: Key, name: str, spec: Spec, meaning: str, *, required: bool) -> None:
    key.unit = key.unit or ("" if spec.unit in ("1", "relative") else spec.unit)
    key.meaning = key.meaning or meaning
    if spec.kind == "number":
        key.must = "; ".join(dict.fromkeys(filter(None, (_rule(spec, name, end) for end in (_LEAST, _MOST)))))
    if spec.kind == "choice" and spec.made_of:
        key.must = "one of " + ", ".join(map(str, spec.made_of))
    if spec.kind == "part":
        key.must = TABLE
    if spec.kind == "law":
        key.default = "must be given" if required else ""
    elif not spec.required:
        key.default = "none" if spec.default is None else _shown(spec.default)
    elif required:
        key.default = "must be given"


def _shown(default: Any) -> str:
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, (tuple, list)):
        return f"[{', '.join(map(_shown, default))}]"
    return (
        f"{default:g}"
        if isinstance(default, (float, int))
        else default
        if isinstance(default, str)
        else "of its keys"
    )


def _rule(spec: Spec, name: str, value: float) -> str:
    """Return what a value beyond every range is told."""
    try:
        spec.check(name, value)
    except ValueError as error:
        told = as_text(re.sub(r"; got .*$", "", str(error).partition(" must be ")[2]))
        return told.removesuffix(f" ({spec.unit})")
    return ""


def _meanings(cls: Any) -> dict[str, str]:
    """Meanings of the parameters in a docstring, in one line each."""
    text = inspect.getdoc(cls) or ""
    part = re.search(r"Parameters\n-+\n(.*?)(?:\n\n\w[^\n]*\n-+\n|\Z)", text, re.S)
    found: dict[str, str] = {}
    names: list[str] = []
    for line in (part[1] if part else "").splitlines():
        if line and not line.startswith(" "):
            names = [name.strip() for name in line.partition(":")[0].split(",")]
        else:
            for name in names:
                found[name] = f"{found.get(name, '')} {line.strip()}".strip()
    return found


def _comments(text: str) -> dict[tuple[str, str], str]:
    """Comments beside keys and tables, also those that are commented out, by table and key."""
    found: dict[tuple[str, str], str] = {}
    table = ""
    for line in text.splitlines():
        if (part := _WRITTEN.match(line)) is None:
            continue
        name, key, words = part[1], part[2], (part[3] or "").strip()
        if name:
            table = name
            outer, _, key = name.rpartition(".")
            found.setdefault((outer, key), words)
        else:
            found.setdefault((table, key), words)
    return found


def noted(command: str) -> dict[str, dict[str, Key]]:
    """Return what the reader of a command asks for, by table."""
    read = import_module(f"hwsim.command._{command}.toml").read
    text, notes = (EXAMPLES / f"{command}.toml").read_text(encoding="utf-8"), Notes()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "job.toml"
        for old, new in (
            ("", ""),
            *MORE.get(command, ()),
            ("", ""),
        ):  # keys asked for first are declared, too
            path.write_text(text.replace(old, new, 1) if old else text + new, encoding="utf-8")
            with _noting(notes), warnings.catch_warnings(), suppress(*([ValueError] if new else [])):
                warnings.simplefilter("ignore")  # as of the area of one law for another
                read(path)  # what was asked before a fault counts
    words = _comments(text)
    for table, keys in notes.tables.items():
        for key, entry in keys.items():
            place = f"{table}.{key}".strip(".")
            told = WORDS.get(f"{command}.{place}", "") or entry.meaning or words.get((table, key), "")
            told = told or _class_words(f"{command}.{table}").get(key, "")
            inside = "A table, see below." if place in notes.tables else ""
            told = f"{told[:1].upper()}{told[1:].removesuffix('.')}." if told else TABLES.get(key, "")
            entry.meaning = " ".join(filter(None, (told, inside)))
            entry.default = _default(f"{command}.{table}".strip("."), key, entry.default)
            if table in _SIDES and key in MONEY:
                entry.unit = MONEY[key].format("s" if table == "lateness_charge" else "mm")
                entry.default = f"one of {', '.join(MONEY)} must be given"
    return notes.tables


def _default(table: str, key: str, declared: str) -> str:
    """Default that the reader sets, else the declared one."""
    own = DEFAULTS.get(f"{table}.{key}", "")
    whole = DEFAULTS.get(table, "") if declared not in ("", "must be given") else ""
    return own or whole or declared


def _class_words(table: str) -> dict[str, str]:
    """Meanings of the parameters of the class of a table."""
    module, _, name = CLASSES.get(table, "").partition(":")
    thing = import_module(module) if module else None
    for part in filter(None, name.split(".")):
        thing = getattr(thing, part)
    return _meanings(thing) if name else {}
