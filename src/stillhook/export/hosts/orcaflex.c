/* Native external function for the pay-out rate of a winch of OrcaFlex: the same as orcaflex.py. Written from the
 * public help of OrcFxAPI (Orcina: "Native external functions", TExtFnInfo); numbers of the model are in its units,
 * which are asked for. Exports StillhookWinch and RegisterCapabilities (Unicode, implicit integration).
 */
#include <stdlib.h>
#include <wchar.h>
#if defined(_WIN32)
#define SH_CALL __stdcall
#define SH_EXPORT __declspec(dllexport)
__declspec(dllimport) void *__stdcall GetModuleHandleA(const char *name);
__declspec(dllimport) void *__stdcall GetProcAddress(void *module, const char *name);
#else
#define SH_CALL
#define SH_EXPORT __attribute__((visibility("default")))
#include <dlfcn.h>
#endif

enum { OF_INITIALISE, OF_FINALISE, OF_CALCULATE, OF_STORE_CREATE, OF_STORE_DESTROY };
enum { OF_UNICODE = 1, OF_IMPLICIT = 2, OF_NOW = 32005, OF_OK = 0 };

#pragma pack(push, 1) /* as in the interface */
typedef struct {
    int size;
    double environment[3];
    int line_point, node;
    double arc_length;
    int radial;
    double theta;
    const wchar_t *wing, *clearance_line;
    int winch_point;
    double rigid_body[3];
    const wchar_t *external_text, *disturbance_vessel;
    int support;
    const wchar_t *supported_line;
} of_extra;

typedef struct {
    int number, unused;
    double from, to;
} of_period;

typedef struct {
    void *handle;
    int type;
    wchar_t name[50];
} of_object;

typedef struct {
    int size, action;
    double time, value;
    int successful;
    void *object;
    const of_extra *extra;
    const wchar_t *parameters;
    const void *working;
    void *data;
    const wchar_t *source_name;
    void *state;
    int state_length;
    const wchar_t *data_name;
    const void *instant;
    const wchar_t *directory;
    int in_statics;
    void *log;
    int log_length, result, new_step;
    void *struct_value;
    void *model;
} of_info;
#pragma pack(pop)

typedef void(SH_CALL *of_time_history)(void *, const of_extra *, const of_period *, int, double *, int *);
typedef void(SH_CALL *of_var_id)(void *, const wchar_t *, int *, int *);
typedef void(SH_CALL *of_called)(void *, const wchar_t *, of_object *, int *);
typedef void(SH_CALL *of_factor)(void *, const wchar_t *, double *, int *);
typedef void(SH_CALL *of_model_of)(void *, void **, int *);
typedef void(SH_CALL *of_error)(of_info *, const wchar_t *, int *);

enum { OF_TENSION, OF_POSITION, OF_SPEED, OF_ACCELERATION, OF_READ };
enum { OF_POINTS = SH_BOOM ? 3 : 1 }; /* whose heights are read: the tip; or what a motion unit feels of the vessel */

typedef struct {
    sh_exchange exchange;
    void *object[OF_READ];
    int result[OF_READ];
    of_extra tip;
    double force, length;
    unsigned char *stored; /* the state that the host is given, until it is told to let go */
} of_winch;

/* A function of OrcFxAPI, which the host has loaded. */
static void of_find(const char *name, void *pointer)
{
#if defined(_WIN32)
    void *module = GetModuleHandleA("OrcFxAPI.dll");
    void *found = GetProcAddress(module ? module : GetModuleHandleA(NULL), name);
#else
    void *found = dlsym(RTLD_DEFAULT, name);
#endif
    memcpy(pointer, &found, sizeof found);
}

static void of_say(of_info *info, const wchar_t *first, const wchar_t *second, const char *third)
{
    wchar_t text[600];
    of_error record;
    int status = 0;
    size_t n;
    text[0] = 0;
    wcsncat(text, L"Stillhook: ", 20);
    wcsncat(text, first, 200);
    wcsncat(text, second, 150);
    for (n = wcslen(text); *third && n < 590; n++)
        text[n] = (wchar_t)*third++;
    text[n] = 0;
    of_find("C_RecordExternalFunctionErrorW", &record);
    if (record != NULL)
        record(info, text, &status);
}

static int of_space(wchar_t c) { return c == L' ' || c == L'\t' || c == L'\r'; }
static wchar_t of_small(wchar_t c) { return c >= L'A' && c <= L'Z' ? (wchar_t)(c + 32) : c; }

