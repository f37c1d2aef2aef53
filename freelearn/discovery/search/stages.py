"""From a model that is far off to one that measuring alone explains: sets looked at under less and less doubt.

A model that is wrong by some amount cannot be judged by digits beyond that. So sets are compared as if every reading
were off by about half of what the best of them leaves, then less, until measuring alone is left; and with many rows on
some of them first; under a dead load, from the places that were measured first, without a search for where the
actuator rests. Where no set comes down to what measuring leaves, the comparison stops at what the best one does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from freelearn.common.progress import begin
from freelearn.data.beds import DEAD_LOAD
from freelearn.data.rows import Rows
from freelearn.data.warm_start import Near
from freelearn.discovery.fits.prepare import Prepared
from freelearn.discovery.fits.white_fit import WhiteFit, evaluated, refitted
from freelearn.discovery.noise.noise import Noise, Whitener, noise_floor, relative_error
from freelearn.discovery.noise.scatter import Scatter
from freelearn.discovery.noise.structure import Structure, structure
from freelearn.discovery.search.hypotheses import Asked, Hypotheses
from freelearn.discovery.search.hypothesis import Effects, Hypothesis
from freelearn.discovery.thresholds import (
    AT_ONCE,
    BEAM,
    CONSISTENT,
    FAR,
    FEW_STATES,
    FORERUNNERS,
    GLANCE,
    HARDLY,
    INADEQUATE,
    LEAST_WRONG,
    LESS_LEFT,
    MANY,
    MENDED,
    MOST_EXPANDED,
    MOST_LOWERED,
    REFITTED,
    RIVALS,
    SCOUTED,
    SETTLED,
    SETTLINGS,
    STEADY,
    TIES,
    WORSE,
    WRONG_BY,
)
from freelearn.physics.chain.dead_load import PLACE
from freelearn.physics.chain.prediction import Status

Told = Callable[[Hypothesis], None]
# What goes wrong most often in a laboratory: zeros, and what a drawing says of the actuator.
ZEROS = ("length_offset", "twist_offset", "pressure_offset", "force_offset", "moment_offset")
TOLERANCES = ("fiber_misalignment", "end_clamps", "wall_thickness", "end_taper", "length_offset")


@dataclass(frozen=True)
class Explored:
    """What was looked at on all rows. noise: about the best set; share: of the largest loads, by which even that is
    wrong in every reading, zero where measuring explains it; whiten: of both, which decides among models that are all
    wrong: the finest digits must not."""

    hypotheses: Hypotheses
    noise: Noise
    share: float
    whiten: Whitener


def explored(prepared: Prepared, fit: WhiteFit, noise: Noise, told: Told = lambda h: None) -> Explored:
    """Looks at sets of effects on top of the first model. told: of each set that is the best so far."""
    glance = _View(prepared, noise, told)
    if (right := glance.right_at_once(glance.begin(fit))) is not None:
        return glance.usual(glance.settled(right))
    view = _View(prepared, noise, told)
    now = view.begin(fit)
    return view.usual(view.lowered(now, 2 * view.wrong_by(now.best)))


def continued(prepared: Prepared, before: Explored, odds: dict[str, float], complete: bool) -> tuple[Explored, bool]:
    """The same with effects beside the library among the candidates, and whether these may be part of an answer. odds:
    theirs. complete: whether the library's answer is one. Where it is none, and what was written takes hardly anything
    off what it leaves, the best written effect alone joins the library's sets."""
    view = _View(prepared, before.noise, lambda h: None, before.share, before.whiten.even)
    known = before.hypotheses
    if view.scouting:
        kept = known.worth_keeping(REFITTED)
        now = known.under(view._whitener(before.share), view.rows, kept, view.about(kept[0]))
    else:
        now = Hypotheses(prepared.question, view.rows, known.whiten, prepared.spans, found=dict(known.found))
    now.odds = known.odds | odds
    # The library's answer may have taken the place of what was written on top of the first model.
    now.expand(now.found[frozenset()])
    if complete:
        now.explore(view.told)
        return view.lowered(now, before.share), True
    # Only whether what was written mends much, or all that is left, for which the next neighbors are enough.
    now.explore(view.told, 1, GLANCE, instead=odds)
    # What else could stand in for effects has not been asked.
    now.exchanged.clear()
    if before.share:
        mends = view.chi2(now.best) <= MENDED * view.chi2(known.best)
    else:
        # The noise has grown by what the library leaves, of which χ² tells little then.
        left, leaves = view.left_in_all(now.best), view.left_in_all(known.best)
        mends = not (left.shows and leaves.shows) or left.size <= LESS_LEFT * leaves.size
    if not mends:
        return _joined(before, now), False
    if not before.share:
        now.explore(view.told)
    return view.lowered(now, before.share), True


