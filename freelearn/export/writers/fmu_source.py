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
enum {{ INPUTS = {inputs}, OUTPUTS = {outputs} }};
typedef struct {{ double in[INPUTS]; double out[OUTPUTS]; int stale; }} Instance;

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
EXPORT Status fmi2ExitInitializationMode(Component c) {{ (void)c; return OK; }}
EXPORT Status fmi2Terminate(Component c) {{ (void)c; return OK; }}
EXPORT Status fmi2Reset(Component c) {{ memset(c, 0, sizeof(Instance)); ((Instance *)c)->stale = 1; return OK; }}
EXPORT Status fmi2SetReal(Component c, const Reference r[], size_t n, const Real value[]) {{
    Instance *self = c;
    for (size_t i = 0; i < n; i++) {{
        if (r[i] >= INPUTS) return ERROR;
        self->in[r[i]] = value[i];
    }}
    self->stale = 1;
    return OK;
}}
EXPORT Status fmi2GetReal(Component c, const Reference r[], size_t n, Real value[]) {{
    Instance *self = c;
    if (self->stale) {{ {name}_forward(self->in, self->out); self->stale = 0; }}
    for (size_t i = 0; i < n; i++) {{
        if (r[i] >= INPUTS + OUTPUTS) return ERROR;
        value[i] = r[i] < INPUTS ? self->in[r[i]] : self->out[r[i] - INPUTS];
    }}
    return OK;
}}
EXPORT Status fmi2DoStep(Component c, Real at, Real step, Boolean kept) {{
    (void)c; (void)at; (void)step; (void)kept; return OK;
}}
EXPORT Status fmi2CancelStep(Component c) {{ (void)c; return OK; }}
{none}"""
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
EXPORT Status fmi2GetFMUstate(Component c, void **s) { (void)c; (void)s; return ERROR; }
EXPORT Status fmi2SetFMUstate(Component c, void *s) { (void)c; (void)s; return ERROR; }
EXPORT Status fmi2FreeFMUstate(Component c, void **s) { (void)c; (void)s; return ERROR; }
EXPORT Status fmi2SerializedFMUstateSize(Component c, void *s, size_t *n) { (void)c; (void)s; (void)n; return ERROR; }
EXPORT Status fmi2SerializeFMUstate(Component c, void *s, char b[], size_t n) {
    (void)c; (void)s; (void)b; (void)n; return ERROR;
}
EXPORT Status fmi2DeSerializeFMUstate(Component c, const char b[], size_t n, void **s) {
    (void)c; (void)b; (void)n; (void)s; return ERROR;
}
EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference u[], size_t n, const Reference k[], size_t m,
                                           const Real d[], Real v[]) {
    (void)c; (void)u; (void)n; (void)k; (void)m; (void)d; (void)v; return ERROR;
}
EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n, const Integer o[],
                                          const Real v[]) {
    (void)c; (void)r; (void)o; (void)v; return n ? ERROR : OK;
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
    return WRAPPER.format(name=name, guid=guid, inputs=len(f.inputs), outputs=len(f.outputs), none=none + LEFT)


def description(name: str, title: str, guid: str, version: str, f: Function) -> str:
    """modelDescription.xml."""
    ports = [*((p, "input") for p in f.inputs), *((p, "output") for p in f.outputs)]
    units = sorted({p.unit for p, _ in ports})
    variables = []
    for i, (p, way) in enumerate(ports):
        start = ' start="0"' if way == "input" else ""
        head = f'<ScalarVariable name={quoteattr(p.name)} valueReference="{i}" causality="{way}" '
        about = f'variability="continuous" description={quoteattr(p.about)}>'
        variables.append(f"{head}{about}<Real unit={quoteattr(p.unit)}{start}/></ScalarVariable>")
    given = " ".join(str(i + 1) for i in range(len(f.inputs)))
    outputs = [f'<Unknown index="{len(f.inputs) + i + 1}" dependencies="{given}"/>' for i in range(len(f.outputs))]
    tool = f"freelearn {version}"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(name)} guid="{guid}" '
        f"description={quoteattr(title)} generationTool={quoteattr(tool)} "
        'variableNamingConvention="flat" numberOfEventIndicators="0">',
        f'<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true">'
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
