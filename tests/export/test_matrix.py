"""Every model on every bed, in every format: the certificate holds, or one sentence says why not."""

import pytest
from exported import BEDS, MODELS, run_of

from freelearn.common.errors import UserError
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.checks import checked
from freelearn.export.export import WRITERS
from freelearn.export.export_options import Options, needed
from freelearn.export.writers.c_file import compiler

# What cannot be, by model, bed and format ("" for all), and a word of its sentence.
CANNOT = {
    ("hybrid", "dead_load", ""): "use model=continuum",
    ("hybrid", "inflation", ""): "use model=continuum",
    ("hybrid", "block", ""): "use model=continuum",
    ("mlp", "isometric", "mujoco"): "MuJoCo needs force and moment",
    ("mlp", "dead_load", "mujoco"): "MuJoCo needs force and moment",
    ("mlp", "inflation", "mujoco"): "MuJoCo needs force and moment",
    **{("continuum", bed, "table"): "no room for what the actuator remembers" for bed in BEDS},
}
CASES = [(model, bed) for model in MODELS for bed in BEDS]


@pytest.mark.nightly
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize(("model", "bed"), CASES)
def test_it_is_exported_or_a_sentence_says_why_not(tmp_path, model, bed):
    if (said := CANNOT.get((model, bed, ""))) is not None:
        with pytest.raises(UserError, match=said):
            run_of(tmp_path / "run", model, bed)
        return
    functions = Functions(Actuator.from_fitted(run_of(tmp_path / "run", model, bed)))
    for to, write in WRITERS.items():
        needed(to)
        (tmp_path / to).mkdir()
        if (said := CANNOT.get((model, bed, to))) is not None:
            with pytest.raises(UserError, match=said):
                write(functions, tmp_path / to, Options(to, "arm"))
            continue
        written = write(functions, tmp_path / to, Options(to, "arm"))
        checks = checked(functions, written)
        assert checks.held, {name: check.plain for name, check in checks.every.items() if not check.held}
        assert not written.broken
        assert checks.outside > 400
        if to in ("c", "onnx", "fmu"):
            assert list(checks.every) == [f.name for f in functions.every]
