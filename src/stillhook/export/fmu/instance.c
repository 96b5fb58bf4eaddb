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

#define SH_FMU "SHFMU__2" /* kind of a saved state, with the version of its format */
enum { SH_OWN = 2 };      /* numbers of an instance beside its twin: phase, time of the start */
#define SH_STATE_SIZE (SH_HEAD + sizeof(double) * (SH_OWN + SH_CARRIED) + SH_CHECKSUM)

/* A state that a host holds by its address; each is in the list of its instance, and known by its place there alone. */
typedef struct sh_kept {
    struct sh_kept *next;
    unsigned char bytes[SH_STATE_SIZE];
} sh_kept;

typedef struct {
    sh_twin twin;
    int phase;
    double start;
    sh_kept *kept;
    char name[128];
    char message[512];
} sh_instance;

static sh_instance *sh_instance_new(const char *name)
{
    sh_instance *s = calloc(1, sizeof *s);
    if (s != NULL) {
        sh_defaults(&s->twin);
        snprintf(s->name, sizeof s->name, "%s", name != NULL ? name : "");
    }
    return s;
}

static void sh_instance_reset(sh_instance *s)
{
    sh_defaults(&s->twin);
    s->phase = SH_INSTANTIATED;
}

static int sh_is_type(int v, enum sh_type type)
{
    const sh_variable *row = sh_row(v);
    return row != NULL && row->type == type;
}

static const char *sh_name(int v) { return sh_row(v) != NULL ? sh_row(v)->name : "?"; }

/* Whether a variable of this type may be set so; what is wrong is in the instance's message. */
static int sh_instance_may_set(sh_instance *s, int v, enum sh_type type, double x)
{
    const sh_variable *row = sh_row(v);
    int answer = sh_is_type(v, type) && s->phase != SH_TERMINATED ? sh_may_set(&s->twin, v, x) : SH_NOT_NOW;
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
    int answer = sh_start(&s->twin, s->start);
    if (answer != SH_OK)
        snprintf(s->message, sizeof s->message, "The winch has no state of rest with these parameters and inputs.");
    return answer;
}

/* A step; *warns: from this step on the host's inputs contradict each other, which the message says. */
static int sh_instance_step(sh_instance *s, double time, double h, int *warns)
{
    int before = sh_motion_says(&s->twin.motion)[0] != 0;
    int answer = s->phase == SH_RUNNING ? sh_step(&s->twin, time, h) : SH_NOT_NOW;
    if (answer == SH_WRONG_STEP)
        snprintf(s->message, sizeof s->message,
                 "Step of %.9g s from %.9g s: give a whole number of PLC cycles of %.9g s, from where the last one ended,"
                 " %.9g s.", h, time, sh_cycle(), sh_time(&s->twin));
    else if (answer == SH_DIVERGED)
        snprintf(s->message, sizeof s->message,
                 "The state is no number any more at %.9g s. Restore a saved state, or reset.", sh_time(&s->twin));
    else if (answer != SH_OK)
        snprintf(s->message, sizeof s->message, "A step is made after the initialization and before the end.");
    *warns = answer == SH_OK && !before && sh_motion_says(&s->twin.motion)[0] != 0;
    if (*warns)
        snprintf(s->message, sizeof s->message,
                 "At %.9g s: %s. Give s_tip, v_tip and a_tip of one motion, in m, m/s and m/s^2, up positive, in steps"
                 " much shorter than its period: the winch follows what it is given.",
                 sh_time(&s->twin), sh_motion_says(&s->twin.motion));
    return answer;
}

static int sh_says(sh_instance *s, int answer, const char *text)
{
    snprintf(s->message, sizeof s->message, "%s", text);
    return answer;
}

/* The place in the list where a state is, NULL for one that this instance never gave, or that was freed. */
static sh_kept **sh_kept_at(sh_instance *s, const void *state)
{
    for (sh_kept **at = &s->kept; *at != NULL; at = &(*at)->next)
        if (*at == state)
            return at;
    sh_says(s, SH_NO_STATE, state == NULL ? "No state was given."
                                          : "This is no state of this instance, or one that was freed.");
    return NULL;
}

