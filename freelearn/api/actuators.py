"""Identified actuators: those that the package ships, those of installed libraries, and folders that others
published."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from freelearn.common.errors import UserError, unknown
from freelearn.common.files import write_text

if TYPE_CHECKING:
    from freelearn.api.fitted_run import FittedRun
    from freelearn.export.certificate import Certificate

SHIPPED = Path(__file__).resolve().parents[1] / "examples" / "actuators"
# The entry points by which an installed package says that actuators lie in it: name = "package".
LIBRARIES = "freelearn.actuators"
CARD, REFEREE = "actuator.json", "referee.json"
# Without these nobody knows what it is.
NEEDED = ("title", "source", "license")
# What a published folder holds of a run.
RUN_FILES = ("predictions.csv", "checkpoint.ckpt")


@dataclass(frozen=True)
class IdentifiedActuator:
    """A fitted actuator with what is told of it. folder: of its run, with actuator.json. card: that file's content:
    title, source and license, whatever else its maker tells, and the referee's line."""

    name: str
    folder: Path
    card: Mapping[str, Any]

    @classmethod
    def open(cls, folder: str | Path) -> IdentifiedActuator:
        """A published folder. Raises UserError."""
        folder = Path(folder)
        try:
            card = json.loads((folder / CARD).read_text(encoding="utf-8"))
            lacking = [key for key in NEEDED if not isinstance(card[key], str)]
        except (OSError, ValueError, KeyError, TypeError) as problem:
            raise UserError(f"{folder} holds no published actuator ({CARD}: {problem}).") from None
        if lacking:
            raise UserError(f"{folder / CARD} must tell {', '.join(lacking)} in words.")
        return cls(folder.name, folder, card)

    def load(self) -> FittedRun:
        """Its fitted model: `predict`, `invert`, `frame()` and so on."""
        from freelearn.api.fitted_run import FittedRun

        return FittedRun.from_folder(self.folder)

    def export(self, path: str | Path, to: str | None = None, **options: Any) -> Certificate:
        """As FittedRun.export, under its own name and with the license of its data."""
        from freelearn.export.export_options import FORMATS

        given = {"name": self.name, "license": str(self.card["license"])}
        # A format alone: into a folder of its name.
        if to is None and str(path) in FORMATS:
            path, to = Path(f"{self.name}_{path}"), str(path)
        if Path(path).suffix.lower() in FORMATS.values():
            del given["name"]
        return self.load().export(path, to, **given | options)

    def __repr__(self) -> str:
        return f"{self.name}: {self.card['title']} ({self.card['license']}), {self.folder}"

    def sheet(self) -> str:
        """Its data sheet: what the card tells, and the parameters."""
        told = [f"{key}: {value}" for key, value in self.card.items() if key != "title"]
        return "\n".join([f"{self.name}: {self.card['title']}", *told, self.load().summary()])


class Actuators(Mapping[str, IdentifiedActuator]):
    """By name: `fl.actuators["dmsp20"]`. Of installed libraries too."""

    def __getitem__(self, name: str) -> IdentifiedActuator:
        found = _folders()
        if name not in found:
            raise unknown("actuator", name, list(self))
        if len(found[name]) > 1:
            places = " and ".join(map(str, found[name]))
            raise UserError(f"The actuator {name} is in {places}: take one by fl.actuators.open(FOLDER).")
        return IdentifiedActuator.open(found[name][0])

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(_folders()))

    def __len__(self) -> int:
        return len(_folders())

    def __repr__(self) -> str:
        return f"fl.actuators: {', '.join(self)}"

    def open(self, folder: str | Path) -> IdentifiedActuator:
        """One that somebody published as a folder. Raises UserError."""
        return IdentifiedActuator.open(folder)

    def publish(
        self, run: FittedRun, folder: str | Path, *, title: str, source: str, license: str, **more: str
    ) -> Path:
        """Writes a run as a folder for others: its model and rows, actuator.json and a certificate, and no path of this
        machine. title, source, license: in words; more: whatever else to tell. Raises UserError."""
        import shutil

        from freelearn.records.provenance import with_digests

        folder = Path(folder)
        if (folder / CARD).exists():
            raise UserError(f"{folder} holds a published actuator already: choose another folder, or delete it.")
        folder.mkdir(parents=True, exist_ok=True)
        for name in RUN_FILES:
            shutil.copyfile(run.folder / name, folder / name)
        content = {key: value for key, value in run.run.content.items() if key not in ("digest", "files")}
        if isinstance(content.get("data"), dict):
            kept = {key: value for key, value in content["data"].items() if key not in ("path", "members")}
            content["data"] = kept
        card = {"title": title, "source": source, "license": license, **more, "referee": _referee(run.folder)}
        run.export(folder, "c", name=folder.name, license=license)
        whole = with_digests(content, folder, RUN_FILES)
        write_text(folder / "results.json", json.dumps(whole, indent=1, ensure_ascii=False) + "\n")
        write_text(folder / CARD, json.dumps(card, indent=1, ensure_ascii=False) + "\n")
        return folder


def _folders() -> dict[str, list[Path]]:
    """Folders of actuators by their name: of this package, and of installed libraries."""
    found: dict[str, list[Path]] = {}
    for place in (SHIPPED, *_libraries()):
        for path in sorted(place.glob(f"*/{CARD}")):
            found.setdefault(path.parent.name, []).append(path.parent)
    return found


def _libraries() -> list[Path]:
    """Folders of the packages that say so. They are looked for and not imported: nothing in them runs."""
    names = sorted({point.value.partition(".")[0] for point in entry_points(group=LIBRARIES)})
    specs = [find_spec(name) for name in names]
    return [Path(place) for spec in specs if spec for place in spec.submodule_search_locations or ()]


def _referee(folder: Path) -> str:
    """The referee's line of a run: its failed checks, or that none failed."""
    try:
        checks = json.loads((folder / REFEREE).read_text(encoding="utf-8"))["checks"]
    except (OSError, ValueError, KeyError):
        return "not asked"
    failed = [c["says"] for c in checks if c["result"] == "fail"]
    return " ".join(failed) if failed else f"none of {len(checks)} checks failed"


actuators = Actuators()
