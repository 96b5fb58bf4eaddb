/* An FMU under sanitizers: normal use, then whatever a host can do wrong. Built with FMI=2 or 3 and the FMU's whole
 * source as MODEL. Prints how many calls of each kind were refused; a fault ends the program.
 */
#include MODEL

#include <stdarg.h>

#define SURE(what)                                                        \
    do {                                                                  \
        if (!(what)) {                                                    \
            fprintf(stderr, "line %d: not so: %s\n", __LINE__, #what);    \
            exit(1);                                                      \
        }                                                                 \
    } while (0)

static unsigned long said;
static uint64_t chance = 88172645463325252u;

static uint64_t any(void)
{
    chance ^= chance << 13;
    chance ^= chance >> 7;
    chance ^= chance << 17;
    return chance;
}

static double any_number(void)
{
    static const double odd[] = {NAN, HUGE_VAL, -HUGE_VAL, 0.0, -0.0, 1.0, -1.0, 0.5, 5e-324, 1e300, -1e300, 1e18, -1e9, 3.0, 2147483648.0};
    double x;
    uint64_t bits = any();
    if (bits % 4 != 0)
        return odd[(bits >> 8) % (sizeof odd / sizeof odd[0])];
    bits = any();
    memcpy(&x, &bits, sizeof x);
    return x;
}

#if FMI == 2
typedef fmi2Component instance;
static void say(void *e, const char *name, fmi2Status status, const char *category, const char *text, ...)
{
    char line[800];
    va_list rest;
    (void)e;
    va_start(rest, text);
    vsnprintf(line, sizeof line, text, rest);
    va_end(rest);
    said += strlen(name) + strlen(category) + strlen(line) + (unsigned)status;
    SURE(strchr(line, '\n') == NULL);
}
static const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};
static instance new_one(void) { return fmi2Instantiate("one", fmi2CoSimulation, sh_identity(), "", &callbacks, 0, 0); }
static int enter(instance c, double start)
{
    return fmi2SetupExperiment(c, 0, 0.0, start, 0, 0.0) == fmi2OK ? fmi2EnterInitializationMode(c) : fmi2Error;
}
static int begin(instance c) { return fmi2ExitInitializationMode(c); }
static int step(instance c, double t, double h) { return fmi2DoStep(c, t, h, 1); }
static int set_real(instance c, const unsigned *v, size_t n, const double *x) { return fmi2SetReal(c, v, n, x); }
static int set_int(instance c, const unsigned *v, size_t n, const int *x) { return fmi2SetInteger(c, v, n, x); }
static int get_real(instance c, const unsigned *v, size_t n, double *x) { return fmi2GetReal(c, v, n, x); }
static int get_int(instance c, const unsigned *v, size_t n, int *x) { return fmi2GetInteger(c, v, n, x); }
static int get_bool(instance c, const unsigned *v, size_t n) { int x; return fmi2GetBoolean(c, v, n, n ? &x : NULL); }
static int get_text(instance c, const unsigned *v, size_t n, const char **x) { return fmi2GetString(c, v, n, x); }
#define Keep fmi2GetFMUstate
#define GoBack fmi2SetFMUstate
#define Forget fmi2FreeFMUstate
#define Size fmi2SerializedFMUstateSize
#define Write fmi2SerializeFMUstate
#define Read fmi2DeSerializeFMUstate
#define Free fmi2FreeInstance
#define Reset fmi2Reset
#define End fmi2Terminate
static void without_an_instance(void)
{
    double x = 0.0;
    int i = 0;
    fmi2Status s;
    const char *text;
    unsigned v = 0;
    SURE(fmi2Instantiate(NULL, fmi2ModelExchange, NULL, NULL, NULL, 0, 0) == NULL);
    SURE(fmi2Instantiate(NULL, fmi2CoSimulation, "no", NULL, &callbacks, 0, 0) == NULL);
    SURE(fmi2SetString(NULL, &v, 1, &text) != fmi2OK && fmi2CancelStep(NULL) != fmi2OK);
    fmi2GetStatus(NULL, fmi2DoStepStatus, NULL), fmi2GetStatus(NULL, fmi2DoStepStatus, &s);
    SURE(fmi2GetRealStatus(NULL, fmi2LastSuccessfulTime, &x) != fmi2OK);
    fmi2GetIntegerStatus(NULL, fmi2DoStepStatus, &i), fmi2GetBooleanStatus(NULL, fmi2Terminated, NULL);
    fmi2GetStringStatus(NULL, fmi2PendingStatus, NULL), fmi2SetDebugLogging(NULL, 1, 0, NULL);
    SURE(fmi2GetDirectionalDerivative(NULL, NULL, 0, NULL, 0, NULL, NULL) != fmi2OK);
    SURE(fmi2SetRealInputDerivatives(NULL, &v, 1, &i, &x) != fmi2OK);
    SURE(fmi2GetRealOutputDerivatives(NULL, &v, 1, &i, &x) != fmi2OK);
}
#else
typedef fmi3Instance instance;
static void say(void *e, fmi3Status status, const char *category, const char *text)
{
    (void)e;
    said += strlen(category) + strlen(text) + (unsigned)status;
    SURE(strchr(text, '\n') == NULL);
}
static instance new_one(void)
{
    return fmi3InstantiateCoSimulation("one", sh_identity(), "", 0, 0, 0, 0, NULL, 0, NULL, say, NULL);
}
static int enter(instance c, double start) { return fmi3EnterInitializationMode(c, 0, 0.0, start, 0, 0.0); }
static int begin(instance c) { return fmi3ExitInitializationMode(c); }
static int step(instance c, double t, double h)
{
    bool events, end, early;
    double reached;
    return fmi3DoStep(c, t, h, 1, &events, &end, &early, &reached);
}
static int set_real(instance c, const unsigned *v, size_t n, const double *x) { return fmi3SetFloat64(c, v, n, x, n); }
static int set_int(instance c, const unsigned *v, size_t n, const int *x) { return fmi3SetInt32(c, v, n, x, n); }
static int get_real(instance c, const unsigned *v, size_t n, double *x) { return fmi3GetFloat64(c, v, n, x, n); }
static int get_int(instance c, const unsigned *v, size_t n, int *x) { return fmi3GetInt32(c, v, n, x, n); }
static int get_bool(instance c, const unsigned *v, size_t n) { bool x; return fmi3GetBoolean(c, v, n, n ? &x : NULL, n); }
static int get_text(instance c, const unsigned *v, size_t n, const char **x) { return fmi3GetString(c, v, n, x, n); }
#define Keep fmi3GetFMUState
#define GoBack fmi3SetFMUState
#define Forget fmi3FreeFMUState
#define Size fmi3SerializedFMUStateSize
#define Write fmi3SerializeFMUState
#define Read fmi3DeserializeFMUState
#define Free fmi3FreeInstance
#define Reset fmi3Reset
#define End fmi3Terminate
static void without_an_instance(void)
{
    unsigned v = 0;
    double x = 0.0;
    instance c;
    SURE(fmi3InstantiateModelExchange(NULL, NULL, NULL, 0, 0, NULL, NULL) == NULL);
    SURE(fmi3InstantiateCoSimulation(NULL, NULL, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL) == NULL);
    SURE(fmi3InstantiateScheduledExecution(NULL, NULL, NULL, 0, 0, NULL, say, NULL, NULL, NULL) == NULL);
    SURE(fmi3DoStep(NULL, 0.0, 0.01, 1, NULL, NULL, NULL, NULL) != fmi3OK);
    SURE(fmi3EnterEventMode(NULL) != fmi3OK && fmi3SetTime(NULL, 0.0) != fmi3OK);
    SURE(fmi3GetFloat32(NULL, &v, 1, NULL, 1) != fmi3OK && fmi3GetClock(NULL, NULL, 1, NULL) != fmi3OK);
    SURE((c = new_one()) != NULL);
    SURE(fmi3GetFloat32(c, NULL, 1, NULL, 1) != fmi3OK && fmi3SetUInt8(c, &v, 1, NULL, 1) != fmi3OK);
    SURE(fmi3GetFloat64(c, &v, 1, &x, 0) != fmi3OK && fmi3SetFloat64(c, &v, 1, &x, 0) != fmi3OK);
    SURE(fmi3GetBinary(c, NULL, 1, NULL, NULL, 1) != fmi3OK && fmi3SetString(c, &v, 1, NULL, 1) != fmi3OK);
    SURE(fmi3DoStep(c, 0.0, 0.01, 1, NULL, NULL, NULL, NULL) != fmi3OK);
    Free(c);
}
#endif

