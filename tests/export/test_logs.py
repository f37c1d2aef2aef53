"""Runs of logs, followed from sample to sample in what was exported, beside `predict` along whole recordings."""

import ctypes
import json

import beds
import numpy as np
import pytest
from exported import HISTORY, VALUES, already, log_run, sampled
from fitted_folders import folder_of
from nightly import EVERY, usually

import freelearn
from freelearn.common.errors import UserError
from freelearn.data.beds import DEG, KPA, MM, NMM
from freelearn.data.columns import with_members
from freelearn.export.actuator import Actuator
from freelearn.export.actuator_functions import Functions
from freelearn.export.checks import checked
from freelearn.export.export import WRITERS
from freelearn.export.export_options import Options
from freelearn.export.log_step import stepped
from freelearn.export.writers.c_file import compiled, compiler
from freelearn.export.writers.c_source import c_source
from freelearn.physics.effects.history.delays import DeadTime
from freelearn.physics.models.build import build_model

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
IMPOSED = {"elongation_mm": MM, "twist_deg": DEG, "pressure_kpa": KPA}
HUNG = {"force_n": 1.0, "moment_nmm": NMM, "pressure_kpa": KPA}
# Several that act before the wall, on it, behind it and on the readings, and what a row remembers besides.
MANY = ["supply_lag", "valve_flow", "creep", "maxwell_slip", "sensor_lag"] if EVERY else ["supply_lag", "sensor_lag"]
# One of each way of carrying a state on.
FOLLOWED = ["contact_slip", "dead_time", "inertia", "second_creep"]
REMEMBERED = {"friction_hysteresis.force": 0.3, "stress_softening.depth": 0.2, "sensor_drift.force_rate": 1e-3}


def close(got, fitted, table):
    """Loads (N, 2) of the table's rows are those of `predict`, to 1e-9 of their range."""
    wanted = fitted.predict(table, bands=False).loads
    span = np.ptp(wanted, axis=0)
    assert (np.abs(got - wanted) / span).max() < 1e-9
    # What lasts alone is something else: there is a history to follow.
    lasting = fitted.predict(table.drop(columns=["time_s", "run"]), bands=False).loads
    assert (np.abs(lasting - wanted) / span).max() > 1e-3


def imposed(table, names=None):
    return np.column_stack([table[name] * factor for name, factor in (names or IMPOSED).items()])


def steps(table):
    """Time from sample to sample of each row, and whether it is its recording's first."""
    first = table["run"].ne(table["run"].shift()).to_numpy()
    return np.where(first, 0.0, table["time_s"].diff().fillna(0.0)), first


def followed(library, name, states, table, begin=lambda state, ended, row: None, names=None):
    """Loads (N, 2) by NAME_reset and NAME_step of a compiled file, and what the steps returned."""
    step, reset = library[f"{name}_step"], library[f"{name}_reset"]
    step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
    state, out, got, flags = np.full(states, 7.0), np.zeros(4), [], []
    for row, (x, dt, first) in enumerate(zip(imposed(table, names), *steps(table), strict=True)):
        if first:
            ended = state.copy()
            reset(ctypes.c_void_p(state.ctypes.data))
            begin(state, ended, row)
        flags.append(step(x.ctypes.data, dt, state.ctypes.data, out.ctypes.data))
        got.append(out[:2].copy())
    return np.array(got), flags


def in_c(function, folder):
    path = folder / "arm.c"
    path.write_text(c_source("arm", "An arm", [function]))
    assert compiled([path], folder / "arm.so") is None
    return ctypes.CDLL(str(folder / "arm.so"))


@needs_compiler
@pytest.mark.parametrize("effect", usually(*FOLLOWED, nightly=[effect for effect in HISTORY if effect not in FOLLOWED]))
def test_c_follows_every_effect_of_the_history(tmp_path, effect):
    fitted = log_run(tmp_path / "run", [effect])
    step = stepped(Actuator.from_fitted(fitted))
    table = sampled(seed=5, runs=2)
    got, _ = followed(in_c(step, tmp_path), "arm", step.carried, table)
    close(got, fitted, table)


