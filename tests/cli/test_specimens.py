"""python -m freelearn.specimens: what it writes can be read back, drawn and trusted."""

import hashlib
import html
import io
import json
import re
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from closed_forms import SHORT, synthetic
from rich.console import Console

from freelearn.cli import specimen_fits as command
from freelearn.common.errors import UserError
from freelearn.fitting.rubber_effects import NEO_HOOKEAN, compare
from freelearn.fitting.rubber_fit import fit_rubber
from freelearn.physics.effects.registry import make_effects
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.rubber import Rubber
from freelearn.records.specimen_record import load_parameters, write_result
from freelearn.report.plots.specimen_plot import specimen_curves
from freelearn.report.tables.specimen_tables import combination_table, curve_table
from freelearn.report.terminal.printed_tables import rich_table

TRUTH = {"C1": 3e5, "wall_stiffening.C20": 8e3}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The command's folder, text and data, with equibiaxial tension held out."""
    folder = tmp_path_factory.mktemp("specimens")
    table = synthetic(*TRUTH.values())
    sources = []
    for mode, rows in table.groupby("mode"):
        path = folder / f"{mode}.csv"
        rows[["stretch", "stress_mpa"]].to_csv(path, index=False)
        sources.append(f"{SHORT[mode]}={path}")
    text = io.StringIO()
    data = command.read_specimens(sources)
    out = folder / "my new" / "out, 2"
    command.fit_specimens(data, ["wall_stiffening"], ["equibiaxial"], out, Console(file=text, width=100))
    return out, text.getvalue(), data


def test_result_holds_the_fit_and_its_data(run):
    out, text, data = run
    result = json.loads((out / "specimen.json").read_text())
    assert result["effects"] == ["wall_stiffening"]
    for name, value in TRUTH.items():
        assert result["parameters"][name]["value"] == pytest.approx(value, rel=1e-5)
        assert result["parameters"][name]["unit"] == "Pa"
    assert {m: (e["n"], e["fitted"]) for m, e in result["modes"].items()} == {
        "uniaxial": (20, True),
        "equibiaxial": (20, False),
        "pure_shear": (20, True),
    }
    assert [d["sha256"] for d in result["data"]] == [
        hashlib.sha256(Path(d["path"]).read_bytes()).hexdigest() for d in data.files
    ]
    assert "equibiaxial (held out)" in text
    assert sorted(p.name for p in out.iterdir()) == ["curves.csv", "curves.png", "report.html", "specimen.json"]


def test_the_report_ends_with_a_command_that_runs_as_it_stands(run, commands, tmp_path):
    page = (run[0] / "report.html").read_text()
    (code,) = re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL)
    words = shlex.split(html.unescape(code))
    given = [word.split("=")[0] for word in words[-3:]]
    assert given == ["train", "constituent", "effects"]
    done = commands.run("train", *words[-3:], "test=sample3", "figures=false", f"hydra.run.dir={tmp_path}")
    assert done.status == 0, done.told
    values = json.loads((tmp_path / "results.json").read_text())["parameters"]
    assert {name: values[name]["value"] for name in TRUTH} == pytest.approx(TRUTH, rel=1e-5)


def test_parameters_are_loaded_by_the_models_names(run):
    loaded = load_parameters(run[0] / "specimen.json")
    assert loaded == pytest.approx(TRUTH, rel=1e-5)
    tube = Continuum(C2=2e6, effects=make_effects(["wall_stiffening"], "continuum"))
    tube.set_values(loaded)
    assert tube.scalars() == pytest.approx({**TRUTH, "C2": 2e6}, rel=1e-5)


def changed(run, tmp_path, change):
    content = json.loads((run[0] / "specimen.json").read_text())
    change(content)
    # As who changes a result by hand is told to.
    del content["digest"]
    path = tmp_path / "specimen.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c.pop("modes"), "is not a specimen.json"),
        (lambda c: c["parameters"].pop("C1"), "Parameter C1 is missing"),
        (lambda c: c["parameters"].update(C3={}), "Parameter C3 belongs to none"),
        (lambda c: c["effects"].append("foam"), "Unknown effect 'foam'"),
        (lambda c: c["parameters"]["C1"].update(value=-1), "C1 in .* is -1: it must be a number"),
        (lambda c: c["parameters"]["C1"].update(value="3"), "C1 in .* is '3'"),
        (lambda c: c["parameters"]["C1"].update(value=float("nan")), "C1 in .* is nan"),
        (lambda c: c["parameters"]["C1"].update(unit="MPa"), "convert it to 'Pa'"),
    ],
)
def test_a_result_that_is_not_right_is_refused(run, tmp_path, change, words):
    with pytest.raises(UserError, match=words):
        load_parameters(changed(run, tmp_path, change))


def test_a_file_that_is_no_result_is_refused(tmp_path):
    with pytest.raises(UserError, match="There is no file"):
        load_parameters(tmp_path / "none.json")
    with pytest.raises(UserError, match="is a folder"):
        load_parameters(tmp_path)
    for text, words in (("C1: 3", "not a JSON file"), ("[1]", "is not a specimen.json")):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(UserError, match=words):
            load_parameters(tmp_path / "x.json")


