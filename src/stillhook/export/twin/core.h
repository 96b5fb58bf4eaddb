/* A crane's winch as plain C99: no Python, no files, no global state, one number behind every variable.
 *
 * Order of calls: sh_defaults, sh_set of parameters and first inputs, sh_start, then sh_set of inputs and sh_step.
 * sh_get reads at any time after sh_start; before it, parameters and inputs.
 *
 * Numbers are SI. Speeds of wire, operator and motor: hoisting positive; wire out: paid out positive; tip: up positive.
 * All functions are static: the file that includes the generated source is the only user.
 */
#include <stddef.h>
#include <stdint.h>

/* What a call answers. From SH_WRONG_STEP on nothing was changed by it. */
enum sh_answer {
    SH_OK = 0,
    SH_DIVERGED,     /* a state is no number any more: the instance is of no use */
    SH_WRONG_STEP,   /* the step is no whole number of PLC cycles, or does not begin where the last one ended */
    SH_NO_NUMBER,    /* NaN or infinity was given */
    SH_OUT_OF_RANGE, /* a value outside the range of its variable */
    SH_NOT_NOW       /* unknown variable, an output that is set, or a fixed parameter after sh_start */
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

typedef struct sh_twin sh_twin; /* plain data without pointers: its bytes are the saved state */

static size_t sh_size(void);                             /* bytes of a sh_twin */
static const char *sh_identity(void);                    /* SHA-256 of crane, case and sources: of one export alone */
static double sh_cycle(void);                            /* PLC cycle, of which a step is a whole number [s] */
static int sh_count(void);                               /* variables */
static const sh_variable *sh_row(int variable);          /* NULL for none */
static void sh_defaults(sh_twin *t);                     /* as exported, before sh_start */
static int sh_set(sh_twin *t, int variable, double x);   /* booleans 0 or 1, integers whole */
static double sh_get(sh_twin *t, int variable);          /* the present value; outputs follow the inputs at once */
static const char *sh_text(sh_twin *t, int variable);    /* of a SH_TEXT: valid until the next call */
static int sh_start(sh_twin *t, double time);            /* derive from the parameters, rest, first cycle */
static int sh_step(sh_twin *t, double time, double h);   /* advance by h [s] */
static double sh_time(const sh_twin *t);                 /* [s] */
