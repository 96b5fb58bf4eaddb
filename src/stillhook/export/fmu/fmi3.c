/* FMI 3.0 for co-simulation, by the standard's text: Modelica Association, "Functional Mock-up Interface
 * Specification", version 3.0.2, 2024. */
#include <stdbool.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind;
typedef int fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);
typedef const fmi3ValueReference *sh_references;

typedef struct {
    sh_instance own;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment host;
} sh_fmi3;

static fmi3Status sh_fmi3_tell(sh_fmi3 *c, fmi3Status status, const char *category)
{
    if (c->log != NULL)
        c->log(c->host, status, category, c->own.message);
    return status;
}

static fmi3Status sh_fmi3_error(sh_fmi3 *c) { return sh_fmi3_tell(c, fmi3Error, "logStatusError"); }

static fmi3Status sh_fmi3_says(fmi3Instance c, const char *text)
{
    sh_fmi3 *s = c;
    if (s == NULL)
        return fmi3Error;
    snprintf(s->own.message, sizeof s->own.message, "%s", text);
    return sh_fmi3_error(s);
}

/* Whether there is an instance, and arrays for n values. */
static int sh_fmi3_usable(fmi3Instance c, size_t n, const void *references, const void *values, size_t room)
{
    int good = n == 0 || (references != NULL && values != NULL && room >= n);
    if (c != NULL && !good)
        sh_fmi3_says(c, "No array of value references or values was given, or no room in it.");
    return c != NULL && good;
}

static fmi3Status sh_fmi3_missing(fmi3Instance c) { return sh_fmi3_says(c, "This FMU does not have this function."); }

static fmi3Status sh_fmi3_untyped(fmi3Instance c, fmi3ValueReference v)
{
    sh_fmi3 *s = c;
    snprintf(s->own.message, sizeof s->own.message, "Value reference %u (%s): no variable of this type.", (unsigned)v,
             sh_name((int)v));
    return sh_fmi3_error(s);
}

/* The answer for a type that no variable has. */
static fmi3Status sh_fmi3_none(fmi3Instance c, sh_references v, size_t n)
{
    if (!sh_fmi3_usable(c, n, v, v, n))
        return fmi3Error;
    return n == 0 ? fmi3OK : sh_fmi3_untyped(c, v[0]);
}

SH_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

SH_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)c, (void)on, (void)n, (void)categories; /* errors alone are told, and always */
    return fmi3OK;
}

SH_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                    fmi3Boolean visible, fmi3Boolean logging,
                                                    fmi3InstanceEnvironment host, fmi3LogMessageCallback log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    if (log != NULL)
        log(host, fmi3Error, "logStatusError", "This FMU is for co-simulation.");
    return NULL;
}

SH_EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                                   fmi3Boolean early, sh_references wanted, size_t n,
                                                   fmi3InstanceEnvironment host, fmi3LogMessageCallback log,
                                                   fmi3IntermediateUpdateCallback update)
{
    (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)wanted, (void)n, (void)update;
    const char *wrong = token == NULL || strcmp(token, sh_identity()) != 0 ? "The token is that of another FMU." : NULL;
    sh_instance *made = wrong == NULL ? sh_instance_new(name) : NULL;
    sh_fmi3 *s = made != NULL ? calloc(1, sizeof *s) : NULL;
    if (s != NULL) {
        s->own = *made;
        s->host = host;
        s->log = log;
    } else if (log != NULL)
        log(host, fmi3Error, "logStatusError", wrong ? wrong : "No memory.");
    free(made);
    return s;
}

SH_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                         fmi3Boolean visible, fmi3Boolean logging,
                                                         fmi3InstanceEnvironment host, fmi3LogMessageCallback log,
                                                         fmi3ClockUpdateCallback update,
                                                         fmi3LockPreemptionCallback lock,
                                                         fmi3UnlockPreemptionCallback unlock)
{
    (void)update, (void)lock, (void)unlock;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, host, log);
}

SH_EXPORT void fmi3FreeInstance(fmi3Instance c)
{
    if (c != NULL)
        sh_instance_clear(&((sh_fmi3 *)c)->own);
    free(c);
}

