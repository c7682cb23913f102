"""The text reader: separator, decimal sign, preamble, units, quoting and encoding, decided together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softnlp.base.errors import InputError
from softnlp.laboratory.cells import is_number, number, numbers
from softnlp.laboratory.choices import AskError, Choices, settings_from_words
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.text import text_table
from softnlp.laboratory.units import split_unit


def table(text: str | bytes, **settings: object) -> RawTable:
    """Return the table of a text."""
    return text_table("file", text if isinstance(text, bytes) else text.encode(), Choices(settings))


NUMBERS = st.lists(st.floats(-1e4, 1e4).map(lambda v: round(v, 3)), min_size=3, max_size=3)


@given(
    rows=st.lists(NUMBERS, min_size=6, max_size=12),
    dialect=st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("|", ",")]),
    preamble=st.sampled_from(["", "Operator: x\nDate: 2025/04/03\n\n", "Width (mm);4\n"]),
    trailing=st.booleans(),
)
def test_a_file_written_in_a_dialect_is_read_in_it(
    rows: list[list[float]], dialect: tuple[str, str], preamble: str, trailing: bool
) -> None:
    separator, decimal = dialect
    end = separator if trailing and separator != " " else ""
    lines = [separator.join(f"{v:.4f}".replace(".", decimal) for v in row) + end for row in rows]
    head = separator.join(["t_s", "a_mm", "b_N"]) + end
    found = table(preamble + head + "\n" + "\n".join(lines) + "\n")
    assert [found.names, [unit.name for unit in found.units if unit]] == [("t", "a", "b"), ["s", "mm", "N"]]
    np.testing.assert_allclose(np.column_stack(found.columns), rows, atol=1e-9)


def test_what_may_be_groups_of_digits_or_decimals_is_asked() -> None:
    text = "a;b\n" + "1,234;5,678\n" * 5
    with pytest.raises(
        AskError, match=r"1\.234 \| 5\.678 \(.*decimal=comma\), or 1234 \| 5678|1234 \| 5678 .*, or 1\.234"
    ):
        table(text)
    assert table(text, decimal="comma").columns[0][0] == 1.234
    assert table(text, decimal="point").columns[0][0] == 1234.0
    assert table("a;b\n" + "0,234;5,678\n" * 5).columns[0][0] == 0.234


def test_a_row_of_units_and_quotes() -> None:
    found = table('Time,Extension,Load\n(s),(mm),(N)\n"0.0","1.0","2.0"\n"1.0","2.0","3.0"\n')
    assert [unit.name for unit in found.units if unit] == ["s", "mm", "N"]
    assert found.columns[2].tolist() == [2.0, 3.0]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_encodings(encoding: str) -> None:
    found = table("t_s;T_°C\n0;21\n1;22\n".encode(encoding))
    assert found.names[1] == "T"
    assert found.columns[1].tolist() == [21.0, 22.0]


def test_missing_cells_short_rows_and_text_between_are_counted() -> None:
    choices = Choices({})
    text = "t_s,x_mm,state\n0,1,OK\n1,NaN,OK\n2,,OK\n3\nrestarted by hand\n4,5,OK\n5,6x,OK\n"
    found = text_table("file", text.encode(), choices)
    np.testing.assert_array_equal(found.columns[1], [1, np.nan, np.nan, np.nan, 5, np.nan])
    assert choices.dropped == {"rows of text between the numbers": 1, "cells that are no number": 1}


def test_a_file_without_header_asks_for_names() -> None:
    with pytest.raises(AskError, match=r"column 1 rises evenly by 100, column 2 0.5 to 0.7"):
        table("0\t0.5\n100\t0.7\n200\t0.6\n")
    found = table("0\t0.5\n100\t0.7\n200\t0.6\n", columns=["t_ms", "-"])
    assert found.names == ("t",)


def test_the_preamble_holds_sizes() -> None:
    found = table("Width;4;mm\nThickness (mm);2\n,;\nMass: 3.5 N\na;b\n1;2\n3;4\n5;6\n")
    assert found.values["width"][0] == 4
    assert found.values["width"][1].name == "mm"  # type: ignore[union-attr]
    assert found.values["thickness"][0] == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"a,b\n" + b"1," * 5000 + b"\n", "at most 2000 columns"),
        (b"a" * 1_100_000, "at most 1000000 characters"),
        (b"a,b\n1,2\0\n", "binary"),
        (b"only words\n", "rows of numbers"),
        (b'a,b\n1,2\n3,"4\n' + b"5,6\n" * 50_000, "field larger"),
    ],
)
def test_what_is_no_table_is_one_line(text: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        table(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("Force (kN)", "Force", "kN"),
        ("Load [N]", "Load", "N"),
        ("P_kPa", "P", "kPa"),
        ("Timestamp (ms since midnight)", "Timestamp", "ms"),
        ("Strain 1 (%)", "Strain 1", "%"),
        ("Strain 1", "Strain 1", None),
        ("Sensor A", "Sensor A", None),
        ("Spannung in N/mm²", "Spannung in", "MPa"),
    ],
)
def test_units_of_headers(header: str, name: str, unit: str | None) -> None:
    found, known = split_unit(header)
    assert (found, known and known.name) == (name, unit)


def test_numbers_in_cells() -> None:
    assert number("1.234,5", ",") == 1234.5
    assert number("1,234.5", ".") == 1234.5
    assert not is_number("1_5", ".")
    assert not is_number("0,500", ".")
    for cells, decimal in ((["1,5", "1.234"], ","), (["1.5", "1_5"], ".")):
        values, wrong = numbers(cells, decimal)
        assert values[0] == 1.5
        assert np.isnan(values[1])
        assert wrong == 1


def test_settings_are_toml_or_plain_words() -> None:
    assert settings_from_words(["a=1", "b=[1, 2]", "c=first loading", "registration.frame='fit'"]) == {
        **{"a": 1, "b": [1, 2], "c": "first loading", "frame": "fit"}
    }
    with pytest.raises(InputError, match="key=value"):
        settings_from_words(["a"])


@pytest.mark.parametrize(
    ("header", "unit", "size"),
    [
        ("Stress (kgf/cm2)", "pressure", 98066.5),
        ("Stress [kgf/cm^2]", "pressure", 98066.5),
        ("Spannung [kp/cm²]", "pressure", 98066.5),
        ("Stress (ksi)", "pressure", 6.894757e6),
        ("Stress (N/mm2)", "pressure", 1e6),
        ("p1 (inHg)", "pressure", 3386.389),
        ("p1 (mmHg)", "pressure", 133.3224),
        ("p1 (cmH2O)", "pressure", 98.0665),
        ("p1 [bar(g)]", "pressure", 1e5),
        ("Strain (in/in)", "ratio", 1.0),
        ("Hencky strain (1)", "ratio", 1.0),
        ("Area (mm2)", "area", 1e-6),
        ("x (mm, filtered)", "length", 1e-3),
    ],
)
def test_sizes_of_units(header: str, unit: str, size: float) -> None:
    known = split_unit(header)[1]
    assert known is not None
    assert (known.kind, known.scale) == (unit, pytest.approx(size, rel=1e-6))


def test_a_number_in_brackets_is_no_unit() -> None:
    assert split_unit("Pressure (1)")[1] is None


def test_a_summary_below_the_rows_is_left_out() -> None:
    rows = "".join(f"{k / 10},{k / 4}\n" for k in range(40))
    for summary, name in (
        ("1.95,4.875\n", "turns back"),
        ("40,9.75\n", "turns back"),
        ("Mean,4.875\n", "rows of text"),
    ):
        choices = Choices({})
        found = text_table("file", f"Time (s),Extension (mm)\n{rows}{summary}".encode(), choices)
        assert found.rows == 40
        assert [name in reason for reason in choices.dropped] == [True]
    for whole in (rows, rows + "".join(f"{4 + k / 10},{9.75 - k / 4}\n" for k in range(3))):  # an unloading that begins
        assert table(f"Time (s),Extension (mm)\n{whole}").rows == whole.count("\n")


def test_a_unit_that_is_not_known_stays_with_its_name() -> None:
    found = table("Time,Extension,Load\n(s),(mm),(kgx)\n" + "0,1,2\n1,2,3\n2,3,4\n")
    assert found.names == ("Time", "Extension", "Load (kgx)")
    assert table("% t(s) d(mm)\n0 1\n1 2\n2 3\n").names == ("t", "d")
    assert [u and u.name for u in table("Dehnung;Spannung\n%;MPa\n1;2\n2;3\n3;4\n").units] == ["%", "MPa"]
