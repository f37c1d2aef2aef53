"""What is chosen on the page, and the shell command that amounts to it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from freelearn.commands.command_line import command_line

DATA = {"virtual": "simulated bed", "hidden": "simulated bed with a hidden effect", "csv": "my own CSV file"}
MODELS = ("continuum", "linear", "mlp")
VIRTUAL_SETS = [f"sample{n}" for n in range(1, 9)] + ["even", "all"]


@dataclass(frozen=True)
class Question:
    """data: a key of DATA; seed: of the simulated bed with a hidden effect; path, name: of the CSV as stored here, and
    as the user calls it."""

    data: str = "virtual"
    seed: int = 1
    path: str = ""
    name: str = ""
    model: str = "continuum"
    train: str = "sample3"
    effects: tuple[str, ...] = field(default_factory=tuple)

    def overrides(self, kind: str) -> list[str]:
        """The overrides of `train` or `discover` that amount to the question, for the reader to type."""
        chosen = [f"model={self.model}", f"train={self.train}"]
        if self.data == "csv":
            chosen += ["data=csv", f"data.path={_quoted(self.path)}"]
        elif self.data == "hidden":
            chosen += ["data.hidden=random", f"data.seed={self.seed}"]
        if kind == "train":
            chosen.append("split=states")
        if self.effects:
            chosen.append(f"effects=[{','.join(self.effects)}]")
        return chosen

    def command(self, kind: str) -> str:
        """The shell command with the same result."""
        return command_line(["python", f"{kind}.py"], self.overrides(kind))

    def about(self, kind: str) -> Question:
        """The part of the question that a job of this kind depends on; a `check` reads the data only."""
        return Question(self.data, self.seed, self.path) if kind == "check" else replace(self, name="")

    def same_but_effects(self, other: Question) -> bool:
        """Whether both ask about the same model on the same rows, so that their errors can be compared."""
        return replace(self, effects=()) == replace(other, effects=())

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Question:
        """The question that `to_json` wrote."""
        return cls(**content | {"effects": tuple(content["effects"])})


def _quoted(path: str) -> str:
    """As Hydra's grammar wants a value with blanks or signs in it."""
    plain = all(c.isalnum() or c in "/._-" for c in path)
    return path if plain else "'" + path.replace("'", "\\'") + "'"


def stored_csv(folder: Path, digest: str) -> Path:
    """Where an uploaded table is kept: under a name that the upload has no say in."""
    return folder / f"measurements_{digest[:16]}.csv"
