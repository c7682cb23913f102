"""`--report`: one page that needs no other file, of every study that has one."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from laboratory_files import FOLDER

from softnlp.cli import main
from softnlp.results.report_page import Section, report_page


class Reader(HTMLParser):
    """Collects what a page loads, and whether its elements close."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_a_page_escapes_what_people_wrote_and_loads_nothing() -> None:
    document = {"title": "<b>", "notes": ["a < b & c"], "checks": [], "laws": [{"model": "<i>", "r": 1.0}], "n": None}
    page = report_page("<script>", document, {"Figure": b"png"}, {"Scenario": "<x>"}, [Section("T", ["a"], [["<"]])])
    reader = Reader(page)
    assert reader.open == []
    assert all(source.startswith("data:") for source in reader.sources)
    assert "<script>" not in page.replace("<title>", "")
    assert "a &lt; b &amp; c" in page


def test_tables_within_tables_are_rows_and_none_is_left_as_code() -> None:
    inner = {"x_mm": {"rmse": 1.23456789, "count": 3}, "y_mm": {"rmse": 2.0, "count": 4}}
    row = {"law": "yeoh", "values": {"k_e": 0.5}, "statistics": inner, "by_robot": {"D25": inner}}
    document = {"loads": {"gravity": {"z": -9.8}}, "variants": [row], "bounds": [None, 2.0]}
    page = report_page("t", document, {}, {}, [])
    assert "{" not in page.partition("</style>")[2]
    for wanted in ("loads.gravity.z", "values.k_e", "Variants: statistics", "D25, y_mm", "1.23457", "-, 2"):
        assert wanted in page


def test_a_tensile_test_stands_beside_the_library(tmp_path: Path) -> None:
    text = f'study = "identify"\n[tensile]\nlaws = ["neo-hookean"]\nfile = "{FOLDER / "utm_preamble_kN_percent.csv"}"\n'
    (tmp_path / "test.toml").write_text(text)
    report = tmp_path / "report.html"
    assert main(["identify", str(tmp_path / "test.toml"), "--out", str(tmp_path), "--report", str(report)]) == 0
    page = report.read_text(encoding="utf-8")
    assert Reader(page).open == []
    for wanted in (
        "width_mm = 4.0 was guessed",
        "Beside the library",
        "Ecoflex 00-50",
        "shear modulus of the data",
        "[tensile]",
    ):
        assert wanted in page
    assert len(re.findall("data:image/png;base64", page)) == 1


def test_a_report_is_refused_where_it_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = Path(__file__).parents[1] / "scenarios" / "workspace"
    first = next(iter(sorted(scenario.glob("*.toml"))))
    assert main(["run", str(first), "--report", str(tmp_path / "x.html")]) == 2
    assert "--report" in capsys.readouterr().err
