"""A field is declared in one line: its check, its text, its place in files; a unit stands once in code."""

import ast
import inspect
import math
import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from house_names import SOURCE, everything

from hwsim._log.labels import Labels
from hwsim.command._toml import read
from sdpgrind import units
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.quantities import (
    Described,
    array,
    choice,
    count,
    custom,
    described,
    flag,
    law,
    part,
    quantity,
    specs,
    text,
    trusted,
    units_of,
    valued,
)  # fmt: skip
from sdpgrind.base.stored import decode, encode


@described("toy.bearing")
class Bearing(Described):
    """Not for sale.

    Parameters
    ----------
    play : float
        Play, mm.
    """

    play: float = quantity("mm", at_least=0, default=0.0)


class Ball:
    def force(self):
        return 1.0


@described("toy.spring")
class Spring(Described):
    rate: float = quantity("N/mm", above=0)

    def force(self):
        return self.rate


@described("toy.spindle")
class Spindle(Described):
    radius: float = quantity("mm", above=0, usual=(5.0, 1000.0), typical=90)
    speed: float = quantity("rad/s", above=0, usual=(10.0, 3000.0), typical=500, default=500)
    worn: float = quantity("1", above=0, at_most=1, default=0.5)
    power_max: float = quantity("W", above=0, default=math.inf)
    lag: float | None = quantity("s", above=0, default=None)
    teeth: int = count(2, default=3)
    internal: bool = flag(default=True)
    sense: str = choice("left", "right", default="left")
    name: str = text(default="")
    bearing: Bearing | None = part(Bearing, " (see toys)", default_factory=Bearing)
    load: object = law(
        {"spring": Spring}, "a load, such as Spring(2.0)", "force", default_factory=lambda: Spring(2.0)
    )
    note: object = custom(unit="mm", default=None)

    def _check(self):
        if self.bearing is not None and self.bearing.play >= self.radius:
            raise self._refused("radius", f"> play = {self.bearing.play:g}")


@described("toy.newer_spindle")
class NewerSpindle(Spindle):
    mass: float = quantity("kg", above=0, default=2.0)  # the one line


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"radius": -1}, ValueError, "radius must be > 0 (mm); got -1.0"),
        ({"radius": "1"}, TypeError, "radius must be a number (mm); got '1'"),
        ({"radius": True}, TypeError, "radius must be a number (mm); got True"),
        ({"radius": math.nan}, ValueError, "radius must be finite (mm); got nan"),
        ({"worn": math.nan}, ValueError, "worn must be finite; got nan"),
        ({"worn": 1.5}, ValueError, "worn must be in (0, 1]; got 1.5"),
        ({"power_max": -math.inf}, ValueError, "power_max must be finite (W); got -inf"),
        ({"lag": 0.0}, ValueError, "lag must be > 0 (s); got 0.0"),
        ({"speed": None}, TypeError, "speed must be a number (rad/s); got None"),
        ({"teeth": 1}, ValueError, "teeth must be >= 2; got 1"),
        ({"teeth": 2.0}, TypeError, "teeth must be a whole number; got 2.0"),
        ({"internal": 1}, TypeError, "internal must be a bool; got 1"),
        ({"sense": "up"}, ValueError, "sense must be one of left, right; got 'up'"),
        ({"name": 3}, TypeError, "name must be a str; got 3"),
        ({"bearing": 3}, TypeError, "bearing must be a Bearing (see toys); got 3"),
        ({"load": 3}, TypeError, "load must be a load, such as Spring(2.0); got 3"),
        ({"bearing": Bearing(100.0)}, ValueError, "radius must be > play = 100 (mm); got 90.0"),
        ({"radius": 0.09}, ValueError, "radius must be in mm, some 90; units.m(...) for metres; got 0.09"),
        ({"radius": 3.5}, ValueError, "radius must be in mm, some 90; units.inch(...) for inches; got 3.5"),
        (
            {"radius": 90000},
            ValueError,
            "radius must be in mm, some 90; units.um(...) for micrometres; got 90000",
        ),
        ({"radius": 1e9}, ValueError, "radius must be in mm, some 90; got 1000000000.0"),
        (
            {"speed": 8500},
            ValueError,
            "speed must be in rad/s, some 500; units.rpm(...) for rev/min; got 8500",
        ),
        ({"speed": 5}, ValueError, "speed must be in rad/s, some 500; units.hz(...) for Hz; got 5"),
    ],
)
def test_a_value_is_refused(changes, error, message):
    with pytest.raises(error) as refused:
        Spindle(**{"radius": 90.0} | changes)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("bounds", "value", "message"),
    [
        ({"above": 0, "below": 1}, 1.0, "in (0, 1); got 1.0"),
        ({"at_least": 0, "at_most": 0.5}, -0.1, "in [0, 0.5]; got -0.1"),
        ({"at_least": 0, "below": 1}, 1.0, "in [0, 1); got 1.0"),
        ({"above": 1}, 1.0, "> 1; got 1.0"),
        ({"at_most": 2}, 3.0, "<= 2; got 3.0"),
        ({"below": 2}, 2.0, "< 2; got 2.0"),
        ({"above": 0, "below": 2, "hint": "; percent/100"}, 3.0, "< 2; percent/100; got 3.0"),
        ({"above": 0, "below": 2, "hint": "; percent/100"}, 0.0, "> 0; got 0.0"),
        ({"at_least": 1, "hint": "; 95.0 for 0.095 m"}, 0.095, ">= 1; 95.0 for 0.095 m; got 0.095"),
    ],
)
def test_bounds(bounds, value, message):
    @described()
    class One(Described):
        x: float = quantity("1", **bounds)

    with pytest.raises(ValueError, match="^" + re.escape(f"x must be {message}") + "$"):
        One(value)