SH_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                                 fmi3Float64 start, fmi3Boolean stops, fmi3Float64 stop)
{
    sh_fmi3 *s = c;
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    if (s == NULL || s->own.phase != SH_INSTANTIATED)
        return sh_fmi3_says(c, "fmi3EnterInitializationMode: the instance is initialized already. Reset it.");
    if (!(fabs(start) <= SH_MOST_TIME))
        return sh_fmi3_says(c, "startTime: give a number of seconds up to 1e12.");
    s->own.start = start;
    s->own.phase = SH_INITIALIZATION;
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    sh_fmi3 *s = c;
    if (s == NULL || s->own.phase != SH_INITIALIZATION)
        return sh_fmi3_says(c, "fmi3ExitInitializationMode: the instance is not in initialization mode.");
    s->own.phase = SH_RUNNING;
    return sh_instance_start(&s->own) == SH_OK ? fmi3OK : sh_fmi3_error(s);
}

SH_EXPORT fmi3Status fmi3Terminate(fmi3Instance c)
{
    if (c == NULL)
        return fmi3Error;
    ((sh_fmi3 *)c)->own.phase = SH_TERMINATED;
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3Reset(fmi3Instance c)
{
    sh_fmi3 *s = c;
    if (s == NULL)
        return fmi3Error;
    sh_instance_reset(&s->own);
    return fmi3OK;
}

/* What is set together is set whole or not at all. */
#define SH_PUT(Name, kind, type)                                                                                      \
    SH_EXPORT fmi3Status fmi3Set##Name(fmi3Instance c, sh_references v, size_t n, const type value[], size_t room)    \
    {                                                                                                                 \
        if (!sh_fmi3_usable(c, n, v, value, room))                                                                          \
            return fmi3Error;                                                                                         \
        for (size_t i = 0; i < n; i++)                                                                                \
            if (sh_instance_may_set(&((sh_fmi3 *)c)->own, (int)v[i], kind, (double)value[i]) != SH_OK)                \
                return sh_fmi3_error(c);                                                                              \
        for (size_t i = 0; i < n; i++)                                                                                \
            sh_set(&((sh_fmi3 *)c)->own.twin, (int)v[i], (double)value[i]);                                           \
        return fmi3OK;                                                                                                \
    }
#define SH_ACCESS(Name, kind, type)                                                                                   \
    SH_EXPORT fmi3Status fmi3Get##Name(fmi3Instance c, sh_references v, size_t n, type value[], size_t room)          \
    {                                                                                                                 \
        if (!sh_fmi3_usable(c, n, v, value, room))                                                                          \
            return fmi3Error;                                                                                         \
        for (size_t i = 0; i < n; i++) {                                                                              \
            if (!sh_is_type((int)v[i], kind))                                                                         \
                return sh_fmi3_untyped(c, v[i]);                                                                      \
            value[i] = (type)sh_get(&((sh_fmi3 *)c)->own.twin, (int)v[i]);                                            \
        }                                                                                                             \
        return fmi3OK;                                                                                                \
    }                                                                                                                 \
    SH_PUT(Name, kind, type)
SH_ACCESS(Int32, SH_INTEGER, int32_t)
SH_ACCESS(Boolean, SH_BOOLEAN, fmi3Boolean)
SH_PUT(Float64, SH_REAL, fmi3Float64)

/* The value reference behind those of the table is the time. */
SH_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, sh_references v, size_t n, fmi3Float64 value[], size_t room)
{
    if (!sh_fmi3_usable(c, n, v, value, room))
        return fmi3Error;
    sh_twin *twin = &((sh_fmi3 *)c)->own.twin;
    for (size_t i = 0; i < n; i++) {
        if (!sh_is_type((int)v[i], SH_REAL) && (int)v[i] != sh_count())
            return sh_fmi3_untyped(c, v[i]);
        value[i] = (int)v[i] == sh_count() ? sh_time(twin) : sh_get(twin, (int)v[i]);
    }
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3GetString(fmi3Instance c, sh_references v, size_t n, fmi3String value[], size_t room)
{
    if (!sh_fmi3_usable(c, n, v, value, room))
        return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (!sh_is_type((int)v[i], SH_TEXT))
            return sh_fmi3_untyped(c, v[i]);
        value[i] = sh_text(&((sh_fmi3 *)c)->own.twin, (int)v[i]);
    }
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3SetString(fmi3Instance c, sh_references v, size_t n, const fmi3String value[], size_t room)
{
    (void)v, (void)value, (void)room;
    return n == 0 ? fmi3OK : sh_fmi3_says(c, "Texts of this FMU are outputs.");
}

/* Types that no variable has. */
#define SH_NONE(Name, type)                                                                                           \
    SH_EXPORT fmi3Status fmi3Get##Name(fmi3Instance c, sh_references v, size_t n, type value[], size_t room)          \
    {                                                                                                                 \
        (void)value, (void)room;                                                                                      \
        return sh_fmi3_none(c, v, n);                                                            \
    }                                                                                                                 \
    SH_EXPORT fmi3Status fmi3Set##Name(fmi3Instance c, sh_references v, size_t n, const type value[], size_t room)    \
    {                                                                                                                 \
        (void)value, (void)room;                                                                                      \
        return sh_fmi3_none(c, v, n);                                                            \
    }
SH_NONE(Float32, float)
SH_NONE(Int8, int8_t)
SH_NONE(UInt8, uint8_t)
SH_NONE(Int16, int16_t)
SH_NONE(UInt16, uint16_t)
SH_NONE(UInt32, uint32_t)
SH_NONE(Int64, int64_t)
SH_NONE(UInt64, uint64_t)

SH_EXPORT fmi3Status fmi3GetBinary(fmi3Instance c, sh_references v, size_t n, size_t sizes[], fmi3Binary value[],
                                   size_t room)
{
    (void)sizes, (void)value, (void)room;
    return sh_fmi3_none(c, v, n);
}

SH_EXPORT fmi3Status fmi3SetBinary(fmi3Instance c, sh_references v, size_t n, const size_t sizes[],
                                   const fmi3Binary value[], size_t room)
{
    (void)sizes, (void)value, (void)room;
    return sh_fmi3_none(c, v, n);
}

SH_EXPORT fmi3Status fmi3GetClock(fmi3Instance c, sh_references v, size_t n, fmi3Clock value[])
{
    (void)value;
    return sh_fmi3_none(c, v, n);
}

SH_EXPORT fmi3Status fmi3SetClock(fmi3Instance c, sh_references v, size_t n, const fmi3Clock value[])
{
    (void)value;
    return sh_fmi3_none(c, v, n);
}

static fmi3Status sh_fmi3_answer(fmi3Instance c, int answer) { return answer == SH_OK ? fmi3OK : sh_fmi3_error(c); }

SH_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return c == NULL ? fmi3Error : sh_fmi3_answer(c, sh_instance_keep(&((sh_fmi3 *)c)->own, state));
}

