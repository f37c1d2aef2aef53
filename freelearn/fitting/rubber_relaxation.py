"""Which relaxation, and which energy, recordings of rubber ask for: by what they miss of tests held out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.specimen_tests import TIME, names_of, tests_of, timed
from freelearn.fitting.rubber_effects import CLOSE, MOST_TERMS, NEO_HOOKEAN
from freelearn.fitting.rubber_fit import RubberFit, fit_rubber, predicted
from freelearn.physics.models.relaxation import MOST_ARMS, POWER, Relaxation
from freelearn.physics.models.rubber import Rubber, isotropic_effects

# Tests are held out in no more groups than these.
FOLDS = 8
KINDS: tuple[int | str, ...] = (0, *range(1, MOST_ARMS + 1), POWER)
# A time constant takes a tenfold range of times to be told from the next.
EACH_ARM = 10.0
STRESSES = ["stress_mpa", "stress_2_mpa"]


def span_of(table: pd.DataFrame) -> tuple[float, float]:
    """Shortest step and longest recording of a table, s: what times it can tell of."""
    recordings = [rows[TIME].to_numpy() for rows in tests_of(table[timed(table)]).values()]
    return min(float(np.diff(t).min()) for t in recordings), max(float(np.ptp(t)) for t in recordings)


def relaxation_of(kind: int | str, softened: bool, table: pd.DataFrame) -> Relaxation:
    """Of a table with recordings. Raises UserError where these are too short or too slow for so many arms."""
    if not timed(table).any():
        raise UserError(
            "No test has a time, so none shows a relaxation: add a column time_s, or fit without relaxation."
        )
    short, long = span_of(table)
    made = Relaxation(kind, softened, (short, long))
    if kind not in (0, POWER) and long / short < EACH_ARM ** int(kind):
        raise UserError(
            f"Recordings of up to {long:.3g} s with samples {short:.3g} s apart do not tell {made.words} of "
            "relaxation: record faster or for longer, or fit fewer arms."
        )
    return made


def compare_relaxations(table: pd.DataFrame, effects: Sequence[str]) -> pd.DataFrame:
    """Fits all tests with each relaxation that their times tell of, and each test held out in turn: columns relaxation,
    kind, softened, parameters, error, held_out (root mean squares of shares of each test's largest stress)."""
    rows = []
    for kind in KINDS:
        for softened in (False, True) if kind else (False,):
            try:
                relaxation = relaxation_of(kind, softened, table)
            except UserError:
                continue
            rubber = Rubber(effects, relaxation)
            own = {"relaxation": relaxation.words, "kind": str(kind), "softened": softened}
            rows.append({**own, "parameters": len(rubber.declared), **_judged(table, rubber)})
    return pd.DataFrame(rows)


def compare_energies(table: pd.DataFrame) -> pd.DataFrame:
    """As compare_relaxations of each energy of the rubber at rest, with softened arms of a power law: each effect, and
    the best of them with each other one. Columns effects, parameters, error, held_out."""
    relaxation = relaxation_of(POWER, True, table)
    names = isotropic_effects()

    def row(effects: Sequence[str]) -> dict[str, object]:
        rubber = Rubber(effects, relaxation)
        said = " ".join(effects) or NEO_HOOKEAN
        return {"effects": said, "parameters": len(rubber.declared), **_judged(table, rubber)}

    rows = [row(c) for size in range(MOST_TERMS) for c in combinations(names, size)]
    best = min(rows[1:], key=lambda r: float(r["held_out"]))["effects"]  # type: ignore[arg-type]
    rows += [row(pair) for pair in combinations(names, MOST_TERMS) if best in pair]
    return pd.DataFrame(rows)


def asked_of_time(compared: pd.DataFrame) -> pd.Series:
    """The row of either comparison that the recordings ask for: of those within a tenth of the least held-out error the
    one with the fewest parameters."""
    good = compared[compared["held_out"] <= (1 + CLOSE) * compared["held_out"].min()]
    return good.sort_values(["parameters", "held_out"]).iloc[0]


def best_relaxation(compared: pd.DataFrame, table: pd.DataFrame) -> Relaxation:
    """What recordings ask for. compared: of compare_relaxations."""
    asked = asked_of_time(compared)
    kind = str(asked["kind"])
    return relaxation_of(kind if kind == POWER else int(kind), bool(asked["softened"]), table)


def best_energy(compared: pd.DataFrame) -> tuple[str, ...]:
    """The effects that recordings ask for. compared: of compare_energies."""
    said = str(asked_of_time(compared)["effects"])
    return () if said == NEO_HOOKEAN else tuple(said.split())


def asked_energies(compared: pd.DataFrame) -> str:
    """Which energy the recordings ask for, in a sentence. compared: of compare_energies."""
    names, asked = best_energy(compared), asked_of_time(compared)
    plain = float(compared.loc[compared["effects"] == NEO_HOOKEAN, "held_out"].iloc[0])
    if not names:
        return f"These tests ask for no more than a neo-Hookean rubber at rest: {100 * plain:.1f} % on tests held out."
    return (
        f"These tests ask for {' + '.join(names)}: on tests held out the error falls from {100 * plain:.1f} % to "
        f"{100 * float(asked['held_out']):.1f} %."
    )


def each_held_out(table: pd.DataFrame, rubber: Rubber, whole: RubberFit) -> Mapping[str, float]:
    """Error of each test when the others alone are fitted, by name, as in ModeError; up to FOLDS groups of tests are
    held out. whole: the fit of all tests. Empty where there is one test only."""
    found: dict[str, float] = {}
    for group in _groups(table):
        fit = fit_rubber(rubber, table, group, start=whole)
        found |= {name: fit.modes[name].error for name in group}
    return {name: found[name] for name in whole.modes if name in found}


def _groups(table: pd.DataFrame) -> Iterator[list[str]]:
    names = list(dict.fromkeys(names_of(table)))
    for number in range(min(FOLDS, len(names)) if len(names) > 1 else 0):
        yield names[number::FOLDS]


def _judged(table: pd.DataFrame, rubber: Rubber) -> dict[str, float]:
    """Error of a fit of all tests, and over tests held out, each of which counts alike."""
    whole = fit_rubber(rubber, table)
    apart = each_held_out(table, rubber, whole)
    missed = list(apart.values()) or _blocks_held_out(table, rubber, whole)
    return {"error": whole.error, "held_out": float(np.sqrt(np.mean(np.square(missed))))}


def _blocks_held_out(table: pd.DataFrame, rubber: Rubber, whole: RubberFit) -> list[float]:
    """As each_held_out of blocks of a single recording, whose stretch stays known."""
    largest, missed = table[STRESSES].abs().max().max(), []
    for block in np.array_split(np.arange(len(table)), FOLDS):
        seen = table.copy()
        seen.loc[seen.index[block], STRESSES] = np.nan
        expected = predicted(fit_rubber(rubber, seen, start=whole), table)
        misfit = ((expected[STRESSES] - table[STRESSES]) / largest).to_numpy(np.float64)[block]
        missed.append(float(np.sqrt(np.nanmean(misfit**2))))
    return missed