@needs_compiler
def test_c_follows_what_rows_remember_too(tmp_path):
    """Direction, clock and severity: a second recording of an actuator begins with what the first one left, a usual
    step later."""
    fitted = log_run(tmp_path / "run", ["creep"], REMEMBERED, "continuum")
    step = stepped(Actuator.from_fitted(fitted))
    places = {p.name: i for i, p in enumerate(step.state)}
    table = fitted.table()
    every, first = steps(table)

    def begin(state, ended, row):
        if row:
            state[places["worst_severity"]] = ended[places["worst_severity"]]
            state[places["clock"]] = ended[places["clock"]] + np.median(every[~first])

    got, _ = followed(in_c(step, tmp_path), "arm", step.carried, table, begin)
    close(got, fitted, table)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    fitted = log_run(tmp_path_factory.mktemp("many") / "run", MANY)
    functions = Functions(Actuator.from_fitted(fitted))
    if not EVERY:
        # Pressures for loads that last are asked of runs without a history.
        vars(functions)["inverses"] = []
    return fitted, functions


def written(to, many, folder):
    """Of functions that were traced once: that takes the most time. What is certified of them holds."""
    found = WRITERS[to](many[1], folder, Options(to, "arm"))
    checks = checked(many[1], found)
    assert checks.held
    assert next(iter(checks.every)) == "step"
    return found


@needs_compiler
def test_an_export_of_a_log_tells_its_state_and_holds(many, tmp_path):
    fitted, functions = many
    with already(functions):
        found = fitted.export(tmp_path / "arm.c")
    assert found.held
    content = json.loads((tmp_path / "export.json").read_text())
    step = content["functions"][0]
    assert step["name"] == "step"
    assert [p["name"] for p in step["inputs"]] == ["elongation", "twist", "pressure", "dt"]
    assert {p["initial"] for p in step["state"]} == {0.0}
    assert {p["about"].split(":")[0] for p in step["state"]} >= set(MANY)
    trip = content["round_trip"]["functions"]["step"]
    assert trip["states"] == 4000 + len(fitted.table())
    assert trip["flags_that_differ"] == {"status": 0, "inside": 0}
    assert any("Bands along a log" in line for line in content["notes"])
    assert "<td>state</td><td>begun</td>" in (tmp_path / "export.html").read_text()
    library = tmp_path / "arm.so"
    assert compiled([tmp_path / "arm.c"], library) is None
    table = sampled(seed=6, runs=2)
    got, _ = followed(ctypes.CDLL(str(library)), "arm", len(step["state"]), table)
    close(got, fitted, table)


@pytest.mark.nightly
def test_onnx_takes_a_state_and_gives_the_next(many, tmp_path):
    onnxruntime = pytest.importorskip("onnxruntime")
    fitted, _ = many
    found = written("onnx", many, tmp_path)
    assert {path.name for path in found.files} >= {"arm.onnx", "arm_steady.onnx", "arm_pressure_for_force.onnx"}
    session = onnxruntime.InferenceSession(str(tmp_path / "arm.onnx"))
    shapes = {i.name: i.shape for i in session.get_inputs()}
    assert list(shapes) == ["elongation", "twist", "pressure", "dt", "state"]
    count = shapes["state"][1]
    assert [o.name for o in session.get_outputs()] == ["force", "moment", "status", "inside", "state_out"]
    # Two recordings at once, each a row.
    table = sampled(seed=7, runs=2)
    halves = [part for _, part in table.groupby("run")]
    state, got = np.zeros((2, count)), []
    for n in range(len(halves[0])):
        x = np.array([imposed(half)[n] for half in halves])
        dt = np.array([steps(half)[0][n] for half in halves])
        given = {"elongation": x[:, 0].copy(), "twist": x[:, 1].copy(), "pressure": x[:, 2].copy(), "dt": dt}
        force, moment, state = session.run(["force", "moment", "state_out"], given | {"state": state})
        got.append(np.stack([force, moment], axis=1))
    close(np.concatenate(np.array(got).transpose(1, 0, 2)), fitted, table)


