"""The discovery as it happens: a table whose error falls towards the noise floor, then the verdict."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.live import Live
from rich.table import Table

from freelearn.inference.step import Step
from freelearn.inference.thresholds import LEFT
from freelearn.results.discovery import stderr, verdict_in_words

if TYPE_CHECKING:
    from freelearn.results.discovery import Discovery

SHOWN = 5


class DiscoveryView:
    """Prints a discovery. As a context manager it keeps the table of steps up to date while the search runs."""

    def __init__(self, console: Console, what: str, simulated: bool) -> None:
        self.console = console
        source = "simulated data" if simulated else "measured data"
        self.table = Table(title=f"{what} ({source})", title_justify="left")
        for heading in ("step", "fitted %", "held-out %", "floor %", "left"):
            words = heading == "step"
            # Numbers are never cut short: long names are.
            self.table.add_column(
                heading, justify="left" if words else "right", no_wrap=not words, min_width=None if words else 8
            )
        self.live = Live(self.table, console=console, auto_refresh=False)

    def __enter__(self) -> DiscoveryView:
        self.live.start()
        return self

    def __exit__(self, *_: Any) -> None:
        self.live.stop()

    def step(self, step: Step, text: str) -> None:
        left = "nothing" if step.left.p_value >= LEFT else "structure"
        floor = f"{100 * step.floor:.3f}"
        self.table.add_row(text, f"{100 * step.E_train:.3f}", f"{100 * step.E_heldout:.3f}", floor, left)
        self.live.refresh()

    def end(self, discovery: Discovery, folder: Path) -> None:
        def say(text: str) -> None:
            self.console.print(text, markup=False, highlight=False)

        findings = discovery.findings
        say("\nWhere the model failed at first:")
        for failure in discovery.failed[:3]:
            say(f"  · {failure.sentence()}")
        for screen in discovery.screens:
            say(f"  · {screen.name}: {screen.says}")
        self._ranking(findings.steps[0])
        if findings.final.effects:
            self._parameters(findings.final)
        say(verdict_in_words(findings))
        for proposal in discovery.proposed[:SHOWN]:
            one, other = proposal.separates
            say(
                f"  → measure sample {proposal.sample} at {proposal.elongation_mm:+.3g} mm, "
                f"{proposal.twist_deg:+.4g}°, {proposal.pressure_kpa:.3g} kPa: "
                f"splits {one} from {other} by {proposal.expected_z:.1f} σ"
            )
        if discovery.left:
            say(
                f"  what is left is {100 * discovery.left.share:.0f} % systematic; hint (not a finding): "
                f"{discovery.left.hint} explains {100 * discovery.left.hint_share:.0f} % of it"
            )
        for note in [*discovery.notes, *([discovery.content["heldout_is"]] if findings.effects else [])]:
            say(f"! {note}")
        self.console.print(f"files: {folder}", markup=False, highlight=False, soft_wrap=True)

    def _ranking(self, step: Step) -> None:
        scores = {c["effect"]: c["score"] or 0.0 for c in step.candidates}
        tested = [c for c in step.candidates if c["status"] == "tested"]
        tested.sort(key=lambda c: -scores[c["effect"]])
        table = Table(title="effects that would explain it, before any was added", title_justify="left")
        for heading in ("effect", "size σ", "p by chance", "E held-out %"):
            table.add_column(heading, justify="left" if heading == "effect" else "right")
        for c in tested[:SHOWN]:
            error = f"{100 * c['E_heldout']:.3f}" if c["E_heldout"] is not None else "–"
            table.add_row(c["effect"], f"{max(scores[c['effect']], 0.0) ** 0.5:.1f}", f"{c['p_value']:.3f}", error)
        self.console.print(table)

    def _parameters(self, step: Step) -> None:
        table = Table(title="parameters with the effects added", title_justify="left")
        for heading in ("parameter", "value", "± stderr", "unit"):
            table.add_column(heading, justify="left" if heading in ("parameter", "unit") else "right")
        errors = stderr(step)
        for name, value in step.fit.values().items():
            table.add_row(name, f"{value:.6g}", f"{errors[name]:.2g}", step.fit.model.declared[name].unit)
        self.console.print(table)
