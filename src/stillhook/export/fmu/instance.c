/* What FMI 2 and FMI 3 share: an instance, its saved states and its messages. */
#include <stdlib.h>

#if defined(_WIN32)
#define SH_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define SH_EXPORT __attribute__((visibility("default")))
#else
#define SH_EXPORT
#endif

/* Phases of an instance. */
enum sh_phase { SH_INSTANTIATED, SH_INITIALIZATION, SH_RUNNING, SH_TERMINATED };

/* A saved state: of one export alone, which its identity says. */
typedef struct {
    char identity[64];
    double phase;
    sh_twin twin;
} sh_state;

typedef struct {
    sh_state now;
    double start;
    char name[128];
    char message[512];
} sh_instance;

static sh_instance *sh_instance_new(const char *name)
{
    sh_instance *s = calloc(1, sizeof *s);
    if (s != NULL) {
        memcpy(s->now.identity, sh_identity(), sizeof s->now.identity);
        sh_defaults(&s->now.twin);
        snprintf(s->name, sizeof s->name, "%s", name != NULL ? name : "");
    }
    return s;
}

static int sh_is_type(int v, enum sh_type type)
{
    const sh_variable *row = sh_row(v);
    return row != NULL && row->type == type;
}

static const char *sh_name(int v) { return sh_row(v) != NULL ? sh_row(v)->name : "?"; }

/* Set a variable of this type; what is wrong is in the instance's message. */
static int sh_instance_set(sh_instance *s, int v, enum sh_type type, double x)
{
    const sh_variable *row = sh_row(v);
    int answer = sh_is_type(v, type) && s->now.phase != SH_TERMINATED ? sh_set(&s->now.twin, v, x) : SH_NOT_NOW;
    if (answer == SH_NO_NUMBER)
        snprintf(s->message, sizeof s->message, "%s: not a number. Give a finite value in SI units.", sh_name(v));
    else if (answer == SH_OUT_OF_RANGE)
        snprintf(s->message, sizeof s->message, "%s = %.9g: give a value from %.9g to %.9g%s.", sh_name(v), x, row->least,
                 row->most, row->type == SH_REAL ? "" : ", a whole number that its description names");
    else if (answer != SH_OK)
        snprintf(s->message, sizeof s->message,
                 "Value reference %d (%s): no variable of this type that may be set now: outputs never, fixed parameters"
                 " before the end of the initialization.", v, sh_name(v));
    return answer;
}

static int sh_instance_start(sh_instance *s)
{
    int answer = sh_start(&s->now.twin, s->start);
    if (answer != SH_OK)
        snprintf(s->message, sizeof s->message, "The winch has no state of rest with these parameters and inputs.");
    return answer;
}

static int sh_instance_step(sh_instance *s, double time, double h)
{
    int answer = s->now.phase == SH_RUNNING ? sh_step(&s->now.twin, time, h) : SH_NOT_NOW;
    if (answer == SH_WRONG_STEP)
        snprintf(s->message, sizeof s->message,
                 "Step of %.9g s from %.9g s: give a whole number of PLC cycles of %.9g s, from where the last one ended,"
                 " %.9g s.", h, time, sh_cycle(), sh_time(&s->now.twin));
    else if (answer == SH_DIVERGED)
        snprintf(s->message, sizeof s->message,
                 "The state is no number any more at %.9g s. Restore a saved state, or reset.", sh_time(&s->now.twin));
    else if (answer != SH_OK)
        snprintf(s->message, sizeof s->message, "A step is made after the initialization and before the end.");
    return answer;
}

static sh_state *sh_state_copy(const sh_state *from, sh_state *to)
{
    if (to == NULL)
        to = malloc(sizeof *to);
    if (to != NULL)
        memcpy(to, from, sizeof *to);
    return to;
}

/* Bytes of a saved state, where they are of this export. */
static sh_state *sh_state_read(sh_instance *s, const unsigned char *bytes, size_t size)
{
    if (size != sizeof(sh_state) || memcmp(bytes, sh_identity(), 64) != 0) {
        snprintf(s->message, sizeof s->message,
                 "%lu bytes that are no state of this FMU (%lu bytes). Give what it saved itself.", (unsigned long)size,
                 (unsigned long)sizeof(sh_state));
        return NULL;
    }
    sh_state *made = malloc(sizeof *made);
    if (made != NULL)
        memcpy(made, bytes, sizeof *made);
    return made;
}
