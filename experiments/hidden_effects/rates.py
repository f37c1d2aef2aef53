"""Whether what a search said of a data set is right, and rates of that against their targets, as rows of a table."""

from __future__ import annotations

import numpy as np
import pandas as pd
from rich.table import Table

from freelearn.testing.reference.truths import MOVED

# What, of how many, rate in percent, target.
Row = tuple[str, int, str, str]
# Slips from this size on, in the load cell's standard deviations, have to be found.
LARGE = 8.0
# Hidden effects have to be this near to the size that was asked for; a physical bound may keep them from it.
REACHED = 0.8
# Name → key of a laboratory's settings.
SETTINGS = {"tails": "tails", "slips": "slipped", "growing noise": "growth"}
MOST_IN_CLASS = 3
# What has no potential, and what depends on the history, of all that is hidden: the truth that the screens are held
# against. What happens as time goes by breaks reciprocity, and shows between rising and falling pressure if quick.
WITHOUT_POTENTIAL = {
    *(
        "friction_hysteresis",
        "contact_friction",
        "pressure_hysteresis",
        "relaxation",
        "stress_softening",
        "viscoelasticity",
        "force_gain",
        "moment_gain",
        "sensor_crosstalk",
    ),
    *("sensor_drift", "bent_force_cell", "temperature_swing", "bulging_caps", "zero_jump"),
}
OF_HISTORY = {
    *("friction_hysteresis", "contact_friction", "pressure_hysteresis", "relaxation", "stress_softening"),
    "viscoelasticity",
}
AFFIRMED = {"reciprocity": WITHOUT_POTENTIAL, "rising against falling pressure": OF_HISTORY}


def right(result: dict) -> bool:
    """Every hidden effect is named, or stands in a class of at most three; nothing else is named."""
    if result["verdict"] not in ("named", "class") or len(result["classes"]) != len(result["hidden"]):
        return False
    left = list(result["hidden"])
    for group in result["classes"]:
        match = next((h for h in left if h in group), None)
        if match is None or len(group) > MOST_IN_CLASS:
            return False
        left.remove(match)
    return not left


def contradicted(result: dict, screen: str) -> bool:
    """Whether what the screen said of a data set contradicts what was hidden in it.

    Reciprocity kept denies nothing: a wrong gain keeps it too where the fluid's thrust is most of the load. Loads that
    do not differ deny friction above the limit that is told with it: half of the largest difference."""
    shows, hidden = result["screens"].get(screen), set(result["hidden"])
    if shows:
        return not hidden & AFFIRMED[screen]
    if shows is None or screen == "reciprocity" or "friction_hysteresis" not in hidden:
        return False
    rubs = [result["truth"][f"friction_hysteresis.{load}"] for load in ("force", "moment")]
    return any(2 * f > most for f, most in zip(rubs, result["hysteresis_at_most"], strict=True))


def table(title: str, headings: list[str], cells: list[list[str]]) -> Table:
    """To be printed; the first column holds words, the others numbers."""
    shown = Table(title=title, title_justify="left")
    for heading in headings:
        shown.add_column(heading, justify="left" if heading == headings[0] else "right")
    for each in cells:
        shown.add_row(*each)
    return shown


def rates_table(title: str, rows: list[Row]) -> Table:
    """Rates to be printed."""
    cells = [[what, str(count), value, target] for what, count, value, target in rows]
    return table(title, ["what", "of", "rate %", "target"], cells)


def answer(result: dict) -> str:
    """What is hidden and what is said of it, in words."""
    claimed = "; ".join("/".join(members) for members in result["classes"]) or "nothing"
    return f"{', '.join(result['hidden']) or 'nothing'} → {result['verdict']}: {claimed}"


def seconds(frame: pd.DataFrame) -> str:
    """How long searches took, in words."""
    return f"time: median {frame['seconds'].median():.1f} s, longest {frame['seconds'].max():.1f} s per table"


def rate(what: str, chosen: pd.DataFrame, good: pd.Series, target: str) -> list[Row]:
    """One row; none without data sets."""
    return [(what, len(chosen), f"{100 * good.mean():.1f}", target)] if len(chosen) else []


