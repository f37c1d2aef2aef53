"""Files that are read back, with bytes flipped, cut off or written by somebody else: the same numbers or one sentence,
never others, and nothing in them is executed."""

import io
import json
import os
import pickle
import random
import shutil
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from attack_runs import command
from closed_forms import synthetic
from hidden_tables import table
from nightly import EVERY
from small_runs import make_csv, run

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.cli.sweep_job import _results
from freelearn.common.errors import UserError
from freelearn.data.intake.recipes.recipe_file import recipe_of
from freelearn.fitting.rubber_fit import fit_rubber
from freelearn.fitting.store import FitOutcome, FitStore, Fitted
from freelearn.fitting.uncertainty import Uncertainty
from freelearn.physics.models.build import build_model, load_model, save_checkpoint
from freelearn.physics.models.rubber import Rubber
from freelearn.records.provenance import OTHERS, OWN
from freelearn.records.specimen_record import load_parameters, write_result
from freelearn.records.sweep_records import collect, read_records

# Damages of each file: in the usual tests, and where every attack is wanted.
DAMAGES = 400 if EVERY else 60


def damaged(content: bytes, count: int, seed: int = 0):
    """The content with one bit flipped somewhere, or cut off somewhere, in turn."""
    generator = random.Random(seed)
    for k in range(count):
        at = generator.randrange(len(content))
        if k % 4 == 3:
            yield content[:at]
        else:
            flipped = bytearray(content)
            flipped[at] ^= 1 << generator.randrange(8)
            yield bytes(flipped)


def outcome(read):
    """What reading gives, or that it was refused; anything else that is raised is no answer."""
    with warnings.catch_warnings():
        # torch tells of old formats, pandas of odd cells: no tracebacks.
        warnings.simplefilter("ignore")
        try:
            return read()
        except UserError:
            return None


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("read_back")


@pytest.fixture(scope="module")
def trained(place) -> Path:
    path = make_csv(place / "table.csv", rows=120)
    run(place / "trained", "data=csv", f"data.path={path}", "train=all", "effects=[force_offset]", "figures=false")
    return place / "trained"


@pytest.fixture(scope="module")
def searched(place) -> Path:
    path = place / "hidden.csv"
    table({"friction_hysteresis": {"force": 0.6, "moment": 0.02}}, samples=(3,), share=0.05).to_csv(path, index=False)
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false"])
    folder = place / "searched"
    folder.mkdir()
    with open(os.devnull, "w") as nowhere:
        from rich.console import Console

        discover(asked, folder, Console(file=nowhere))
    return folder


def loaded(folder: Path):
    """All that is known of a run taken up again."""
    fitted = freelearn.load(folder)
    table = fitted.table().to_csv(index=False)
    run = fitted.run
    about = {name: value for name, value in run.content.items() if not name.endswith("seconds") and name != OWN}
    about.pop("fit_reused", None)
    return fitted.parameters, fitted.covariance.tobytes(), table, repr(run.accuracy), json.dumps(about, sort_keys=True)


READ = {
    "trained": ["checkpoint.ckpt", "predictions.csv", "results.json"],
    "searched": ["checkpoint.ckpt", "predictions_after.csv", "discovery.json"],
}