/* The value of a line NAME=value of the object's parameters, without a comment behind //; 0 for none. */
static int of_parameter(const wchar_t *text, const wchar_t *name, wchar_t *to, int room)
{
    for (const wchar_t *line = text; line != NULL && *line;) {
        const wchar_t *end = line, *p = line, *q = name;
        while (*end && *end != L'\n' && !(end[0] == L'/' && end[1] == L'/'))
            end++;
        while (p < end && of_space(*p))
            p++;
        while (p < end && *q && of_small(*p) == of_small(*q))
            p++, q++;
        while (p < end && of_space(*p))
            p++;
        if (!*q && p < end && *p == L'=') {
            int n = 0;
            for (p++; p < end && of_space(*p); p++)
                ;
            while (end > p && of_space(end[-1]))
                end--;
            while (p < end && n < room - 1)
                to[n++] = *p++;
            to[n] = 0;
            return n > 0;
        }
        line = wcschr(line, L'\n');
        line = line ? line + 1 : NULL;
    }
    return 0;
}

/* Numbers of a parameter; 0 where it is none. */
static int of_numbers(const wchar_t *text, double *to, int count)
{
    for (int i = 0; i < count; i++) {
        wchar_t *end;
        while (*text == L',' || of_space(*text))
            text++;
        to[i] = wcstod(text, &end);
        if (end == text || !sh_finite(to[i]))
            return 0;
        text = end;
    }
    while (of_space(*text))
        text++;
    return *text == 0;
}

static int of_result(of_info *info, of_winch *w, int which, const wchar_t *parameter, const wchar_t *first,
                     const wchar_t *second)
{
    wchar_t own[100];
    const wchar_t *names[2] = {first, second};
    int status = 1;
    of_var_id var_id;
    of_find("C_GetVarIDW", &var_id);
    if (of_parameter(info->parameters, parameter, own, 100))
        names[0] = names[1] = own;
    for (int i = 0; i < 2 && status != OF_OK && var_id != NULL; i++)
        var_id(w->object[which], names[i], &w->result[which], &status);
    if (status != OF_OK)
        of_say(info, L"no result ", names[0], ". Name it in the parameters, as the results form shows it.");
    return status == OF_OK;
}

static int of_modes(const wchar_t *name, double *mode)
{
    static const char *const names[] = {SH_MODE_NAMES};
    for (int i = 0; i < SH_MODES; i++) {
        size_t n = 0;
        while (names[i][n] && of_small(name[n]) == (wchar_t)names[i][n])
            n++;
        if (!names[i][n] && !name[n]) {
            *mode = sh_modes[i];
            return 1;
        }
    }
    return 0;
}

static int of_fill(of_info *info, of_winch *w)
{
    wchar_t text[200];
    of_called called;
    of_factor factor;
    of_model_of model_of;
    of_object tip;
    void *model = NULL;
    double v = 0.0;
    int status = 1, force = 1;
    of_find("C_ObjectCalledW", &called);
    of_find("C_GetUnitsConversionFactorW", &factor);
    of_find("C_GetModelHandle", &model_of);
    if (called == NULL || factor == NULL || model_of == NULL) {
        of_say(info, L"this version of OrcaFlex", L"",
               " lacks functions of OrcFxAPI that are needed: use the Python one.");
        return 0;
    }
    factor(info->object, L"FF", &w->force, &force);
    factor(info->object, L"LL", &w->length, &status);
    if (force != OF_OK || status != OF_OK) {
        of_say(info, L"the units of the model", L"", " are not said by OrcFxAPI. Choose SI units.");
        return 0;
    }
    if (!of_parameter(info->parameters, L"TipObject", text, 200)) {
        of_say(info, L"TipObject", L"", " is missing. Name the object that the crane tip is fixed to.");
        return 0;
    }
    memset(&tip, 0, sizeof tip);
    model_of(info->object, &model, &status);
    if (status == OF_OK)
        called(model, text, &tip, &status);
    if (status != OF_OK) {
        of_say(info, L"TipObject: no object ", text, " is in the model. Name one.");
        return 0;
    }
    w->object[OF_TENSION] = info->object;
    for (int i = OF_POSITION; i < OF_READ; i++)
        w->object[i] = tip.handle;
    w->tip.size = sizeof w->tip;
    double place[3] = {0.0, 0.0, 0.0}; /* the record is packed: no pointer into it */
    if (of_parameter(info->parameters, L"TipPosition", text, 200) && !of_numbers(text, place, 3)) {
        of_say(info, L"TipPosition ", text, ": give three numbers in the model's units.");
        return 0;
    }
    for (int i = 0; i < 3; i++)
        w->tip.rigid_body[i] = place[i];
    if (of_parameter(info->parameters, L"WireOut", text, 200)) {
        if (!of_numbers(text, &v, 1)) {
            of_say(info, L"WireOut ", text, ": give one number in the model's units.");
            return 0;
        }
        w->exchange.s_w_start = v / w->length;
    }
    if (of_parameter(info->parameters, L"OperatorSpeed", text, 200)) {
        if (!of_numbers(text, &v, 1)) {
            of_say(info, L"OperatorSpeed ", text, ": give one number in the model's units.");
            return 0;
        }
        w->exchange.v_op = v / w->length;
    }
    if (of_parameter(info->parameters, L"Mode", text, 200) && !of_modes(text, &w->exchange.mode)) {
        of_say(info, L"Mode: the crane has no mode ", text, ". See parameters.txt.");
        return 0;
    }
    return of_result(info, w, OF_TENSION, L"TensionResult", L"Tension", L"Tension") &&
           of_result(info, w, OF_POSITION, L"PositionResult", L"Z", L"Z") &&
           of_result(info, w, OF_SPEED, L"SpeedResult", L"GZ velocity", L"GZ-Velocity") &&
           of_result(info, w, OF_ACCELERATION, L"AccelerationResult", L"GZ acceleration", L"GZ-Acceleration");
}