def _joined(before: Explored, now: Hypotheses) -> Explored:
    """What was explored before, on all rows, and the best single effect of those that were written."""
    written = [h for h in now.ordered() if len(h.effects) == 1 and h.effects[0] in now.odds]
    known = before.hypotheses
    found = Hypotheses(known.question, known.rows, known.whiten, known.spans, now.odds, found=dict(known.found))
    if written:
        found.fit(written[0].effects, written[0].fit.vector)
    return replace(before, hypotheses=found)


class _View:
    """The rows that are looked at now, and the noise in them. scouting: whether these are some of the rows, or every
    evaluation is one step from the places measured; scouted: whether it was so at first. share: under which sets were
    looked at last; even: whether readings weigh alike, because the best set was far off once; tried: the best ones that
    were looked at under the noise alone."""

    def __init__(self, prepared: Prepared, noise: Noise, told: Told, share: float = 0.0, even: bool = False) -> None:
        self.prepared, self.noise, self.told, self.share, self.even = prepared, noise, told, share, even
        self.some = scouted(prepared.rows)
        self.scouting = self.scouted = self.some is not None or prepared.rows.states.bed is DEAD_LOAD
        self.rows: Rows = prepared.rows if self.some is None else prepared.rows[self.some]
        self.scale, self.tried = prepared.scale, set[Effects]()

    def begin(self, fit: WhiteFit) -> Hypotheses:
        """The first model alone."""
        question = self.prepared.question
        started = Hypotheses(question, self.rows, self._whitener(0.0), self.prepared.spans)
        started.fit((), fit.vector)
        return started

    def about(self, best: Hypothesis) -> Near | None:
        """Under a dead load, while scouting, the places measured."""
        return held_where_measured(best.fit, self.rows) if self.scouting else None

    def right_at_once(self, now: Hypotheses) -> Hypotheses | None:
        """The sets under the noise alone, where one of an effect or two is adequate there.

        Doubt of a share of the largest loads drowns what is clear in small ones: so of samples of which one is stiff,
        whose loads change more where it stands a little elsewhere than all that is missing of the others."""
        for _ in range(AT_ONCE):
            if self.adequate(now):
                break
            now.expand(now.best)
        right = self.right(now) if self.adequate(now) else None
        # In few states more together may stand for one that no library has: these are looked at under doubt first.
        few = self._whitener(0.0).states < FEW_STATES
        return None if right is not None and few and len(right.best.effects) > AT_ONCE else right

    def lowered(self, now: Hypotheses, share: float) -> Explored:
        """From sets looked at as if every reading were off by a share of the largest loads, on to less."""
        share = min(WRONG_BY * self.wrong_by(now.best), share / 2)
        for _ in range(MOST_LOWERED):
            if (right := self.right(now)) is not None:
                return self.settled(right)
            finer, left = self.moved(now, share), self.misfit(now.best)
            if self.misfit(finer.best) > WORSE * left:
                # Digits that no set explains begin to decide.
                break
            now = finer
            if not self.adequate(now):
                break
            share = min(WRONG_BY * self.wrong_by(now.best), share / 2)
        return self.ended(now, self.wrong_by(now.best))

    def right(self, now: Hypotheses) -> Hypotheses | None:
        """The sets under the noise alone, where the best one is adequate there. Asked once of each that may be."""
        if now.best.key in self.tried or self.chi2(now.best) > HARDLY:
            return None
        self.tried.add(now.best.key)
        self.noise = self.prepared.noise(self._whole(now.best), self.noise.scatter)
        few = now.under(self._whitener(0.0), self.rows, now.worth_keeping(FORERUNNERS), self.about(now.best))
        if not self.adequate(few, FAR):
            return None
        alone = self.moved(now, 0.0)
        return alone if self.adequate(alone) else None

    def settled(self, now: Hypotheses) -> Explored:
        """From sets that are adequate under the noise alone, until that settles."""
        for _ in range(SETTLINGS - 1):
            before = self.noise.scatter
            now = self.moved(now, 0.0)
            if not self.adequate(now):
                return self.ended(now, self.wrong_by(now.best))
            if _steady(before, self.noise.scatter):
                break
        return self.ended(now, 0.0)

    def moved(self, before: Hypotheses, share: float) -> Hypotheses:
        """The sets under the noise about the best of them, and this share of the largest loads besides; looked at
        further."""
        same, self.share = share == self.share, share
        begin("comparing sets of effects" + (f", to {100 * share:.2g} % of the largest loads" if share else ""))
        whole = self._whole(before.best)
        self.noise = self.prepared.noise(whole, self.noise.scatter)
        self.even = self.even or self.far_off(replace(before.best, fit=whole))
        now = self.anew(before, share, same)
        if not share and not self.adequate(now):
            # Under a little doubt none of these sets was adequate, and hardly one is next to them.
            now.expand(now.best)
            if not self.adequate(now):
                return now
        if self.scouting or not self.scouted:
            beam, most = BEAM, MOST_EXPANDED
        else:
            # All rows judge what some of them found; of models that are all wrong they find nothing new.
            beam, most = 1, 1 if share or self.lacks(now.best) else MOST_EXPANDED
        now.explore(self.told, beam, most)
        if not share and not self.lacks(now.best):
            now = self.as_left(now)
            # What is claimed is what all sets share that are as good: where something may be, these are asked too.
            now.explore(self.told, beam, MOST_EXPANDED, RIVALS)
        return now

    def as_left(self, now: Hypotheses) -> Hypotheses:
        """The sets under a noise no less than what the best of them leaves, of which nothing is systematic: where every
        row is a state of its own, smooth shapes take a part of the noise for theirs, and chance passes for an effect.
        """
        free = self.rows.readings.count - len(now.best.fit.vector)
        times = math.sqrt(now.best.fit.chi2 / max(free, 1))
        if times <= CONSISTENT:
            return now
        self.noise = replace(self.noise, scatter=self.noise.scatter.wider(times))
        return self.anew(now, 0.0, same=True)

    def anew(self, before: Hypotheses, share: float, same: bool) -> Hypotheses:
        """The sets that are worth keeping, fitted under the noise as it is now. same: whether it is hardly another
        one, under which nothing else stands in for what does not any more."""
        now = before.under(self._whitener(share), self.rows, before.worth_keeping(REFITTED), self.about(before.best))
        if same:
            now.exchanged = set(before.exchanged)
        return now

    def ended(self, last: Hypotheses, share: float) -> Explored:
        """The sets on all rows. share: by which the best one is wrong in every reading; less, where a better one is
        found."""
        if not self.scouting and share == self.share:
            return Explored(last, self.noise, share, self._whitener(share))
        self.some, self.rows, self.scouting = None, self.prepared.rows, False
        now = self.moved(last, share)
        for _ in range(SETTLINGS if share else 0):
            if (right := self.right(now)) is not None:
                return self.settled(right)
            left = self.wrong_by(now.best)
            if left > SETTLED * share:
                break
            share, now = left, self.moved(now, left)
        if self.share != share:
            now = self.moved(now, share)
        return Explored(now, self.noise, share, self._whitener(share))

    def usual(self, known: Explored) -> Explored:
        """Where many effects together, or none, were the answer: looked at also from what goes wrong most often, all of
        it at once, which no path of single effects leads to."""
        now = known.hypotheses
        before = now.best
        if not known.share and len(before.effects) <= MANY:
            return known
        begin("looking from zeros and tolerances")
        about = held_where_measured(before.fit, now.rows)
        glance = now if about is None else now.under(now.whiten, now.rows, [before], about)
        for kind in (ZEROS, TOLERANCES):
            if effects := [name for name in kind if name in now.library]:
                glance.descend(effects)
        now.fits([Asked(glance.best.effects, glance.best.fit.vector, glance.best.fit)])
        if now.best.evidence < before.evidence + TIES:
            return known
        now.explore(self.told, BEAM)
        return self.lowered(now, known.share) if known.share else self.settled(now)

    def adequate(self, now: Hypotheses, times: float = 1.0) -> bool:
        """Whether the best set is right, as far as the noise and the doubt that it is looked at under go, or so many
        times as far."""
        return now.best.fit.chi2 <= times * INADEQUATE * max(self.rows.readings.count, 1)

    def lacks(self, best: Hypothesis) -> bool:
        """Whether something systematic is left of the rows looked at: of such an answer nothing is claimed."""
        return structure(best.fit.residual, best.fit.jacobian, self.rows.states, self._whitener(0.0)).shows

    def left_in_all(self, best: Hypothesis) -> Structure:
        """What is left systematically of all rows, to which the set is fitted for that."""
        rows, whiten = self.prepared.rows, self.noise.whitener()
        fit = refitted(best.fit, rows, whiten, roughly=True)
        return structure(fit.residual, fit.jacobian, rows.states, whiten)

    def chi2(self, best: Hypothesis) -> float:
        """χ² per reading of a set's model under the noise alone, on the rows looked at."""
        white = self._whitener(0.0)(self._seen(best))
        return float(white.square().sum()) / max(self.rows.readings.count, 1)

    def far_off(self, best: Hypothesis) -> bool:
        """Whether a set leaves so much that what stands out is its own misfit, rather than noise."""
        return self.chi2(best) > HARDLY or self.misfit(best) > WORSE * self.floor(even=False)

    def wrong_by(self, best: Hypothesis) -> float:
        """The share of the largest loads by which a set is wrong beside what measuring makes."""
        left = self.misfit(best)
        # How much of the misfit is noise is not known to the last digit.
        return max(math.sqrt(max(left**2 - self.floor(self.even) ** 2, 0.0)), LEAST_WRONG * left)

    def floor(self, even: bool) -> float:
        """What the noise leaves of a right model on the rows looked at, as a share of the largest loads; even: without
        places that were elsewhere."""
        whiten = self.noise.whitener(None, self.some, even)
        return noise_floor(whiten.own.square(), whiten.right, self.scale) if even else whiten.found_floor(self.scale)

    def misfit(self, best: Hypothesis) -> float:
        """The error of the best set on the rows looked at, as a share of the largest loads; readings that slipped do
        not count."""
        return relative_error((self._seen(best) / self.scale).square(), self._whitener(0.0).right)

    def _seen(self, best: Hypothesis) -> Tensor:
        """Residuals of the rows looked at, of a fit to these or to all."""
        raw = best.fit.raw_residual
        return raw if self.some is None or len(raw) == len(self.rows) else raw[self.some]

    def _whitener(self, share: float) -> Whitener:
        return self.noise.whitener(share * self.scale if share else None, self.some, bool(share) and self.even)

    def _whole(self, best: Hypothesis) -> WhiteFit:
        """The set's model on all rows."""
        if len(best.fit.raw_residual) == len(self.prepared.rows):
            return best.fit
        return evaluated(best.fit.model, self.prepared.rows, best.fit.vector)