/* Everything that can be read, as numbers, truths and texts, whatever its type is. */
static void read_all(instance c)
{
    for (unsigned v = 0; v < (unsigned)sh_count() + 2; v++) {
        double x;
        int i;
        const char *text = "";
        get_real(c, &v, 1, &x);
        get_int(c, &v, 1, &i);
        get_bool(c, &v, 1);
        if (get_text(c, &v, 1, &text) == 0)
            said += strlen(text);
    }
}

static int started(instance c) { return enter(c, 0.0) == 0 && begin(c) == 0; }

static double run(instance c, double t, int n)
{
    int motion = sh_find("s_tip") >= 0;
    for (int k = 0; k < n; k++) {
        if (motion) {
            unsigned v[3] = {(unsigned)sh_find("s_tip"), (unsigned)sh_find("v_tip"), (unsigned)sh_find("a_tip")};
            double x[3] = {sin(0.5 * t), 0.5 * cos(0.5 * t), -0.25 * sin(0.5 * t)};
            SURE(set_real(c, v, 3, x) == 0);
        }
        SURE(step(c, t, SH_T_CYCLE) == 0);
        t += SH_T_CYCLE;
    }
    return t;
}

static void seal_again(unsigned char *bytes, size_t size)
{
    uint32_t crc = sh_crc(bytes, size - SH_CHECKSUM);
    for (size_t i = 0; i < SH_CHECKSUM; i++)
        bytes[size - SH_CHECKSUM + i] = (unsigned char)(crc >> (8 * i));
}

