"""From a raw file to the report. What the file does not say is asked for, and kept as a recipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from freelearn.api.tasks.intake_task import actuators_of, asked_of, taken_in
from freelearn.api.tasks.rubber_intake import is_rubber_recipe, rubber_taken_in, same_names
from freelearn.cli.command_line import command_line, option, program
from freelearn.cli.intake_command import specimens_command, stem_of, table_options
from freelearn.cli.interview import ActuatorInterview, Ask, Interview, RubberInterview, WantedInterview
from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes, write_text
from freelearn.data.intake.guesses.guessed import Guess
from freelearn.data.intake.guesses.joined import DesignGuess, guess_and_table
from freelearn.data.intake.guesses.recordings_found import EVERY
from freelearn.data.intake.guesses.side_by_side import not_together, of_files
from freelearn.data.intake.readers.raw_files import is_folder, table_files
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.rubber.rubber_guess import guess_tests, looks_like_rubber
from freelearn.report.terminal.printed_intake import show_columns, show_intake, show_rubber, show_tests
from freelearn.report.terminal.printed_tables import print_line, print_words

RUBBER = (
    "No column tells an actuator's file from one of rubber alone. Is it a test of rubber (a sheet or a strip, no tube)?"
)


@dataclass(frozen=True)
class Next:
    """The command that goes on, and its words."""

    command: str
    words: Sequence[str]


def start(
    raws: Sequence[Path],
    folder: Path,
    console: Console,
    ask: Ask,
    design: Path | None = None,
    recipe: Path | None = None,
    run: Path | None = None,
) -> Next:
    """Writes recipe, table and provenance to `folder`; gives the command that goes on. Raises UserError."""
    given = list(raws)
    folder_of_raws = next((raw for raw in raws if is_folder(raw)), None)
    if folder_of_raws is not None and len(raws) > 1:
        raise UserError(f"{folder_of_raws} is a folder: name it alone, or files.")
    if folder_of_raws is not None:
        given = [folder_of_raws / name for name in table_files(folder_of_raws)]
    else:
        same_names(raws)
    if run is not None and len(given) > 1:
        raise UserError("One file asks something of a run: name one.")
    started = _Start(given, folder, console, ask, design, recipe, folder_of_raws)
    return started.asks(run) if run is not None else started.run()


@dataclass
class _Start:
    raws: list[Path]
    folder: Path
    console: Console
    ask: Ask
    design: Path | None
    recipe: Path | None
    # That holds the files, where it was named; else they were.
    inside: Path | None = None
    shown: bool = False
    # Whether it is known what kind of table the file becomes, and so what a recipe of it asks.
    begun: bool = False
    # A fitted run, of which the file asks something.
    of: Path | None = None

    def run(self) -> Next:
        """Asks where there is no recipe, and makes the table."""
        if self.recipe is not None:
            return self._rubber() if is_rubber_recipe(self.recipe) else self._actuator()
        laid = of_files(self.raws, self.inside)
        if laid and not self.inside and looks_like_rubber(laid[0]) is not False:
            # Files that are named one by one, and may be tests of rubber, are.
            laid = None
        if len(self.raws) > 1 and laid is None:
            if self.inside is not None:
                self._refuse_strangers(self.inside)
            return self._rubber()
        found, joined, cells = (laid[0], None, laid[1]) if laid else self._guessed(self.design)
        interview = ActuatorInterview(self.ask, self._tell, first=found, raw=cells, joined=joined)
        rubber = looks_like_rubber(found)
        if rubber is None:
            show_columns(self.console, found)
            self.shown = True
            with self._answered(interview):
                rubber = interview.sure(RUBBER)
        return self._rubber() if rubber else self._actuator(interview)

    def _refuse_strangers(self, folder: Path) -> None:
        """Raises UserError where the files of the folder, which are no recordings, are no tests of rubber either."""
        strangers = [raw for raw in self.raws if looks_like_rubber(guess_and_table(raw)[0]) is False]
        if strangers:
            raise not_together(folder, [raw.relative_to(folder).as_posix() for raw in self.raws])

    def asks(self, run: Path) -> Next:
        """What the file asks of a fitted run, as a table of questions."""
        known, self.of = actuators_of(run), run
        interview = None
        found, _, cells = self._guessed(None, by_time=False)
        if self.recipe is None:
            interview = WantedInterview(self.ask, self._tell, first=found, raw=cells, known=known)
        made = self._made(interview, lambda recipe: asked_of(self.raws[0], recipe, known, self._table()))
        words = [option("run", run), option("data.path", made.path)]
        print_line(self.console, f"written: {made.path}")
        return Next("predict", words)

    def _guessed(self, design: Path | None, by_time: bool = True) -> tuple[Guess, DesignGuess | None, RawTable]:
        """The guess at the file, once somebody has said which of several sheets that look alike is meant."""
        guessed = guess_and_table(self.raws[0], design, by_time=by_time)
        found = guessed[0]
        if not found.sheets or self.recipe is not None or looks_like_rubber(found):
            return guessed
        interview = ActuatorInterview(self.ask, self._tell, first=found, raw=guessed[2])
        with self._answered(interview):
            choices = [*found.sheets, *([EVERY] if found.recordings else [])]
            wanted = interview.chosen("Several sheets hold readings. Which one is it?", choices)
        return (
            guessed
            if wanted in (EVERY, "" if found.recordings else found.sheet)
            else guess_and_table(self.raws[0], design, wanted=wanted)
        )

    def _actuator(self, interview: ActuatorInterview | None = None) -> Next:
        made = self._made(interview, lambda recipe: taken_in(self._data(), recipe, self._table(), self.design))
        words = ["train=all", *table_options(made)]
        files = [made.path, self._kept(), *([made.members] if made.members else [])]
        show_intake(self.console, made.intake, files, [command_line(program("discover"), words)], going_on=True)
        return Next("discover", words)

    def _rubber(self) -> Next:
        interview = None
        if self.recipe is None:
            tests = guess_tests({raw.name: read_bytes(raw) for raw in self.raws})
            name = ", ".join(raw.name for raw in self.raws)
            interview = RubberInterview(self.ask, self._tell, tests=tests, name=name)
        made = self._made(interview, lambda recipe: rubber_taken_in(self.raws, recipe, self._table()))
        words = [str(made.path), "--best"]
        files = [made.path, self._kept()]
        show_rubber(self.console, made.intake, files, specimens_command(made.path), going_on=True)
        return Next("specimens", words)

    def _made(self, interview: ActuatorInterview | RubberInterview | None, make: Callable[[Path], Any]) -> Any:
        """What comes of the recipe, once whoever answers is content with it."""
        if interview is None:
            assert self.recipe is not None
            return make(self.recipe)
        recipe = self._kept()
        if isinstance(interview, RubberInterview):
            show_tests(self.console, interview.tests)
        elif not self.shown:
            show_columns(self.console, interview.first)
        self.begun = True
        with self._answered(interview):
            interview.columns()
            interview.run()
        while True:
            self._keep(interview)
            try:
                made = make(recipe)
            except UserError as mistake:
                self._tell(f"This makes no table: {mistake}")
                if not self._changed(interview):
                    raise
                continue
            names = tuple(f"{raw.name}: " for raw in self.raws)
            doubtful = [warning for warning in made.intake.warnings if not warning.startswith(names)]
            for warning in doubtful:
                self._tell(f"! {warning}")
            if not doubtful or not self._changed(interview):
                break
        print_line(self.console, f"again without questions: {self._again()}")
        # What has been said need not be said again.
        return replace(made, intake=replace(made.intake, warnings=()))

    def _changed(self, interview: Interview) -> bool:
        """Whether an answer was changed."""
        with self._answered(interview):
            return interview.change()

    @contextmanager
    def _answered(self, interview: Interview) -> Iterator[None]:
        """What was answered is kept where nobody answers any more."""
        try:
            yield
        except (EOFError, KeyboardInterrupt) as ended:
            raise UserError(self._broken_off(interview, ended)) from None

    def _tell(self, sentence: str) -> None:
        print_words(self.console, f"  {sentence}")

    def _data(self) -> Path:
        """The file, or the folder of several whose channels are joined by time."""
        return self.inside or (self.raws[0].parent if self.raws[1:] else self.raws[0])

    def _named(self) -> Path:
        """What was named: the folder, or the first of the files."""
        return self.inside or self.raws[0]

    def _kept(self) -> Path:
        """Where the answers are kept."""
        return self.recipe or self.folder / f"{stem_of(self._named())}_recipe.yaml"

    def _table(self) -> Path:
        return self.folder / f"{stem_of(self._named())}_table.csv"

    def _keep(self, interview: Interview) -> None:
        self._kept().parent.mkdir(parents=True, exist_ok=True)
        write_text(self._kept(), interview.recipe())

    def _again(self) -> str:
        """The command that asks nothing."""
        words = [
            *map(str, [self.inside] if self.inside else self.raws),
            "--recipe",
            str(self._kept()),
            *(["--run", str(self.of)] if self.of else []),
        ]
        words += ["--design", str(self.design)] if self.design else []
        return command_line(program("start", ["python", "-m", "freelearn", "start"]), words)

    def _broken_off(self, interview: Interview, ended: BaseException) -> str:
        """What to say where nobody answers any more; what was answered is kept."""
        # The question is still open on its line.
        self.console.print()
        if interview.answers:
            self._keep(interview)
            return f"broken off. The answers are kept in {self._kept()}: fill in its TODOs, then: {self._again()}"
        if isinstance(ended, KeyboardInterrupt):
            return "interrupted; nothing was written."
        asks = "start asks, and nobody answers: run it in a terminal, or"
        if self.begun:
            self._keep(interview)
            return f"{asks} fill in the TODOs of the recipe {self._kept()}, then: {self._again()}"
        words = [option("data.path", self._named()), *([option("design", self.design)] if self.design else [])]
        return f"{asks} draft a recipe to edit with {command_line(program('intake'), words)}"
