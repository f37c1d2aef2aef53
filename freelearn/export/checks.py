"""Each exported function beside the fitted model: answers, derivatives, bands, flags, what is handed on, pressures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch

from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions, View
from freelearn.export.along import Along, Follow, Followed
from freelearn.export.arithmetic.function import Function
from freelearn.export.round_trip import ON_EDGE, STATES, Answers, Reference, Samples, Written
from freelearn.physics.chain.prediction import Status

# A pressure may be so much larger than the one that is known to do: both are, where two are one.
LESS = 1e-6
# What an input is taken to go through that was never varied, SI.
UNVARIED = {"elongation": 1e-2, "twist": 1.0}
# Share of the states at which a search through the pressures may miss the least, or all, where two are close together.
SEARCHED = {"found": 1e-3, "least": 1e-3}
# Flags, which are right or wrong.
FLAGS = ("status", "inside")


@dataclass(frozen=True)
class Check:
    """A function at so many states. largest: difference of each output as a share of its range (of the answers), or of
    its largest amount (of all else); of pressures what they leave of what is wanted. ranges: these, SI. wrong: how many
    states' flags differ, by name. limit: allowed. worst: the state of the largest. shares (n, outputs)."""

    function: str
    states: int
    on_edge: int
    settled: int
    largest: dict[str, float]
    ranges: dict[str, float]
    wrong: dict[str, int]
    limit: float
    worst: dict[str, float]
    shares: np.ndarray

    @property
    def held(self) -> bool:
        """Whether all is as it should be."""
        missed = {n: SEARCHED.get(n, 0.0) * self.states for n in self.wrong}
        right = all(count <= missed[n] for n, count in self.wrong.items())
        return right and max(self.largest.values(), default=0.0) <= self.limit

    @property
    def plain(self) -> dict[str, Any]:
        """For export.json."""
        told = ("states", "on_edge", "settled", "ranges", "limit", "held")
        finite = {n: v if np.isfinite(v) else -1.0 for n, v in self.largest.items()}
        own = {n: getattr(self, n) for n in told}
        return {"largest_difference": finite, "worst_state": self.worst, "flags_that_differ": self.wrong, **own}


@dataclass(frozen=True)
class Checks:
    """every: by function, what is asked first at the head. outside: states beyond the data; flagged: the share of them
    that was told as such."""

    every: dict[str, Check]
    outside: int
    flagged: float

    @property
    def first(self) -> Check:
        """Of what is asked first."""
        return next(iter(self.every.values()))

    @property
    def held(self) -> bool:
        """Whether all hold."""
        return all(check.held for check in self.every.values()) and self.flagged == 1.0


def checked(functions: Functions, written: Written) -> Checks:
    """Every function that was written and can be run here."""
    every, flags = dict[str, Check](), list[np.ndarray]()
    if functions.step and written.follow:
        every[functions.step.name], far = _along(functions.actuator, functions.step, written.follow, written.limit)
        flags.append(far)
    for view in functions.views:
        trip = _Trip(view)
        for f in view.parts:
            if f.name in written.answers:
                every[f.name] = trip.checked(f, written)
                place = [p.name for p in f.outputs].index("inside")
                flags.append(written.answers[f.name](trip.samples.outside)[:, place] == 0)
        if view is functions.loads:
            for f in functions.inverses if any(f.name in written.answers for f in functions.inverses) else []:
                every[f.name], far = trip.inverted(f, written.answers[f.name], written.limit)
                flags.append(far)
    each = np.concatenate(flags)
    return Checks(every, len(each), float(each.mean()))


