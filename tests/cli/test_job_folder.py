"""Jobs of a sweep have names, and what lies in a folder of the same number under another name is not lost."""

from pathlib import Path

from freelearn.cli.sweep_job import named_folder
from freelearn.records.sweep_records import job_order

ASKED = {"model": "continuum", "effects": [], "train": "sample3", "seed": 0}


def made_by_hydra(sweep: Path, number: int) -> Path:
    folder = sweep / str(number)
    (folder / ".hydra").mkdir(parents=True)
    (folder / ".hydra/config.yaml").write_text("new")
    return folder


def test_a_job_has_a_name(tmp_path):
    folder = named_folder(made_by_hydra(tmp_path, 7), 7, ASKED)
    assert folder == tmp_path / "continuum_sample3_seed0_7"
    assert (folder / ".hydra/config.yaml").read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == [folder.name]


def test_results_under_the_number_alone_or_another_name_are_the_jobs(tmp_path):
    for earlier in ("1", "linear_sample3_seed5_1"):
        sweep = tmp_path / earlier
        old = sweep / earlier
        (old / ".hydra").mkdir(parents=True)
        (old / ".hydra/config.yaml").write_text("old")
        (old / "results.json").write_text("{}")
        # Of job 11, which ends alike.
        (sweep / "continuum_sample6_seed0_11").mkdir()
        (sweep / "continuum_sample6_seed0_11" / "results.json").write_text("its own")
        hydra = old if earlier == "1" else made_by_hydra(sweep, 1)
        folder = named_folder(hydra, 1, ASKED)
        assert (folder / "results.json").read_text() == "{}"
        assert sorted(p.name for p in sweep.iterdir()) == ["continuum_sample3_seed0_1", "continuum_sample6_seed0_11"]
        assert (sweep / "continuum_sample6_seed0_11" / "results.json").read_text() == "its own"


def test_a_folder_that_the_user_named_stays(tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    assert named_folder(mine, 0, ASKED) == mine


def test_a_long_training_set_and_odd_letters_make_a_name_that_systems_take(tmp_path):
    asked = ASKED | {"train": "+".join(f"sample{n}" for n in range(60)) + "/../x"}
    folder = named_folder(made_by_hydra(tmp_path, 0), 0, asked)
    assert folder.parent == tmp_path
    assert len(folder.name) < 120
    assert folder.is_dir()


def test_jobs_are_in_the_order_of_their_numbers():
    names = ["b_seed0_10", "a_seed0_2", "7", "mine"]
    assert [path.name for path in sorted(map(Path, names), key=job_order)] == ["a_seed0_2", "7", "b_seed0_10", "mine"]