static sh_kept *sh_kept_new(sh_instance *s)
{
    sh_kept *made = calloc(1, sizeof *made);
    if (made == NULL) {
        sh_says(s, SH_NO_STATE, "No memory.");
        return NULL;
    }
    made->next = s->kept;
    s->kept = made;
    return made;
}

/* Keep the present state; in *state where it is one of this instance, else in a new one. */
static int sh_instance_keep(sh_instance *s, void **state)
{
    double own[SH_OWN] = {s->phase, s->start};
    sh_kept **at, *to;
    if (state == NULL)
        return sh_says(s, SH_NO_STATE, "No room for a state was given.");
    at = *state != NULL ? sh_kept_at(s, *state) : NULL;
    to = *state == NULL ? sh_kept_new(s) : at != NULL ? *at : NULL;
    if (to == NULL)
        return SH_NO_STATE;
    sh_state_write(to->bytes, SH_FMU, own, SH_OWN, &s->twin);
    *state = to;
    return SH_OK;
}

/* Bytes of a state into an instance of its own, checked whole; what is wrong is in the message of s. */
static int sh_instance_read(sh_instance *s, const unsigned char *bytes, size_t size, sh_twin *twin, double *own)
{
    char why[300];
    int answer = sh_state_read(bytes, size, SH_FMU, own, SH_OWN, twin, why, sizeof why);
    if (answer == SH_OK) {
        int began = twin->started != 0.0;
        int known = own[0] == SH_INSTANTIATED || own[0] == SH_INITIALIZATION ? !began
                    : own[0] == SH_RUNNING                                   ? began
                                                                             : own[0] == SH_TERMINATED;
        if (!known || !(fabs(own[1]) <= SH_MOST_TIME)) {
            snprintf(why, sizeof why, "phase %.9g or start at %.9g s is none", own[0], own[1]);
            answer = SH_NO_STATE;
        }
    }
    if (answer != SH_OK)
        snprintf(s->message, sizeof s->message,
                 "Refused, and nothing changed: no state of this FMU: %s. Give what it saved itself.", why);
    return answer;
}

/* Go back to a state that the host holds. */
static int sh_instance_go_back(sh_instance *s, const void *state)
{
    sh_kept **at = sh_kept_at(s, state);
    sh_twin twin;
    double own[SH_OWN];
    if (at == NULL || sh_instance_read(s, (*at)->bytes, SH_STATE_SIZE, &twin, own) != SH_OK)
        return SH_NO_STATE;
    s->twin = twin;
    s->phase = (int)own[0];
    s->start = own[1];
    return SH_OK;
}

static int sh_instance_forget(sh_instance *s, void **state)
{
    sh_kept **at, *gone;
    if (state == NULL || *state == NULL)
        return SH_OK;
    at = sh_kept_at(s, *state);
    if (at == NULL)
        return SH_NO_STATE;
    gone = *at;
    *at = gone->next;
    free(gone);
    *state = NULL;
    return SH_OK;
}

static int sh_instance_serialize(sh_instance *s, const void *state, unsigned char *bytes, size_t size)
{
    sh_kept **at = sh_kept_at(s, state);
    if (at == NULL)
        return SH_NO_STATE;
    if (bytes == NULL || size < SH_STATE_SIZE)
        return sh_says(s, SH_NO_STATE, "No room for the bytes of a state.");
    memcpy(bytes, (*at)->bytes, SH_STATE_SIZE);
    return SH_OK;
}

static int sh_instance_deserialize(sh_instance *s, const unsigned char *bytes, size_t size, void **state)
{
    sh_twin twin;
    double own[SH_OWN];
    sh_kept *made;
    if (state == NULL)
        return sh_says(s, SH_NO_STATE, "No room for a state was given.");
    if (sh_instance_read(s, bytes, size, &twin, own) != SH_OK || (made = sh_kept_new(s)) == NULL)
        return SH_NO_STATE;
    memcpy(made->bytes, bytes, SH_STATE_SIZE);
    *state = made;
    return SH_OK;
}

static void sh_instance_clear(sh_instance *s)
{
    while (s->kept != NULL) {
        sh_kept *gone = s->kept;
        s->kept = gone->next;
        free(gone);
    }
}