def test_what_is_kept():
    made = Spindle(np.float32(90), speed=np.int64(400), teeth=np.int64(4), worn=1)
    assert type(made.radius) is type(made.speed) is type(made.worn) is float and type(made.teeth) is int
    assert Spindle(90).speed == 500.0 and type(Spindle(90).speed) is float
    assert Spindle(90, power_max=float("inf")).power_max == math.inf and Spindle(90, lag=None).lag is None
    assert Spindle(90, bearing=None).bearing is None
    assert Spindle(90) == Spindle(90.0) and hash(Spindle(90)) == hash(Spindle(90.0))
    with pytest.raises(AttributeError):
        made.radius = 3.0


def test_arrays_and_what_checks_itself():
    def rising(name, value):
        if list(value) != sorted(value):
            raise ValueError(f"{name} must rise; got {value!r}")
        return tuple(value)

    @described()
    class Curve(Described, ByValue):
        x: tuple[float, ...] = custom(rising, "mm")
        y: np.ndarray = array("N")
        rest: np.ndarray = array("1", np.int64, finite=False, default=())

    curve = Curve([1, 2], [3, 4])
    assert curve == Curve((1, 2), np.array([3.0, 4.0])) and hash(curve) == hash(Curve((1, 2), [3, 4]))
    assert curve != Curve([1, 2], [3, 5]) and not curve.y.flags.writeable
    with pytest.raises(ValueError, match=r"^x must rise; got \[2, 1\]$"):
        Curve([2, 1], [3, 4])
    with pytest.raises(ValueError, match=r"^y\[1\] must be finite \(N\); got nan$"):
        Curve([1, 2], [3, math.nan])


def test_a_declaration_is_checked():
    with pytest.raises(ValueError, match='unit must be that of the quantity, "1" for a pure number'):
        quantity("")
    with pytest.raises(
        ValueError, match="typical must be a number other than 0 where a usual range is given"
    ):
        quantity("mm", usual=(1.0, 2.0))
    with pytest.raises(
        TypeError, match=r"Plain.width must be declared as quantity\(unit\), .*; it is a plain field"
    ):

        @described()
        class Plain(Described):
            width: float


def test_a_new_field_takes_one_line(tmp_path):
    with pytest.raises(ValueError, match=r"^mass must be > 0 \(kg\); got -1.0$"):
        NewerSpindle(90.0, mass=-1.0)
    heavy = NewerSpindle(90.0, mass=3.0)
    assert repr(heavy).endswith(", mass=3 kg)")
    assert decode(encode(heavy)) == heavy and '"mass": 3.0' in encode(heavy)
    assert valued(heavy, units_of(NewerSpindle))["mass"] == (3.0, "kg")
    file = tmp_path / "spindle.toml"
    file.write_text('radius = "90 mm"\nmass = "3000 g"\nload = "spring"\nrate = 2\n')
    assert read(file, lambda table: table.one(NewerSpindle)) == heavy
    assert _labels(heavy).description["mass"] == 3.0 and _labels(heavy).column("mass")["units"] == "kg"