@pytest.mark.nightly
@needs_compiler
def test_an_fmu_holds_its_state_and_gives_it_away(many, tmp_path):
    pytest.importorskip("fmpy")
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    fitted, _ = many
    found = written("fmu", many, tmp_path)
    about = fmpy.read_model_description(str(found.files[0]))
    reference = {v.name: v.valueReference for v in about.modelVariables}
    assert {v.causality for v in about.modelVariables} == {"input", "local", "output"}
    fmpy.extract(str(found.files[0]), str(tmp_path / "there"))
    fmu = FMU2Slave(guid=about.guid, unzipDirectory=str(tmp_path / "there"),
                    modelIdentifier=about.coSimulation.modelIdentifier, instanceName="arm")  # fmt: skip
    fmu.instantiate()
    given = [reference[n] for n in ("elongation", "twist", "pressure")]
    outputs = [reference[n] for n in ("force", "moment")]
    table = sampled(seed=8, runs=2)
    got, again, kept, time = [], [], None, 0.0
    for row, (x, dt, first) in enumerate(zip(imposed(table), *steps(table), strict=True)):
        if first:
            fmu.reset()
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
            fmu.setReal(given, x.tolist())
            fmu.exitInitializationMode()
            time = 0.0
        else:
            fmu.setReal(given, x.tolist())
            fmu.doStep(currentCommunicationPoint=time, communicationStepSize=dt)
            time += dt
        got.append(fmu.getReal(outputs))
        if row == 20:
            kept = fmu.serializeFMUstate(fmu.getFMUState())
    close(np.array(got), fitted, table)
    # From the state kept it goes the same way once more.
    fmu.setFMUState(fmu.deSerializeFMUstate(kept))
    for x, dt in zip(imposed(table)[21:40], steps(table)[0][21:40], strict=True):
        fmu.setReal(given, x.tolist())
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=dt)
        again.append(fmu.getReal(outputs))
    np.testing.assert_array_equal(again, got[21:40])
    # Or by the inputs at each step's start and how fast they change.
    fmu.setFMUState(fmu.deSerializeFMUstate(kept))
    for row in range(20, 39):
        x, after, dt = imposed(table)[row], imposed(table)[row + 1], steps(table)[0][row + 1]
        fmu.setReal(given, x.tolist())
        fmu.setRealInputDerivatives(given, [1] * 3, ((after - x) / dt).tolist())
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=dt)
        again.append(fmu.getReal(outputs))
    fmu.freeInstance()
    np.testing.assert_allclose(again[19:], got[21:40], rtol=1e-9, atol=1e-9)


@pytest.mark.nightly
def test_mujoco_follows_its_own_time(many, tmp_path):
    pytest.importorskip("mujoco")
    found = written("mujoco", many, tmp_path)
    assert found.more["simulated"]["moved"] < 1e-9
    assert not found.broken


def test_a_table_has_no_memory(many, tmp_path):
    pytest.importorskip("h5netcdf")
    with pytest.raises(UserError, match=r"no room.*supply_lag.*to=c"):
        WRITERS["table"](many[1], tmp_path, Options("table", "arm"))


@pytest.mark.nightly
@needs_compiler
def test_a_hung_log_tells_places(tmp_path):
    effects = ["creep", "supply_lag", "sensor_lag"]
    fitted = log_run(tmp_path / "run", effects, bed="dead_load")
    step = stepped(Actuator.from_fitted(fitted))
    table = fitted.table()
    got, _ = followed(in_c(step, tmp_path), "arm", step.carried, table, names=HUNG)
    wanted = fitted.predict(table, bands=False).loads
    assert (np.abs(got - wanted) / np.ptp(wanted, axis=0)).max() < 1e-9
    assert [p.name for p in step.answered] == ["elongation", "twist", "status", "inside"]