static void damage(unsigned char *bytes, size_t size)
{
    for (uint64_t n = 1 + any() % 3; n > 0; n--) {
        size_t at = (size_t)(any() % size);
        double x = any_number();
        switch (any() % 4) {
        case 0: bytes[at] ^= (unsigned char)(1u << (any() % 8)); break;
        case 1: bytes[at] = (unsigned char)any(); break;
        case 2: memset(bytes + at, (int)(any() % 256), size - at < 40 ? size - at : 40); break;
        default: /* a number as a whole */
            at = SH_HEAD + 8 * (size_t)(any() % ((size - SH_HEAD - SH_CHECKSUM) / 8));
            memcpy(bytes + at, &x, sizeof x);
        }
    }
}

/* Damaged bytes, half of them with a right checksum: refused without a trace, or a state that can be gone on from. */
static unsigned long damaged_states(instance c, int n)
{
    size_t size;
    unsigned long refused = 0;
    unsigned char *good, *bad, *now;
    void *kept = NULL, *read;
    SURE(Keep(c, &kept) == 0 && Size(c, kept, &size) == 0);
    good = malloc(size), bad = malloc(size), now = malloc(size);
    SURE(Write(c, kept, (void *)good, size) == 0);
    for (int i = 0; i < n; i++) {
        size_t length = i % 10 == 0 ? (size_t)(any() % size) : size;
        unsigned char *exact = malloc(length + 1); /* of this very size, so that reading past it is seen */
        memcpy(bad, good, size);
        damage(bad, size);
        if (i % 2)
            seal_again(bad, size);
        memcpy(exact, bad, length);
        read = NULL;
        if (Read(c, (void *)exact, length, &read) != 0) {
            SURE(read == NULL);
            refused++;
        } else {
            SURE(GoBack(c, read) == 0);
            read_all(c);
            step(c, sh_time(&((sh_instance *)c)->twin), SH_T_CYCLE);
            step(c, sh_time(&((sh_instance *)c)->twin), 3.0 * SH_T_CYCLE);
            read_all(c);
            SURE(Forget(c, &read) == 0);
            SURE(GoBack(c, kept) == 0);
        }
        free(exact);
        if (i % 100 == 0) {
            void *after = NULL;
            SURE(Keep(c, &after) == 0 && Write(c, after, (void *)now, size) == 0 && memcmp(now, good, size) == 0);
            SURE(Forget(c, &after) == 0);
        }
    }
    free(good), free(bad), free(now);
    SURE(Forget(c, &kept) == 0 && kept == NULL);
    return refused;
}

