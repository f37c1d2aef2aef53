"""What pictures and tables show of a table, whatever bed it was measured on."""

import beds
import numpy as np
import pandas as pd
import pytest

from freelearn.data.beds import BED, BEDS, DIAMETER, ELONGATION, FORCE, KINEMATIC, MOMENT, PRESSURE, TWIST
from freelearn.data.columns import with_members
from freelearn.discovery.residuals.suspects import Suspect
from freelearn.queries.curves.curve_panels import curve_numbers, measured_points, panels_of, read
from freelearn.queries.curves.curve_rows import measured_quantities, misses, plane, sweep, sweep_text, words
from freelearn.queries.curves.shown_states import pick_states, squared_error, state_title
from freelearn.records.suspected_readings import SuspectedReading, flagged, suspected_readings, suspects_frame
from freelearn.report.tables.residual_tables import residual_table


@pytest.fixture(scope="module")
def tables():
    """Each bed's table as the program has it."""
    made = {name: beds.TABLES[name]({}).assign(**{BED: name}) for name in BEDS if name in beds.TABLES}
    return made | {"block": with_members(beds.block({}), beds.MEMBERS)}


def predicted(table: pd.DataFrame, **off: float) -> pd.DataFrame:
    """The table with predictions that are off by so much, in the columns' units."""
    columns = {q.predicted: table[q.column] + off.get(q.name, 0.0) for q in measured_quantities(table)}
    return table.assign(**columns, status="ok", split="train")


def test_a_picture_is_over_what_varies(tables):
    assert plane(tables["isometric"]) == (ELONGATION, PRESSURE)
    assert plane(tables["dead_load"]) == (FORCE, MOMENT)
    assert plane(tables["inflation"]) == plane(tables["block"]) == (ELONGATION, TWIST)
    one = tables["inflation"][:8]
    assert plane(one) == (ELONGATION, PRESSURE)
    assert plane(one[:1]) == (ELONGATION, TWIST)
    still = tables["block"].query("elongation_mm == 0 and twist_deg == 0")
    assert [quantity.symbol for quantity in plane(still)] == ["P1", "P2"]


@pytest.mark.parametrize(
    ("bed", "quantities", "titles", "heading"),
    [
        ("isometric", (FORCE,), ["F–P"], "Force"),
        ("dead_load", (ELONGATION, TWIST), ["Δl–P", "φ–P", "Δl–φ"], "Elongation and twist"),
        ("inflation", (FORCE, DIAMETER), ["F–P", "D–P", "F–D"], "Force and outer diameter"),
        ("block", (FORCE, MOMENT), ["F–P1", "M–P1", "F–M"], "Loads"),
    ],
)
def test_panels_are_of_what_was_measured(tables, bed, quantities, titles, heading):
    first = tables[bed][:8]
    assert measured_quantities(first) == quantities
    assert [panel.title for panel in panels_of(first)] == titles
    assert words(quantities) == heading


def test_what_nobody_measured_has_no_panel(tables):
    second = tables["dead_load"].query("sample == 2")[:8]
    assert [panel.title for panel in panels_of(second)] == ["φ–P"]


def test_states_are_called_by_what_was_imposed(tables):
    assert state_title(tables["dead_load"][:8]) == "sample 1, +0 N, -90 N·mm"
    assert state_title(tables["isometric"][:8]) == "sample 1, +2 mm, +0°"
    block = tables["block"]
    ends = [block[start : start + 8] for start in (0, 72, 216)]
    assert [state_title(rows) for rows in ends] == [f"sample 1, -3 mm, -60°, {p}" for p in ("P1", "P2", "P1 + P2 + P3")]
    assert [sweep(rows).over.label for rows in ends] == [
        "pressure P1 [kPa]",
        "pressure P2 [kPa]",
        "pressure of all P [kPa]",
    ]
    assert sweep_text(ends[0].assign(pressure_3_kpa=20.0)) == "P1, P3 at 20 kPa"