def test_an_error_that_does_not_exist_is_written_as_null(tmp_path):
    found = fit_rubber(Rubber(), synthetic(*TRUTH.values()), ["equibiaxial"])
    beyond = replace(found.modes["equibiaxial"], error=float("nan"))
    write_result(tmp_path / "s.json", replace(found, modes=found.modes | {"equibiaxial": beyond}), [])
    assert json.loads((tmp_path / "s.json").read_text())["modes"]["equibiaxial"]["error"] is None
    assert load_parameters(tmp_path / "s.json") == pytest.approx(found.values)


def test_picture_shows_every_row_and_dashes_what_was_held_out(run):
    table = run[2].table
    fits = {
        n: fit_rubber(Rubber(e), table, ["equibiaxial"]) for n, e in ((NEO_HOOKEAN, []), ("b", ["wall_stiffening"]))
    }
    curves = curve_table(table, fits)
    figure = specimen_curves(curves, fits)
    assert [axes.get_title().split(":")[0] for axes in figure.axes] == [
        *("uniaxial, fitted", "equibiaxial, held out", "pure shear, fitted"),
    ]
    for axes, style in zip(figure.axes, ("-", "--", "-"), strict=True):
        lines = {line.get_label(): line for line in axes.lines}
        assert len(lines["measured"].get_xdata()) == 20
        assert lines["measured"].get_marker() == "s"
        assert lines[NEO_HOOKEAN].get_linestyle() == lines["b"].get_linestyle() == style
    # On exact data the right energy's curve ends where the measured rows do.
    for _, rows in curves.groupby("mode"):
        ends = rows[rows["stretch"] == rows["stretch"].max()].set_index("source")["stress_mpa"]
        assert ends["b"] == pytest.approx(ends["measured"], rel=1e-5)
    written = pd.read_csv(run[0] / "curves.csv")
    assert (written["source"] == "measured").sum() == len(table)


def test_comparison_tries_every_combination_and_finds_the_right_one(run, monkeypatch):
    monkeypatch.setattr("freelearn.fitting.rubber_effects.isotropic_effects", lambda: ["wall_stiffening"])
    compared = compare(run[2].table, run[2].modes)
    assert len(compared) == 2 * 4 * 3
    right = compared[compared["effects"] == "wall_stiffening"]
    assert right["error"].max() < 1e-6
    assert compared.loc[compared["effects"] == NEO_HOOKEAN, "error"].min() > 0.01
    assert (compared.groupby("held_out")["fitted"].mean()[["uniaxial", "equibiaxial", "pure_shear"]] == 2 / 3).all()
    text = io.StringIO()
    Console(file=text, width=80).print(rich_table(combination_table(compared)))
    assert "…" not in text.getvalue()


def test_mistakes_end_in_one_sentence(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(sys, "argv", ["specimens", f"UT={tmp_path}/none.csv", "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as caught:
        command.main()
    assert str(caught.value).startswith("error: There is no file")
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(sys, "argv", ["specimens", "x.csv", "--compare", "--held-out", "ET"])
    with pytest.raises(SystemExit):
        command.main()
    assert "drop --effects and --held-out" in capsys.readouterr().err


def test_a_biaxial_mode_has_a_panel_for_each_direction_and_a_line_for_each_specimen(tmp_path):
    rows = [
        f"{mode},{name},{one},{two},{stress},{across}"
        for mode, name, one, two, stress, across in (
            *(("BT", "a", x, 1.5, x / 3, 0.5) for x in (1.0, 1.3, 1.5)),
            *(("BT", "b", x, 2.0, x / 2, 0.7) for x in (1.0, 1.6)),
            *(("UT", "", x, "", x / 4, "") for x in (1.2, 1.8)),
        )
    ]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["mode,specimen,stretch,stretch_2,stress_mpa,stress_2_mpa", *rows]) + "\n")
    table = command.read_specimens([str(path)]).table
    fits = {NEO_HOOKEAN: fit_rubber(Rubber(), table)}
    curves = curve_table(table, fits)
    figure = specimen_curves(curves, fits)
    assert [axes.get_title().split(":")[0] for axes in figure.axes] == ["uniaxial, fitted", *["biaxial, fitted"] * 2]
    assert [text.get_text() for text in figure.axes[1].texts] == ["a", "b"]
    # The lines pass where the rows are, and what direction 2 carries is what direction 1 would of the sheet turned.
    own = curves[(curves["source"] == NEO_HOOKEAN) & (curves["mode"] == "biaxial")]
    assert own.groupby("specimen")["stretch"].agg(["min", "max"]).to_numpy().tolist() == [[1.0, 1.5], [1.0, 1.6]]
    equal = own[(own["stretch"] == own["stretch_2"])]
    assert len(equal) == 1
    assert equal["stress_mpa"].to_numpy() == pytest.approx(equal["stress_2_mpa"].to_numpy())
    assert curves.loc[curves["mode"] == "uniaxial", "stress_2_mpa"].isna().all()
