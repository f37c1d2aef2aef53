"""The wrapper that makes an FMU (FMI 2.0 co-simulation) of an actuator's C, and its description."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from freelearn.export.arithmetic.function import Function

# Of the standard's headers only what the functions below name, so that the source needs no other file.
WRAPPER = """\
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT
#endif

typedef void *Component;
typedef unsigned int Reference;
typedef double Real;
typedef int Integer, Boolean, Status;
typedef const char *String;
typedef struct {{
    void (*logger)(void *, String, Status, String, String, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
}} Callbacks;
enum {{ OK = 0, DISCARD = 2, ERROR = 3 }};
enum {{ INPUTS = {inputs}, STATES = {states}, OUTPUTS = {outputs}, ALL = INPUTS + STATES + OUTPUTS }};
/* Inputs, the state, outputs, by their references; how fast the inputs change in the next step; whether the outputs are
   not those of the inputs; whether it runs. */
typedef struct {{ double number[ALL]; double rate[INPUTS]; int stale; int running; }} Instance;
{answering}
EXPORT String fmi2GetTypesPlatform(void) {{ return "default"; }}
EXPORT String fmi2GetVersion(void) {{ return "2.0"; }}
EXPORT Component fmi2Instantiate(String name, int type, String guid, String place, const Callbacks *calls,
                                 Boolean visible, Boolean logging) {{
    (void)name; (void)place; (void)calls; (void)visible; (void)logging;
    if (type != 1 || strcmp(guid, "{guid}") != 0) return NULL;
    Instance *self = calloc(1, sizeof(Instance));
    if (self) self->stale = 1;
    return self;
}}
EXPORT void fmi2FreeInstance(Component c) {{ free(c); }}
EXPORT Status fmi2SetDebugLogging(Component c, Boolean on, size_t n, const String kinds[]) {{
    (void)c; (void)on; (void)n; (void)kinds; return OK;
}}
EXPORT Status fmi2SetupExperiment(Component c, Boolean d, Real tolerance, Real start, Boolean e, Real stop) {{
    (void)c; (void)d; (void)tolerance; (void)start; (void)e; (void)stop; return OK;
}}
EXPORT Status fmi2EnterInitializationMode(Component c) {{ (void)c; return OK; }}
EXPORT Status fmi2ExitInitializationMode(Component c) {{ begin(c); return OK; }}
EXPORT Status fmi2Terminate(Component c) {{ (void)c; return OK; }}
EXPORT Status fmi2Reset(Component c) {{ memset(c, 0, sizeof(Instance)); ((Instance *)c)->stale = 1; return OK; }}
EXPORT Status fmi2SetReal(Component c, const Reference r[], size_t n, const Real value[]) {{
    Instance *self = c;
    for (size_t i = 0; i < n; i++) {{
        if (r[i] >= INPUTS + STATES) return ERROR;
        self->number[r[i]] = value[i];
    }}
    changed(self);
    return OK;
}}
EXPORT Status fmi2GetReal(Component c, const Reference r[], size_t n, Real value[]) {{
    Instance *self = c;
    if (self->stale) answer(self);
    for (size_t i = 0; i < n; i++) {{
        if (r[i] >= ALL) return ERROR;
        value[i] = self->number[r[i]];
    }}
    return OK;
}}
EXPORT Status fmi2DoStep(Component c, Real at, Real step, Boolean kept) {{
    Instance *self = c;
    (void)at; (void)kept;
    for (int i = 0; i < INPUTS; i++) {{
        if (self->rate[i] != 0.0) self->stale = 1;
        self->number[i] += self->rate[i] * step;
        self->rate[i] = 0.0;
    }}
    advance(self, step);
    return OK;
}}
EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n, const Integer order[],
                                          const Real value[]) {{
    Instance *self = c;
    for (size_t i = 0; i < n; i++) {{
        if (r[i] >= INPUTS || order[i] != 1) return ERROR;
        self->rate[r[i]] = value[i];
    }}
    return OK;
}}
EXPORT Status fmi2GetFMUstate(Component c, void **s) {{
    if (!*s) *s = malloc(sizeof(Instance));
    if (!*s) return ERROR;
    memcpy(*s, c, sizeof(Instance));
    return OK;
}}
EXPORT Status fmi2SetFMUstate(Component c, void *s) {{ memcpy(c, s, sizeof(Instance)); return OK; }}
EXPORT Status fmi2FreeFMUstate(Component c, void **s) {{ (void)c; free(*s); *s = NULL; return OK; }}
EXPORT Status fmi2SerializedFMUstateSize(Component c, void *s, size_t *n) {{
    (void)c; (void)s; *n = sizeof(Instance); return OK;
}}
EXPORT Status fmi2SerializeFMUstate(Component c, void *s, char b[], size_t n) {{
    (void)c;
    if (n < sizeof(Instance)) return ERROR;
    memcpy(b, s, sizeof(Instance));
    return OK;
}}
EXPORT Status fmi2DeSerializeFMUstate(Component c, const char b[], size_t n, void **s) {{
    if (n < sizeof(Instance) || fmi2GetFMUstate(c, s) != OK) return ERROR;
    memcpy(*s, b, sizeof(Instance));
    return OK;
}}
EXPORT Status fmi2CancelStep(Component c) {{ (void)c; return OK; }}
{none}"""
# How outputs follow: at once, whatever the time.
AT_ONCE = """\
static void answer(Instance *self) {{ {name}_{f}(self->number, self->number + INPUTS); self->stale = 0; }}
static void changed(Instance *self) {{ self->stale = 1; }}
static void begin(Instance *self) {{ self->running = 1; }}
static void advance(Instance *self, double step) {{ (void)self; (void)step; }}
"""
# Or from sample to sample: the first is where the initialization ends, and each step goes straight to its inputs.
ALONG = """\
static void advance(Instance *self, double step) {{
    double *state = self->number + INPUTS;
    {name}_{f}(self->number, step, state, state + STATES);
    self->stale = 0;
}}
static void answer(Instance *self) {{
    Instance first = *self;
    advance(&first, 1.0);
    memcpy(self->number + INPUTS + STATES, first.number + INPUTS + STATES, OUTPUTS * sizeof(double));
    self->stale = 0;
}}
static void changed(Instance *self) {{ self->stale = !self->running; }}
static void begin(Instance *self) {{ self->running = 1; advance(self, 1.0); }}
"""
# What an actuator has none of.
KINDS = ("Integer", "Boolean", "String")
NONE = """\
EXPORT Status fmi2Get{kind}(Component c, const Reference r[], size_t n, {kind} value[]) {{
    (void)c; (void)r; (void)value; return n ? ERROR : OK;
}}
EXPORT Status fmi2Set{kind}(Component c, const Reference r[], size_t n, const {kind} value[]) {{
    (void)c; (void)r; (void)value; return n ? ERROR : OK;
}}
"""
LEFT = """\
EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference u[], size_t n, const Reference k[], size_t m,
                                           const Real d[], Real v[]) {
    (void)c; (void)u; (void)n; (void)k; (void)m; (void)d; (void)v; return ERROR;
}
EXPORT Status fmi2GetRealOutputDerivatives(Component c, const Reference r[], size_t n, const Integer o[], Real v[]) {
    (void)c; (void)r; (void)o; (void)v; return n ? ERROR : OK;
}
EXPORT Status fmi2GetStatus(Component c, int kind, Status *v) { (void)c; (void)kind; (void)v; return DISCARD; }
EXPORT Status fmi2GetRealStatus(Component c, int kind, Real *v) { (void)c; (void)kind; (void)v; return DISCARD; }
EXPORT Status fmi2GetIntegerStatus(Component c, int kind, Integer *v) { (void)c; (void)kind; (void)v; return DISCARD; }
EXPORT Status fmi2GetBooleanStatus(Component c, int kind, Boolean *v) { (void)c; (void)kind; (void)v; return DISCARD; }
EXPORT Status fmi2GetStringStatus(Component c, int kind, String *v) { (void)c; (void)kind; (void)v; return DISCARD; }
"""


def wrapper(name: str, guid: str, f: Function) -> str:
    """What follows NAME.c in the FMU's one source file."""
    none = "".join(NONE.format(kind=kind) for kind in KINDS)
    given = len(f.given) - 1 if f.carried else len(f.inputs)
    answering = (ALONG if f.carried else AT_ONCE).format(name=name, f=f.name)
    counts = {"inputs": given, "states": f.carried, "outputs": len(f.answered)}
    return WRAPPER.format(guid=guid, answering=answering, none=none + LEFT, **counts)


