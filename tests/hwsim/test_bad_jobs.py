"""Jobs that no parser should see: each is one line that names the file, after little work."""

import random
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwsim.command import _toml_text
from hwsim.command._weldbead.toml import read
from sdpgrind.base import unit_text

JOB = (Path(__file__).parents[2] / "examples" / "weldbead.toml").read_text(encoding="utf-8")
LONG = 50_000
BAD = {
    "has brackets nested deeper than 32": ["x = " + "[" * 33, "x = " + "[" * LONG, "x = " + "{a=" * LONG],
    "has a key of more than 32 parts": [f"[{'.'.join('a' * 33)}]", f"{'.'.join('a' * LONG)} = 1", f"[[{'. '.join('a' * 99)}]]"],
    "has a number of more than 64 digits": ["x = " + "9" * 65, "x = " + "9_" * LONG],
    "this file is UTF-16": [JOB.encode("utf-16")],
    "this file is UTF-32": [JOB.encode("utf-32")],
    "has a byte 0: this is no text in UTF-8": [JOB.encode() + b"\0", JOB.encode("utf-16-le")],
    "is not UTF-8: byte 0xe4": ["höhe = 1".encode("cp1252").replace(b"\xf6", b"\xe4")],
    "must have at most 1048576 bytes": ["#" * 2**20 + "\n"],
    "must have at most 10000 keys; got 20000": ["\n".join(f"k{k} = 1" for k in range(20_000))],
    "line 1, ": ['"' * LONG, '"\\' * LONG, "'" * LONG, "x='''" * 2001, 'x="""' * 2001, "a" * LONG, "= " * LONG],
}  # fmt: skip


def refused(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError) as caught:
        read(path)
    return str(caught.value)


@pytest.mark.parametrize("said", BAD)
def test_what_no_parser_should_see(said, tmp_path):
    for content in BAD[said]:
        told = refused(tmp_path / "job.toml", content)
        assert told.startswith(f"{tmp_path / 'job.toml'}: ")
        assert said in told
        assert "\n" not in told
        assert len(told) < 300 + len(str(tmp_path))


def test_strings_and_comments_may_hold_anything():
    harmless = [
        f'x = "{"[" * 99}"',
        f"x = '{'{' * 99}'",
        f'x = """\n{"a." * 99}"\n"""',
        f"x = '''{'[' * 99}''s'''",
        f"# {'[' * 99}",
        r'x = "\"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["',
    ]
    assert not [text for text in harmless if _toml_text._beyond(text)]
    assert _toml_text._beyond('x = """\n\n""" # [\ny = ' + "[" * 33).startswith("line 4 ")


def test_a_byte_order_mark_is_skipped(tmp_path):
    (tmp_path / "job.toml").write_text(JOB, encoding="utf-8-sig")
    assert (
        read(tmp_path / "job.toml").problem
        == read(Path(__file__).parents[2] / "examples/weldbead.toml").problem
    )


@pytest.mark.parametrize("seed", range(20))
def test_bytes_changed_at_random(seed, tmp_path):
    drawn, content = random.Random(seed), bytearray(JOB.encode())
    for _ in range(4):
        content[drawn.randrange(len(content))] = drawn.randrange(256)
    assert refused(tmp_path / "job.toml", bytes(content) + b"\nq = [\n").startswith(
        f"{tmp_path / 'job.toml'}: "
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1e99999999 mm", "must be a number with an exponent within +-400"),
        ("1e401 mm", "must be a number with an exponent within +-400"),
        ("0." + "1" * 41 + " mm", "must be a number of at most 40 digits on each side of the point"),
        ("1" * 81, "must be a text of at most 80 characters; got 81"),
        ("3 mm^13", "'13' is no exponent within +-12, of denominators up to 12"),
        ("3 mm^(1/13)", "'1/13' is no exponent within +-12"),
        ("3 ((((mm^12)^12)^12)^12)^12", "12 is too large an exponent here"),
        ("3 (((((%^12)^12)^12)^12)^12)^12", "12 is too large an exponent here"),
        ("3 " + "(" * 9 + "mm" + ")" * 9, "a unit has at most 8 parentheses"),
        (2**53 + 1, "must be a whole number of at most 2^53"),
        (10**400, "must be a whole number of at most 2^53"),
    ],
    ids=range(11),
)
def test_quantities_that_would_take_long(text, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        unit_text.quantity("height", text, "mm")


def test_quantities_at_the_bounds():
    assert unit_text.quantity("x", "1" * 40 + " mm", "mm") == float("1" * 40)
    assert unit_text.quantity("x", f"3e-{400} mm", "mm") == 0.0
    assert unit_text.quantity("x", 2**53, "mm") == 2.0**53
    assert unit_text.factor("mm^12", "m^12") == 1e-36


@given(st.text("0123456789.eE+-^()*/mNs% ", max_size=80))
def test_any_text_is_a_quantity_or_one_line(text):
    try:
        assert isinstance(unit_text.quantity("x", text, "mm"), float)
    except ValueError as error:
        assert "\n" not in str(error)
