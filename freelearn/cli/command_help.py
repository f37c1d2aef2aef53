"""What a command's --help says: every choice with its meaning, from the comments of the configuration files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from freelearn.common.package import CONF

# A setting in a configuration file: its name, its value, and what is said behind it.
SETTING = re.compile(r"^(?P<inside>  )?(?P<name>\w+):(?: (?P<value>.*?))??(?:\s+# (?P<means>.*))?$")
# The widest column of names.
NAMES = 30


@dataclass(frozen=True)
class Setting:
    """name=value, and what the value means; lines as they are written."""

    name: str
    value: str
    means: str


@dataclass(frozen=True)
class Group:
    """Files to choose from, the one that is chosen first; what each is, and the settings that come with it."""

    name: str
    chosen: str
    choices: dict[str, str]
    settings: dict[str, list[Setting]]


def show_help(name: str, console: Console) -> None:
    """Prints it: how the command is called, its settings, its choices, and the effects that there are."""
    path = CONF / f"{name}.yaml"
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    about = content["hydra"]["help"]
    console.print(about["header"], highlight=False)
    _heading(console, "For example")
    for line in about["template"].splitlines():
        console.print(Text(f"  {line}", no_wrap=True, overflow="ignore"), crop=False)
    _heading(console, "Settings, as name=value; the value that stands here is the default")
    console.print(_table(settings_of(path)))
    for group in groups_of(content):
        _heading(console, f"{group.name}={group.chosen}, or another:")
        # What several choices have in common is told with the first.
        told_already: set[tuple[str, str]] = set()
        for choice in sorted(group.choices, key=lambda c: (c != group.chosen, c)):
            console.print(_table([Setting(f"{group.name}={choice}", "", group.choices[choice])]))
            own = [s for s in group.settings[choice] if (s.name, s.means) not in told_already]
            told_already |= {(s.name, s.means) for s in own}
            console.print(Padding(_table(own, f"{group.name}."), (0, 0, 0, 4)))
    if "effects" in content:
        _heading(console, "effects, and those of your own in the files that FREELEARN_EFFECTS names")
        # torch is imported with them.
        from freelearn.physics.effects.registry import EFFECTS

        console.print(Padding(", ".join(EFFECTS), (0, 0, 0, 2)), highlight=False)
        console.print("\nWhat each is: docs/effects.md.", highlight=False)
    sweeps = "-m sweeps over values with commas; " if "sweep" in content["hydra"] else ""
    console.print(f"\nAlso: {sweeps}hydra.run.dir=FOLDER says where to write.", highlight=False)


def settings_of(path: Path) -> list[Setting]:
    """Of one file, without Hydra's own and without those of other files, but with the accuracy's."""
    text = path.read_text(encoding="utf-8")
    content: dict[str, Any] = yaml.safe_load(text) or {}
    found, comment, before = list[Setting](), list[str](), ""
    for line in text.splitlines():
        if line.strip().startswith("# "):
            comment.append(line.strip()[2:])
            continue
        match = SETTING.match(line)
        if match and not match["inside"]:
            before = match["name"] if isinstance(content[match["name"]], dict) else ""
        if match and (before if match["inside"] else match["name"]) not in ("", "defaults", "hydra", "name"):
            name = f"{before}.{match['name']}" if match["inside"] else match["name"]
            value = "" if not match["inside"] and content[name] == {} else (match["value"] or "").strip()
            means = [*comment, *([match["means"]] if match["means"] else [])]
            if value or means:
                found.append(Setting(name, "" if value == "???" else value, _joined(means)))
        comment = []
    for entry in content.get("defaults", []):
        if isinstance(entry, dict) and "/accuracy@accuracy" in entry:
            of = settings_of(CONF / "accuracy" / f"{entry['/accuracy@accuracy']}.yaml")
            found += [Setting(f"accuracy.{s.name}", s.value, s.means) for s in of]
    return found


def _joined(lines: list[str]) -> str:
    """Lines of one sentence as one line; lists keep theirs."""
    text = ""
    for line in lines:
        text += f"\n{line}" if line.startswith(" ") else f" {line}"
    return text.strip()


def groups_of(content: dict[str, Any]) -> Iterator[Group]:
    """The groups of files that a command's file chooses from."""
    for entry in content.get("defaults", []):
        if not isinstance(entry, dict):
            continue
        ((name, chosen),) = entry.items()
        folder = CONF / str(name)
        if not folder.is_dir() or " " in str(name):
            continue
        files = sorted(folder.glob("*.yaml"))
        yield Group(
            str(name),
            str(chosen or "none"),
            {path.stem: meaning(path) for path in files},
            {path.stem: settings_of(path) if name != "experiment" else [] for path in files},
        )


def meaning(path: Path) -> str:
    """What a file is chosen for: the comment behind its name, or those at its beginning."""
    lines = path.read_text(encoding="utf-8").splitlines()
    behind = [match["means"] for match in map(SETTING.match, lines) if match and match["name"] == "name"]
    if behind and behind[0]:
        return str(behind[0])
    first = []
    for line in lines:
        if not line.startswith("# "):
            break
        if not line.startswith("# @"):
            first.append(line[2:])
    return _joined(first)


def _heading(console: Console, text: str) -> None:
    console.print(f"\n{text}", style="bold", highlight=False)


def _table(settings: list[Setting], before: str = "") -> Table:
    table = Table.grid(padding=(0, 2), expand=False)
    table.add_column(no_wrap=True, min_width=NAMES)
    table.add_column()
    for setting in settings:
        name = f"{before}{setting.name}" + (f"={setting.value}" if setting.value else "")
        table.add_row(Text(f"  {name}"), Text(setting.means))
    return table
