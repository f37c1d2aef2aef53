"""What terminal and page say of one run: its errors, its rows, where it fails."""

from __future__ import annotations

from dataclasses import replace

from freelearn.common.display import DisplayTable
from freelearn.common.formats import error_percent, known_floor, percent, sentence
from freelearn.data.beds import bed_of
from freelearn.data.columns import SLACK
from freelearn.records.estimates import effect_notes, interval_notes, notes, parameter_table
from freelearn.records.run import Run
from freelearn.records.sampling import sampling_notes

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
    """Errors by test set; the training set's own says so. Where the model answers fewer than half of a set's rows,
    those that it answers tell no error."""
    measured = [quantity.name for quantity in bed_of(run.table).measured]
    rows, untold = [], 0
    for name, e in run.errors.items():
        shown = (e.E, *map(e.part, measured)) if e.tells else (None,) * (1 + len(measured))
        untold += not e.tells
        scored = str(e.n) if e.n == e.of else f"{e.n} of {e.of}"
        rows.append([f"{name} ({OWN})" if name == run.train else name, *map(error_percent, shown), scored])
    caption = "No error where the model answers fewer than half of the rows." if untold else ""
    fitted = f"fitted on {run.train} by {run.method}" if run.uncertainty else f"not fitted ({run.train})"
    return DisplayTable.from_rows(
        ["test set"], ["E %", *(f"{name} %" for name in measured), "rows"], rows, f"{run.title}, {fitted}", caption
    )


def run_parameters(run: Run) -> DisplayTable | str:
    """The physical parameters; of a network one sentence about its weights."""
    if not run.model.declared:
        return f"{len(run.model.vector())} weights and biases, listed in fit_report.txt."
    table = parameter_table(run.estimates())
    return replace(table, caption="; ".join(filter(None, [table.caption, beside(run.model.coefficients)])))


def beside(coefficients: int) -> str:
    """What stands below a model's parameters where a fit has learned more than these.

    >>> beside(125), beside(0)
    ('and 125 learned coefficients', '')
    """
    return f"and {coefficients} learned coefficients" if coefficients else ""


def parameter_notes(run: Run) -> list[str]:
    """Sentences on the parameters, those that were fitted and times of which the rows show nothing."""
    slow = sampling_notes(run.model, run.table)
    if run.uncertainty is None:
        return slow
    known = run.uncertainty
    return [*notes(run.model, run.start), *effect_notes(run.model, known), *interval_notes(known), *slow]


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
    floor = known_floor(run.misfit.noise_floor)
    if floor is None:
        return ["The accuracy is coarser than the readings are large: what measuring alone leaves says nothing."]
    said = f"A perfect model would have E = {percent(floor)} % on {run.train}: the measuring's noise."
    own = run.errors.get(run.train)
    if own is not None and floor >= own.E:
        return [f"{said} This one errs by no more than that."]
    return [said, *(sentence(failure.sentence()) for failure in run.misfit.failures[:most])]