def _labels(spindle):
    """Labels of the log of a plant that tells the fields of its spindle."""

    told = valued(spindle, units_of(type(spindle)))
    units_told, values = ({name: pair[k] for name, pair in told.items()} for k in (1, 0))
    plant = SimpleNamespace(measures=units_told, accepts={}, description=values)
    return Labels.of(plant, SimpleNamespace(period=None, tier="sequence"))


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ('load = "spring"\nrate = 2', "radius is missing"),
        ("radius = 90", "load is missing"),
        ('radius = 90\nload = "ball"', "load must be one of spring; got 'ball'"),
        ('radius = 90\nload = "spring"\nrate = -2', "rate must be > 0 (N/mm); got -2.0"),
        ('radius = 90\nload = "spring"\nrate = 2\nteeths = 2', "teeths is not a key; is teeth meant?"),
        ('radius = 90\nload = "spring"\nrate = 2\ninternal = 1', "internal must be true or false; got 1"),
        ('radius = 90\nload = "spring"\nrate = 2\nsense = "up"', "sense must be one of left, right; got 'up'"),
        ('radius = "9 s"\nload = "spring"\nrate = 2', "radius must have a unit like mm; got '9 s'"),
        ('radius = "90 mm"\nload = "spring"\nrate = 2\nworn = "x"',
         'worn must be a number (1) or a text such as "3 %"; got \'x\''),
        ('radius = 90\nload = "spring"\nrate = 2\n[bearing]\nplay = -1', "[bearing] play must be >= 0 (mm); got -1.0"),
    ],
)  # fmt: skip
def test_a_file_is_refused(tmp_path, lines, message):
    file = tmp_path / "spindle.toml"
    file.write_text(lines)
    with pytest.raises(ValueError, match="^" + re.escape(f"{file}: {message}") + "$"):
        read(file, lambda table: table.one(Spindle))


def test_a_file_may_hold_a_part_of_the_values(tmp_path):
    file = tmp_path / "spindle.toml"
    file.write_text("worn = '20 %'\n[bearing]\nplay = '1 um'\n")
    values = read(file, lambda table: table.values(Spindle, every=False, skip=("load",)))
    assert values == {"worn": 0.2, "bearing": Bearing(0.001)}


def test_what_is_trusted_is_not_checked():
    made = trusted(Spindle, radius=-1.0)
    assert made.radius == -1.0 and made.bearing == Bearing() and made.speed == 500.0
    assert trusted(Spindle, radius=90.0) == Spindle(90.0)


# ---------------------------------------------------------- units: once in code, once in the docstring


@cache
def all_described():
    """Every described class of the library."""
    everything()  # imports all that is public
    found, new = set(), [Described]
    while new:
        new = [cls for each in new for cls in each.__subclasses__() if cls not in found]
        found.update(new)
    return sorted(
        (cls for cls in found if cls.__module__.startswith(("sdpgrind", "centering", "hwsim"))), key=str
    )


