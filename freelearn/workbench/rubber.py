"""The rubber alone, fitted to sheets of its own tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import panel as pn

from freelearn.workbench.aside import Aside
from freelearn.workbench.controls import Dropper
from freelearn.workbench.session import Session
from freelearn.workbench.words import say, words

MODES = {"UT": "uniaxial tension", "ET": "equibiaxial tension", "PS": "pure shear"}
ABOUT = (
    "Tests of rubber alone, one sheet (CSV: stretch, stress_mpa) for each way of loading. A model of an actuator can "
    "take over what comes out, as its constituent."
)
ENERGIES = (
    "limited_extensibility",
    "second_invariant",
    "second_invariant_log",
    "small_strain_stiffness",
    "wall_stiffening",
)


class Rubber(Aside):
    """A place for each sheet, and the energies that the rubber may have besides the neo-Hookean."""

    kind, file, title = "rubber", "specimen.json", "Rubber alone"
    first = "Drop a sheet first."

    def __init__(self, session: Session) -> None:
        super().__init__(session, "Fit the rubber")
        latest = session.asides.get(self.kind)
        self.sheets: dict[str, str] = dict(latest["question"].sheets) if latest else {}
        about, self.given = words(), words()
        say(about, [ABOUT], "quiet")
        places = []
        for mode, name in MODES.items():
            label, place = words(), Dropper(200, self._taker(mode))
            place.visible = True
            say(label, [name], "quiet")
            places.append(pn.Column(label, place, width=220))
        self.effects = pn.widgets.CheckBoxGroup(name="energies", options=list(ENERGIES))
        self.effects.param.update(value=list(latest["question"].effects) if latest else [])
        self.picture = pn.pane.PNG(
            None,
            max_width=760,
            sizing_mode="scale_width",
            visible=False,
            alt_text="Stress against stretch, measured and fitted",
        )
        self.asking.objects = [about, pn.FlexBox(*places), self.given, self.effects]
        self.view.insert(-1, self.picture)

    def _taker(self, mode: str) -> Callable[[str, bytes], None]:
        """What takes in the sheet of one way of loading."""

        def take(name: str, content: bytes) -> None:
            self.sheets[mode] = self.session.stored(content, f"rubber_{mode}")
            self.refresh()

        return take

    @property
    def possible(self) -> bool:
        """Whether there is a sheet."""
        return bool(self.sheets)

    def asked(self) -> None:
        """Fits the sheets."""
        self.session.fit_rubber(self.sheets, self.effects.value)

    def refresh(self) -> None:
        """Shows the session as it is."""
        there = ", ".join(MODES[mode] for mode in MODES if mode in self.sheets)
        say(self.given, [f"There: {there}. Another sheet takes the place of one."] if there else [], "quiet")
        super().refresh()

    def _show(self, run: str, folder: Path) -> None:
        path, text = folder / self.file, folder / "rubber.txt"
        if not (path.exists() and text.exists()):
            say(self.said, [f"{path} is gone: fit again."], "bad")
            return
        lines = text.read_text(encoding="utf-8").splitlines()
        told = [line.rstrip() for line in lines if not line.startswith("files: ")]
        say(self.answer, ["\n".join(told).strip()], code=True)
        self.picture.param.update(object=str(folder / "curves.png"), visible=True)
        self.save.param.update(file=str(path), visible=True)