def _along(actuator: Actuator, step: Function, follow: Follow, limit: float) -> tuple[Check, np.ndarray]:
    """What is answered along recordings, and whether what lies beyond the data was flagged."""
    along, place = Along(actuator, step), {p.name: i for i, p in enumerate(step.answered)}
    got, x = np.concatenate(follow(along.recordings)), np.concatenate([r.inputs for r in along.recordings])
    want = {n: np.concatenate([w[n] for w in along.wanted]) for n in place}
    settled, reached = np.concatenate(along.settled), np.concatenate(along.reached)
    shares, ranges, wrong = dict[str, np.ndarray](), dict[str, float](), dict[str, int]()
    for name, i in place.items():
        if name in FLAGS:
            told = reached if name == "status" else settled
            wrong[name] = int((got[told, i] != want[name][told]).sum())
            continue
        ranges[name] = _span(want[name][settled])
        shares[name] = _shares(got[settled, i], want[name][settled], ranges[name])
    found = _check(step.name, [p.name for p in step.given], x, settled, 0, shares, ranges, wrong, limit)
    far = Samples.from_actuator(actuator, [p.name for p in actuator.imposed]).outside
    first = [Followed(row[None], np.zeros(1), np.zeros(step.carried)) for row in far]
    return found, np.concatenate(follow(first))[:, place["inside"]] == 0


