"""The lines of Python with the same numbers as what the page does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from freelearn.workbench.state.question import OWN, Question

# What the functions take where nothing is said; the page's own choices may differ.
USUAL: dict[str, Any] = {
    "bed": "kinematic", "split": "rows", "fit": "levenberg_marquardt", "seed": 0, "per_sample": True,
}  # fmt: skip
FACE = "import freelearn as fl"


def python_lines(question: Question, kind: str) -> list[str]:
    """What does the same as a job of this kind; nothing for one that only Python's neighbors do."""
    if kind in ("train", "discover"):
        return [*_own(question), FACE, f"run = {_call(question, kind)}"]
    if kind == "study":
        one = _call(question, "train", model="model", train="train")
        pairs = f"for model in {list(question.models)!r} for train in {list(question.trains)!r}"
        return [*_own(question), FACE, f"runs = {{(model, train): {one}", f"        {pairs}}}"]
    if kind == "compare":
        loaded = f"runs = [fl.load({question.run!r}), fl.load({question.beside!r})]"
        together = "pd.concat([run.frame() for run in runs], axis=1, keys=['A', 'B'])"
        return [f"{FACE}, pandas as pd", loaded, together]
    if kind == "predict":
        # Of a laboratory's file the command writes the table first.
        table = "'outputs/predict/questions.csv'" if question.recipe else repr(question.asks)
        loaded = f"fl.load({question.run!r})"
        return [f"{FACE}, pandas as pd", f"blanks = pd.read_csv({table})", f"{loaded}.invert(blanks).frame()"]
    return [FACE, f"fl.plan({question.run!r}, rows={question.rows}).frame()"]


def rubber_lines(question: Question, specimen: Path, effects: Sequence[str]) -> list[str]:
    """How a fit takes over the rubber that tests have told: of the data that are chosen, or of a table to be named."""
    asked = replace(question, model="continuum", train="constituent", effects=tuple(effects), own=())
    options = dict(arguments(asked, "train"))
    table = options.pop("table") or "mine.csv"
    given = {name: value for name, value in options.items() if name in ("data", "bed", "members", "effects")}
    words = {"train": "constituent", "constituent": str(specimen), **given}
    return [FACE, f"fl.fit({table!r}, {', '.join(f'{name}={value!r}' for name, value in words.items())})"]


def _own(question: Question) -> list[str]:
    """Effects that a search wrote are in files that the environment names."""
    files = ":".join(question.own)
    return ["import os", f"os.environ['FREELEARN_EFFECTS'] = {files!r}"] if files else []


def _call(question: Question, kind: str, **names: str) -> str:
    """The call alone. names: arguments that are variables."""
    options = arguments(question, kind)
    shown = [f"{name}={names.get(name, repr(value))}" for name, value in options.items() if name != "table"]
    function = "fl.fit" if kind == "train" else "fl.discover"
    return f"{function}({options['table']!r}, {', '.join(shown)})"


def arguments(question: Question, kind: str) -> Mapping[str, Any]:
    """The arguments of `fl.fit` (train) or `fl.discover`, those that say something."""
    own = question.data == OWN
    hidden = {"data": {"hidden": "random", "seed": question.seed}} if question.data == "hidden" else {}
    table = question.path if own else "virtual" if question.data in ("virtual", "hidden") else question.data
    given: dict[str, Any] = {"table": table, "model": question.model, "train": question.train, **hidden}
    given |= {"effects": list(question.effects)} if question.effects else {}
    given |= {"ruled_out": list(question.ruled_out)} if question.ruled_out and kind == "discover" else {}
    if own:
        given |= {"bed": question.bed} | ({"members": question.members} if question.members else {})
        given["accuracy"] = "estimate" if question.accuracy is None else dict(question.accuracy)
    if kind == "train":
        given |= {"split": question.split, "fit": question.fit}
    given |= {"seed": question.fit_seed, "per_sample": question.per_sample}
    return {n: value for n, value in given.items() if value != USUAL.get(n) and (n != "accuracy" or value)}
