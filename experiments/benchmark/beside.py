"""python experiments/benchmark/beside.py: the search beside a forward selection (peer.py), on the same rows.

--few NUMBER …, --laboratory NUMBER …: tables of those plans of experiments/hidden_effects. --real FOLDER [NAME …]: the
measured sets of experiments/real_data. Both sets of effects, and what predicts best of those that the search looked at,
are fitted and left out by the peer's own method, from where its fits begin and from where the search's ended, in E of
the rows left out; ratio: the better of the search's two over the peer's. Of tables of few states the models' errors
between the states are told in floors. Writes beside.md to --out.
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "experiments"), str(ROOT)]

import numpy as np  # noqa: E402
import torch  # noqa: E402
from benchmark.peer import Build, Chosen, fitted, refitted, selected  # noqa: E402
from hidden_effects import examine_few, few, plan  # noqa: E402
from hidden_effects.make import make  # noqa: E402
from real_data.sets import SETS, RealSet  # noqa: E402
from rich.console import Console  # noqa: E402

from freelearn.api.settings.configuration import settings  # noqa: E402
from freelearn.api.settings.settings import DiscoverSettings  # noqa: E402
from freelearn.api.tasks.discover_task import discover  # noqa: E402
from freelearn.common.files import write_text  # noqa: E402
from freelearn.data.columns import usable_rows  # noqa: E402
from freelearn.data.rows import Rows  # noqa: E402
from freelearn.discovery.fits.prepare import Question  # noqa: E402
from freelearn.discovery.search.search import Findings, search  # noqa: E402
from freelearn.discovery.search.testable import candidates, question_of_rows  # noqa: E402
from freelearn.physics.chain.model import Model  # noqa: E402
from freelearn.physics.models.build import build_model  # noqa: E402
from freelearn.records.written_effects import known  # noqa: E402

HEADS = (
    *("set", "hidden", "search", "what predicts best", "peer", "left out %: search", "predicts best", "peer", "ratio"),
    *("between: search", "peer", "s", "s"),
)


@dataclass(frozen=True)
class Beside:
    """A table to be searched by both. searched: → findings; build: effects beside those given → model; rows: those that
    the search had an answer for; fresh: model → error between the states in floors, where the truth is known."""

    name: str
    hidden: str
    searched: Callable[[], Findings]
    build: Build
    library: Callable[[Rows], list[str]]
    fresh: Callable[[Model], float] | None = None


def compared(beside: Beside) -> list[str]:
    """One line of the table."""
    began = time.perf_counter()
    found = beside.searched()
    ours = time.perf_counter() - began
    rows = found.rows
    told = found.predicts_best
    answers = [(found.effects, found.final.fit.values())]
    answers += [(told.effects, told.parameters)] if told else []
    with known(found):
        refits = [refitted(_fitted(beside.build, rows, *each), rows) for each in answers]
    refit, hint = refits[0], refits[-1]
    began = time.perf_counter()
    peer = selected(beside.build, rows, beside.library(rows))
    theirs = time.perf_counter() - began
    between = ["–", "–"]
    if beside.fresh:
        between = [f"{beside.fresh(model):.2f}" for model in (found.final.fit.model, peer.model)]
    errors = [f"{100 * each.left_out:.2f}" for each in (refit, hint, peer)]
    ratio = f"{min(refit.left_out, hint.left_out) / peer.left_out:.2f}"
    words = [f"{found.verdict}: {_words(found.effects)}", _words(answers[-1][0]), _words(peer.effects)]
    return [beside.name, beside.hidden, *words, *errors, ratio, *between, f"{ours:.0f}", f"{theirs:.0f}"]


def _fitted(build: Build, rows: Rows, effects: Sequence[str], values: Mapping[str, float]) -> Chosen:
    """The peer's fit of one of the search's sets: from where its own fits begin, or from where the search's ended
    (values: SI, by label), whichever ends lower."""
    cold = fitted(build, rows, effects)
    model = cold.model
    raw = [
        float(model.declared[label].to_raw(values[label])) if label in values else x
        for label, x in zip(model.labels(), cold.x, strict=True)
    ]
    warm = fitted(build, rows, effects, replace(cold, x=np.array(raw)))
    return min(cold, warm, key=lambda each: each.E)


def of_few(number: int) -> Beside:
    """A table of the plan few."""
    job = few.plan(number + 1)[number]
    made = few.make(job)
    table = examine_few.as_read(made.table, made.bed)
    rows = Rows.from_table(table[usable_rows(table)].reset_index(drop=True))
    return _simulated(
        f"few {number}", _words(job["hidden"]) if job["hidden"] else job["unknown"] or "nothing",
        question_of_rows(examine_few.build, table.columns, rows, examine_few.told(made.told), job["seed"] % 1000),
        lambda model: examine_few.fresh(model, made),
    )  # fmt: skip


def of_laboratory(number: int) -> Beside:
    """A set of the plan laboratory."""
    job = plan.laboratory(1)[number]
    made = make(job)
    table = made.measured.table
    rows = Rows.from_table(table[table["buckled"] == 0].reset_index(drop=True))

    def build(names: Sequence[str]) -> Model:
        return build_model("continuum", {}, names, list(made.actuators))

    question = question_of_rows(build, table.columns, rows, made.told, job["seed"] % 1000)
    return _simulated(f"laboratory {number}", f"{_words(job['hidden'])} ({job['size']} σ)", question)


def of_real(chosen: RealSet, data: Path, out: Path) -> Beside:
    """A measured set, as discover.py is told to look at it."""
    intake, command = chosen.commands(data, out)
    subprocess.run([sys.executable, *intake], cwd=ROOT, check=True, capture_output=True)
    asked = settings(DiscoverSettings, [*(w for w in command[1:] if "hydra" not in w), "figures=false"])
    given = list(asked.effects)
    per_sample: list[Findings] = []

    def searched() -> Findings:
        found = discover(asked, out / chosen.recipe, Console(file=io.StringIO())).findings
        per_sample.append(found)
        return found

    def build(names: Sequence[str]) -> Model:
        rows = per_sample[0].rows
        samples = [int(n) for n in rows.states.sample.unique()] if asked.per_sample else []
        members = len(rows.states.members) if asked.per_sample else 0
        return build_model("continuum", {}, [*given, *names], samples, members)

    def library(rows: Rows) -> list[str]:
        columns = (chosen.table(out)).read_text(encoding="utf-8").splitlines()
        header = next(line for line in columns if not line.startswith("#")).split(",")
        return [name for name in candidates(build([]), given, header, rows).names if name not in asked.ruled_out]

    return Beside(chosen.recipe, "measured", searched, build, library)


def _simulated(name: str, hidden: str, question: Question, fresh: Callable[[Model], float] | None = None) -> Beside:
    library = list(question.candidates)
    return Beside(name, hidden, lambda: search(question), question.build, lambda rows: library, fresh)


def _words(names: Sequence[str]) -> str:
    return " + ".join(names) or "nothing"


def chosen_sets(asked: argparse.Namespace, out: Path) -> Iterator[Beside]:
    """What was asked for; measured sets whose files are absent are left out."""
    yield from (of_few(number) for number in asked.few)
    yield from (of_laboratory(number) for number in asked.laboratory)
    folder, *names = asked.real or [""]
    for each in SETS if folder else ():
        if (not names or each.recipe in names) and (Path(folder) / each.raw).exists():
            yield of_real(each, Path(folder).resolve(), out)


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description="The search beside a forward selection.")
    parser.add_argument("--few", type=int, nargs="*", default=[])
    parser.add_argument("--laboratory", type=int, nargs="*", default=[])
    parser.add_argument("--real", nargs="+", metavar=("FOLDER", "NAME"))
    parser.add_argument("--out", type=Path, default=Path("outputs/beside"))
    asked = parser.parse_args()
    torch.set_num_threads(1)
    out = asked.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    lines = [f"| {' | '.join(HEADS)} |", "|---" * len(HEADS) + "|"]
    print(*lines, sep="\n", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for beside in chosen_sets(asked, Path(folder)):
            lines.append(f"| {' | '.join(compared(beside))} |")
            print(lines[-1], flush=True)
            write_text(out / "beside.md", "\n".join([*lines, ""]))


if __name__ == "__main__":
    main()
