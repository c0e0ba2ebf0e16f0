"""TOML files that no parser may see, and those that none may choke on: one sentence each, never a hang."""

from pathlib import Path

import numpy as np
import pytest

from hwsim.command import _toml, _toml_bounds
from hwsim.command._centering.toml import read as read_centering
from hwsim.command._finishing.toml import read as read_finishing
from hwsim.command._locus.toml import read as read_locus
from hwsim.command._plunge.toml import read as read_plunge
from hwsim.command._weldbead.toml import read as read_weldbead
from sdpgrind.base.unit_text import factor, parse, quantity

ROOT = Path(__file__).parents[2]
READERS = {
    "weldbead": read_weldbead,
    "plunge": read_plunge,
    "locus": read_locus,
    "finishing": read_finishing,
    "centering": read_centering,
}
EXAMPLES = {name: (ROOT / "examples" / f"{name}.toml").read_bytes() for name in READERS}


def taken(path, raw):
    """What a file of one quantity ``x`` (mm) gives."""
    path.write_bytes(raw if isinstance(raw, bytes) else raw.encode())
    return _toml.read(path, lambda table: (table.number("x", "mm"), table.known.update(table.entries))[0])


NESTED = {
    "arrays": (
        "y = " + "[" * 32 + "]" * 32,
        "y = " + "[" * 33 + "]" * 33,
        "brackets must be nested at most 32",
    ),
    "tables": (
        "y = " + "{a=" * 32 + "1" + "}" * 32,
        "y = " + "{a=" * 33 + "1" + "}" * 33,
        "brackets must be nested at most 32",
    ),
    "a key": (".".join("a" * 32) + " = 1", ".".join("a" * 33) + " = 1", "a key must have at most 32 parts"),
    "blanks": (
        " . ".join("a" * 32) + " = 1",
        " . ".join("a" * 33) + " = 1",
        "a key must have at most 32 parts",
    ),
    "quoted": (
        ".".join(["'a'"] * 32) + " = 1",
        ".".join(["'a'"] * 33) + " = 1",
        "a key must have at most 32 parts",
    ),
    "a header": (f"[{'.'.join('a' * 32)}]", f"[{'.'.join('a' * 33)}]", "a key must have at most 32 parts"),
    "an array": (
        f"[[{'.'.join('a' * 32)}]]",
        f"[[{'.'.join('a' * 33)}]]",
        "a key must have at most 32 parts",
    ),
    "digits": ("y = " + "1" * 64, "y = " + "1" * 65, "a number must have at most 64 digits in a row"),
    "marked": (
        "y = " + "1_" * 63 + "1",
        "y = " + "1_" * 64 + "1",
        "a number must have at most 64 digits in a row",
    ),
    "hexadecimal": (
        "y = 0x" + "f" * 64,
        "y = 0x" + "f" * 65,
        "a number must have at most 64 digits in a row",
    ),
    "keys": (
        "\n".join(f"k{k} = 1" for k in range(9_999)),
        "\n".join(f"k{k} = 1" for k in range(10_000)),
        "the file must have at most 10000 keys; it has 10001",
    ),
    "keys of tables": (
        "y = [[" + ", ".join("{a = 1}" for _ in range(9_998)) + "]]",
        "y = [[" + ", ".join("{a = 1}" for _ in range(9_999)) + "]]",
        "the file must have at most 10000 keys; it has 10001",
    ),
    "pieces": (
        "# " * 3 + "\n" * 199_960,
        "\n" * 200_000,
        "up to here the file has 200000 words and signs",
    ),
    "bytes": (
        "#" * (2**20 - len("x = 1.5\n\n")),
        "#" * (2**20 - len("x = 1.5\n")),
        r"the file must have at most 1048576 bytes \(1 MiB\)",
    ),
}


@pytest.mark.parametrize("what", NESTED)
def test_bounds_are_kept_and_told_with_the_file(tmp_path, what):
    good, bad, told = NESTED[what]
    assert taken(tmp_path / "job.toml", f"x = 1.5\n{good}\n") == 1.5
    with pytest.raises(ValueError, match=rf"job\.toml: (line \d+: )?{told}"):
        taken(tmp_path / "job.toml", f"x = 1.5\n{bad}\n")


@pytest.mark.parametrize(
    "text",
    [
        'y = "' + "[" * 99 + '"',
        "y = '" + "[" * 99 + "'",
        'y = """\n' + "[" * 99 + '\\"""\n"""',
        "y = '''\n" + "[" * 99 + "\n'''",
        "# " + "[" * 99,
        "y = '" + "9" * 99 + "." * 99 + "'",
        'y = "a \\" # ' + "{" * 99 + '"',
        "\n".join(f"y{k} = [{{a = 1.5}}]" for k in range(99)),
    ],
)
def test_texts_and_comments_do_not_count(tmp_path, text):
    assert taken(tmp_path / "job.toml", f"x = 1.5\n{text}\n") == 1.5


@pytest.mark.parametrize(
    ("raw", "told"),
    [
        ("x = 1.5".encode("utf-16"), "the file must be in UTF-8; it is in UTF-16"),
        (b"\xfe\xff" + "x = 1.5".encode("utf-16-be"), "it is in UTF-16"),
        (b"\0\0\xfe\xff" + "x = 1.5".encode("utf-32-be"), "it is in UTF-32"),
        ("x = 1.5".encode("utf-32"), "it is in UTF-32"),
        (b"x = 1.5\0", "must be a text in UTF-8; byte 7 is NUL"),
        ("x = '1.5 µm'".encode("latin-1"), "must be in UTF-8; byte 9 is 0xb5, which is none there"),
    ],
)
def test_another_encoding_is_named(tmp_path, raw, told):
    with pytest.raises(ValueError, match=rf"job\.toml: .*{told}"):
        taken(tmp_path / "job.toml", raw)


