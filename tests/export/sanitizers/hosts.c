/* The libraries for OrcaFlex (HOST=1) and SIMO (HOST=2) under sanitizers, linked with MODEL's object: normal use, a
 * stored and a resumed simulation, damaged states, wrong steps, no numbers, null pointers, calls out of order. Prints
 * how many damaged states were refused, how many calls were, and how much was said.
 */
#define main mock_main
#if HOST == 1
#include "../hosts/host_orcaflex.c"
void StillhookWinch(Info *info);
#else
#include "../hosts/host_simo.c"
void gfexfo_(int *, float *, double *, int *, int *, float *, int *, float *, float *, int *, float *, float *, int *,
             int *, int *, int *, int *, int *, int *, char *, double *, double *, double *, float *, int *);
#endif
#undef main
#include <stdint.h>

void *stillhook_new(double wire_out, double v_op, double mode);
void stillhook_free(void *e);
int stillhook_exchange(void *e, double time, double F_w, double s_tip, double v_tip, double a_tip, int new_step,
                       double *payout, double *s_w);
double stillhook_get(void *e, const char *name);
int64_t stillhook_size(void);
void stillhook_save(const void *e, void *bytes);
int stillhook_restore(void *e, const void *bytes, int64_t size);
const char *stillhook_why(const void *e);
const char *stillhook_words(int answer);

#define SURE(what)                                                     \
    do {                                                               \
        if (!(what)) {                                                 \
            fprintf(stderr, "line %d: not so: %s\n", __LINE__, #what); \
            exit(1);                                                   \
        }                                                              \
    } while (0)

enum { HEAD = 80, CHECKSUM = 4 };
static uint64_t chance = 88172645463325252u;
static unsigned long said, calls_refused;

static uint64_t any(void)
{
    chance ^= chance << 13;
    chance ^= chance >> 7;
    chance ^= chance << 17;
    return chance;
}

static double any_number(void)
{
    static const double odd[] = {NAN, HUGE_VAL, -HUGE_VAL, 0.0, 1.0, -1.0, 0.5, 5e-324, 1e300, -1e18, 1e6, 100.0};
    return odd[any() % (sizeof odd / sizeof odd[0])];
}

static void seal_again(unsigned char *bytes, size_t size)
{
    uint32_t crc = 0xffffffff;
    for (size_t i = 0; i < size - CHECKSUM; i++) {
        crc ^= bytes[i];
        for (int b = 0; b < 8; b++)
            crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320 : 0);
    }
    crc = ~crc;
    for (int i = 0; i < CHECKSUM; i++)
        bytes[size - CHECKSUM + (size_t)i] = (unsigned char)(crc >> (8 * i));
}

static void damage(unsigned char *bytes, size_t size)
{
    size_t at = (size_t)(any() % size);
    double x = any_number();
    switch (any() % 3) {
    case 0: bytes[at] ^= (unsigned char)(1u << (any() % 8)); break;
    case 1: memset(bytes + at, (int)(any() % 256), size - at < 40 ? size - at : 40); break;
    default:
        at = HEAD + 8 * (size_t)(any() % ((size - HEAD - CHECKSUM) / 8));
        memcpy(bytes + at, &x, sizeof x);
    }
}

static int at(void *e, double t, double F_w, double *payout)
{
    double s_w, v = 0.5 * cos(0.5 * t);
    int answer = stillhook_exchange(e, t, F_w, 20.0 + sin(0.5 * t), v, -0.25 * sin(0.5 * t), 1, payout, &s_w);
    said += strlen(stillhook_words(answer));
    calls_refused += answer != 0;
    return answer;
}

