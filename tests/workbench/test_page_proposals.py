"""What the search wrote itself, on the page: shown, added, saved; without a browser."""

import json
import os
import shlex
import shutil
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import written_searches
from pydantic import TypeAdapter
from written_searches import CABLE, FLOOR, write_search

from freelearn.common.errors import UserError
from freelearn.common.formats import sentence
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.written.forms import ENERGIES, ONE, TWO
from freelearn.physics.written.places import PLACES, PRESSURE
from freelearn.physics.written.source import source
from freelearn.physics.written.written_effect import Written
from freelearn.workbench.panels.comparison import Comparison
from freelearn.workbench.panels.effects_panel import Effects
from freelearn.workbench.panels.outcome import Outcome
from freelearn.workbench.panels.proposals import HINT, Proposals
from freelearn.workbench.state.proposed import proposed, written_of
from freelearn.workbench.state.question import Question
from freelearn.workbench.state.session_store import SessionStore

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")

SEARCH = "discover_0123456789"
NAME = CABLE.name


def searched(session, **more):
    """The session has had a search that wrote CABLE."""
    write_search(session.folder / SEARCH, **more)
    session.search = {"folder": SEARCH, "question": session.question}
    session.save()
    return session


def file_of(session):
    return session.folder / SEARCH / f"proposed_{NAME}.py"


def drawn(session):
    page = Proposals(session)
    page.refresh()
    return page


@pytest.fixture
def session(sessions):
    return searched(sessions.get("")[1])


def ticked(session):
    page = Effects(session)
    page.refresh()
    return page


def said(pane):
    return [unescape(line.split(">", 1)[1]) for line in pane.object.split("</p>")[:-1]]


def test_a_proposal_is_told_in_the_words_of_the_report_beside_its_curve(session):
    page = drawn(session)
    (block,) = page.blocks
    first, *rest = written_searches.told()
    assert page.view.visible
    assert said(block.says) == [f"{first}.", *map(sentence, rest)]
    assert "a = 3 ± 0.012 N" in block.says.object
    assert "Δl₀ = 2 ± 0.01 mm" in block.says.object
    (chart,) = (part for part in block.view.objects if part is not block.view.objects[0])
    figure = chart.object
    assert figure.title.text == "ΔF = a max(Δl − Δl₀, 0)"
    assert (figure.xaxis[0].axis_label, figure.yaxis[0].axis_label) == ("elongation Δl [mm]", "ΔF [N]")
    table = next(r.data_source for r in figure.renderers).data
    assert table["elongation"] == pytest.approx(np.linspace(-6, 6, 13))
    assert table["high"] - table["low"] == pytest.approx(np.full(13, 0.06))


def test_added_it_is_ticked_and_known_to_this_session_alone(session):
    # Other tests of the same process may have run such a file on purpose.
    before = set(sys.modules)
    page, boxes = drawn(session), ticked(session)
    assert NAME not in boxes.boxes.options.values()
    (block,) = page.blocks
    assert block.add.visible
    block.add.clicks += 1
    assert session.question.effects == (NAME,)
    page.refresh()
    boxes.refresh()
    assert boxes.boxes.value == [NAME]
    assert f"{NAME}: written by a search, {CABLE.formula}" in boxes.boxes.options
    assert not block.add.visible
    assert "among the effects below" in block.told.object
    boxes.boxes.value = []
    boxes.refresh()
    assert session.question.effects == ()
    # It is one of this session's, not of every one's, and nothing of its file was run.
    assert NAME not in EFFECTS
    assert not [name for name in set(sys.modules) - before if name.startswith("freelearn_own")]
    assert SessionStore(session.folder).added == session.added


def test_what_was_found_is_adopted_as_the_search_fitted_it(session):
    """With the search's own error and parameters, and with the file of the effect that it wrote."""
    before = set(sys.modules)
    session.adopt()
    (run,) = session.runs
    assert session.adopted(run)
    assert (session.question.effects, run["question"].effects) == ((NAME,), (NAME,))
    assert run["question"].own == (str(file_of(session).resolve()),)
    about = session.about(run)
    assert (about["error"], about["E"], about["parameters"]["C1"]["value"]) == ("held-out error", 0.0101, 1e6)
    assert ticked(session).boxes.value == [NAME]
    assert not [name for name in set(sys.modules) - before if name.startswith("freelearn_own")]
    # Once more, it is the same run.
    session.adopt()
    assert session.runs == [run]