/* Calls in any order with any arguments. */
static unsigned long wild_host(instance c, instance other, int n)
{
    unsigned long refused = 0;
    void *states[4] = {NULL, NULL, NULL, NULL}, *gone, *foreign = NULL;
    unsigned char small[16];
    SURE(Keep(other, &foreign) == 0);
    for (int i = 0; i < n; i++) {
        unsigned v[3];
        double x[3];
        int k[3];
        int which = (int)(any() % 4), answer = 0;
        for (int j = 0; j < 3; j++) {
            v[j] = any() % 8 == 0 ? (unsigned)any() : (unsigned)(any() % (unsigned)sh_count());
            x[j] = any_number();
            k[j] = any() % 3 == 0 ? (int)any() : (int)(any() % 9);
        }
        switch (any() % 20) {
        case 0: answer = set_real(c, v, 3, x); break;
        case 1: answer = set_int(c, v, 1, k); break;
        case 2: answer = set_real(c, v, 1, x); break;
        case 3: answer = set_real(c, NULL, 2, x) | get_real(c, v, 1, NULL) | get_text(c, NULL, 1, NULL); break;
        case 4: answer = enter(c, x[0]); break;
        case 5: answer = begin(c); break;
        case 6: answer = step(c, x[0], x[1]); break;
        case 7: answer = step(c, sh_time(&((sh_instance *)c)->twin), x[0]); break;
        case 8: case 9: case 10: answer = step(c, sh_time(&((sh_instance *)c)->twin), (1 + (double)(any() % 3)) * SH_T_CYCLE); break;
        case 11: answer = Reset(c); break;
        case 12: answer = any() % 5 == 0 ? End(c) : 0; break;
        case 13: answer = Keep(c, &states[which]); break;
        case 14: answer = GoBack(c, states[which]); break;
        case 15: answer = Forget(c, &states[which]); break;
        case 16:
            answer = GoBack(c, foreign) | Keep(c, &foreign) | Write(c, states[which], (void *)small, sizeof small);
            SURE(answer != 0);
            break;
        case 17: /* a state that is used after it was let go */
            gone = states[which];
            Forget(c, &states[which]);
            SURE(gone == NULL || (GoBack(c, gone) != 0 && Forget(c, &gone) != 0));
            break;
        case 18:
            answer = Read(c, NULL, 0, &gone) | Read(c, (void *)small, sizeof small, NULL) | Keep(c, NULL);
            SURE(answer != 0);
            break;
        default: read_all(c);
        }
        refused += answer != 0;
        if (any() % 20 == 0) {
            Reset(c);
            started(c);
        }
    }
    SURE(Forget(other, &foreign) == 0);
    return refused;
}

int main(void)
{
    unsigned long damaged, wild;
    double t;
    instance a = new_one(), b = new_one();
    SURE(a != NULL && b != NULL && a != b);
    read_all(a); /* before the start, as if it were now */
    SURE(step(a, 0.0, SH_T_CYCLE) != 0);
    damaged = damaged_states(a, 600);
    SURE(started(a) && started(b) && enter(a, 0.0) != 0 && begin(a) != 0);
    t = run(a, 0.0, 250);
    run(b, 0.0, 50);
    read_all(a);
    damaged += damaged_states(a, 6000);
    SURE(step(a, t + 0.5 * SH_T_CYCLE, SH_T_CYCLE) != 0 && step(a, NAN, SH_T_CYCLE) != 0 && step(a, t, NAN) != 0);
    SURE(step(a, t, 0.5 * SH_T_CYCLE) != 0 && step(a, t, 1e300) != 0 && step(a, t, -SH_T_CYCLE) != 0);
    run(a, t, 50); /* a restart from what was refused is none */
    for (double cycles = -70.0; cycles < 70.0; cycles += 1.0) { /* counts overwritten in memory */
        sh_twin *w = &((sh_instance *)b)->twin;
        w->cycles = cycles * 100.0 - 0.5 * (cycles > 0.0);
        step(b, sh_time(w), SH_T_CYCLE);
        read_all(b);
    }
    SURE(Reset(b) == 0 && started(b));
    wild = wild_host(a, b, 6000);
    without_an_instance();
    SURE(set_real(NULL, NULL, 0, NULL) != 0 && step(NULL, 0.0, 0.01) != 0 && started(NULL) == 0);
    SURE(Reset(NULL) != 0 && End(NULL) != 0 && Keep(NULL, NULL) != 0 && GoBack(NULL, NULL) != 0);
    SURE(Forget(NULL, NULL) != 0 && Size(NULL, NULL, NULL) != 0 && Write(NULL, NULL, NULL, 0) != 0);
    SURE(Read(NULL, NULL, 0, NULL) != 0);
    Free(NULL);
    void *left = NULL;
    SURE(Keep(b, &left) == 0); /* left behind by the host */
    Free(a), Free(b);
    printf("%lu %lu %lu\n", damaged, wild, said);
    return 0;
}