def _constants(nodes):
    return [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def _pairs(node):
    """Names with the texts that a piece of code puts beside each."""
    if isinstance(node, ast.Dict):
        for key, value in zip(node.keys, node.values, strict=True):
            yield from ((name, text) for name in _constants([key]) for text in _constants(ast.walk(value)))
    elif isinstance(node, ast.Tuple | ast.Call):
        texts = _constants(node.elts if isinstance(node, ast.Tuple) else node.args)
        yield from ((texts[0], text) for text in texts[1:])
    elif isinstance(node, ast.For | ast.DictComp):
        over, told = (
            (node.iter, node.body) if isinstance(node, ast.For) else (node.generators[0].iter, [node.value])
        )
        texts = [text for each in told for inner in ast.walk(each) for text in _constants([inner])]
        yield from ((name, text) for name in _constants(ast.walk(over)) for text in texts)


def stated_twice(source, declared):
    """Fields whose declared unit a source pairs with their name."""
    pairs = {pair for node in ast.walk(ast.parse(source)) for pair in _pairs(node)}
    return sorted(pairs & {(name, unit) for name, unit in declared if unit != "1"})


ARGUMENTS = {
    "hwsim/command/_finishing/toml.py": [("amplitude", "mm"), ("phase", "rad")],  # of wave
    "hwsim/command/_finishing/robot_toml.py": [
        ("acceleration_max", "rad/s^2"),
        ("jerk_max", "rad/s^3"),
    ],  # of from_urdf
    "hwsim/command/_finishing/surface_toml.py": [("margin", "mm"), ("radius", "mm")],  # of zigzag
    "hwsim/command/_centering/toml.py": [("spindle_speed", "rad/s")],  # of plan
}
"""What a file gives to functions, which no class declares, though a field elsewhere has the name and the unit."""


def test_a_unit_stands_once_in_code():
    declared: dict[Path, set] = {}
    for cls in all_described():
        declared.setdefault(Path(inspect.getsourcefile(cls)), set()).update(units_of(cls).items())
    everywhere = set().union(*declared.values())
    readers = list(SOURCE.joinpath("hwsim", "command").rglob("*.py"))
    for path in readers:
        declared[path] = everywhere
    twice = {
        str(path.relative_to(SOURCE)): found
        for path, names in declared.items()
        if (found := stated_twice(path.read_text(), names))
    }
    assert readers and twice == ARGUMENTS, f"a unit of a field is declared, and stated again: {twice}"


@pytest.mark.parametrize(
    "source",
    [
        'UNITS = {"stock": "mm"}', 'x = (("stock", "mm"),)', 'checks.positive("stock", stock, "mm")',
        'job = {"stock": (self.stock, "mm")}', 'for name in ("stock", "gap"):\n    positive(name, getattr(self, name), "mm")',
        '{name: (getattr(self, name), "mm") for name in ("stock", "gap")}',
    ],
)  # fmt: skip
def test_a_second_one_is_found(source):
    assert stated_twice(source, {("stock", "mm")}) == [("stock", "mm")]
    assert not stated_twice(source, {("stock", "s"), ("gauge", "mm"), ("stock", "1")})


PURE = re.compile(r"unit 1|0\.\.1|[Rr]elative|\bshares?\b|[\[(]0, 1[\])]|\(1\)")
"""How a docstring says that a number is pure."""


def documented(doc):
    """Parameters of a docstring, each with its entry."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)", doc, re.DOTALL | re.MULTILINE)
    found = {}
    for entry in re.split(r"\n(?=\S)", section[1]) if section else []:
        names, _, _ = entry.partition(" : ")
        found |= {name.strip(): " ".join(entry.split()) for name in names.split(",")}
    return found


def named(unit, entry):
    """Whether an entry names a unit."""
    if unit == "1":
        return bool(PURE.search(entry))
    return bool(re.search(rf"(?<![\w.'^/]){re.escape(unit)}(?![\w^/(])", entry))


def test_docstrings_give_the_declared_units():
    wrong, documents = {}, {cls: documented(inspect.getdoc(cls) or "") for cls in all_described()}
    for cls in all_described():
        told = {}
        for base in reversed(cls.__mro__):
            told |= documents.get(base, {})
        if told and not cls.__name__.startswith("_"):
            missing = {
                name: unit for name, unit in units_of(cls).items() if not named(unit, told.get(name, ""))
            }
            wrong |= {cls.__name__: missing} if missing else {}
    assert not wrong, f"the docstring gives no unit, or another than is declared: {wrong}"


def test_docstrings_can_be_wrong():
    told = documented(inspect.getdoc(Bearing))
    assert told == {"play": "play : float Play, mm."}
    assert named("mm", told["play"]) and not named("mm", "In mm/s.") and not named("s", "In mm/s, it's")
    assert not named("1", told["play"]) and named("1", "R_0 in mm, k_r unit 1.")
    assert documented("X.\n\nParameters\n----------\na, b : float\n    In mm.\nc : int\n\nRaises\n------\nValueError\n") == {
        "a": "a, b : float In mm.", "b": "a, b : float In mm.", "c": "c : int",
    }  # fmt: skip


def test_conversions_give_the_unit_that_they_stand_under():
    for unit, conversions in units.CONVERSIONS.items():
        for convert, words in conversions:
            assert getattr(units, convert.__name__) is convert and words and unit
    assert units.m(0.09) == 90.0


def test_specs_of_what_is_not_described():
    assert not specs(Ball) and not units_of(Ball)
