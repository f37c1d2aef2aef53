"""What terminal and page say of one run: its errors, its rows, where it fails."""

from __future__ import annotations

from freelearn.measurements.beds import bed_of
from freelearn.measurements.usable import SLACK
from freelearn.results.estimate import parameter_table
from freelearn.results.formats import percent, sentence
from freelearn.results.notes import effect_notes, interval_notes, notes
from freelearn.results.run import Run
from freelearn.results.tables import DisplayTable

# Behind the name of the set that a run trained on.
OWN = "its own test rows"
# What became of rows that are neither fitted nor scored.
MEANING = {
    "buckled": "buckled",
    "left_out": "marked to be left out",
    "no_equilibrium": "without an equilibrium (the model's tube balloons)",
    "singular": "at the linear model's singularity (fibers along the axis)",
    "overstretched": "longer than an inextensible fiber allows",
}


def explained(run: Run) -> str:
    """What E is, by what the bed measures."""
    shown, table = bed_of(run.table).measured, run.table
    parts = " + ".join(f"(({q.symbol}−{q.symbol}\u0302)/max|{q.symbol}|)²" for q in shown)
    text = f"E = √mean({parts}) over a set's test rows."
    if table[[q.column for q in shown if q.column in table]].isna().any(axis=None):
        text += " Each mean is over the rows in which it was measured."
    if SLACK in table and (table[SLACK] == 1).any():
        text += " A push that is predicted where the tube hangs loose costs nothing."
    return text


def error_table(run: Run) -> DisplayTable:
    """Errors by test set; the training set's own says so."""
    measured = [quantity.name for quantity in bed_of(run.table).measured]
    rows = [
        [f"{name} ({OWN})" if name == run.train else name, *map(percent, (e.E, *map(e.part, measured))), str(e.n)]
        for name, e in run.errors.items()
    ]
    fitted = f"fitted on {run.train} by {run.method}" if run.uncertainty else f"not fitted ({run.train})"
    return DisplayTable.of(
        ["test set"], ["E %", *(f"{name} %" for name in measured), "rows"], rows, f"{run.title}, {fitted}"
    )


def run_parameters(run: Run) -> DisplayTable | str:
    """The physical parameters; of a network one sentence about its weights."""
    if not run.model.declared:
        return f"{len(run.model.vector())} weights and biases, listed in fit_report.txt."
    return parameter_table(run.estimates())


def parameter_notes(run: Run) -> list[str]:
    """Sentences on the fitted parameters; none where nothing was fitted."""
    if run.uncertainty is None:
        return []
    known = run.uncertainty
    return [*notes(run.model, run.start), *effect_notes(run.model, known), *interval_notes(known)]


def row_counts(run: Run) -> str:
    """How many rows there are, and what became of them."""
    parts = (f"{n} {name.replace('_', ' ')}" for name, n in run.counts().items())
    return f"Rows: {', '.join(parts)}."


def row_notes(run: Run) -> list[str]:
    """A sentence on rows that are neither fitted nor scored, where there are some."""
    counts = run.counts()
    parts = [f"{counts[key]} {meaning}" for key, meaning in MEANING.items() if counts[key]]
    return [f"of {counts['rows']} rows these are neither fitted nor scored: {'; '.join(parts)}."] if parts else []


def misfit_lines(run: Run, most: int | None = None) -> list[str]:
    """How small the error could be, then where the model fails, worst first; none without a stated accuracy.

    most: how many regions are named, None for all."""
    if run.misfit is None:
        return []
    floor = f"A perfect model would have E = {percent(run.misfit.noise_floor)} % on {run.train}: the measuring's noise."
    return [floor, *(sentence(failure.sentence()) for failure in run.misfit.failures[:most])]