def test_nothing_is_adopted_of_a_search_that_found_nothing(sessions):
    session = searched(sessions.get("")[1], hint=True)
    session.adopt()
    assert not session.runs
    assert session.found() == ()


def test_its_file_is_there_to_be_saved(session):
    (block,) = drawn(session).blocks
    assert (block.save.visible, block.save.filename) == (True, f"proposed_{NAME}.py")
    assert Path(block.save.file).read_text() == file_of(session).read_text()


def test_of_what_stays_unexplained_there_is_a_hint_alone(sessions):
    session = searched(sessions.get("")[1], hint=True)
    page = drawn(session)
    (block,) = page.blocks
    assert "A hint at what remains" in page.view.objects[0].object
    assert said(block.says)[0].startswith(f"{HINT}{NAME}: ")
    assert (block.add.visible, block.save.visible, block.problem.object) == (False, False, "")
    assert NAME not in ticked(session).boxes.options.values()
    with pytest.raises(UserError):
        session.add_proposal(NAME)


def test_nothing_is_shown_of_a_search_that_wrote_nothing(session):
    path = session.folder / SEARCH / "discovery.json"
    page = drawn(session)
    # As a search of former times left it.
    content = json.loads(path.read_text())
    path.write_text(json.dumps({k: v for k, v in content.items() if k not in ("proposals", "hint")}))
    page.refresh()
    assert not page.view.visible
    session.choose(model="linear")
    page.refresh()
    assert not page.view.visible


# --- only what a search of this session wrote -----------------------------------------------------------------------

HARM = "import os\nos.environ['FREELEARN_HARM'] = 'done'\n"


def harm_before(path):
    path.write_text(HARM + path.read_text())


def harm_in_a_body(path):
    path.write_text(path.read_text().replace("        x = (", "        __import__('os').system('true')\n        x = ("))


def harm_in_a_number(path):
    path.write_text(path.read_text().replace("start=3.0", "start=float(exec('1'))"))


def another_number(path):
    path.write_text(path.read_text().replace("start=3.0", "start=4.0"))


def harm_in_another_encoding(path):
    text = path.read_text().encode("ascii", "ignore").decode()
    path.write_bytes(b"# -*- coding: utf-7 -*-\n" + text.encode() + b"#+AAo-import os\n")


def unknown_to_the_search(path):
    content = json.loads((path.parent / "discovery.json").read_text())
    (path.parent / "discovery.json").write_text(json.dumps(content | {"proposals": []}))


def a_link_elsewhere(path):
    elsewhere = path.parent.parent / path.name
    shutil.move(path, elsewhere)
    path.symlink_to(elsewhere)


def gone(path):
    path.unlink()


def too_long(path):
    path.write_text(path.read_text() + "#" * 2**16)


def no_python(path):
    path.write_text("ends here (")


@pytest.mark.parametrize(
    "change",
    [harm_before, harm_in_a_body, harm_in_a_number, another_number, harm_in_another_encoding, unknown_to_the_search,
     a_link_elsewhere, gone, too_long, no_python],
)  # fmt: skip
def test_a_file_that_is_not_as_the_search_wrote_it_is_refused(session, change):
    page = drawn(session)
    change(file_of(session))
    with pytest.raises(UserError, match="is not as a search of this session wrote it"):
        session.add_proposal(NAME)
    # Pressed before the page is drawn anew.
    page.blocks[0].add.clicks += 1
    assert "search again" in page.blocks[0].problem.object
    assert (session.question.effects, session.added) == ((), {})
    for block in drawn(session).blocks:
        assert (block.add.visible, block.save.visible) == (False, False)
        assert "search again" in block.problem.object


def test_comments_and_docstrings_make_no_difference(session):
    path = file_of(session)
    path.write_text(path.read_text().replace("Force of an element", "Cable", 1) + "# seen\n")
    session.add_proposal(NAME)
    assert session.question.effects == (NAME,)