def of_clean(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `clean`."""
    none, one, pair = (frame[frame["kind"] == kind] for kind in ("none", "one", "pair"))
    rows = rate("effect wrongly named on effect-free data", none, _named(none), "≤ 5")
    rows += rate("effect-free data called adequate", none, none["verdict"] == "adequate", "")
    for size, target in ((4, ""), (8, "≥ 95"), (15, "≥ 99"), (30, "")):
        part = one[one["size"] == size]
        rows += rate(f"right effect or class of ≤ 3, {size} σ", part, part["right"], target)
    rows += rate("both of a pair, 15 σ", pair, pair["right"], "≥ 85")
    return rows + _outside(frame, "≥ 90") + _common(frame)


def of_laboratory(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `laboratory`."""
    able = frame[frame["possible"]]
    standard = able[able["protocol"] == "standard"]
    none, one = (standard[standard["kind"] == kind] for kind in ("none", "one"))
    rows = rate("nothing named on effect-free data", none, ~_named(none), "≥ 97")
    rows += rate("effect-free data called adequate", none, none["verdict"] == "adequate", "")
    for size, target in ((8, ""), (15, "≥ 95"), (30, "")):
        part = one[one["size"] == size]
        rows += rate(f"right effect or class of ≤ 3, {size} σ", part, part["right"], target)
    for kind, what, target in (("pair", "both of a pair", "≥ 85"), ("triple", "all of a triple", "≥ 60")):
        part = standard[standard["kind"] == kind]
        rows += rate(f"{what}, 15 σ each", part, part["right"], target)
    for protocol in ("short", "sorted"):
        part = able[able["protocol"] == protocol]
        none, one = (part[part["kind"] == kind] for kind in ("none", "one"))
        rows += rate(f"{protocol} protocol: nothing named on effect-free data", none, ~_named(none), "")
        rows += rate(f"{protocol} protocol: right effect or class, 15 σ", one, one["right"], "")
    rows += _outside(standard, "")
    unexplained = able[able["verdict"] == "unexplained"]
    if len(unexplained):
        listed = unexplained["effects"].map(len)
        rows.append(("effects listed on average where unexplained (not %)", len(listed), f"{listed.mean():.2f}", ""))
    rows += of_slips(frame) + _common(able)
    if not frame["possible"].all():
        rows += rate("left out: cannot be tested, or a bound keeps it small", frame, ~frame["possible"], "")
    return rows


def of_braids(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `braids`, by tubes and bed."""
    rows: list[Row] = []
    for (tubes, bed), part in frame[frame["possible"]].groupby(["tubes", "bed"], sort=False):
        none, one, pair = (part[part["kind"] == kind] for kind in ("none", "one", "pair"))
        where = f"{tubes}, {bed} bed"
        rows += rate(f"{where}: nothing named where nothing is hidden", none, ~_named(none), "≥ 97")
        for size, target in ((8, ""), (15, "≥ 95"), (30, "")):
            same = one[one["size"] == size]
            rows += rate(f"{where}: right effect or class of ≤ 3, {size} σ", same, same["right"], target)
        rows += rate(f"{where}: both of a pair, 15 σ each", pair, pair["right"], "≥ 85")
    return rows + _common(frame)


def of_moves(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `moves`, and how often each of its effects is named where it is not hidden."""
    rows: list[Row] = []
    for name in MOVED:
        part = frame[~frame["hidden"].map(lambda hidden, name=name: name in hidden)]
        named = part["classes"].map(lambda classes, name=name: any(name in group for group in classes))
        rows += rate(f"{name} named, or in a class, where it is not hidden", part, named, "≤ 3")
    return rows + of_laboratory(frame)


def of_slips(frame: pd.DataFrame) -> list[Row]:
    """How many of the slipped rows were found, and how many good ones accused."""
    slips = slips_of(frame)
    rows: list[Row] = []
    if len(slips):
        large = slips[slips["sensor_sigmas"] >= LARGE]
        rows += rate(f"slipped rows found, {LARGE:g} sensor σ and more", large, large["found"], "≥ 95")
        rows += rate("… and the right one of the two loads", large, large["load_too"], "")
    if "good_rows" in frame and (good := int(frame["good_rows"].sum())):
        rows.append(("good rows accused", good, f"{100 * frame['accused'].sum() / good:.3f}", "≤ 0.2"))
    return rows


def by_setting(frame: pd.DataFrame) -> list[list[str]]:
    """How it was measured → data sets, right at 15 σ, nothing named where nothing is, slips found, accused, intervals.

    A data set counts in each setting that it has; clean is one that has none."""
    how = frame["laboratory"].map(dict)
    settings = {name: how.map(lambda s, key=key: key in s) for name, key in SETTINGS.items()}
    settings["misstated to a third"] = how.map(lambda s: s.get("misstated", 1) < 1)
    settings["misstated threefold"] = how.map(lambda s: s.get("misstated", 1) > 1)
    settings |= {name: frame["protocol"] == name for name in ("short", "sorted")}
    odd = pd.concat(settings, axis=1).any(axis=1)
    rows = []
    for name, chosen in {"clean noise": ~odd, **settings, "all": frame["seed"] > 0}.items():
        part = frame[chosen & frame["possible"]]
        one, none = part[part["kind"].eq("one") & part["size"].eq(15)], part[part["kind"] == "none"]
        slips = slips_of(part)
        large = slips[slips["sensor_sigmas"] >= LARGE]["found"] if len(slips) else pd.Series(dtype=bool)
        good = part["good_rows"].sum() if "good_rows" in part else 0
        accused = f"{100 * part['accused'].sum() / good:.2f}" if good else ""
        hits = pd.Series([hit for c in part.get("covered", pd.Series(dtype=object)).dropna() for hit in c.values()])
        cells = (one["right"], ~none["effects"].map(bool), large)
        rows.append([name, str(len(part)), *map(_percent, cells), accused, _percent(hits)])
    return rows


def _percent(hits: pd.Series) -> str:
    return f"{100 * hits.astype(float).mean():.0f} ({len(hits)})" if len(hits) else ""


def slips_of(frame: pd.DataFrame) -> pd.DataFrame:
    """All slips of all data sets."""
    each = frame["slips"].dropna() if "slips" in frame else []
    return pd.DataFrame([slip for slips in each for slip in slips])


def of_directions(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `directions`."""
    claimed = frame["verdict"].isin(["named", "class", "proposed"])
    answers = zip(frame["hidden"], frame["effects"], frame["classes"], strict=True)
    said = [bool(set(hidden) & {*effects, *(n for c in classes for n in c)}) for hidden, effects, classes in answers]
    told, rows = pd.Series(said, frame.index), list[Row]()
    none = frame["kind"] == "none"
    rows += rate("nothing hidden: nothing claimed", frame[none], ~claimed[none], "≥ 97")
    for (protocol, name), part in frame[~none].groupby(["protocol", frame["hidden"].map(" ".join)], sort=False):
        wrong = claimed & ~told
        rows += rate(f"{protocol}, {name}: claimed without it", part, wrong[part.index], "≤ 3")
        rows += rate(f"{protocol}, {name}: in the answer, claimed or undecided", part, told[part.index], "")
        if protocol != "rising":
            rows += rate(f"{protocol}, {name}: named, or in a class of three", part, part["right"], "")
    return rows + rate("undecided", frame, frame["verdict"] == "undecided", "")


def of_unknown(frame: pd.DataFrame) -> list[Row]:
    """Rates of the plan `unknown`."""
    able, rows = frame[frame["possible"]], list[Row]()
    for name, chosen in [*able.groupby("protocol", sort=False), *able.groupby("size"), ("all", able)]:
        what = f"{name} σ" if isinstance(name, int) else str(name)
        wrong = chosen["verdict"].isin(["named", "class"])
        rows += rate(f"{what}: an effect of the library claimed", chosen, wrong, "≤ 10" if what == "all" else "")
    for verdict in ("proposed", "unexplained", "undecided", "adequate"):
        rows += rate(verdict, able, able["verdict"] == verdict, "")
    return rows


def _named(frame: pd.DataFrame) -> pd.Series:
    """Whether effects were claimed: of an undecided table those that are listed are no claim."""
    return frame["effects"].map(bool) & (frame["verdict"] != "undecided")


def _outside(frame: pd.DataFrame, target: str) -> list[Row]:
    rows = []
    for size in (15, 30):
        part = frame[(frame["kind"] == "outside") & (frame["size"] == size)]
        said = part["verdict"].isin(["unexplained", "proposed"])
        rows += rate(f"outside the library, unexplained or proposed, {size} σ", part, said, target)
    return rows


def _common(frame: pd.DataFrame) -> list[Row]:
    rows: list[Row] = []
    found = frame[frame["right"] & (frame["kind"] != "none")]
    if len(found):
        rows += rate(
            "held-out error ≤ 1.1 × noise floor after adding", found, found["after"] <= 1.1 * found["floor"], ""
        )
    spoken = [r for r in frame.to_dict("records") if isinstance(r.get("screens"), dict)]
    for what, chosen in (
        ("95 % intervals that cover the truth", spoken),
        ("… without stress softening", [r for r in spoken if "stress_softening" not in r["hidden"]]),
    ):
        covered = [hit for r in chosen for hit in r["covered"].values()]
        if covered:
            rows.append((what, len(covered), f"{100 * np.mean(covered):.1f}", "90–98"))
    for screen in AFFIRMED if spoken else ():
        wrong = np.mean([contradicted(r, screen) for r in spoken])
        said = np.mean([r["screens"].get(screen) is not None for r in spoken])
        what = f"false statements, {screen} (speaks on {100 * said:.0f} %)"
        rows.append((what, len(spoken), f"{100 * wrong:.1f}", "≤ 2"))
    rows += rate("undecided", frame, frame["verdict"] == "undecided", "")
    return [*rows, ("failed", len(frame), f"{100 * (frame['verdict'] == 'failed').mean():.1f}", "0")]