static unsigned long plain_interface(void)
{
    double x, y, t = 0.0;
    unsigned long refused = 0;
    size_t size = (size_t)stillhook_size();
    void *a = stillhook_new(NAN, 0.1, NAN), *b = stillhook_new(200.0, 0.0, NAN), *odd = stillhook_new(1e300, NAN, 77.5);
    unsigned char *good = malloc(size), *bad = malloc(size);
    stillhook_save(a, good);
    SURE(stillhook_restore(b, good, (int64_t)size) == 0); /* before the first sample */
    SURE(at(odd, 0.0, 1e6, &x) != 0 && stillhook_get(odd, "s_w") == stillhook_get(odd, "s_w"));
    for (int i = 0; i < 120; i++) {
        SURE(at(a, t, 1.01e6, &x) == 0);
        t += 0.0137;
    }
    SURE(stillhook_get(a, "none") != stillhook_get(a, "none") && stillhook_get(NULL, "s_w") != 0.0);
    stillhook_get(a, NULL), stillhook_why(NULL), stillhook_words(-5), stillhook_words(99);
    SURE(stillhook_exchange(NULL, t, 1e6, 0.0, 0.0, 0.0, 1, &x, &y) != 0);
    SURE(stillhook_exchange(a, t, 1e6, 0.0, 0.0, 0.0, 1, NULL, NULL) != 0);
    stillhook_save(a, good);
    for (int i = 0; i < 12; i++) /* no numbers, times back and far ahead: refused without a trace */
        if (stillhook_exchange(a, i < 6 ? any_number() : i < 9 ? 0.5 : 1e12, i < 6 ? NAN : 1e6, 0.0, 0.0, 0.0, 1, &x, &y))
            calls_refused++;
    SURE(stillhook_exchange(a, 0.5, 1e6, 0.0, 0.0, 0.0, 1, &x, &y) != 0);
    SURE(stillhook_restore(NULL, good, (int64_t)size) != 0 && stillhook_restore(b, NULL, (int64_t)size) != 0);
    SURE(stillhook_restore(b, good, -1) != 0);
    for (int i = 0; i < 4000; i++) {
        size_t length = i % 10 == 0 ? (size_t)(any() % size) : size;
        unsigned char *exact = malloc(length + 1);
        memcpy(bad, good, size);
        damage(bad, size);
        if (i % 2)
            seal_again(bad, size);
        memcpy(exact, bad, length);
        if (stillhook_restore(b, exact, (int64_t)length) != 0) {
            refused++;
            said += strlen(stillhook_why(b));
        } else {
            at(b, t, 1.01e6, &x);
            at(b, t + 0.5, 1.02e6, &x);
        }
        free(exact);
    }
    SURE(stillhook_restore(b, good, (int64_t)size) == 0);
    stillhook_save(b, bad);
    SURE(memcmp(good, bad, size) == 0 && at(a, t, 1.01e6, &x) == 0 && at(b, t, 1.01e6, &y) == 0 && x == y);
    free(good), free(bad);
    stillhook_free(a), stillhook_free(b), stillhook_free(odd), stillhook_free(NULL);
    return refused;
}

#if HOST == 1
static int of(Info *info, int action)
{
    recorded[0] = 0;
    info->Action = action;
    StillhookWinch(info);
    said += strlen(recorded);
    calls_refused += recorded[0] != 0;
    return recorded[0] == 0;
}