@pytest.mark.parametrize("name", ["../../x", f"../{SEARCH}/proposed_{NAME}", "", "x.py\x00", "/etc/passwd", "Ä"])
def test_no_name_leads_out_of_the_searchs_folder(session, name):
    with pytest.raises((UserError, ValueError)):
        session.add_proposal(name)
    path = session.folder / SEARCH / "discovery.json"
    content = json.loads(path.read_text())
    content["proposals"][0]["name"] = name
    content["proposals"][0]["file"] = "/etc/passwd"
    path.write_text(json.dumps(content))
    (block,) = drawn(session).blocks
    assert (block.add.visible, block.save.visible) == (False, False)
    assert (session.question.effects, session.added) == ((), {})


def test_files_of_other_folders_are_refused(session, sessions):
    other = searched(sessions.get("")[1])
    beside = session.folder / "proposed_folder"
    shutil.copytree(session.folder / SEARCH, beside)
    deeper = session.folder / SEARCH / SEARCH
    shutil.copytree(session.folder / SEARCH, deeper)
    link = session.folder / "discover_aaaaaaaaaa"
    link.symlink_to(other.folder / SEARCH)
    assert proposed(file_of(session), session.folder).written == replace(CABLE, starts=dict(CABLE.starts))
    for folder in (other.folder / SEARCH, beside, deeper, link):
        with pytest.raises(UserError):
            proposed(folder / f"proposed_{NAME}.py", session.folder)


def test_whatever_a_search_may_write_is_known_again(tmp_path):
    folder = tmp_path / SEARCH
    folder.mkdir()
    scales = {"elongation": 6e-3, "twist": 2.0, "pressure": 7e4, "force": 40.0, "moment": 0.2, "time": 2e4}
    generator, count = np.random.default_rng(0), 0
    for place in PLACES:
        pair = place.inputs[:2]
        forms = [*((pair[:1], f) for f in (ENERGIES if place.energy else ONE))] if not place.potential else []
        forms += [(pair, f) for f in generator.permutation(np.array(TWO, dtype=object))[:8]] if len(pair) == 2 else []
        for inputs, form in forms:
            # Rates and slopes are bounded by what the measurements can tell.
            form = form.told_by([[-1.0, -0.8, -0.6, 0.0, 0.4, 0.6, 1.0], [-1.0, -0.4, 0.1, 0.5, 1.0]][: len(inputs)])
            starts = {s.name: s.grid[0] * 1.1 for s in form.shapes}
            own = tuple(scales.get(i.name, 0.4) for i in inputs)
            whole = Written(
                place, inputs, own, form, {"amount": -0.7, "second": 1 / 3} | starts, ("Read it.",), count % 3 == 0
            )
            whole = whole.started({c.name: c.start for c in whole.constants()})
            entry = {
                "name": whole.name, "port": place.port, "where": place.where, "formula": whole.formula,
                "in_units_of": {i.name: {"value": s} for i, s in zip(inputs, own, strict=True)},
                "parameters": {c.name: {"value": c.start} for c in whole.constants()},
            }  # fmt: skip
            entry = json.loads(json.dumps(entry))
            (folder / "discovery.json").write_text(json.dumps({"verdict": "proposed", "proposals": [entry]}))
            path = folder / f"proposed_{whole.name}.py"
            path.write_text(source(whole))
            again = replace(proposed(path, tmp_path).written, lines=whole.lines)
            assert (again.place, again.inputs, again.each) == (place, inputs, whole.each), whole.name
            for one, other in zip(again.constants(), whole.constants(), strict=True):
                assert vars(one) | {"lower": 0, "upper": 0} == vars(other) | {"lower": 0, "upper": 0}, whole.name
                assert (one.lower, one.upper) == pytest.approx((other.lower, other.upper), rel=1e-12), whole.name
            path.unlink()
            count += 1
    assert count > 300


def test_an_entry_that_tells_of_nothing_known_is_none():
    entry = {
        "name": NAME, "port": "parallel", "where": "axial", "formula": CABLE.formula,
        "in_units_of": {"elongation": {"value": 6e-3}},
        "parameters": {"amount": {"value": 3.0}, "knee": {"value": 2e-3}},
    }  # fmt: skip
    assert written_of(entry) == CABLE
    changes = [
        {"port": "nowhere"}, {"name": "x"}, {"formula": "ΔF = exec"}, {"in_units_of": {PRESSURE.name: {"value": 1.0}}},
        {"in_units_of": {"elongation": {"value": float("nan")}}}, {"in_units_of": {"elongation": {"value": 0}}},
        {"in_units_of": []}, {"parameters": {"amount": {"value": "exec('1')"}, "knee": {"value": 2e-3}}},
        {"parameters": {"amount": {"value": 3.0}}}, {"parameters": {"amount": None, "knee": None}},
    ]  # fmt: skip
    for change in changes:
        assert written_of(entry | change) is None, change


