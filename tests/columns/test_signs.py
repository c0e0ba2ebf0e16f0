"""The decimal sign of a text is told by all its lines, or the text is refused."""

import numpy as np
import pytest

import hwsim

ROWS = 450


@pytest.fixture
def read(tmp_path):
    """Write rows of time and power below their names, and read the power."""

    def _read(rows, separator=";", head="t [ms]{}P [W]"):
        path = tmp_path / "a.csv"
        lines = [head.format(separator), *(separator.join(row) for row in rows)]
        path.write_text("\n".join(lines) + "\n")
        return hwsim.Log.read(path, time="t", grinding_power="P", plausible=False)["data"]

    return _read


def in_groups(value, sign):
    return f"{value:,d}".replace(",", sign)


@pytest.mark.parametrize("sign", [".", ","])
@pytest.mark.parametrize("separator", [";", "\t", " "])
@pytest.mark.parametrize("first", [3, 195, 205, 400])
@pytest.mark.parametrize("values", [(900, 1250), (1250, 900)])
def test_groups_of_three_among_whole_numbers_are_refused_wherever_they_begin(
    read, sign, separator, first, values
):
    rows = [(f"{k}", in_groups(values[k >= first], sign)) for k in range(ROWS)]
    other = {".": ",", ",": "."}[sign]
    message = (
        rf"must show its decimal sign; '1\{sign}250' may be 1\.250 or 1250: .*decimal='\{sign}',"
        rf" thousands='\{other}'\), \.\.\.\) or .*decimal='\{other}', thousands='\{sign}'\)"
    )
    with pytest.raises(ValueError, match=message):
        read(rows, separator)


def test_quoted_groups_of_three_are_refused_wherever_they_begin(read):
    rows = [(f"{k}", f'"{in_groups(900 if k < 205 else 1250, ",")}"') for k in range(ROWS)]
    with pytest.raises(ValueError, match=r"'1,250' may be 1\.250 or 1250"):
        read(rows, ",")


@pytest.mark.parametrize("late", ["5,5", "1.250,5", "1.250.000", "0,125", "-,5", "1250,125"])
def test_one_number_below_tells_the_sign_of_all(read, late):
    rows = [(f"{k}", in_groups(900 if k < 205 else 1250, ".")) for k in range(ROWS)]
    told = read([*rows[:-1], (rows[-1][0], late)]).grinding_power.values
    assert told[[0, 204, 205, -2]].tolist() == [900.0, 900.0, 1250.0, 1250.0]
    assert told[-1] == float(late.replace(".", "").replace(",", "."))


def test_a_decimal_point_below_tells_the_sign_of_all(read):
    rows = [(f"{k}", "900" if k < 205 else "1.250") for k in range(ROWS)]
    assert read([*rows, (str(ROWS), "12.5")]).grinding_power.values[[204, 205, -1]].tolist() == [
        900,
        1.25,
        12.5,
    ]


def test_three_decimals_in_each_row_are_decimals(read):
    values = 1.25 + np.arange(ROWS) / 1000
    rows = [(f"{k}", f"{value:.3f}") for k, value in enumerate(values)]
    np.testing.assert_allclose(read(rows).grinding_power, values, rtol=1e-12)


def test_three_digits_behind_both_signs_are_refused(read):
    rows = [(in_groups(1000 + k, "."), in_groups(1013 + k, ",")) for k in range(ROWS)]
    with pytest.raises(
        ValueError, match=r"may be 1\.000 or 1000: .*decimal='\.', thousands=','.* or .*decimal=','"
    ):
        read(rows)


def test_points_of_stamps_tell_nothing(read):
    rows = [(f"02.03.2026 10:{k // 60:02d}:{k % 60:02d}", f"{k}") for k in range(ROWS)]
    late = [*rows[:-1], (rows[-1][0], "0,125")]
    assert read(late, head="t{}P [W]").grinding_power.values[[0, 300, -1]].tolist() == [0.0, 300.0, 0.125]
    groups = [*rows[:-1], (rows[-1][0], "1.250")]
    with pytest.raises(ValueError, match=r"'1\.250' may be 1\.250 or 1250"):
        read(groups, head="t{}P [W]")


def test_a_count_of_rows_without_a_name_is_one_with_decimals_below(read):
    rows = [(f"{k}", f"{10 * k}", "5" if k < 205 else "5,25") for k in range(ROWS)]
    assert read(rows).grinding_power.values[[0, -1]].tolist() == [5.0, 5.25]


def test_lines_of_several_blocks_are_looked_at(read, monkeypatch):
    monkeypatch.setattr("sdpgrind.base.columns.signs._BLOCK", 64)
    rows = [(f"{k}", "900" if k < ROWS - 1 else "1.250") for k in range(ROWS)]
    with pytest.raises(ValueError, match=r"'1\.250' may be 1\.250 or 1250"):
        read(rows)
    assert read([*rows, (str(ROWS), "5,5")]).grinding_power.values[-2:].tolist() == [1250.0, 5.5]