@pytest.mark.slow
@pytest.mark.parametrize(("which", "name"), [(which, name) for which, names in READ.items() for name in names])
def test_a_damaged_file_of_a_run_is_refused_or_says_the_same(which, name, request, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(request.getfixturevalue(which), folder)
    expected, content = loaded(folder), (folder / name).read_bytes()
    refused = 0
    for wrong in damaged(content, DAMAGES):
        (folder / name).write_bytes(wrong)
        found = outcome(lambda: loaded(folder))
        refused += found is None
        # Where the digest's own name is what was damaged, the rest stands, and that name beside it.
        told = None if f'"{OWN}"'.encode() in wrong else 4
        assert found is None or found[:told] == expected[:told]
    # Nearly every damage says something else: few are lost in white space, or in times.
    assert refused > 0.8 * DAMAGES
    (folder / name).unlink()
    assert outcome(lambda: loaded(folder)) is None


def test_a_checkpoint_alone_is_refused_or_says_the_same(tmp_path):
    path, model = tmp_path / "checkpoint.ckpt", build_model("continuum", {"C1": 3e5}, ["end_clamps"])
    save_checkpoint(model, path)
    expected, content, read = model.scalars(), path.read_bytes(), 0
    for wrong in damaged(content, 10 * DAMAGES):
        path.write_bytes(wrong)
        found = outcome(lambda: load_model(path).scalars())
        read += found is not None
        assert found is None or found == expected
    assert 0 < read < 9 * DAMAGES


def test_a_damaged_fit_is_made_again(tmp_path):
    errors = Uncertainty(
        names=["ka"],
        values=np.array([1.0]),
        stderr=np.array([2.0]),
        stderr_independent=np.array([3.0]),
        low=np.array([0.5]),
        high=np.array([1.5]),
        freedom=4,
        covariance=np.eye(1),
        chi_square=5.0,
        residuals=6,
        rows=3,
    )

    def compute(model):
        def fitted():
            model.set_values({"ka": 1234.5})
            ended = FitOutcome(np.ones(3, dtype=bool), torch.zeros(3), [(0, 1.0, 2.0)], "made", True)
            return Fitted(ended, errors, seconds=1.0)

        return fitted

    def kept():
        model = build_model("linear")
        got = FitStore(tmp_path).fitted(model, "key", compute(model))
        return model.vector().detach().numpy().tobytes(), repr(got.uncertainty), got.outcome.history, got.reused

    expected = kept()[:3]
    path = tmp_path / "key.fit"
    content = path.read_bytes()
    assert kept() == (*expected, True)
    for wrong in damaged(content, 3 * DAMAGES):
        path.write_bytes(wrong)
        assert kept() == (*expected, False)
        assert path.read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["key.fit"]


def test_damaged_results_of_a_sweep_are_told_of_and_made_again(trained, tmp_path):
    shutil.copytree(trained, tmp_path / "sweep" / "0")
    job = tmp_path / "sweep" / "0"
    expected, content = collect([tmp_path / "sweep"]), (job / "results.json").read_bytes()
    records = read_records(job)
    assert _results(job) is not None
    refused = 0
    for wrong in damaged(content, 2 * DAMAGES, seed=1):
        (job / "results.json").write_bytes(wrong)
        found = collect([tmp_path / "sweep"])
        if (found["error"] == "").all():
            pd.testing.assert_frame_equal(found, expected)
            assert outcome(lambda: read_records(job)) == records
        else:
            refused += 1
            assert len(found) == 1
            assert "make the run again" in found["error"][0]
            assert outcome(lambda: read_records(job)) is None
            assert _results(job) is None
    assert refused > 1.6 * DAMAGES
    # A job whose other files are damaged is not done either.
    (job / "results.json").write_bytes(content)
    (job / "checkpoint.ckpt").write_bytes(b"")
    assert _results(job) is None


def test_a_damaged_specimen_is_refused_or_says_the_same(tmp_path):
    path = tmp_path / "specimen.json"
    write_result(path, fit_rubber(Rubber(["wall_stiffening"]), synthetic(3e5, 8e3), []), [{"path": "a.csv"}])
    expected, content, read = load_parameters(path), path.read_bytes(), 0
    for wrong in damaged(content, 4 * DAMAGES, seed=2):
        path.write_bytes(wrong)
        found = outcome(lambda: load_parameters(path))
        read += found is not None
        assert found is None or found == expected
    assert read < 0.8 * DAMAGES
    # Whoever changes a constant on purpose takes the digest out.
    own = json.loads(content)
    own["parameters"]["C1"]["value"] = 5e5
    path.write_text(json.dumps(own))
    assert outcome(lambda: load_parameters(path)) is None
    del own[OWN]
    path.write_text(json.dumps(own))
    assert load_parameters(path)["C1"] == 5e5


ODD = [None, [], {}, "x", 3, True, -1, 1e400, [[]], {"a": None}, "../../x", "NaN"]


@pytest.mark.slow
@pytest.mark.parametrize("which", READ)
def test_a_document_of_somebody_else_is_a_run_or_one_sentence(which, request, tmp_path):
    """Without digests, every entry exchanged in turn: what cannot be understood is said, in whatever reads it."""
    folder = tmp_path / "run"
    shutil.copytree(request.getfixturevalue(which), folder)
    path = folder / READ[which][-1]
    content = json.loads(path.read_text())
    for name in (OWN, OTHERS):
        content.pop(name)
    generator = random.Random(0)
    words = """train seed covariance accuracy split data model alternatives per_sample effects parameters tests classes
        verdict"""
    names = [name for name in words.split() if name in content]
    for name in names:
        for odd in ODD if EVERY else generator.sample(ODD, 3):
            path.write_text(json.dumps(content | {name: odd}))
            outcome(lambda: freelearn.load(folder).table())
            ended = command("plan", f"run={folder}", "rows=2", "figures=false", folder=tmp_path) if EVERY else None
            assert ended is None or ended.status in (0, 1)


class Evil:
    """Makes a file where it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


def evil_files(canary: Path) -> dict[str, bytes]:
    """Pickles in every dress in which torch or numpy would open one."""
    zipped, legacy, array = io.BytesIO(), io.BytesIO(), io.BytesIO()
    torch.save({"freelearn": Evil(canary)}, zipped)
    torch.save({"freelearn": Evil(canary)}, legacy, _use_new_zipfile_serialization=False)
    np.save(array, np.array([Evil(canary)], dtype=object), allow_pickle=True)
    module, archive = io.BytesIO(), io.BytesIO()
    torch.save(torch.nn.Linear(1, 1), module)
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("archive/data.pkl", pickle.dumps({"freelearn": Evil(canary)}))
        file.writestr("archive/version", "3\n")
        file.writestr("archive/constants.pkl", pickle.dumps((Evil(canary),)))
    return {
        "zip": zipped.getvalue(), "legacy": legacy.getvalue(), "plain": pickle.dumps(Evil(canary)),
        "npy": array.getvalue(), "module": module.getvalue(), "script": archive.getvalue(), "text": b"cos\nsystem\n.",
    }  # fmt: skip


@pytest.mark.parametrize("dress", ["zip", "legacy", "plain", "npy", "module", "script", "text"])
def test_no_pickle_is_executed(dress, trained, tmp_path):
    canary = tmp_path / "executed"
    content = evil_files(canary)[dress]
    # It would be, by whoever opens it so.
    if dress == "plain":
        pickle.loads(content)
        assert canary.exists()
        canary.unlink()
    path = tmp_path / "checkpoint.ckpt"
    path.write_bytes(content)
    assert outcome(lambda: load_model(path)) is None
    folder = tmp_path / "run"
    shutil.copytree(trained, folder)
    document = json.loads((folder / "results.json").read_text())
    for name in ("checkpoint.ckpt", "predictions.csv", "results.json"):
        before = (folder / name).read_bytes()
        (folder / name).write_bytes(content)
        assert outcome(lambda: loaded(folder)) is None
        (folder / name).write_bytes(before)
    # Nor where nothing says that it was changed.
    (folder / "checkpoint.ckpt").write_bytes(content)
    (folder / "results.json").write_text(
        json.dumps({k: v for k, v in document.items() if k not in ("digest", "files")})
    )
    assert outcome(lambda: loaded(folder)) is None
    (tmp_path / "fits").mkdir()
    (tmp_path / "fits" / "key.fit").write_bytes(content)
    model = build_model("linear")

    def again():
        raise UserError("made again")

    assert outcome(lambda: FitStore(tmp_path / "fits").fitted(model, "key", again)) is None
    assert not canary.exists()


def test_a_fit_with_a_fitting_digest_executes_nothing_either(tmp_path):
    import hashlib

    canary = tmp_path / "executed"
    content = evil_files(canary)["zip"]
    (tmp_path / "key.fit").write_bytes(hashlib.sha256(content).digest() + content)

    def again():
        raise UserError("made again")

    assert outcome(lambda: FitStore(tmp_path).fitted(build_model("linear"), "key", again)) is None
    assert not canary.exists()


def test_code_that_lies_in_a_run_is_not_executed(trained, tmp_path):
    folder, canary = tmp_path / "run", tmp_path / "executed"
    shutil.copytree(trained, folder)
    for name in ("proposed_force.py", "sitecustomize.py", "conftest.py", "freelearn.py", "effects.py"):
        (folder / name).write_text(f"open({str(canary)!r}, 'w')\n")
    assert freelearn.load(folder).parameters
    questions = tmp_path / "questions.csv"
    questions.write_text("sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm\n3,1,10,40,,\n")
    ended = command(
        "predict", f"run={folder}", f"data.path={questions}", f"hydra.run.dir={tmp_path}/out", folder=folder
    )
    assert ended.status == 0, ended.said
    assert not canary.exists()


RECIPE = "bed: kinematic\nconstants: {{gamma_deg: 60}}\ncolumns:\n  force_n: {{from: F, unit: {unit}}}\n{more}"
EVIL = [
    "!!python/object/apply:os.system ['touch {0}']", "!!python/object/new:os.system ['touch {0}']",
    "!!python/name:os.system", "!!python/module:os", "!<tag:yaml.org,2002:python/object/apply:os.system> ['touch {0}']",
    "!include {0}", "&a [*a]", "${{oc.env:HOME}}", "${{python:__import__}}",
]  # fmt: skip
UNITS = [
    "__import__('os').system('touch {0}')", "(lambda: open('{0}', 'w'))()", "N*__import__('os').system('touch {0}')",
    "exec('open(\"{0}\",\"w\")')", "N; import os", "N ** 10 ** 10 ** 10", "{{}}.__class__", "${{oc.env:HOME}}", "N\nN",
]  # fmt: skip


@pytest.mark.parametrize("words", EVIL)
def test_a_recipe_makes_nothing_but_plain_values(words, tmp_path):
    canary = tmp_path / "executed"
    text = RECIPE.format(unit="N", more=f"about: {words.format(canary)}\n")
    found = outcome(lambda: recipe_of(text, "recipe.yaml"))
    # Words are words.
    assert found is None or words.startswith("$")
    assert not canary.exists()


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_no_expression(unit, tmp_path):
    canary, folder = tmp_path / "executed", tmp_path
    (folder / "raw.csv").write_text("s,w,P,F\n0,0,0,1\n1,0,0,2\n1,0,10,3\n")
    design = "gamma_deg: 60, length_mm: 90, inner_radius_mm: 4.77, outer_radius_mm: 6.35, moment_nmm: 0"
    columns = "".join(
        f"  {name}: {{from: {source}, unit: {told}}}\n"
        for name, source, told in [
            ("elongation_mm", "s", "mm"), ("twist_deg", "w", "deg"), ("pressure_kpa", "P", "kPa"),
            ("force_n", "F", json.dumps(unit.format(canary))),
        ]
    )  # fmt: skip
    (folder / "recipe.yaml").write_text(f"bed: kinematic\nconstants: {{{design}}}\ncolumns:\n{columns}")
    line = [f"data.path={folder}/raw.csv", f"recipe={folder}/recipe.yaml", f"hydra.run.dir={folder}/out"]
    ended = command("intake", *line, folder=folder)
    assert ended.status == 1
    assert ended.err.startswith("error: ")
    assert not canary.exists()


@pytest.mark.parametrize(
    "word",
    [
        "seed=${oc.env:HOME}",
        "seed=${python:1}",
        "seed=${eval:1+1}",
        "seed=${oc.decode:'!!python/name:os.system'}",
        "model.C1=${oc.create:{_target_:os.system}}",
        "+model._target_=os.system",
        "train=${seed",
        "seed=!!python/name:os",
        "+data={_target_:os.system,command:'touch executed'}",
        "effects=[__import__('os').system('touch executed')]",
    ],
)  # fmt: skip
def test_an_override_is_never_executed(word, tmp_path):
    """What is resolved of the configuration library's own is read alone: an environment variable, another setting."""
    make_csv(tmp_path / "table.csv", rows=40)
    line = ["data=csv", f"data.path={tmp_path}/table.csv", "fits=null", f"hydra.run.dir={tmp_path}/out", word]
    ended = command("train", *line, folder=tmp_path)
    assert ended.status == 1, ended.said
    assert ended.err.startswith("error: ")
    assert not (tmp_path / "executed").exists()
