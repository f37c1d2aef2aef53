"""What stands in cells, headings, names and kept files: text, on the page, in reports and in tables."""

import json
import random
import re
import string

import pandas as pd
import pytest
from nightly import EVERY, chosen
from small_runs import make_csv

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import TrainSettings
from freelearn.api.tasks.train_task import train
from freelearn.common.csv_text import csv_text
from freelearn.workbench.state.session import Sessions

pytestmark = pytest.mark.slow

HTML = ["<img src=x onerror=\"document.title='owned'\">", "<script>document.title='owned'</script>", "</p><b>bold</b>"]
FORMULAS = ["=1+1", "+1+1", "-1+cmd|' /C calc'!A0", "@SUM(1)", "\t=1", "\r=1", '=HYPERLINK("http://evil.example","x")']
HARMLESS = ["-5.2", "+5.2", "-1e-3", "a=b", "", "3", "−4"]


def test_no_text_of_a_table_that_is_written_is_a_formula():
    table = pd.DataFrame({"note": [*FORMULAS, *HARMLESS], "=1": 1.0})
    head, *_ = csv_text(table).splitlines()
    assert head == "note,'=1"
    for text in FORMULAS:
        (line,) = csv_text(pd.DataFrame({"note": [text]})).split("\n", 1)[1:]
        assert line.lstrip('"').startswith("'")
    for text in HARMLESS:
        assert csv_text(pd.DataFrame({"note": [text]})) == f"note\n{text}\n"


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """The folder of a run on a table with formulas and HTML in columns of the user's own, in its name and command."""
    folder = tmp_path_factory.mktemp("reported")
    path = make_csv(folder / "<b>mine<b>.csv", note="=1+1", **{"@evil": HTML[0], HTML[1]: HTML[2]})
    chosen_run = ["fits=null", f"figures={EVERY}", "data=csv", f"data.path='{path}'", "model=linear", "train=all"]
    train(settings(TrainSettings, chosen_run), folder, command=f"python train.py {HTML[0]}")
    return folder


def test_formulas_of_a_users_own_columns_are_text_in_the_predictions(reported):
    written = (reported / "predictions.csv").read_text()
    assert "'=1+1" in written
    assert not re.search(r"(^|,)\"?[=@]", written, re.MULTILINE)


@pytest.fixture
def page(browser):
    """A fresh page in the browser; fails the test where anything ran or asked anybody else for anything."""
    elsewhere, dialogs = [], []
    page = browser.new_page()
    page.set_default_timeout(90_000)
    page.on(
        "request",
        lambda r: r.url.startswith(("http://localhost:", "data:", "blob:", "file:")) or elsewhere.append(r.url),
    )
    page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    yield page
    assert "owned" not in page.title()
    assert not page.locator("img[src=x]").count()
    # Read as HTML, these would be all of an element's text.
    assert not any(page.get_by_text(word, exact=True).count() for word in ("bold", "rig", "mine"))
    page.close()
    assert not elsewhere
    assert not dialogs


def drop(page, server, path):
    page.goto(f"http://localhost:{server.port}")
    page.wait_for_url("**session=**")
    page.get_by_label("data", exact=True).select_option(label="my own file")
    page.locator("input[type=file]").first.set_input_files(path)


@pytest.mark.nightly
def test_html_in_headings_cells_and_names_is_text_on_the_page(server, page, tmp_path):
    rows = [f"{HTML[n % 3]};{n % 3};{n % 2};{n / 2};{-n / 3};{HTML[1]}" for n in range(12)]
    own = tmp_path / "<b>rig<b>.csv"
    own.write_text("\n".join([f"rig {HTML[0]};dl_mm;phi_deg;P {HTML[1]};F_N;{HTML[2]}", *rows, ""]))
    drop(page, server, own)
    page.get_by_text("<b>rig<b>.csv is no measurement table yet").wait_for()
    page.get_by_label(f"what rig {HTML[0]} is", exact=True).wait_for()
    # Of the words that name samples, and of every choice about every column, none became markup.
    page.get_by_role("button", name="Make the table only", exact=True).click()
    page.locator("p.bad").first.wait_for()


def test_html_in_a_table_is_text_in_its_report(reported, page):
    page.goto(f"file://{reported / 'report.html'}")
    assert HTML[0] in page.locator("body").inner_text()
    assert "<b>mine<b>.csv" in page.locator("body").inner_text()


def test_what_was_kept_of_a_session_and_is_broken_is_put_aside_and_said(tmp_path):
    state = Sessions(tmp_path).get("")[1]
    state.choose(model="linear")
    whole = (state.folder / "state.json").read_text()
    generator = random.Random(0)
    cases = [whole[: generator.randrange(len(whole))] for _ in range(20)]
    flipped = [(place, generator.choice(string.printable)) for place in generator.sample(range(len(whole)), 200)]
    cases += [whole[:place] + sign + whole[place + 1 :] for place, sign in flipped]
    plain = json.loads(whole)
    cases += [json.dumps(plain | {name: evil}) for name in plain for evil in (None, 3, "x", [1], {"a": 1}, [[]])]
    for text in chosen(cases, 80):
        (state.folder / "state.json").write_text(text)
        again = Sessions(tmp_path).get(state.folder.name)[1]
        again.poll()
        again.choose(model="mlp")
        assert json.loads((again.folder / "state.json").read_text())["question"]["model"] == "mlp"
    assert list(state.folder.glob("state.json.broken*"))