static void of_initialise(of_info *info)
{
    static const wchar_t *const allowed[] = {L"WholeSimulationPayoutRate", L"StageValue", L"PayoutRate"};
    int known = info->data_name == NULL;
    of_winch *w;
    for (int i = 0; i < 3 && !known; i++)
        known = wcsncmp(info->data_name, allowed[i], wcslen(allowed[i])) == 0;
    info->data = NULL;
    if (!known) {
        of_say(info, L"StillhookWinch gives a rate of pay-out, and OrcaFlex requested ", info->data_name,
               ". Choose it for the winch's pay-out rate.");
        return;
    }
    w = calloc(1, sizeof *w);
    if (w == NULL) {
        of_say(info, L"no memory", L"", ".");
        return;
    }
    sh_exchange_new(&w->exchange);
    if (!of_fill(info, w)) {
        free(w);
        return;
    }
    if (info->state != NULL &&
        (info->state_length < 0 ||
         sh_exchange_restore(&w->exchange, info->state, (size_t)info->state_length) != SH_OK)) {
        char text[400];
        snprintf(text, sizeof text, " is refused: %s. Begin the simulation anew.", w->exchange.why);
        of_say(info, L"the stored state", L"", text);
        free(w);
        return;
    }
    info->data = w;
    if (info->state == NULL)
        info->value = 0.0;
}

static void of_calculate(of_info *info)
{
    of_winch *w = info->data;
    of_time_history history;
    of_period now = {OF_NOW, 0, 0.0, 0.0};
    of_extra none;
    double x[OF_READ] = {0.0}, z[OF_POINTS][3], *seen = z[0];
    int status = 0;
    sh_sample sample;
    sh_reply reply;
    if (w == NULL)
        return;
    memset(&none, 0, sizeof none);
    none.size = sizeof none;
    of_find("C_GetTimeHistory2W", &history);
    for (int j = 0; j < OF_POINTS; j++) {
        of_extra at = w->tip;
#if SH_BOOM
        for (int i = 0; i < 3; i++)
            at.rigid_body[i] += w->length * ((i == j - 1) - sh_lever[i]);
#endif
        for (int i = j == 0 ? OF_TENSION : OF_POSITION; i < OF_READ; i++) {
            if (history != NULL)
                history(w->object[i], i == OF_TENSION ? &none : &at, &now, w->result[i], &x[i], &status);
            if (history == NULL || status != OF_OK) {
                of_say(info, L"a result", L"", " cannot be read at the present time.");
                return;
            }
            if (i > OF_TENSION)
                z[j][i - OF_POSITION] = x[i] / w->length;
        }
    }
    sample.time = info->time;
    sample.F_w = 1000.0 * x[OF_TENSION] / w->force;
#if SH_BOOM
    double tip[3];
    sh_seen(z, tip);
    seen = tip;
#endif
    sample.s_tip = seen[0];
    sample.v_tip = seen[1];
    sample.a_tip = seen[2];
    status = sh_exchange_at(&w->exchange, sample, info->new_step, &reply);
    if (status != SH_OK)
        of_say(info, L"", L"", sh_words(status));
    else
        info->value = reply.payout * w->length;
}

static void of_let_go(of_winch *w)
{
    if (w != NULL) {
        free(w->stored);
        w->stored = NULL;
    }
}

static void of_store(of_info *info)
{
    of_winch *w = info->data;
    if (w == NULL)
        return;
    of_let_go(w);
    w->stored = malloc(sh_exchange_size());
    if (w->stored == NULL) {
        of_say(info, L"no memory", L"", ".");
        return;
    }
    sh_exchange_save(&w->exchange, w->stored);
    info->state = w->stored;
    info->state_length = (int)sh_exchange_size();
}

SH_EXPORT void SH_CALL StillhookWinch(of_info *info)
{
    switch (info->action) {
    case OF_INITIALISE: of_initialise(info); break;
    case OF_FINALISE:
        of_let_go(info->data);
        free(info->data);
        info->data = NULL;
        break;
    case OF_CALCULATE: of_calculate(info); break;
    case OF_STORE_CREATE: of_store(info); break;
    case OF_STORE_DESTROY: of_let_go(info->data); break;
    default: break; /* no results of its own, no tracking */
    }
}

SH_EXPORT void SH_CALL RegisterCapabilities(uint32_t *capabilities)
{
    *capabilities |= OF_UNICODE | OF_IMPLICIT;
}