def test_blanks_and_loose_tubes_count_for_nothing(tables):
    isometric = predicted(tables["isometric"], force=5.0)
    loose = isometric["slack"] == 1
    missed = misses(isometric)["force_n"]
    assert (missed[loose] == 0).all()
    assert missed[~loose].to_numpy() == pytest.approx(-5.0)
    assert (squared_error(isometric)[loose] == 0).all()
    pulled = squared_error(predicted(tables["isometric"], force=-5.0))
    assert pulled.to_numpy() == pytest.approx((5 / isometric["force_n"].abs().max()) ** 2)

    hung = predicted(tables["dead_load"], elongation=0.5)
    error = squared_error(hung).groupby(hung["sample"]).max()
    assert error[1] > 0
    assert error[2] == 0
    table = residual_table(hung)
    assert table.loc[table["sample"] == 2, "elongation_mm"].isna().all()
    assert table.loc[table["sample"] == 1, "elongation_mm"].to_numpy() == pytest.approx(-0.5)
    assert (table["rows"] == 8).all()
    blank = hung.assign(elongation_mm=np.nan, twist_deg=np.nan)
    assert pick_states(blank) == []


def test_fields_over_a_pressure_and_of_an_end_block(tables):
    isometric = predicted(tables["isometric"], force=1.0)
    over = residual_table(isometric, plane(isometric))
    # Sixteen lengths and eight pressures.
    assert len(over) == 128
    assert len(residual_table(isometric)) == 16
    block = predicted(tables["block"], force=1.0)
    assert len(residual_table(block, plane(block))) == 9
    assert len(residual_table(block)) == 36


def test_fields_stand_in_rows_and_columns_where_pressures_and_lengths_wander(tables):
    wandering = predicted(tables["isometric"], force=1.0)
    generator = np.random.default_rng(0)
    wandering["pressure_kpa"] += generator.uniform(-0.5, 0.5, len(wandering))
    table = residual_table(wandering, plane(wandering))
    assert len(table) == 128
    assert table.groupby("sample")["pressure_kpa"].nunique().eq(8).all()
    # Where every row has a length of its own, lengths share fields too.
    wandering["elongation_mm"] = np.linspace(0, 5, len(wandering))
    assert residual_table(wandering, plane(wandering)).groupby("sample")["elongation_mm"].nunique().le(21).all()


def test_a_state_of_loose_rows_alone_is_not_the_best(tables):
    loose = predicted(tables["isometric"], force=5.0)
    loose.loc[:7, "slack"] = 1
    picked = pick_states(loose)
    assert picked
    assert not any(0 in rows for rows in picked)


def test_loose_rows_are_told_apart(tables):
    state = tables["isometric"][-8:]
    points, (panel,) = measured_points(state), panels_of(state)
    assert points["slack"].sum() + read(points, panel).sum() == 8
    assert set(curve_numbers(state, {})["what"]) == {"slack", "measured"}


def test_suspects_of_other_beds(tables):
    hung = tables["dead_load"]
    found = [
        Suspect(38, "twist", 0.1, 0.2, -9.0, "", (38,)), Suspect(3, "elongation", 1e-3, 2e-3, 8.0, "", (3,)),
    ]  # fmt: skip
    marks = flagged(hung, found)
    assert np.flatnonzero(marks["suspect_twist"]).tolist() == [38]
    assert np.flatnonzero(marks["suspect_elongation"]).tolist() == [3]
    twist, elongation = suspected_readings(found, hung, np.arange(len(hung)) + 2)
    assert "the twist shows +5.73° where +11.46° was expected" in twist.sentence()
    assert "the elongation shows +1.00 mm where +2.00 mm was expected" in elongation.sentence()
    entry = twist.plain()
    assert entry["elongation_mm"] is None
    assert (entry["force_n"], entry["moment_nmm"], entry["unit"]) == (0.0, -90.0, "°")
    assert SuspectedReading.from_plain(entry) == twist
    assert suspects_frame([twist, elongation])["moment_nmm"].tolist() == [-90.0, -90.0]
    (wide,) = suspected_readings([Suspect(0, "outer diameter", 0.013, 0.012, 9.0, "", (0,))], tables["inflation"], [2])
    assert set(wide.plain()).isdisjoint({"force_n", "moment_nmm"})
    assert "suspect_outer_diameter" in flagged(tables["inflation"], [])
    assert flagged(tables["block"], []).filter(like="suspect").columns.tolist() == ["suspect_force", "suspect_moment"]
    assert KINEMATIC.measured == (FORCE, MOMENT)