@pytest.mark.nightly
@needs_compiler
def test_an_end_block_of_a_log(tmp_path):
    """A pressure each, whose lags and directions are the actuators' own."""
    table = beds.block({})
    count = np.arange(len(table))
    table = table.assign(run=count // 60, time_s=0.2 * count + 0.03 * np.sin(count))
    table = with_members(table[table["run"] < 3], beds.MEMBERS)
    values = {f"{e}.{n}": v for e in ("creep", "supply_lag", "maxwell_slip") for n, v in HISTORY[e].items()}
    model = build_model(
        "linear", VALUES["linear"], ["creep", "supply_lag", "maxwell_slip", "friction_hysteresis"], [1], 3
    )
    model.set_values(values | {n: 0.1 for n in model.declared if n.startswith("friction_hysteresis.force")})
    known = np.eye(len(model.declared))
    fitted = freelearn.load(folder_of(tmp_path / "run", model, table, covariance=known))
    step = stepped(Actuator.from_fitted(fitted))
    names = {"elongation_mm": MM, "twist_deg": DEG, **{f"pressure_{i}_kpa": KPA for i in (1, 2, 3)}}
    got, _ = followed(in_c(step, tmp_path), "arm", step.carried, fitted.table(), names=names)
    close(got, fitted, fitted.table())


def test_samples_too_close_for_a_dead_time_are_flagged(tmp_path):
    fitted = log_run(tmp_path / "run", ["dead_time"])
    step = stepped(Actuator.from_fitted(fitted))
    library = in_c(step, tmp_path)
    table = sampled(seed=5, runs=1)
    _, flags = followed(library, "arm", step.carried, table.assign(time_s=table["time_s"] / 50))
    # While all that there was is kept nothing is lost.
    assert flags[0] == flags[1] == 0
    assert flags[-1] & 1


@pytest.mark.parametrize(
    ("delay", "said"),
    [(-0.1, r"'dead_time' has a delay of -0\.1 s.*later one"), (29.9, r"'dead_time'.*would have to be kept")],
)
def test_a_dead_time_that_no_export_can_follow(tmp_path, delay, said):
    fitted = log_run(tmp_path / "run", ["dead_time"], {"dead_time.delay": delay}, every=0.02)
    with pytest.raises(UserError, match=said):
        stepped(Actuator.from_fitted(fitted))


@pytest.mark.parametrize(
    ("carry", "said"),
    [
        (lambda self, signal, recording, p: signal + 0 * recording.time[:, None], r"'dead_time'.*recording\.time"),
        (lambda self, signal, recording, p: signal.cumsum(0), "'dead_time' keeps its state in a way of its own"),
    ],
)
def test_an_effect_that_follows_in_a_way_of_its_own(tmp_path, monkeypatch, carry, said):
    fitted = log_run(tmp_path / "run", ["dead_time"])
    monkeypatch.setattr(DeadTime, "carry", carry)
    with pytest.raises(UserError, match=said):
        stepped(Actuator.from_fitted(fitted))


def test_a_table_without_time_asks_for_what_lasts(tmp_path):
    """The same model of a table that is no log has no samples to follow."""
    fitted = log_run(tmp_path / "run", ["creep"], log=False)
    assert Functions(Actuator.from_fitted(fitted)).step is None


@pytest.mark.parametrize(
    ("effect", "bed", "said"), [("creep", "dead_load", "answers with places"), ("dead_time", "kinematic", "dead time")]
)
def test_what_mujoco_cannot_follow(tmp_path, effect, bed, said):
    pytest.importorskip("mujoco")
    functions = Functions(Actuator.from_fitted(log_run(tmp_path / "run", [effect], bed=bed)))
    with pytest.raises(UserError, match=said):
        WRITERS["mujoco"](functions, tmp_path, Options("mujoco", "arm"))