def scouted(rows: Rows) -> Tensor | None:
    """Numbers of the rows to look at first, (n,) int64; None for all. Of each kinematic state some, evenly over it."""
    if len(rows) <= SCOUTED:
        return None
    every = -(-len(rows) // SCOUTED)
    state = torch.as_tensor(rows.state)
    first = torch.cat([torch.ones(1, dtype=torch.bool), state[1:] != state[:-1]])
    visit = torch.cumsum(first, 0) - 1
    begun = torch.nonzero(first)[:, 0]
    place = torch.arange(len(rows)) - begun[visit]
    # Each state begins at another of its rows, so that together they have all steps of the pressure.
    return torch.nonzero((place + visit) % every == 0)[:, 0]


def held_where_measured(fit: WhiteFit, rows: Rows) -> Near | None:
    """Under a dead load what makes of each evaluation one step from where the actuator was seen to rest (where the fit
    rests, of what was not measured); None on other beds."""
    if rows.states.bed is not DEAD_LOAD:
        return None
    readings, values = rows.readings, {name: value.detach() for name, value in fit.model.physical(fit.vector).items()}
    place = readings.value
    if not bool(readings.present.all()):
        with torch.no_grad():
            rest = fit.model(rows.states, values)
        known = torch.where((rest.status == Status.OK)[:, None], rest.loads, 0.0)
        place = torch.where(readings.present, place, known)
    return Near({PLACE: place + torch.stack([rows.states.reference_length, 0 * rows.states.twist], dim=-1)})


def _steady(before: Scatter, now: Scatter) -> bool:
    sizes = [(float(a), float(b)) for a, b in zip(before.deviations, now.deviations, strict=True)]
    sizes.append((before.position, now.position))
    return all(abs(math.log(b / a)) < STEADY for a, b in sizes if a > 0 and b > 0)
