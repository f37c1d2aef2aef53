"""From the folder of a run to the checks of what it claims."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch

from freelearn.api.settings.run_settings import RefereeSettings
from freelearn.api.tasks.plan_source import Source, source_of
from freelearn.common.cores import configure_runtime, limited
from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.common.progress import tell
from freelearn.data.error import load_scale
from freelearn.discovery.fits.left_out import folds_of
from freelearn.discovery.fits.prepare import Question, noise_about
from freelearn.discovery.fits.white_fit import WhiteFit, white_fit
from freelearn.discovery.referee.case import Case, Check
from freelearn.discovery.referee.referee import Referee, refereed
from freelearn.discovery.search.ranking import Ranking
from freelearn.discovery.search.simulated_searches import Searched, searched, sentences, tally
from freelearn.discovery.search.stability import visible
from freelearn.physics.chain.priors import spans
from freelearn.physics.effects.registry import EFFECTS
from freelearn.records.claims import REFEREE, RefereedRun

# Searches of simulated tables that are done, one a line, so that an interrupted simulation goes on.
TABLES = "referee_tables.jsonl"


def refereed_run(settings: RefereeSettings) -> RefereedRun:
    """The checks of a run, written into its folder. Raises UserError."""
    configure_runtime()
    source = source_of(settings.run)
    question = question_of(source, settings.seed)
    final = _fitted(source, question)
    claimed, verdict, kept = _claimed(source)
    checks = _checked(source, question, final, settings.seed)
    # What only the search itself could look at stays as it found it.
    names = {check.name for check in checks.checks}
    every = [*checks.checks, *(check for check in kept if check.name not in names)]
    stands = Referee(every).verdict(claimed) if claimed else verdict
    result: dict[str, Any] = {}
    if settings.referee == "simulate":
        result = tally(list(_simulated(settings, source)))
    ranking = _ranking(source, question, final)
    done = RefereedRun(
        settings.run, claimed, stands, every, visible(ranking), result, sentences(result) if result else []
    )
    done.write()
    return done


def question_of(source: Source, seed: int) -> Question:
    """What the run's search was asked; of a run of train, what it would be."""
    given = list(source.content.get("given_effects", source.effects))
    told = [entry for entry in source.content.get("candidates", []) if entry["step"] == 0]
    # What these rows could not tell, or what was ruled out, was not asked.
    tried = [str(entry["effect"]) for entry in told if entry["status"] != "not_testable"]
    known = source.known
    still = known.rows.states.recording is None
    fitting = [
        name
        for name, effect in EFFECTS.items()
        if source.model.family in effect.families() and not (still and effect.port == "history")
    ]
    candidates = [name for name in tried or fitting if name not in given and name in EFFECTS]
    return Question(
        lambda names: source.build(list(names)), candidates, known.rows, _stated(source), seed, given,
        unshown=source.content.get("unshown", {}),
    )  # fmt: skip


def _stated(source: Source) -> Any:
    from freelearn.data.accuracy import PAPER
    from freelearn.records.run_files import read_run

    return read_run(source.folder).accuracy or PAPER


def _fitted(source: Source, question: Question) -> WhiteFit:
    """The run's last model with what is known of its parameters beforehand."""
    known = source.known
    model = known.fit.model
    prior = question.prior(model, spans(known.rows))
    return white_fit(model, known.rows, known.whiten, known.fit.vector, prior)


def _claimed(source: Source) -> tuple[str, str, list[Check]]:
    """What the search claimed, what stood of it, and its checks; of a run of train nothing."""
    path = source.folder / REFEREE
    verdict = str(source.content.get("verdict", ""))
    if not path.exists():
        return "", verdict, []
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return str(content["claimed"]), verdict, [Check(**check) for check in content["checks"]]
    except (ValueError, KeyError, TypeError):
        raise UserError(f"{path} is not as discover wrote it: remove it, and ask again.") from None


def _checked(source: Source, question: Question, final: WhiteFit, seed: int) -> Referee:
    known, added = source.known, question.added(source.effects)
    plain = _plain(source, question, final) if added else None
    rows = known.rows
    slipped = known.whiten.scatter.slipped if known.whiten.scatter is not None else torch.zeros_like(rows.loads).bool()
    scale = load_scale(torch.where(slipped, 0.0, rows.loads))
    return refereed(Case(final, plain, rows, known.whiten, scale, question.accuracy, folds_of(rows.state, seed), added))


def _plain(source: Source, question: Question, final: WhiteFit, without: str | None = None) -> WhiteFit:
    """The model without what was found, or without one effect, fitted under the same noise."""
    known = source.known
    names = [*question.given] if without is None else [e for e in source.effects if e != without]
    model = source.build(names)
    place = {label: i for i, label in enumerate(final.model.labels())}
    start = torch.stack(
        [final.vector[place[label]] if label in place else model.vector()[i] for i, label in enumerate(model.labels())]
    ).detach()
    return white_fit(model, known.rows, known.whiten, start, question.prior(model, spans(known.rows)))


def _ranking(source: Source, question: Question, final: WhiteFit) -> Ranking:
    """What the effects that the model lacks would add to it."""
    known = source.known
    others = [name for name in question.candidates if name not in source.effects]
    return Ranking(
        final, known.rows, known.whiten, others, question.on(source.effects), spans(known.rows), question.priors, {}
    )


def _simulated(settings: RefereeSettings, source: Source) -> Iterator[Searched]:
    """Searches of simulated tables, those done before first; half of them without the effect that was found last."""
    from joblib import Parallel, cpu_count, delayed

    path = settings.run / TABLES
    done = _done(path, settings)
    yield from done.values()
    left = [number for number in range(settings.tables) if number not in done]
    cores = settings.cores or cpu_count()
    # Each process reads the run itself: nothing of a model has to travel.
    jobs = (delayed(one_table)(settings.run, number, settings.seed) for number in left)
    for count, table in enumerate(Parallel(n_jobs=cores, return_as="generator")(jobs), len(done) + 1):
        done[table.number] = table
        lines = [json.dumps({"seed": settings.seed, **t.plain()}) for t in done.values()]
        write_text(path, "\n".join(lines) + "\n")
        tell("searching simulated tables", count, settings.tables)
        yield table
    # Whoever asks again gets new ones.
    path.unlink(missing_ok=True)


def _done(path: Path, settings: RefereeSettings) -> dict[int, Searched]:
    if not path.exists():
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            entry = json.loads(line)
            if entry.pop("seed") == settings.seed:
                table = Searched(**entry)
                found[table.number] = table
        except (ValueError, KeyError, TypeError):
            continue
    return {number: table for number, table in found.items() if number < settings.tables}


def one_table(folder: Path, number: int, seed: int) -> Searched:
    """The search of one simulated table: every other one from the model without the effect that was found last."""
    configure_runtime()
    torch.set_num_threads(1)
    source = source_of(folder)
    question = question_of(source, seed)
    fit, added = _fitted(source, question), question.added(source.effects)
    last = added[-1] if added else None
    if last is not None and number % 2 == 0:
        fit = _plain(source, question, fit, without=last)
    # Noise as the run found it, about the model that the table is made from.
    whiten = noise_about(fit, question.rows, question.accuracy, source.known.whiten.scatter).whitener()
    hidden = [effect.name for effect in fit.model.effects if effect.name not in question.given]
    # Every core has a table of its own already.
    with limited(1):
        return searched(question, fit, whiten, hidden, 1000 * seed + number)
