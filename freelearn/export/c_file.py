"""An actuator as a C99 file."""

from __future__ import annotations

import tempfile
from pathlib import Path

from freelearn.errors import UserError
from freelearn.export.actuator import Actuator
from freelearn.export.c_source import c_source
from freelearn.export.compiled import Library, compiled, compiler
from freelearn.export.options import Options
from freelearn.export.written import Written
from freelearn.files import write_text

OUTSIDE = (
    "Bit 0 of what each function returns, and its output `inside` = 0; the numbers are what the model itself would say "
    "there. Bit 1: no equilibrium."
)


def write_c(actuator: Actuator, folder: Path, options: Options) -> Written:
    """NAME.c."""
    functions = actuator.functions
    path = folder / f"{options.name}.c"
    write_text(path, c_source(options.name, title(actuator, options), functions))
    notes = [f"{f.name}: {f.operations} operations in every call" for f in functions]
    if compiler() is None:
        return Written([path], None, OUTSIDE, notes=[*notes, "No C compiler on this machine: the file was not run."])
    library = run(path, options.name)
    return Written([path], lambda x: library.answers(functions[0], x)[0], OUTSIDE, notes=notes)


def run(path: Path, name: str) -> Library:
    """The file compiled, with every warning an error. Raises UserError where the compiler refuses."""
    with tempfile.TemporaryDirectory() as place:
        library = Path(place) / f"{name}.so"
        if problem := compiled([path], library):
            raise UserError(f"The C compiler of this machine refuses {path.name}: {problem}")
        # Loaded, it stays when its file is gone.
        return Library(library, name)


def title(actuator: Actuator, options: Options) -> str:
    """The actuator in a line."""
    states = actuator.states
    design = "an end block of several actuators" if states.members else f"sample {actuator.sample}"
    return f"{options.name}: {actuator.fitted.title}, {design}, written by freelearn"
