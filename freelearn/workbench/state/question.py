"""What is chosen on the page, the shell command that amounts to it, and what sentences of commands call an option."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from freelearn.cli.command_line import OWN_CODE, command_line, program

EFFECTS_VARIABLE = OWN_CODE[0]


@contextmanager
def named(files: Sequence[str]) -> Iterator[None]:
    """Meanwhile the environment names these files, after those that it names already."""
    before = os.environ.get(EFFECTS_VARIABLE)
    if files:
        known = [path for path in (before or "").split(os.pathsep) if path]
        os.environ[EFFECTS_VARIABLE] = os.pathsep.join(dict.fromkeys([*known, *files]))
    try:
        yield
    finally:
        if before is not None:
            os.environ[EFFECTS_VARIABLE] = before
        elif files:
            del os.environ[EFFECTS_VARIABLE]


PHRASES = {
    "add data.bed=": "choose the bed ",
    "correct data.accuracy, or use data.accuracy=estimate": "state it in step 1, or let it be estimated from the data",
    "data.accuracy": "the accuracy of the measuring",
}


def as_on_the_page(text: str) -> str:
    """The sentence for a reader who has no command line before them.

    >>> as_on_the_page("repeats scatter 2 times as much as data.accuracy says")
    'repeats scatter 2 times as much as the accuracy of the measuring says'
    """
    for said, meant in PHRASES.items():
        text = text.replace(said, meant)
    return text


OWN, MUSCLE = "csv", "dmsp20"
DATA = {
    "virtual": "simulated bed",
    "hidden": "simulated, an effect hidden",
    MUSCLE: "measured muscle (Festo)",
    OWN: "my own file",
}
MODELS = (
    "continuum", "linear", "mlp", "hybrid",
    "continuum_inextensible", "continuum_linear_material", "continuum_thin_wall",
)  # fmt: skip
# Of the simulated bed with a hidden effect: one whose effects show.
SEED = 7
VIRTUAL_SETS = [f"sample{n}" for n in range(1, 9)] + ["even", "all"]
KINEMATIC = "kinematic"
LM = "levenberg_marquardt"
FITS = {LM: "Levenberg–Marquardt", "adam": "Adam", "adamw": "AdamW", "nadam": "NAdam"}
# Kinds of jobs that ask something of a finished run, or of rubber alone.
ASIDES = ("asks", "predict", "plan", "tests", "rubber", "compare", "study")
SPLITS = {"states": "whole kinematic states", "rows": "single rows"}

# Standard deviations that differ from the paper's bed, by their option; None: to be estimated from the data.
Stated = tuple[tuple[str, float], ...] | None


@dataclass(frozen=True)
class Question:
    """data: a key of DATA; seed: of the simulated bed with a hidden effect; path, name: of the table as stored here,
    and as the user calls it; bed: what was imposed and measured; members: the file of an end block's actuators, "" for
    one alone; accuracy: see Stated; ruled_out: effects that a search does not try; per_sample: see api.settings;
    recipe: of a laboratory's file that is still to be converted; split: what a fit holds out, whole kinematic states
    or rows; fit: how it is made, see FITS; fit_seed: of the split and of what a fit begins with; own: files of the
    effects that a search of the session wrote, as far as these are in the model; run, asks, rows: of what is asked of a
    finished run: its folder, the file of a table with blanks, and how many rows to plan; beside: the folder of another
    run, to be set beside it; sheets: of tests of rubber alone, each file by the name that the user gives it, and as
    stored; models, trains: of a study, every one of them on every one."""

    data: str = "virtual"
    seed: int = SEED
    path: str = ""
    name: str = ""
    model: str = "continuum"
    train: str = "sample3"
    effects: tuple[str, ...] = field(default_factory=tuple)
    bed: str = KINEMATIC
    members: str = ""
    accuracy: Stated = ()
    ruled_out: tuple[str, ...] = ()
    per_sample: bool = True
    recipe: str = ""
    split: str = "states"
    own: tuple[str, ...] = ()
    fit: str = LM
    fit_seed: int = 0
    run: str = ""
    asks: str = ""
    rows: int = 0
    sheets: tuple[tuple[str, str], ...] = ()
    beside: str = ""
    models: tuple[str, ...] = ()
    trains: tuple[str, ...] = ()

    @property
    def measured(self) -> bool:
        """Whether the data were measured, not simulated."""
        return self.data in (OWN, MUSCLE)

    def overrides(self, kind: str) -> list[str]:
        """The overrides of `train` or `discover` that amount to the question, for the reader to type."""
        chosen = [f"model={self.model}", f"train={self.train}"]
        if self.data == MUSCLE:
            chosen.append("data=dmsp20")
        elif self.data == OWN:
            chosen += ["data=csv", f"data.path={quoted_value(self.path)}", *self._of_the_bed()]
        elif self.data == "hidden":
            chosen += ["data.hidden=random", f"data.seed={self.seed}"]
        if kind == "train":
            chosen.append(f"split={self.split}")
            chosen += [f"fit={self.fit}"] if self.fit != LM else []
        if self.effects:
            chosen.append(f"effects=[{','.join(self.effects)}]")
        if self.ruled_out and kind == "discover":
            chosen.append(f"ruled_out=[{','.join(self.ruled_out)}]")
        chosen += [f"seed={self.fit_seed}"] if self.fit_seed else []
        return chosen if self.per_sample else [*chosen, "per_sample=false"]

    def _of_the_bed(self) -> list[str]:
        chosen = [f"data.bed={self.bed}"] if self.bed != KINEMATIC else []
        chosen += [f"data.members={quoted_value(self.members)}"] if self.members else []
        if self.accuracy is None:
            return [*chosen, "data.accuracy=estimate"]
        return [*chosen, *(f"data.accuracy.{name}={value!r}" for name, value in self.accuracy)]

    def command(self, kind: str) -> str:
        """The shell command with the same result."""
        with named(() if kind == "compare" else self.own):
            return command_line(*self._words(kind))

    def _words(self, kind: str) -> tuple[list[str], list[str]]:
        """How the command is started, and its options."""
        if kind == "intake":
            return started("intake"), [f"data.path={quoted_value(self.path)}", f"recipe={quoted_value(self.recipe)}"]
        if kind == "rubber":
            # In the user's own names: the recipe is there to download.
            names = [name for name, _ in self.sheets]
            return started("start"), [*names, "--recipe", downloaded_recipe(names[0]), "--out", "outputs/rubber"]
        if kind == "compare":
            return started("compare"), [self.run, self.beside]
        if kind == "study":
            return [*started("train"), "-m"], self._sweep()
        if kind == "predict" and self.recipe:
            # As above, for a file that asks something of a run.
            return started("start"), [self.name, "--recipe", downloaded_recipe(self.name), "--run", self.run]
        if kind in ASIDES:
            asked = f"data.path={quoted_value(self.asks)}" if kind == "predict" else f"rows={self.rows}"
            return started(kind), [f"run={quoted_value(self.run)}", asked]
        return started(kind), self.overrides(kind)

    def _sweep(self) -> list[str]:
        """The overrides of a multirun."""
        chosen = {"model": ",".join(self.models), "train": ",".join(self.trains)}
        words = [word for word in self.overrides("train") if word.split("=")[0] not in chosen]
        several = [f"{name}={values}" for name, values in chosen.items()]
        return [*several, *words, "figures=false", "hydra.sweep.dir=outputs/study"]

    def about(self, kind: str) -> Question:
        """The part of the question that a job of this kind depends on; a `check` reads the data only."""
        if kind in ("check", "convert"):
            return Question(self.data, self.seed, self.path, bed=self.bed, members=self.members, recipe=self.recipe)
        if kind == "study":
            return replace(self, name="", train="", ruled_out=())
        if kind in ASIDES:
            energies = self.effects if kind == "rubber" else ()
            asked = Question(own=self.own, run=self.run, asks=self.asks, rows=self.rows)
            asked = replace(asked, sheets=self.sheets, recipe=self.recipe, name=self.name)
            return replace(asked, effects=energies, beside=self.beside)
        return replace(self, name="", ruled_out=self.ruled_out if kind == "discover" else ())

    def same_data(self, other: Question) -> bool:
        """Whether both ask about the same table."""
        return self.about("check") == other.about("check")

    def same_but_effects(self, other: Question) -> bool:
        """Whether both ask about the same model on the same rows, so that their errors can be compared."""
        return replace(self, effects=(), ruled_out=(), own=()) == replace(other, effects=(), ruled_out=(), own=())

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)


def downloaded_recipe(name: str) -> str:
    """What the recipe of a file is called once it is downloaded."""
    return f"{Path(name).stem}_recipe.yaml"


def started(name: str) -> list[str]:
    """How a command is started where the page was: in a checkout by its script, if it has one, as the documentation
    says it; elsewhere as the page itself."""
    module = ["python", "-m", "freelearn", name]
    if not Path("train.py").is_file():
        return program(name, module)
    return ["python", f"{name}.py"] if Path(f"{name}.py").is_file() else module


def quoted_value(path: str) -> str:
    """As Hydra's grammar wants a value with blanks or signs in it."""
    plain = all(c.isalnum() or c in "/._-" for c in path)
    return path if plain else "'" + path.replace("'", "\\'") + "'"


def stored_csv(folder: Path, digest: str, kind: str = "measurements", ending: str = ".csv") -> Path:
    """Where an uploaded file is kept: under a name that the upload has no say in."""
    return folder / f"{kind}_{digest[:16]}{ending}"
