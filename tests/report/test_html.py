"""report.html: whole, self-contained, safe, and with the numbers of the run."""

import base64
import io
import json
import re

import pandas as pd
import pytest
from small_runs import make_csv, run

from freelearn.cli.command_line import command_line
from freelearn.common.display import DisplayTable
from freelearn.report.html.html_page import Section, write_page

MEGABYTE = 2**20
# What would make a browser fetch something: sources, style sheets, imports. Links that wait for a click do not.
FETCHES = re.compile(r"""<(?:script|img|iframe|source)[^>]*\ssrc=|<link\b|@import|url\(\s*["']?https?:""")


def downloads(page):
    """Tables to download, by name."""
    found = re.findall(r'<a download="([^"]+)" href="data:text/csv;base64,([^"]+)"', page)
    return {name: pd.read_csv(io.BytesIO(base64.b64decode(content))) for name, content in found}


def without_scripts(page):
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    csv = make_csv(folder / "<i>mine<i>.csv", rows=1200)
    run(folder / "run", "train=all", "data=csv", f"data.path='{csv}'", "split=states", "figures=true")
    return folder / "run", csv


def test_it_is_whole_self_contained_and_small(fitted):
    page = (fitted[0] / "report.html").read_text()
    assert page.startswith("<!DOCTYPE html>")
    assert page.rstrip().endswith("</html>")
    assert not FETCHES.search(without_scripts(page))
    assert len(page) < 5 * MEGABYTE


def test_its_numbers_are_those_of_the_run(fitted):
    folder, _ = fitted
    text = without_scripts((folder / "report.html").read_text())
    results = json.loads((folder / "results.json").read_text())
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", text)
    assert f"{100 * results['tests']['all']['E']:.2f}" in cells
    for name, p in results["parameters"].items():
        shown = [
            name,
            *(f"{p[key]:.{digits}g}" for key, digits in (("value", 5), ("stderr", 2), ("low", 4), ("high", 4))),
        ]
        place = cells.index(name)
        assert cells[place : place + 5] == shown
    assert results["data"]["sha256"] in text
    assert "measured data" in text
    assert "SIMULATED" not in text
    for failure in results["failures"]:
        sentence = failure["sentence"].replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        assert sentence[1:] in text
    tables = downloads(text)
    rows = pd.read_csv(folder / "predictions.csv")
    assert {"parity.csv"} <= set(tables)
    assert sum(name.startswith("curves_") for name in tables) == 3
    parity = tables["parity.csv"]
    shown = rows[rows["split"] != ""]
    assert len(parity) == len(shown)
    assert parity["force_n"].sum() == pytest.approx(shown["force_n"].sum(), rel=1e-6)


def test_nothing_from_a_file_is_html(fitted, tmp_path):
    text = without_scripts((fitted[0] / "report.html").read_text())
    assert "<i>" not in text
    assert "&lt;i&gt;mine" in text
    evil = "<script>alert(1)</script>"
    frame = pd.DataFrame({evil: [evil]})
    table = DisplayTable.from_frame(frame, caption=evil)
    write_page(tmp_path / "r.html", evil, False, [Section(evil, [evil], [table], code=evil, numbers={evil: frame})])
    page = (tmp_path / "r.html").read_text()
    assert evil not in page
    # Title twice, section's heading, line, code, table's heading, cell and caption, file name twice.
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt;") == 10


def test_a_long_table_can_be_folded_away(tmp_path):
    table = DisplayTable.from_rows(["line"], [], [["7"]])
    write_page(
        tmp_path / "r.html",
        "page",
        False,
        [Section("s", ["text"], [table], folded="all <1>"), Section("t", [], [table])],
    )
    page = (tmp_path / "r.html").read_text()
    assert re.search(
        r"<p>text</p>\s*<details><summary>all &lt;1&gt;</summary>\s*<div.*?</div>\s*</details>", page, re.DOTALL
    )
    assert page.count("<details>") == 1


