"""What terminal and page say of readings that slipped, perhaps."""

from __future__ import annotations

from freelearn.measurements.beds import bed_of
from freelearn.results.discovery import Discovery
from freelearn.results.formats import DASH, number, sentence, signed
from freelearn.results.quantities import digits
from freelearn.results.suspects import ranges, suspected_lines, worst_of_each
from freelearn.results.tables import DisplayTable

TITLE = "Suspected readings"


def suspect_overview(discovery: Discovery, most: int) -> DisplayTable:
    """The worst suspected readings, a row for those that slipped together, in few columns. most: rows shown."""
    worst = worst_of_each(discovery.suspects)
    rows = [[ranges(r.lines), r.load, *r.readings, r.deviation, r.slip or DASH] for r in worst[:most]]
    more = f"… {len(worst) - most} more in suspects.csv" if len(worst) > most else ""
    heads = ["shows", "expected", "σ off"]
    return DisplayTable.of(["line", "reading"], heads, rows, TITLE, more, last=["how it slipped, perhaps"])


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
    return DisplayTable.of(["line", "reading"], [*place, "shows", "expected", "σ off"], rows, title=TITLE, last=last)


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