def description(name: str, title: str, guid: str, version: str, f: Function) -> str:
    """modelDescription.xml."""
    inputs = f.given[:-1] if f.carried else f.inputs
    # Of the state some may be given at the begin of a recording.
    ways = {"input": inputs, "local": f.state, "output": f.answered}
    ports = [(p, way) for way, some in ways.items() for p in some]
    units = sorted({p.unit for p, _ in ports})
    variables = []
    for i, (p, way) in enumerate(ports):
        start = "" if way == "output" else ' start="0"'
        head = f'<ScalarVariable name={quoteattr(p.name)} valueReference="{i}" causality="{way}" '
        head += 'initial="exact" ' if way == "local" else ""
        about = f'variability="continuous" description={quoteattr(p.about)}>'
        variables.append(f"{head}{about}<Real unit={quoteattr(p.unit)}{start}/></ScalarVariable>")
    given = " ".join(str(i + 1) for i in range(len(inputs)))
    before = len(ports) - len(f.answered)
    outputs = [f'<Unknown index="{before + i + 1}" dependencies="{given}"/>' for i in range(len(f.answered))]
    tool = f"freelearn {version}"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(name)} guid="{guid}" '
        f"description={quoteattr(title)} generationTool={quoteattr(tool)} "
        'variableNamingConvention="flat" numberOfEventIndicators="0">',
        f'<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" '
        'canInterpolateInputs="true" '
        'canGetAndSetFMUstate="true" canSerializeFMUstate="true">'
        f'<SourceFiles><File name="{name}_fmu.c"/></SourceFiles></CoSimulation>',
        "<UnitDefinitions>" + "".join(f"<Unit name={quoteattr(u)}/>" for u in units) + "</UnitDefinitions>",
        "<ModelVariables>",
        *variables,
        "</ModelVariables>",
        f"<ModelStructure><Outputs>{''.join(outputs)}</Outputs>"
        f"<InitialUnknowns>{''.join(outputs)}</InitialUnknowns></ModelStructure>",
        "</fmiModelDescription>",
    ]
    return "\n".join(lines) + "\n"