def test_headings_take_more_lines_before_a_table_is_cut(browser, tmp_path):
    """Half of a wide window is less than what the staircase's headings take in one line each."""
    headings = ["E fitted %", "E held-out %", "noise floor %", "misfit in noise standard deviations", "left over"]
    row = ["+ small_strain_stiffness", "1.513", "2.084", "0.356", "4.67", "0.1", "no pattern"]
    table = DisplayTable.from_rows(["step"], headings, [row] * 3, last=["remaining misfit"])
    write_page(tmp_path / "r.html", "page", False, [Section("s", [], [table]), Section("t", ["beside"])])
    page = browser.new_page(viewport={"width": 1920, "height": 1000})
    page.goto((tmp_path / "r.html").as_uri())
    wide = page.locator(".wide").first
    assert wide.evaluate("e => e.clientWidth") < 1000
    assert wide.evaluate("e => e.scrollWidth - e.clientWidth") == 0
    page.close()


def test_a_column_of_sentences_keeps_room_beside_many_numbers(browser, tmp_path):
    """Sixteen rows of it took three sheets of paper: a word in each line."""
    row = ["348", "force", *["−1.24 N"] * 9, "stuck: 12 readings far off show nearly the same"]
    table = DisplayTable.from_rows(["line", "reading"], ["a"] * 9, [row] * 16, last=["how it slipped, perhaps"])
    write_page(tmp_path / "r.html", "page", False, [Section("s", [], [table])])
    page = browser.new_page(viewport={"width": 700, "height": 1000})
    page.goto((tmp_path / "r.html").as_uri())
    page.emulate_media(media="print")
    line = float(page.evaluate("parseFloat(getComputedStyle(document.querySelector('td')).lineHeight)"))
    assert page.locator("td.long").first.evaluate("e => e.clientHeight") < 3.5 * line
    page.close()


def test_simulated_data_are_said_to_be_so(tmp_path):
    write_page(tmp_path / "r.html", "title", True, [Section("s")])
    assert "SIMULATED DATA" in (tmp_path / "r.html").read_text()


def test_without_charts_there_is_no_library(tmp_path):
    write_page(tmp_path / "r.html", "title", True, [Section("s", ["text"])])
    assert (tmp_path / "r.html").stat().st_size < 5000


def test_the_command_is_one_that_a_shell_reads_back(monkeypatch):
    import shlex

    monkeypatch.delenv("FREELEARN_EFFECTS", raising=False)
    words = ["data.path=/my files/it's.csv", "effects=[a,b]", "model.C1=1e6"]
    assert shlex.split(command_line(["python", "train.py", "-m"], words)) == ["python", "train.py", "-m", *words]
    monkeypatch.setenv("FREELEARN_EFFECTS", "/my effects.py")
    assert command_line(["python", "train.py"], []) == "FREELEARN_EFFECTS='/my effects.py' python train.py"


def test_tables_sort_by_a_script_that_only_pages_with_tables_have(tmp_path):
    table = DisplayTable.from_rows(["set"], ["E %"], [["a", "10.0"], ["b", "−2.5"], ["c", "–"]])
    write_page(tmp_path / "r.html", "page", False, [Section("s", [], [table])])
    page = (tmp_path / "r.html").read_text()
    assert page.count('<button type="button">') == 2
    assert "aria-sort" in page
    assert not FETCHES.search(page)


def test_a_page_has_one_minus_sign(tmp_path):
    table = DisplayTable.from_rows(["place"], ["M"], [["-3 mm, run-7", "-1.5e-06"]])
    write_page(tmp_path / "r.html", "page", False, [Section("at -60°", ["from (-2 N)"], [table], code="x=-1")])
    page = (tmp_path / "r.html").read_text()
    for shown in ("at −60°", "from (−2 N)", "−3 mm, run-7", "−1.5e−06"):
        assert shown in page
    # What a shell reads stays as it is.
    assert "x=-1" in page


def test_it_has_a_paragraph_for_the_lab_book(fitted):
    text = without_scripts((fitted[0] / "report.html").read_text())
    note = re.search(r'<p class="note">(.*?)</p>', text, re.DOTALL)[1]
    results = json.loads((fitted[0] / "results.json").read_text())
    assert f"E = {100 * results['tests']['all']['E']:.2f} %" in note
    assert all(f"{name} = (" in note for name in results["parameters"])
    assert results["data"]["sha256"] in note
    assert "seed 0, split by states" in note
