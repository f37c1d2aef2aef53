"""`completion`: commands and options in the shell, at the tab key."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import yaml

from freelearn.cli.command_names import COMMANDS
from freelearn.common.package import CONF

SHELLS = ("bash", "zsh", "fish")
USAGE = """usage: freelearn completion bash|zsh|fish
  bash:  eval "$(freelearn completion bash)"      in ~/.bashrc
  zsh:   eval "$(freelearn completion zsh)"       in ~/.zshrc, below compinit
  fish:  freelearn completion fish | source       in ~/.config/fish/config.fish"""


def main() -> None:
    """Prints the script of a shell."""
    words = sys.argv[1:]
    if words in (["--help"], ["-h"]):
        print(USAGE)
        return
    if len(words) != 1 or words[0] not in SHELLS:
        sys.exit(f"error: name one shell.\n{USAGE}")
    print(script(words[0], sorted(COMMANDS)))


def script(shell: str, commands: Iterable[str]) -> str:
    """What a shell is to read."""
    names = list(commands)
    options = {name: options_of(name) for name in names}
    if shell == "fish":
        first = f"complete -c freelearn -f -n __fish_use_subcommand -a '{' '.join(names)}'"
        rest = [
            f"complete -c freelearn -n '__fish_seen_subcommand_from {name}' -a '{' '.join(words)}'"
            for name, words in options.items()
            if words
        ]
        return "\n".join([first, *rest])
    cases = [f'    {name}) words="{" ".join(words)}" ;;' for name, words in options.items() if words]
    head = ["autoload -U +X bashcompinit && bashcompinit"] if shell == "zsh" else []
    return "\n".join([
        *head,
        "_freelearn() {",
        '  local line="${COMP_LINE:0:COMP_POINT}" words=""',
        '  local current="${line##* }"',
        # bash takes the = for a word of its own, and wants what is behind it alone.
        '  local before=""; [[ "$current" == *=* && "$COMP_WORDBREAKS" == *=* ]] && before="${current%%=*}="',
        '  if [ "$COMP_CWORD" -eq 1 ]; then',
        f'    COMPREPLY=($(compgen -W "{" ".join(names)}" -- "$current")); return',
        "  fi",
        '  case "${COMP_WORDS[1]}" in',
        *cases,
        "  esac",
        '  COMPREPLY=($(compgen -W "$words" -- "$current"))',
        '  COMPREPLY=("${COMPREPLY[@]#$before}")',
        "}",
        "complete -o default -o nospace -F _freelearn freelearn",
    ])  # fmt: skip


def options_of(command: str) -> list[str]:
    """The words that a command takes, as its configuration has them."""
    path = CONF / f"{command}.yaml"
    if not path.is_file():
        return ["--help"]
    content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    words = ["--help", "hydra.run.dir="]
    for name, value in content.items():
        if name in ("defaults", "hydra"):
            continue
        words += [f"{name}.{inner}=" for inner in value] if isinstance(value, dict) and value else [f"{name}="]
    for group in _groups(content.get("defaults") or []):
        words += [f"{group}={file.stem}" for file in sorted(Path(CONF / group).glob("*.yaml"))]
    return list(dict.fromkeys(words))


def _groups(defaults: list[object]) -> list[str]:
    """Names of the groups of files that a configuration chooses from."""
    keys = [str(key) for entry in defaults if isinstance(entry, dict) for key in entry]
    names = [key.split("@")[0].split()[-1].lstrip("/") for key in keys]
    return [name for name in names if (CONF / name).is_dir()]
