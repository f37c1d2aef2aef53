"""The table that intake made of a laboratory's file: what looks wrong in it, and what to take along."""

from __future__ import annotations

from pathlib import Path

import panel as pn

from freelearn.workbench.controls import download
from freelearn.workbench.session import Session
from freelearn.workbench.words import heading, say, words

# Five of them stand side by side.
WIDTH = 165


class Made:
    """Hidden where the table was given as it is."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.about, self.warnings, self.command = words(), words(), words()
        self.table, self.members = download("Table (CSV)", WIDTH), download("Actuators (CSV)", WIDTH)
        self.recipe, self.provenance = download("Recipe (YAML)", WIDTH), download("Provenance (JSON)", WIDTH)
        self.again = pn.widgets.Button(name="Change the columns", width=WIDTH)
        self.again.on_click(lambda _: self.session.map_columns(True))
        self.view = pn.Column(
            heading("The table that was made"), self.about, pn.Column(self.warnings, scroll=True, max_height=220),
            pn.FlexBox(self.table, self.members, self.recipe, self.provenance, self.again), self.command,
            visible=False,
        )  # fmt: skip

    def refresh(self) -> None:
        """Shows the session as it is."""
        made, table = self.session.made, self.session.table
        # Once rows are marked to be left out, the table is no longer the one that was made.
        self.view.visible = bool(made) and made["path"] == self.session.question.path and not self.session.mapping
        if not self.view.visible:
            return
        say(self.about, [f"Made of {made['name']}. From here on it is used as if it had been given."], "quiet")
        told = {*table.get("warnings", []), *table.get("unit_warnings", [])}
        say(self.warnings, [f"! {warning}" for warning in made["warnings"] if warning not in told])
        folder, stem = self.session.folder / made["folder"], Path(made["name"]).stem
        files = (
            (self.table, folder / "table.csv", f"{stem}_table.csv"),
            (self.members, folder / "table_members.csv", f"{stem}_table_members.csv"),
            (self.provenance, folder / "table_provenance.json", f"{stem}_table_provenance.json"),
            (self.recipe, Path(made["recipe"]), f"{stem}_recipe.yaml"),
        )
        for button, path, name in files:
            button.param.update(file=str(path), visible=button is not self.members or made["members"])
            # With the file comes its name: the user's own goes after it.
            button.filename = name
        self.again.disabled = self.session.busy
        say(self.command, [made["command"]], code=True)