SH_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    return c == NULL ? fmi3Error : sh_fmi3_answer(c, sh_instance_go_back(&((sh_fmi3 *)c)->own, state));
}

SH_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return c == NULL ? fmi3Error : sh_fmi3_answer(c, sh_instance_forget(&((sh_fmi3 *)c)->own, state));
}

SH_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    if (c == NULL || size == NULL || sh_kept_at(&((sh_fmi3 *)c)->own, state) == NULL)
        return c == NULL || size == NULL ? fmi3Error : sh_fmi3_error(c);
    *size = SH_STATE_SIZE;
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    if (c == NULL)
        return fmi3Error;
    return sh_fmi3_answer(c, sh_instance_serialize(&((sh_fmi3 *)c)->own, state, (unsigned char *)bytes, size));
}

SH_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    if (c == NULL)
        return fmi3Error;
    return sh_fmi3_answer(
        c, sh_instance_deserialize(&((sh_fmi3 *)c)->own, (const unsigned char *)bytes, size, state));
}

SH_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    (void)c; /* there is no event mode to come from */
    return fmi3OK;
}

SH_EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 h, fmi3Boolean no_return,
                                fmi3Boolean *events, fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached)
{
    sh_fmi3 *s = c;
    (void)no_return;
    if (s == NULL || events == NULL || end == NULL || early == NULL || reached == NULL)
        return sh_fmi3_says(c, "fmi3DoStep: no room for what it answers was given.");
    int warns = 0, answer = sh_instance_step(&s->own, time, h, &warns);
    *events = *end = *early = false;
    *reached = sh_time(&s->own.twin);
    if (answer != SH_OK)
        return sh_fmi3_error(s);
    return warns ? sh_fmi3_tell(s, fmi3Warning, "logStatusWarning") : fmi3OK;
}

