/* FMI 2.0.4 for co-simulation, by the standard's text: Modelica Association, "Functional Mock-up Interface for Model
 * Exchange and Co-Simulation", version 2.0.4, 2022. */

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    sh_instance own;
    const fmi2CallbackFunctions *host;
} sh_fmi2;

static fmi2Status sh_fmi2_tell(sh_fmi2 *c, fmi2Status status, const char *category)
{
    if (c->host != NULL && c->host->logger != NULL)
        c->host->logger(c->host->componentEnvironment, c->own.name, status, category, "%s", c->own.message);
    return status;
}

static fmi2Status sh_fmi2_error(sh_fmi2 *c) { return sh_fmi2_tell(c, fmi2Error, "logStatusError"); }

static fmi2Status sh_fmi2_says(fmi2Component c, const char *text)
{
    sh_fmi2 *s = c;
    if (s == NULL)
        return fmi2Error;
    snprintf(s->own.message, sizeof s->own.message, "%s", text);
    return sh_fmi2_error(s);
}

/* Whether there is an instance, and arrays for n values. */
static int sh_fmi2_usable(fmi2Component c, size_t n, const void *references, const void *values)
{
    if (c != NULL && n > 0 && (references == NULL || values == NULL))
        sh_fmi2_says(c, "No array of value references or values was given.");
    return c != NULL && (n == 0 || (references != NULL && values != NULL));
}

static fmi2Status sh_fmi2_missing(fmi2Component c) { return sh_fmi2_says(c, "This FMU does not have this function."); }

SH_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
SH_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

SH_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c, (void)on, (void)n, (void)categories; /* errors and warnings are told, and always */
    return fmi2OK;
}

SH_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                        const fmi2CallbackFunctions *host, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)resources, (void)visible, (void)logging;
    const char *wrong = type != fmi2CoSimulation                               ? "This FMU is for co-simulation."
                        : guid == NULL || strcmp(guid, sh_identity()) != 0 ? "The GUID is that of another FMU."
                                                                               : NULL;
    sh_instance *made = wrong == NULL ? sh_instance_new(name) : NULL;
    sh_fmi2 *s = made != NULL ? calloc(1, sizeof *s) : NULL;
    if (s != NULL) {
        s->own = *made;
        s->host = host;
    } else if (host != NULL && host->logger != NULL)
        host->logger(host->componentEnvironment, name != NULL ? name : "", fmi2Error, "logStatusError", "%s",
                     wrong ? wrong : "No memory.");
    free(made);
    return s;
}

SH_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    if (c != NULL)
        sh_instance_clear(&((sh_fmi2 *)c)->own);
    free(c);
}

SH_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start,
                                         fmi2Boolean stops, fmi2Real stop)
{
    sh_fmi2 *s = c;
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    if (s == NULL || s->own.phase != SH_INSTANTIATED)
        return sh_fmi2_says(c, "fmi2SetupExperiment: the instance is initialized already. Reset it.");
    if (!(fabs(start) <= SH_MOST_TIME))
        return sh_fmi2_says(c, "startTime: give a number of seconds up to 1e12.");
    s->own.start = start;
    return fmi2OK;
}

SH_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    sh_fmi2 *s = c;
    if (s == NULL || s->own.phase != SH_INSTANTIATED)
        return sh_fmi2_says(c, "fmi2EnterInitializationMode: the instance is initialized already. Reset it.");
    s->own.phase = SH_INITIALIZATION;
    return fmi2OK;
}

SH_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    sh_fmi2 *s = c;
    if (s == NULL || s->own.phase != SH_INITIALIZATION)
        return sh_fmi2_says(c, "fmi2ExitInitializationMode: the instance is not in initialization mode.");
    s->own.phase = SH_RUNNING;
    return sh_instance_start(&s->own) == SH_OK ? fmi2OK : sh_fmi2_error(s);
}

SH_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    if (c == NULL)
        return fmi2Error;
    ((sh_fmi2 *)c)->own.phase = SH_TERMINATED;
    return fmi2OK;
}

SH_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    sh_fmi2 *s = c;
    if (s == NULL)
        return fmi2Error;
    sh_instance_reset(&s->own);
    return fmi2OK;
}

static fmi2Status sh_fmi2_untyped(fmi2Component c, fmi2ValueReference v)
{
    sh_fmi2 *s = c;
    snprintf(s->own.message, sizeof s->own.message, "Value reference %u (%s): no variable of this type.", v,
             sh_name((int)v));
    return sh_fmi2_error(s);
}

/* What is set together is set whole or not at all. */
#define SH_ACCESS(Name, kind, type)                                                                                 \
    SH_EXPORT fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, type value[])       \
    {                                                                                                               \
        if (!sh_fmi2_usable(c, n, v, value))                                                                        \
            return fmi2Error;                                                                                       \
        for (size_t i = 0; i < n; i++) {                                                                            \
            if (!sh_is_type((int)v[i], kind))                                                                       \
                return sh_fmi2_untyped(c, v[i]);                                                                    \
            value[i] = (type)sh_get(&((sh_fmi2 *)c)->own.twin, (int)v[i]);                                          \
        }                                                                                                           \
        return fmi2OK;                                                                                              \
    }                                                                                                               \
    SH_EXPORT fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference v[], size_t n, const type value[]) \
    {                                                                                                               \
        if (!sh_fmi2_usable(c, n, v, value))                                                                        \
            return fmi2Error;                                                                                       \
        for (size_t i = 0; i < n; i++)                                                                              \
            if (sh_instance_may_set(&((sh_fmi2 *)c)->own, (int)v[i], kind, (double)value[i]) != SH_OK)              \
                return sh_fmi2_error(c);                                                                            \
        for (size_t i = 0; i < n; i++)                                                                              \
            sh_set(&((sh_fmi2 *)c)->own.twin, (int)v[i], (double)value[i]);                                         \
        return fmi2OK;                                                                                              \
    }
SH_ACCESS(Real, SH_REAL, fmi2Real)
SH_ACCESS(Integer, SH_INTEGER, fmi2Integer)
SH_ACCESS(Boolean, SH_BOOLEAN, fmi2Boolean)

SH_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String value[])
{
    if (!sh_fmi2_usable(c, n, v, value))
        return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (!sh_is_type((int)v[i], SH_TEXT))
            return sh_fmi2_untyped(c, v[i]);
        value[i] = sh_text(&((sh_fmi2 *)c)->own.twin, (int)v[i]);
    }
    return fmi2OK;
}

SH_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String value[])
{
    (void)v, (void)value;
    return n == 0 ? fmi2OK : sh_fmi2_says(c, "Texts of this FMU are outputs.");
}

static fmi2Status sh_fmi2_answer(fmi2Component c, int answer) { return answer == SH_OK ? fmi2OK : sh_fmi2_error(c); }

SH_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return c == NULL ? fmi2Error : sh_fmi2_answer(c, sh_instance_keep(&((sh_fmi2 *)c)->own, state));
}

SH_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return c == NULL ? fmi2Error : sh_fmi2_answer(c, sh_instance_go_back(&((sh_fmi2 *)c)->own, state));
}

SH_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return c == NULL ? fmi2Error : sh_fmi2_answer(c, sh_instance_forget(&((sh_fmi2 *)c)->own, state));
}

SH_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    if (c == NULL || size == NULL || sh_kept_at(&((sh_fmi2 *)c)->own, state) == NULL)
        return c == NULL || size == NULL ? fmi2Error : sh_fmi2_error(c);
    *size = SH_STATE_SIZE;
    return fmi2OK;
}

SH_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (c == NULL)
        return fmi2Error;
    return sh_fmi2_answer(c, sh_instance_serialize(&((sh_fmi2 *)c)->own, state, (unsigned char *)bytes, size));
}

SH_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (c == NULL)
        return fmi2Error;
    return sh_fmi2_answer(
        c, sh_instance_deserialize(&((sh_fmi2 *)c)->own, (const unsigned char *)bytes, size, state));
}

SH_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
                                                  const fmi2ValueReference k[], size_t nk, const fmi2Real dk[],
                                                  fmi2Real du[])
{
    (void)u, (void)nu, (void)k, (void)nk, (void)dk, (void)du;
    return sh_fmi2_missing(c);
}

SH_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                                 const fmi2Integer order[], const fmi2Real value[])
{
    (void)v, (void)order, (void)value;
    return n == 0 ? fmi2OK : sh_fmi2_missing(c);
}

SH_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                                  const fmi2Integer order[], fmi2Real value[])
{
    (void)v, (void)order, (void)value;
    return n == 0 ? fmi2OK : sh_fmi2_missing(c);
}

SH_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_return)
{
    sh_fmi2 *s = c;
    (void)no_return;
    int warns = 0;
    if (s == NULL)
        return fmi2Error;
    if (sh_instance_step(&s->own, time, h, &warns) != SH_OK)
        return sh_fmi2_error(s);
    return warns ? sh_fmi2_tell(s, fmi2Warning, "logStatusWarning") : fmi2OK;
}

SH_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return sh_fmi2_says(c, "A step is over when fmi2DoStep returns."); }

SH_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c, (void)kind;
    if (value != NULL)
        *value = fmi2OK;
    return fmi2Discard;
}

SH_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (c == NULL || value == NULL)
        return fmi2Error;
    *value = sh_time(&((sh_fmi2 *)c)->own.twin);
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

SH_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

SH_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    (void)c;
    if (value != NULL)
        *value = 0;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

SH_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c, (void)kind;
    if (value != NULL)
        *value = "";
    return fmi2Discard;
}
