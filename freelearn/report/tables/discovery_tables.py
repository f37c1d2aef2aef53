"""What terminal and page say of a discovery: checks of the table, parameters, suspects, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from freelearn.common.display import DisplayTable
from freelearn.common.formats import DASH, error_percent, fixed, known_floor, number, percent, sentence, signed
from freelearn.data.beds import BEDS, Quantity, bed_of
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck
from freelearn.discovery.fits.step import Step
from freelearn.discovery.residuals.residual_summary import NO_HINT
from freelearn.discovery.search.next_states import NextState
from freelearn.discovery.thresholds import INADEQUATE
from freelearn.queries.curves.curve_rows import digits
from freelearn.records.discovery import Discovery, final_estimates, sigmas_heldout
from freelearn.records.estimates import parameter_table
from freelearn.records.suspected_readings import ranges, suspected_lines, worst_of_each
from freelearn.records.written_effects import proposal_entry, proposal_lines
from freelearn.report.tables.ranking_tables import staircase_row

WORDS = {PASS: "pass", FAIL: "FAIL", CANNOT: "cannot tell"}


def check_table(checks: Sequence[Mapping[str, Any]]) -> DisplayTable:
    """checks: as discovery.json holds them."""
    rows = [
        [
            *(check["name"], WORDS[check["status"]]),
            *("" if check[name] is None else number(check[name], 3) for name in ("figure", "threshold")),
            TableCheck(**check).sentence,
        ]
        for check in checks
    ]
    return DisplayTable.from_rows(
        ["looked at", "result"], ["figure", "threshold"], rows, title="A look at the table, before any search",
        last=["what it says"],
    )  # fmt: skip


def table_check_lines(checks: Sequence[TableCheck], overruled: bool) -> list[str]:
    """Those that failed with what to do, and how many there were. overruled: by checks=off."""
    failed = [check for check in checks if check.status == FAIL]
    lines = [check.sentence for check in failed]
    if lines:
        what = "overruled by checks=off" if overruled else "nothing will be claimed; checks=off overrules them"
        lines.append(f"{len(failed)} of {len(checks)} checks of the table failed: {what}.")
    return lines


# What terminal and page say of readings that slipped, perhaps.

TITLE = "Suspected readings"


def suspect_overview(discovery: Discovery, most: int) -> DisplayTable:
    """The worst suspected readings, a row for those that slipped together, in few columns. most: rows shown."""
    worst = worst_of_each(discovery.suspects)
    rows = [[ranges(r.lines), r.load, *r.readings, r.deviation, r.slip or DASH] for r in worst[:most]]
    more = f"… {len(worst) - most} more in suspects.csv" if len(worst) > most else ""
    heads = ["shows", "expected", "σ off"]
    return DisplayTable.from_rows(["line", "reading"], heads, rows, TITLE, more, last=["how it slipped, perhaps"])


def suspect_table(discovery: Discovery) -> DisplayTable:
    """Every suspected reading, with its place."""
    state = bed_of(discovery.predictions["before"]).state
    rows = [
        [
            *(
                str(r.line),
                r.load,
                str(r.sample),
                *(signed(getattr(r, q.column), digits(q)) for q in state),
                str(r.step),
            ),
            *(number(r.pressure_kpa, 3), *r.readings, r.deviation),
            *(r.slip or DASH, ranges(r.lines) if len(r.lines) > 1 else DASH),
        ]
        for r in discovery.suspects
    ]
    place = ["sample", *(f"{q.name} {q.unit}" for q in state), "step", "pressure kPa"]
    last = ["how it slipped, perhaps", "together in lines"]
    return DisplayTable.from_rows(
        ["line", "reading"], [*place, "shows", "expected", "σ off"], rows, title=TITLE, last=last
    )


def suspect_lines(discovery: Discovery) -> list[str]:
    """The worst suspected reading in words, and how to leave such readings out; none where there are none."""
    if not discovery.suspects:
        return []
    count = len(suspected_lines(discovery.suspects))
    first = sentence(discovery.suspects[0].sentence())
    if not count:
        return [f"A block of readings may have slipped together. {first} Put it right in the table and search again."]
    rows = "One row has a reading" if count == 1 else f"{count} rows have readings"
    lines = [f"{rows} that may have slipped. {first}"]
    if not discovery.content["data"]["simulated"]:
        lines.append(
            "In marked.csv, beside discovery.json, left_out is 1 in these rows: look them over, blank it where the "
            "reading is right, and search again with data.path= that file."
        )
    return lines


# What terminal and page say of a discovery: parameters, what to measure next, and its sentences.


def step_row(step: Step, text: str) -> list[str]:
    """One step as a row under staircase.HEADINGS and the remaining misfit; text: what the step added."""
    # Without a pattern that the tests see it is noise only where it is as small as noise.
    patterns = step.left.shows
    left = "structure" if patterns else "noise" if sigmas_heldout(step) ** 2 <= INADEQUATE else "no pattern"
    return [*staircase_row(text, step.E_train, step.E_heldout, step.floor, sigmas_heldout(step)), left]


def final_parameters(discovery: Discovery) -> DisplayTable:
    """Parameters of the last model, with 95 % intervals that count each kinematic state once."""
    return parameter_table(final_estimates(discovery.findings), "Parameters of the last model")


def next_states(proposed: Sequence[NextState], most: int | None = None) -> DisplayTable:
    """States whose measurement would split effects that now look alike. most: rows shown, None for all."""
    state = _imposed(proposed)
    rows = [
        [
            *(str(p.sample), *(signed(getattr(p, q.column), digits(q)) for q in state)),
            *(*(number(pressure, 3) for pressure in _pressures(p)), fixed(p.expected_z, 1), *p.separates),
        ]
        for p in proposed[:most]
    ]
    several = max((len(p.pressures_kpa) for p in proposed), default=0)
    if courses := any(p.course for p in proposed):
        rows = [[*row, p.course] for row, p in zip(rows, proposed, strict=False)]
    pressures = [f"pressure {i} kPa" for i in range(1, several + 1)] or ["pressure kPa"]
    return DisplayTable.from_rows(
        ["sample"],
        [*(f"{q.name} {q.unit}" for q in state), *pressures, "expected σ"],
        rows,
        title="What to measure next",
        last=["splits this", "from that", *(["what to do"] if courses else [])],
    )


def next_state_lines(proposed: Sequence[NextState], most: int) -> list[str]:
    """The same as sentences, for a terminal that is too narrow for the table."""
    return [
        f"{'record' if p.course else 'measure'} sample {p.sample} at "
        + ", ".join(f"{signed(getattr(p, q.column), digits(q))}{q.suffix}" for q in _imposed(proposed))
        + f", {p.course or _held(p)}: "
        f"splits {' from '.join(p.separates)} by {fixed(p.expected_z, 1)} σ"
        for p in proposed[:most]
    ]


def _held(proposed: NextState) -> str:
    return f"{' + '.join(number(pressure, 3) for pressure in _pressures(proposed))} kPa"


def _imposed(proposed: Sequence[NextState]) -> list[Quantity]:
    """The two quantities that the bed imposes on a kinematic state."""
    pairs = (bed.state for bed in BEDS.values())
    known = (state for state in pairs if all(getattr(p, q.column) is not None for p in proposed for q in state))
    return list(next(known))


def _pressures(proposed: NextState) -> tuple[float, ...]:
    """Of each actuator on one end block, or of the one there is [kPa]."""
    return proposed.pressures_kpa or (proposed.pressure_kpa,)


def rows_told(discovery: Discovery) -> str:
    """How many rows were looked at."""
    rows = discovery.content["rows"]
    return f"{rows} {'row' if rows == 1 else 'rows'}"


def error_line(discovery: Discovery) -> str:
    """The held-out error before and after, and what measuring alone leaves."""
    error = discovery.content["error"]
    before, after = (error_percent(error[name], 3) for name in ("before", "after"))
    floor = known_floor(error["noise_floor"])
    fell = f"from {before} % to {after} %" if discovery.findings.effects else f"{after} %"
    line = f"Held-out error {fell} on {rows_told(discovery)}"
    line += f"; measuring alone leaves {percent(floor, 3)} %." if floor is not None else "."
    return f"{line} {sentence(discovery.content['heldout_is'])}"


def failure_lines(discovery: Discovery, most: int | None = None) -> list[str]:
    """Where the first model fails, worst first. most: regions named, None for all."""
    lines = [sentence(failure.sentence()) for failure in discovery.failed[:most]]
    return lines or ["No region stands out."]


def screen_lines(discovery: Discovery) -> list[str]:
    """What the screens rule out."""
    return [sentence(f"{screen.name}: {screen.says}") for screen in discovery.screens]


def class_lines(discovery: Discovery) -> list[str]:
    """Effects that the data cannot tell apart."""
    return [f"The data cannot tell these apart: {', '.join(c)}." for c in discovery.content["classes"] if len(c) > 1]


def remainder_lines(discovery: Discovery) -> list[str]:
    """How systematic is what no effect accounts for, and a hint at its form; none where nothing is left."""
    left = discovery.left
    if left is None:
        return []
    said = f"Of the remaining misfit {percent(left.share, 0)} % is systematic."
    if left.hint == NO_HINT:
        return [said]
    return [f"{said} Hint, not a finding: {left.hint} explains {percent(left.hint_share, 0)} % of that."]


def written_lines(discovery: Discovery) -> list[str]:
    """What the search wrote; of a model that stays unexplained the best part of an answer."""
    findings = discovery.findings
    lines = []
    for proposal in findings.proposals:
        first, *rest = proposal_lines(proposal_entry(proposal, findings.noise_floor), proposal.written)
        # A name keeps its small letters.
        lines += [f"{first}.", *map(sentence, rest)]
    if lines and findings.verdict != "proposed":
        lines[0] = f"Hint, not a finding: the largest part of it looks like {lines[0]}"
    return lines


def places_table(discovery: Discovery) -> DisplayTable | None:
    """Where what is missing could enter, and what each place promised before anything was fitted; None where nothing
    was written."""
    if not discovery.findings.proposals:
        return None
    entry = discovery.content["proposals"] or [discovery.content["hint"]]
    rows = [
        [f"{p['port']} ({p['where']})", ", ".join(p["inputs"]), p["formula"], fixed(p["sigmas"], 1)]
        for p in entry[0]["places"]
    ]
    return DisplayTable.from_rows(
        ["where", "of", "best form"], ["promises σ"], rows, title="Where it could enter",
        caption="By linear least squares on what the model before left: one form at one place each, the best first.",
    )  # fmt: skip


def note_lines(discovery: Discovery) -> list[str]:
    """What else to know."""
    return [sentence(note) for note in discovery.notes]