/* Functions of what this FMU does not have: events, clocks, continuous states, derivatives, structural parameters. */
#define SH_MISSING(Name, ...)                         \
    SH_EXPORT fmi3Status fmi3##Name(__VA_ARGS__)      \
    {                                                 \
        return sh_fmi3_missing(c);                    \
    }
#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
SH_MISSING(EnterEventMode, fmi3Instance c)
SH_MISSING(GetNumberOfVariableDependencies, fmi3Instance c, fmi3ValueReference v, size_t *n)
SH_MISSING(GetVariableDependencies, fmi3Instance c, fmi3ValueReference v, size_t a[], fmi3ValueReference b[], size_t d[],
           fmi3DependencyKind kinds[], size_t n)
SH_MISSING(GetDirectionalDerivative, fmi3Instance c, sh_references u, size_t nu, sh_references k, size_t nk,
           const fmi3Float64 seed[], size_t ns, fmi3Float64 out[], size_t no)
SH_MISSING(GetAdjointDerivative, fmi3Instance c, sh_references u, size_t nu, sh_references k, size_t nk,
           const fmi3Float64 seed[], size_t ns, fmi3Float64 out[], size_t no)
SH_MISSING(EnterConfigurationMode, fmi3Instance c)
SH_MISSING(ExitConfigurationMode, fmi3Instance c)
SH_MISSING(GetIntervalDecimal, fmi3Instance c, sh_references v, size_t n, fmi3Float64 x[], fmi3IntervalQualifier q[])
SH_MISSING(GetIntervalFraction, fmi3Instance c, sh_references v, size_t n, uint64_t a[], uint64_t b[],
           fmi3IntervalQualifier q[])
SH_MISSING(GetShiftDecimal, fmi3Instance c, sh_references v, size_t n, fmi3Float64 x[])
SH_MISSING(GetShiftFraction, fmi3Instance c, sh_references v, size_t n, uint64_t a[], uint64_t b[])
SH_MISSING(SetIntervalDecimal, fmi3Instance c, sh_references v, size_t n, const fmi3Float64 x[])
SH_MISSING(SetIntervalFraction, fmi3Instance c, sh_references v, size_t n, const uint64_t a[], const uint64_t b[])
SH_MISSING(SetShiftDecimal, fmi3Instance c, sh_references v, size_t n, const fmi3Float64 x[])
SH_MISSING(SetShiftFraction, fmi3Instance c, sh_references v, size_t n, const uint64_t a[], const uint64_t b[])
SH_MISSING(EvaluateDiscreteStates, fmi3Instance c)
SH_MISSING(UpdateDiscreteStates, fmi3Instance c, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e,
           fmi3Boolean *f, fmi3Float64 *next)
SH_MISSING(EnterContinuousTimeMode, fmi3Instance c)
SH_MISSING(CompletedIntegratorStep, fmi3Instance c, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *d)
SH_MISSING(SetTime, fmi3Instance c, fmi3Float64 time)
SH_MISSING(SetContinuousStates, fmi3Instance c, const fmi3Float64 x[], size_t n)
SH_MISSING(GetContinuousStateDerivatives, fmi3Instance c, fmi3Float64 x[], size_t n)
SH_MISSING(GetEventIndicators, fmi3Instance c, fmi3Float64 x[], size_t n)
SH_MISSING(GetContinuousStates, fmi3Instance c, fmi3Float64 x[], size_t n)
SH_MISSING(GetNominalsOfContinuousStates, fmi3Instance c, fmi3Float64 x[], size_t n)
SH_MISSING(GetNumberOfEventIndicators, fmi3Instance c, size_t *n)
SH_MISSING(GetNumberOfContinuousStates, fmi3Instance c, size_t *n)
SH_MISSING(GetOutputDerivatives, fmi3Instance c, sh_references v, size_t n, const int32_t orders[], fmi3Float64 x[],
           size_t room)
SH_MISSING(ActivateModelPartition, fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif
