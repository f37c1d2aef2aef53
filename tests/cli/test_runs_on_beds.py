"""`train` and `discover` from a table of each bed to their files, pictures and pages."""

import json
import re

import beds
import numpy as np
import pandas as pd
import pytest
from hidden_tables import QUICK
from matplotlib import pyplot
from nightly import EVERY as NIGHT
from nightly import usually
from rich.console import Console
from small_runs import run

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.cli.paper_figures import draw_folder

CLAMPS, FRICTION = {"end_clamps": {"clamp_length": 6e-3}}, {"friction_hysteresis": {"force": 0.8}}
HIDDEN = {"isometric": FRICTION, "dead_load": CLAMPS, "inflation": FRICTION, "block": CLAMPS}
# Under four moments any one that is left out lies far from the others: what they say of it decides no claim.
ENOUGH = {"dead_load": {"levels": 7}}
# What each bed measures: words of its failures, columns of its predictions, and panels of its curves.
WORDS = {
    "isometric": ("Force", ["force"], ["force_pred_n"], ["F–P"]),
    "dead_load": (
        "Elongation and twist", ["elongation", "twist"], ["elongation_pred_mm", "twist_pred_deg"],
        ["Δl–P", "φ–P", "Δl–φ"],
    ),
    "inflation": (
        "Force and outer diameter", ["force", "outer_diameter"], ["force_pred_n", "outer_diameter_pred_mm"],
        ["F–P", "D–P", "F–D"],
    ),
    "block": ("Loads", ["force", "moment"], ["force_pred_n", "moment_pred_nmm"], ["F–M"]),
}  # fmt: skip
EVERY = {"force_pred_n", "moment_pred_nmm", "elongation_pred_mm", "twist_pred_deg", "outer_diameter_pred_mm"}


def no_constant(name):
    raise AssertionError(f"{name} is no JSON")


def read(path):
    return json.loads(path.read_text(), parse_constant=no_constant)


@pytest.fixture(scope="module", params=usually("isometric", nightly=[bed for bed in beds.TABLES if bed != "isometric"]))
def found(request, tmp_path_factory):
    """A search on each bed: its name, folder and discovery.json."""
    folder = tmp_path_factory.mktemp(request.param)
    overrides = beds.write(request.param, HIDDEN[request.param], folder, **ENOUGH.get(request.param, {}))
    with open(folder / "terminal.txt", "w") as file:
        asked = settings(DiscoverSettings, [*overrides, "train=all", QUICK])
        discover(asked, folder, Console(file=file, width=100))
    return request.param, folder, read(folder / "discovery.json")


@pytest.fixture(scope="module", params=list(beds.TABLES))
def fitted(request, tmp_path_factory):
    """A run on each bed: its name and folder."""
    folder = tmp_path_factory.mktemp(request.param)
    run(
        folder / "run",
        *beds.write(request.param, {}, folder),
        "train=all",
        "figures=true" if NIGHT else "figures=false",
    )
    return request.param, folder / "run"


def test_the_hidden_effect_is_found(found):
    bed, _, content = found
    assert (content["verdict"], content["effects"]) == ("named", list(HIDDEN[bed]))
    error = content["error"]
    assert error["before"] > 1.3 * error["after"]
    assert error["after"] < 1.5 * error["noise_floor"]
    # Blank, censored and unmeasured readings do not make noise look smaller than it is.
    assert content["trail"][-1]["sigmas_heldout"] == pytest.approx(1, abs=0.15)
    assert content["noise_scale"] == pytest.approx(1, abs=0.3)


def test_it_is_told_in_the_quantities_of_the_bed(found):
    bed, folder, content = found
    heading, parts, _, panels = WORDS[bed]
    for failure in content["failures"]:
        told = {name for name, value in failure.items() if name.startswith("sigma_") and value is not None}
        assert told <= {f"sigma_{part}" for part in parts}
    whole = content["splits"][0]
    assert {name for name, value in whole.items() if name.startswith("E_") and value is not None} == {
        f"E_{part}" for part in parts
    }
    page = (folder / "report.html").read_text()
    assert f"<h2>{heading} before and after: sample" in page
    assert all(json.dumps(json.dumps(panel)[1:-1])[1:-1] in page for panel in panels)
    text = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    if "moment" not in parts:
        assert "moment residual" not in text
    curves = pd.read_csv(folder / "curves_1.csv")
    assert curves["what"].isin(["measured", "slack", "before", "after"]).all()
    # What the bed measures has bands, and the better model the narrower ones.
    column = "elongation_mm" if bed == "dead_load" else "force_n"
    wide, narrow = (
        (own[f"{column}_high"] - own[f"{column}_low"]).mean()
        for own in (curves[curves["what"] == when] for when in ("before", "after"))
    )
    assert wide > narrow > 0
    for name in ("staircase", "residuals_before", "residuals_after", "curves_1"):
        assert (folder / f"{name}.png").stat().st_size > 5000


def test_only_what_the_bed_measures_is_predicted(found):
    bed, folder, _ = found
    for when in ("before", "after"):
        columns = set(pd.read_csv(folder / f"predictions_{when}.csv"))
        assert columns & EVERY == set(WORDS[bed][2])


def test_a_run_tells_its_errors_by_quantity(fitted):
    bed, folder = fitted
    results = read(folder / "results.json")
    scores = results["tests"]["all"]
    measured = {f"E_{part}" for part in WORDS[bed][1]}
    assert {name for name, value in scores.items() if name.startswith("E_") and value is not None} == measured
    assert results["counts"]["used"] == int((pd.read_csv(folder / "predictions.csv")["split"] == "train").sum())
    text = (folder / "report.html").read_text()
    for symbol, shown in (("F", "force"), ("M", "moment"), ("φ", "twist"), ("D", "outer_diameter")):
        assert (f"/max|{symbol}|" in text) == (shown in WORDS[bed][1])
    assert ("hangs loose" in text) == (bed == "isometric")
    names = " and ".join(WORDS[bed][1]).replace("_", " ")
    assert f"({names} of {results['counts']['used']} rows)" in (folder / "fit_report.txt").read_text()


def test_a_fitted_model_is_taken_up_again(fitted):
    bed, folder = fitted
    model = freelearn.load(folder)
    rows = model.table()
    answer = model.predict(rows)
    shown = answer.table()
    for name in WORDS[bed][2]:
        np.testing.assert_allclose(shown[name], rows[name], rtol=1e-6, atol=1e-7)
        assert (shown[f"{name}_stderr"] >= 0).all()
    assert set(shown) & EVERY == set(WORDS[bed][2])
    # What is imposed is enough.
    imposed = [q.column for q in model.bed.state] + [c for c in rows if re.fullmatch(r"pressure(_\d)?_kpa", c)]
    short = model.predict(rows[["sample", *imposed]])
    np.testing.assert_allclose(short.loads, answer.loads, rtol=1e-9, atol=1e-12)


def test_a_notebook_draws_what_the_bed_measures(fitted):
    bed, folder = fitted
    model = freelearn.load(folder)
    for draw in (model.plot.parity, model.plot.residuals):
        for part in WORDS[bed][1]:
            assert draw(quantity=part.replace("_", " ")).has_data()
    # Of the worst state, at which a reading may be blank.
    assert all(axes.has_data() for axes in np.ravel(model.plot.curves()))
    pyplot.close("all")


def test_figures_of_a_run(fitted, tmp_path):
    _, folder = fitted
    with open(tmp_path / "terminal.txt", "w") as file:
        draw_folder(folder, tmp_path, "", [1, 0.0, 0.0], Console(file=file))
    pictures = {path.stem for path in tmp_path.glob("*.png")}
    # Of no bed here both loads of a single actuator are measured.
    assert pictures == {"admissible", "curves"}


@pytest.mark.nightly
def test_few_moments_name_nothing_else(tmp_path):
    overrides = beds.write("dead_load", HIDDEN["dead_load"], tmp_path)
    with open(tmp_path / "terminal.txt", "w") as file:
        discover(settings(DiscoverSettings, [*overrides, "train=all", "figures=false"]), tmp_path, Console(file=file))
    content = read(tmp_path / "discovery.json")
    assert content["verdict"] in ("named", "undecided")
    assert content["effects"] == list(HIDDEN["dead_load"])
    if content["verdict"] == "undecided":
        assert any(c["decides"] and c["result"] == "cannot_tell" for c in content["referee"])
