/* A crane's winch as plain C99: no Python, no files, no global state, numbers behind every variable.
 *
 * Order of calls: sh_defaults, sh_set of parameters and first inputs, sh_start, then sh_set of inputs and sh_step.
 * sh_get reads at any time; before sh_start it answers as if the start were now.
 *
 * Numbers are SI. Speeds of wire, operator and motor: hoisting positive; wire out: paid out positive; tip: up positive.
 * All functions are static: the file that includes the generated source is the only user.
 */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#if defined(__GNUC__)
#define SH_UNUSED __attribute__((unused))
#else
#define SH_UNUSED
#endif

/* What a call answers. From SH_WRONG_STEP on nothing was changed by it. */
enum sh_answer {
    SH_OK = 0,
    SH_DIVERGED,     /* a state is no number any more: the instance is of no use */
    SH_WRONG_STEP,   /* the step is no whole number of PLC cycles, or does not begin where the last one ended */
    SH_NO_NUMBER,    /* NaN or infinity was given */
    SH_OUT_OF_RANGE, /* a value outside the range of its variable */
    SH_NOT_NOW,      /* unknown variable, an output that is set, or a fixed parameter after sh_start */
    SH_NO_STATE      /* bytes that are no state of this winch */
};

/* What a variable is. */
enum sh_causality { SH_INPUT, SH_FIXED, SH_TUNABLE, SH_OUTPUT };
enum sh_type { SH_REAL, SH_INTEGER, SH_BOOLEAN, SH_TEXT };

/* Row of the table of variables; its number is the value reference. */
typedef struct {
    const char *name;
    enum sh_causality causality;
    enum sh_type type;
    double least, most; /* allowed range of what may be set */
} sh_variable;

typedef struct sh_twin sh_twin; /* plain data without pointers */

static SH_UNUSED size_t sh_size(void);                           /* bytes of a sh_twin */
static SH_UNUSED const char *sh_identity(void);                  /* SHA-256 of crane, case and sources */
static SH_UNUSED double sh_cycle(void);                          /* PLC cycle, of which a step is a whole number [s] */
static SH_UNUSED int sh_count(void);                             /* variables */
static SH_UNUSED const sh_variable *sh_row(int variable);        /* NULL for none */
static SH_UNUSED int sh_find(const char *name);                  /* number of a variable, -1 for none */
static SH_UNUSED void sh_defaults(sh_twin *t);                   /* as exported, before sh_start */
static SH_UNUSED int sh_set(sh_twin *t, int variable, double x); /* booleans 0 or 1, integers whole */
static SH_UNUSED double sh_get(sh_twin *t, int variable);        /* the present value */
static SH_UNUSED const char *sh_text(sh_twin *t, int variable);  /* of a SH_TEXT: valid until it is read again */
static SH_UNUSED int sh_start(sh_twin *t, double time);          /* derive from the parameters, rest, first cycle */
static SH_UNUSED int sh_step(sh_twin *t, double time, double h); /* advance by h [s] */
static SH_UNUSED double sh_time(const sh_twin *t);               /* [s] */

/* A twin as bytes, with `count` numbers of the caller's own; kind: eight characters that say whose state it is. What is
 * read is checked whole before anything changes; what is wrong is in `why`. */
static SH_UNUSED size_t sh_state_size(size_t count);
static SH_UNUSED void sh_state_write(unsigned char *to, const char *kind, const double *own, size_t count,
                                     const sh_twin *t);
static SH_UNUSED int sh_state_read(const unsigned char *from, size_t size, const char *kind, double *own, size_t count,
                                   sh_twin *t, char *why, size_t room);

/* Rows of the generated tables. */

/* Where the number behind a variable is. */
enum sh_kind {
    SH_OF_INPUT,     /* input: number `at` of the host's inputs */
    SH_OF_LANE,      /* parameter in the record that is calculated with */
    SH_OF_BEGINNING, /* parameter of the beginning: payload, wire out */
    SH_OF_OPTION,    /* input_time */
    SH_OF_SEEN,      /* signal of the present PLC cycle */
    SH_OF_SENSED,    /* what the PLC reads now, or what it commands where it is alone */
    SH_OF_LIMIT,     /* whether a limit is passed now: its count grows in the present cycle */
    SH_OF_DURATION,  /* time for which it was passed since the start */
    SH_OF_STATUS,    /* 0 ok, 1 a limit was passed since the start, 2 no numbers any more */
    SH_OF_CAUSES,    /* which limits, in words */
    SH_OF_VALID,     /* whether a condition is within the envelope of the validation: number `at`, all of them for -1 */
    SH_OF_OUTSIDE,   /* which are not, in words */
    SH_OF_ONE,       /* whether the tip's position, speed and acceleration are one motion */
    SH_OF_APART      /* what contradicts what, in words */
};
typedef struct {
    enum sh_kind kind;
    int at;
} sh_place;

/* An input: columns of the row that it fills (-1: none), and whether it is in force from the moment it is set. */
typedef struct {
    int first, second;
    int at_once;
} sh_entry;

/* What a number of a lane or a row may be: in a range; as in the export, or as it follows from the beginning; a setting,
 * in the range of its variable; a whole number of PLC cycles; the code of a mode. */
enum sh_is { SH_IS_RANGE, SH_IS_SAME, SH_IS_SETTING, SH_IS_COUNT, SH_IS_CODE };
typedef struct {
    const char *name;
    enum sh_is is;
    double least, most;
} sh_number;

/* A limit: its word, and the place in a lane of its count of cycles. */
typedef struct {
    const char *word;
    int at;
} sh_limit;