# --- fits with it ---------------------------------------------------------------------------------------------------


class Waiting:
    """A job that never ends."""

    asked: list[Question] = []  # noqa: RUF012

    def __init__(self, kind, question, folder, fits):
        self.kind, self.folder, self.status, self.text, self.share = kind, folder, "running", "", None
        self.asked.append(question)

    def poll(self):
        return False

    def cancel(self):
        pass


def test_fits_and_searches_with_it_name_its_file_and_are_compared_with_those_before(session, monkeypatch):
    monkeypatch.setattr("freelearn.workbench.state.running.Job", Waiting)
    monkeypatch.setenv("FREELEARN_EFFECTS", "/mine.py")
    Waiting.asked.clear()
    before = session.question
    session.add_proposal(NAME)
    session.start("train")
    (asked,) = Waiting.asked
    path = str(file_of(session).resolve())
    assert asked.own == (path,)
    assert asked.same_but_effects(before)
    assert TypeAdapter(Question).validate_python(json.loads(json.dumps(asked.to_json()))) == asked
    shell = shlex.split(asked.command("train"))
    assert shell[0] == f"FREELEARN_EFFECTS=/mine.py{os.pathsep}{path}"
    assert f"effects=[{NAME}]" in shell
    assert os.environ["FREELEARN_EFFECTS"] == "/mine.py"
    # Busy: nothing can be added, and nothing changes.
    page = drawn(session)
    assert page.blocks[0].add.disabled
    session.added.clear()
    session.add_proposal(NAME)
    assert session.added == {}


def test_where_it_is_not_in_the_model_its_file_is_not_named(session, monkeypatch):
    monkeypatch.setattr("freelearn.workbench.state.running.Job", Waiting)
    monkeypatch.delenv("FREELEARN_EFFECTS", raising=False)
    Waiting.asked.clear()
    session.add_proposal(NAME)
    session.choose(effects=("twist_offset",))
    session.start("train")
    assert Waiting.asked[0].own == ()
    assert Waiting.asked[0].command("train").startswith("python train.py")
    assert "FREELEARN_EFFECTS" not in os.environ


@pytest.mark.slow
@pytest.mark.nightly
def test_a_fit_has_the_added_effect_and_a_changed_file_is_never_run(sessions, finish, monkeypatch):
    monkeypatch.delenv("FREELEARN_EFFECTS", raising=False)
    session = sessions.get("")[1]
    session.start("train")
    finish(session)
    searched(session)
    session.add_proposal(NAME)
    session.start("train")
    finish(session)
    assert session.job.status == "done", session.job.text
    assert len(session.comparable()) == 2
    run = session.runs[-1]
    assert {f"{NAME}.amount", f"{NAME}.knee"} <= set(session.read(run, "results.json")["parameters"])
    report = (session.folder / run["folder"] / "report.html").read_text()
    assert f"FREELEARN_EFFECTS={file_of(session).resolve()} python train.py" in unescape(report)
    page = Comparison(session)
    page.refresh()
    outcome = Outcome(session)
    outcome.refresh(drawn=False)
    assert f"continuum + {NAME}, fitted on sample3" in outcome.title.object
    assert page.now.bands is not None
    assert page.first.model.labels() != page.now.model.labels()
    assert NAME not in EFFECTS
    # The file runs in the job's process alone, and only as it was written.
    harm = session.folder / "harm"
    path = file_of(session)
    path.write_text(path.read_text() + f"\nopen({str(harm)!r}, 'w').close()\n")
    session.choose(train="sample2")
    session.start("train")
    finish(session)
    assert session.job.status == "failed"
    assert session.job.text == f"{path.name} is not as a search of this session wrote it: search again."
    assert not harm.exists()


def test_the_floor_is_told(session):
    (block,) = drawn(session).blocks
    assert f"measuring alone leaves {100 * FLOOR:.3f} %" in block.says.object
