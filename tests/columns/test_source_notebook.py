"""What a notebook shows of the origin of a log, and of a log that was read."""

import html5lib
import numpy as np

import hwsim


def log():
    table = {"t [s]": np.arange(5.0), "<b>X</b> [um]": 50.0 * np.arange(5.0)}
    return hwsim.Log.read(table, time="t", size="<b>X</b>")


def test_a_source_is_a_table_with_units_and_factors():
    shown = log().source._repr_html_()
    html5lib.HTMLParser(strict=True).parse("<!DOCTYPE html><title>t</title>" + shown)
    assert "<th>recorded in</th>" in shown and "<td>um</td>" in shown and "<td>0.001</td>" in shown
    assert "5 rows read, 0 left out" in shown and "<b>" not in shown and "&lt;b&gt;X" in shown


def test_a_log_that_was_read_shows_its_columns():
    read = log()
    assert repr(read) == "<hwsim.Log: 1 part on the mapping, tables data>"
    assert "<td>size</td><td>mm</td><td>5</td>" in read._repr_html_()