@dataclass(frozen=True)
class _Trip:
    view: View

    @property
    def actuator(self) -> Actuator:
        return self.view.actuator

    @cached_property
    def names(self) -> list[str]:
        return [p.name for p in self.view.inputs]

    @cached_property
    def samples(self) -> Samples:
        return Samples.from_actuator(self.actuator, self.names)

    @cached_property
    def reference(self) -> Reference:
        return Reference(self.actuator, self.samples.inside, self.names)

    @cached_property
    def settled(self) -> np.ndarray:
        y, status = self.reference.answered
        there: np.ndarray = (status != int(Status.NO_EQUILIBRIUM)) & np.isfinite(y).all(1)
        return there

    def checked(self, f: Function, written: Written) -> Check:
        got, want = written.answers[f.name](self.samples.inside), self.reference.outputs
        if written.boxed:
            want = want | {"inside": self.actuator.inside(self.reference.x).numpy()}
        shares, ranges, wrong = dict[str, np.ndarray](), dict[str, float](), dict[str, int]()
        answered = [p.name for p in self.actuator.answered]
        for i, port in enumerate(f.outputs):
            if port.name in FLAGS:
                told = np.ones(len(got), dtype=bool) if port.name == "status" else self.settled
                wrong[port.name] = int((got[told, i] != want[port.name][told]).sum())
                continue
            mine, model = got[self.settled, i], want[port.name][self.settled]
            size = _span(model) if port.name in answered else self._size(port.name)
            shares[port.name], ranges[port.name] = _shares(mine, model, size), size
        return self._check(f.name, shares, ranges, wrong, written.limit)

    def inverted(self, f: Function, answers: Answers, limit: float) -> tuple[Check, np.ndarray]:
        """Pressures for what the model answers at pressures that are known: what they leave of it, by the model's own
        searches. Also whether what lies beyond the data was flagged."""
        imposed, given = len(self.actuator.imposed), [p.name for p in f.inputs]
        wanted = [n for n in given if n in (p.name for p in self.actuator.answered)]
        at = {n: i for i, n in enumerate(self.names)}

        def asked(x: np.ndarray, y: dict[str, np.ndarray]) -> np.ndarray:
            return np.stack([y[n] if n in wanted else x[:, at[n]] for n in given], axis=1)

        known = self.samples.inside
        out = answers(asked(known, self.reference.outputs))
        place = {p.name: i for i, p in enumerate(f.outputs)}
        pressures = [place[p.name] for p in self.actuator.imposed[2:]]
        there = known.copy()
        there[:, 2:imposed] = out[:, pressures]
        again = Reference(self.actuator, there, self.names)
        found = out[:, place["found"]] == 1
        told = self.settled & found
        shares, ranges = dict[str, np.ndarray](), dict[str, float]()
        for name in wanted:
            ranges[name] = _span(self.reference.outputs[name][self.settled])
            left = _shares(again.outputs[name], self.reference.outputs[name], ranges[name])
            shares[name] = np.where(told, left, 0.0)[self.settled]
        size = np.ptp(torch.stack(self.actuator.span.looked)[:, 2:].numpy(), axis=0)
        bands = {n: i for n, i in place.items() if n.endswith("_half_band")}
        if bands:
            # A band that is wider than all pressures tells nothing more.
            own = np.minimum(self._bands(again, wanted), size)
            for k, (name, i) in enumerate(bands.items()):
                ranges[name] = _most(own[told, k])
                left = _shares(np.minimum(out[:, i], size[k]), own[:, k], ranges[name])
                shares[name] = np.where(told, left, 0.0)[self.settled]
        least = [np.square(x[:, 2:imposed] / size).sum(1) for x in (there, known)]
        inside, plain = out[:, place["inside"]], self.reference.answered[1] == int(Status.OK)
        wrong = {
            "found": int((self.settled & ~found & plain).sum()),
            "least": int((told & (least[0] > least[1] + LESS)).sum()),
            "inside": int((inside != again.outputs["inside"])[told].sum()),
        }
        # Beyond the data by the place alone: by its pressure a question cannot be.
        low, high = (edge[:2].numpy() for edge in self.actuator.edges)
        far = self.samples.outside
        place_of = far[:, :2] + self.actuator.rest[:2].numpy()
        far = far[((place_of < low) | (place_of > high)).any(1)]
        middle = {n: np.full(len(far), np.median(self.reference.outputs[n][self.settled])) for n in wanted}
        flagged = answers(asked(far, middle))[:, place["inside"]] == 0
        return self._check(f.name, shares, ranges, wrong, limit), flagged

    def _size(self, output: str) -> float:
        """The largest amount of a derivative or a band; of derivatives also what the other inputs make of the answer,
        for one that is none anywhere is nothing to measure by."""
        want = self.reference.outputs
        largest = _most(want[output][self.settled])
        if not output.startswith("d_"):
            return largest
        answer, by = output[2:].split("_by_")
        span = {p.name: (high - low) or UNVARIED.get(p.name, 1.0)
                for p, (low, high) in zip(self.actuator.imposed, self.actuator.domain, strict=True)}  # fmt: skip
        made = [_most(want[f"d_{answer}_by_{n}"][self.settled]) * span[n] for n in span]
        return max(largest, max(made) / span[by])

    def _bands(self, at: Reference, wanted: list[str]) -> np.ndarray:
        bands, fitted = self.actuator.fitted.bands, self.actuator.fitted
        assert bands is not None
        readings = [p.name for p in self.actuator.answered]
        given = [self.actuator.shown[readings.index(n)] for n in wanted]
        asked = range(2, len(self.actuator.imposed))
        half = bands.miss.half_width(at.system, at.x, at.system.slopes(at.x)[1], asked, given, fitted.asker.scale)[0]
        found: np.ndarray = half.numpy()
        return found

    def _check(
        self, name: str, shares: dict[str, np.ndarray], ranges: dict[str, float], wrong: dict[str, int], limit: float
    ) -> Check:
        x = self.samples.inside
        return _check(name, self.names, x, self.settled, len(x) * ON_EDGE // STATES, shares, ranges, wrong, limit)


def _check(
    name: str,
    names: list[str],
    x: np.ndarray,
    settled: np.ndarray,
    on_edge: int,
    shares: dict[str, np.ndarray],
    ranges: dict[str, float],
    wrong: dict[str, int],
    limit: float,
) -> Check:
    """names: of the inputs x (n, k). settled: (n,) bool. shares: of the settled states, by output."""
    every = np.stack(list(shares.values()), axis=1)
    worst = x[settled][every.max(1).argmax()].tolist() if len(every) else []
    return Check(
        function=name,
        states=len(x),
        on_edge=on_edge,
        settled=int(settled.sum()),
        largest={n: float(v.max(initial=0.0)) for n, v in shares.items()},
        ranges=ranges,
        wrong=wrong,
        limit=limit,
        worst=dict(zip(names, worst, strict=False)),
        shares=every,
    )


def _span(values: np.ndarray) -> float:
    return float(np.ptp(values)) if len(values) else 0.0


def _most(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max(initial=0.0))


def _shares(got: np.ndarray, want: np.ndarray, size: float) -> np.ndarray:
    """Differences as shares of a size; what is a number on one side alone is as far off as can be."""
    with np.errstate(invalid="ignore"):
        off = np.abs(got - want) / (size or 1.0)
    same = (np.isnan(got) & np.isnan(want)) | (got == want)
    return np.where(same, 0.0, np.where(np.isnan(off), np.inf, off))