def test_a_byte_order_mark_is_skipped(tmp_path):
    assert taken(tmp_path / "job.toml", b"\xef\xbb\xbfx = 1.5\r\n") == 1.5


def test_whole_numbers_that_no_float_holds_are_refused(tmp_path):
    assert taken(tmp_path / "job.toml", f"x = {2**53}") == 2.0**53
    for value in (2**53 + 1, -(2**53) - 1):
        with pytest.raises(
            ValueError, match=r"x must be a whole number of at most 2\^53, or a float \(mm\); got"
        ):
            taken(tmp_path / "job.toml", f"x = {value}")


QUANTITIES = [
    (f"{'1' * 40} mm", f"{'1' * 41} mm", "x must have at most 40 digits before and after the point"),
    (f"0.{'1' * 40} mm", f"0.{'1' * 41} mm", "x must have at most 40 digits before and after the point"),
    ("1e-400 mm", "1e-401 mm", r"x must have an exponent within \+-400"),
    ("0e400 mm", "0e401 mm", r"x must have an exponent within \+-400"),
    ("1 mm" + " " * 76, "1 mm" + " " * 77, "x must have at most 80 characters; got 81"),
    ("1 mm^12/mm^11", "1 mm^13/mm^12", "'13' is no exponent within"),
    ("1 mm^-11*mm^12", "1 mm^-13*mm^14", "'-13' is no exponent within"),
    ("1 mm^(1/12)*mm^(11/12)", "1 mm^(1/13)*mm^(12/13)", "'1/13' is no exponent within"),
    ("1 " + "(" * 8 + "mm" + ")" * 8, "1 " + "(" * 9 + "mm" + ")" * 9, "at most 8 parentheses"),
]


@pytest.mark.parametrize(("good", "bad", "told"), QUANTITIES)
def test_bounds_of_a_quantity(good, bad, told):
    assert quantity("x", good, "mm") >= 0.0
    with pytest.raises(ValueError, match=told):
        quantity("x", bad, "mm")


@pytest.mark.parametrize(
    "value",
    [
        "1e99999999 mm",
        "1e-99999999 mm",
        "1 mm^99999999",
        "1 mm^(1e99999999)",
        "1 mm^(1/0)",
        "1 %^(12)",
        "1 ((((((((%^12)^12)^12)^12)^12)^12)^12)^12)",
        "1 (((nm^12)^12)^(1/12))^(1/12)",
        "1e400 mm",
        "1e300 km",
    ],
)
def test_nothing_hangs_or_overflows(value):
    with pytest.raises(ValueError, match="x must"):
        quantity("x", value, "mm")


def test_a_unit_alone_has_the_bounds_too():
    for text in ("mm" + " " * 79, "(" * 9 + "mm" + ")" * 9, "mm^(1e9999999)", "(((((%^12)^12)^12)^12)^12)"):
        with pytest.raises(ValueError, match=r"at most|no exponent|too great"):
            parse(text)
        with pytest.raises(ValueError, match="have a unit like mm"):
            factor(text, "mm")
    with pytest.raises(ValueError, match="have a unit like"):
        factor("m^12 m^12 m^12", "nm^12 nm^12 nm^12 mm^(1/2)")


def bad_files(example, count):
    """An example cut, doubled, with bytes exchanged and with what parsers choke on, from one seed."""
    rng = np.random.default_rng(11)
    poison = [
        b"[" * 5000, b"{a=" * 3000, b"a." * 3000, b'"' * 3000, b"'" * 2999, b'"""\\', b"'''", b"9" * 5000, b"0x" + b"f" * 9000,
        b'"1e99999999 mm"', b'"1 mm^(1e99999999)"', b"1e999999", b"inf", b"nan", b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\\u0000",
        b'"\\UFFFFFFFF"', b"1979-05-27T07:32:00Z", b"[[a]]\n", b"[a.b]\n", b"=", b"\n\n", b"true", b"[]", b"{}", b"-", b"\xe2\x80\xa8",
    ]  # fmt: skip
    for _ in range(count):
        raw = bytearray(example)
        for _ in range(int(rng.integers(1, 4))):
            place = int(rng.integers(len(raw) + 1))
            way = rng.integers(4)
            if way == 0:
                del raw[place:]
            elif way == 1:
                raw[place:place] = poison[int(rng.integers(len(poison)))]
            elif way == 2:
                raw[place:place] = raw[:place]
            elif place < len(raw):
                raw[place] = int(rng.integers(256))
        yield bytes(raw)


@pytest.mark.parametrize("name", EXAMPLES)
def test_of_600_bad_files_each_is_read_or_refused_in_one_sentence(tmp_path, name):
    path, refused = tmp_path / "job.toml", 0
    for raw in bad_files(EXAMPLES[name], 120):
        path.write_bytes(raw)
        try:
            READERS[name](path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error).strip()
            refused += 1
    assert refused > 80


def test_a_long_line_is_cut_in_the_message(tmp_path):
    for length, told in ((79, "=" + "a" * 79 + "'"), (80, "=" + "a" * 79 + r"\.\.\.'")):
        with pytest.raises(ValueError, match=f"line 1, '{told}: Invalid"):
            taken(tmp_path / "job.toml", "=" + "a" * length)


def test_the_bounds_are_needed():
    """What the parser of the standard library does without them."""
    import tomllib

    for raw in (b"y = " + b"[" * 5000, b"a." * 3000 + b"b = 1"):
        with pytest.raises(ValueError, match="must"):
            _toml_bounds._refuse_deep(raw.decode())
    with pytest.raises(RecursionError):
        tomllib.loads("y = " + "[" * 5000)