static void host_itself(void)
{
    static const wchar_t *const parameters[] = {
        L"TipObject=Vessel", L"", L"TipObject=", L"=", L"TipObject=Tug", L"TipObject=Vessel\nTipPosition=1 2 x",
        L"TipObject=Vessel\nMode=fast", L"TipObject=Vessel\nWireOut=1e999", L"TipObject // x\n//\n\n=\nTipObject=Vessel"};
    wchar_t wide[3000];
    Info info;
    unsigned char *kept, *bad;
    size_t size;
    memset(&info, 0, sizeof info);
    info.Size = (int)sizeof info;
    info.ObjectHandle = &winch;
    for (int action = 0; action < 14; action++) /* before it is initialised; and with no parameters at all */
        of(&info, action), of(&info, 1);
    for (size_t i = 0; i < sizeof parameters / sizeof parameters[0]; i++) {
        info.lpObjectParameters = parameters[i];
        of(&info, 0), of(&info, 1), of(&info, 1);
    }
    wmemset(wide, L'x', 2999);
    wide[2999] = 0;
    wide[9] = L'=';
    wmemcpy(wide, L"TipObject", 9);
    info.lpObjectParameters = wide;
    info.lpDataName = wide;
    SURE(!of(&info, 0));
    info.lpDataName = L"WholeSimulationPayoutRate";
    SURE(!of(&info, 0));
    info.lpObjectParameters = parameters[0];
    SURE(of(&info, 0) && of(&info, 10));
    row[1] = 1.01e6;
    for (int i = 0; i < 100; i++) {
        info.SimulationTime = row[0] = 0.023 * i;
        row[2] = sin(0.5 * row[0]), row[3] = 0.5 * cos(0.5 * row[0]), row[4] = -0.25 * sin(0.5 * row[0]);
        info.NewTimeStep = 1;
        SURE(of(&info, 2));
    }
    SURE(of(&info, 3) && of(&info, 3));
    size = (size_t)info.LengthOfStateData;
    kept = malloc(size), bad = malloc(size);
    memcpy(kept, info.lpStateData, size);
    SURE(of(&info, 4) && of(&info, 4));
    row[3] = NAN;
    SURE(!of(&info, 2));
    row[3] = 0.0;
    SURE(of(&info, 1));
    for (int i = 0; i < 500; i++) {
        memcpy(bad, kept, size);
        damage(bad, size);
        info.lpStateData = bad;
        info.LengthOfStateData = i % 10 ? (int)size : (int)(any() % size) - 5;
        if (memcmp(bad, kept, size) != 0)
            SURE(!of(&info, 0) && info.lpData == NULL);
    }
    info.lpStateData = kept;
    info.LengthOfStateData = (int)size;
    SURE(of(&info, 0) && of(&info, 3) && of(&info, 2) && of(&info, 1));
    free(kept), free(bad);
}
#else
static int si(int body, double time, double h, int step, int substeps, int ints, double odd)
{
    int none = 0, info[12] = {0}, bodies[2] = {1, 2}, error = 0, reals = 7;
    float info_r[6] = {0}, stor[9] = {0}, unused = 0.0f;
    double other = 0.0, places[24] = {0};
    char text[120] = {0};
    info[2] = body;
    info[4] = 2;
    info[5] = step;
    info[7] = 1;
    info[8] = substeps;
    info_r[0] = (float)time;
    info_r[1] = (float)h;
    places[2] = sin(0.5 * time);
    places[14] = -100.0 + odd;
    gfexfo_(&none, &unused, &other, &none, info, info_r, &none, &unused, &unused, bodies, tip, &unused, &none, &none,
            &none, &ints, &reals, &none, &none, text, places, &other, &other, stor, &error);
    calls_refused += error != 0;
    said += error != 0;
    return error == 0;
}

static void host_itself(void)
{
    for (int i = 0; i < 60; i++) {
        SURE(si(2, 0.05 * i, 0.05, i + 1, 1, 2, 0.0) && si(2, 0.05 * i, 0.05, i + 1, 1, 2, 1e-3));
        SURE(si(1, 0.05 * i, 0.05, i + 1, 1, 2, 0.0));
    }
    SURE(!si(3, 3.0, 0.05, 61, 1, 2, 0.0) && !si(2, 3.0, 0.05, 61, 1, 0, 0.0));
    for (int i = 0; i < 400; i++)
        si(1 + (int)(any() % 3), any_number(), any() % 2 ? 0.05 : any_number(), (int)any(), (int)any(), 2, any_number());
    SURE(si(2, 0.0, 0.05, 1, 1, 2, 0.0)); /* a new run */
}
#endif

int main(void)
{
    unsigned long refused = plain_interface();
    host_itself();
    printf("%lu %lu %lu\n", refused, calls_refused, said);
    return 0;
}
