/* The host's side of a winch: inputs in time. What a host reads is in reading.c. What is calculated is in the generated part
 * above: kernels sh_kernel_..., tables and sizes SH_....
 */

#ifdef SH_ALONE /* the PLC: rows are what it reads, and nothing goes on between its cycles */

static void sh_rest(double *A, const double *row, double *beginning)
{
    double sensed[SH_ROW], commands[SH_SENSED];
    (void)beginning;
    memcpy(sensed, row, sizeof sensed);
    sh_kernel_begin(A, sensed);
    sh_kernel_once(A, sensed, commands);
}

static void sh_observe(double *A, const double *row, double *commands)
{
    double sensed[SH_ROW];
    memcpy(sensed, row, sizeof sensed);
    sh_kernel_once(A, sensed, commands);
}

static void sh_advance(double *A, const double *row, const double *ahead)
{
    double commands[SH_SENSED];
    (void)ahead;
    sh_observe(A, row, commands);
}

#else /* the winch: rows are `Tick`s */

static void sh_rest(double *A, const double *row, double *beginning)
{
    memcpy(A + SH_TICK, row, SH_ROW * sizeof(double));
    sh_kernel_prepare(A, beginning);
    sh_kernel_at_rest(A);
}

static void sh_run(double *A, double *rows, int64_t cycles)
{
    double windows[1] = {0.0}, series[1] = {0.0}, lost[1];
    sh_kernel_run(A, rows, SH_ROW, sh_quintic, windows, series, lost, 0, 0, cycles, SH_NEVER,
                  cycles > 0 ? SH_NEVER : 0, 1, SH_N_SUB, SH_T_CYCLE);
}

static void sh_observe(double *A, const double *row, double *sensed)
{
    double rows[SH_ROW];
    memcpy(rows, row, sizeof rows);
#if SH_READS
    memcpy(A + SH_TICK, row, sizeof rows);
    sh_kernel_read(A, sensed);
#else
    (void)sensed;
#endif
    sh_run(A, rows, 0);
}

/* One cycle, in which the tension changes linearly and the tip moves on a quintic. */
static void sh_advance(double *A, const double *row, const double *ahead)
{
    double rows[2 * SH_ROW];
    memcpy(rows, row, SH_ROW * sizeof(double));
    memcpy(rows + SH_ROW, ahead, SH_ROW * sizeof(double));
#if SH_TENSION >= 0
    rows[SH_TENSION + 1] = rows[SH_ROW + SH_TENSION + 1] = (ahead[SH_TENSION] - row[SH_TENSION]) / SH_T_CYCLE;
    rows[SH_TENSION + 2] = rows[SH_ROW + SH_TENSION + 2] = 0.0;
#endif
    sh_run(A, rows, 1);
}

#endif

enum { SH_END, SH_START };                                             /* values of input_time */
enum { SH_LOAD, SH_WIRE, SH_SPAN, SH_PERIOD, SH_MODE, SH_FAULT, SH_CONDITIONS }; /* of the envelope */
#define SH_MOST_TIME 1e12 /* up to which a host's clock tells cycles apart [s] */
enum { SH_SECONDS = 30 };                                              /* blocks of the moving peak-to-peak */

struct sh_twin {
    /* What a saved state holds, doubles alone up to `seen`. */
    double A[SH_LANE];  /* everything that is carried from cycle to cycle */
    double row[SH_ROW]; /* inputs in force at the present time */
    double input[SH_INPUTS];
    double beginning[SH_BEGINNING];
    double time_0, cycles; /* time at the start [s], and PLC cycles since: a double counts them for millions of years */
    double host_time;      /* where the last step ended by the host's own clock [s] */
    double input_time, started, lost;
    double count, sum_s, sum_s2, sum_v2;                    /* of the tip, for the period of its motion */
    double lowest[SH_SECONDS + 1], highest[SH_SECONDS + 1]; /* of the tip, a second each */
    sh_motion motion; /* of the tip as the host gives it */
    /* What follows from it. */
    double seen[SH_LANE]; /* A after the PLC's cycle of the present time */
    double sensed[SH_SENSED];
    double observed;
    char causes[SH_TEXT_LENGTH], outside[SH_TEXT_LENGTH];
};

static size_t sh_size(void) { return sizeof(sh_twin); }
static const char *sh_identity(void) { return SH_IDENTITY; }
static double sh_cycle(void) { return SH_T_CYCLE; }
static int sh_count(void) { return SH_VARIABLES; }
static const sh_variable *sh_row(int v) { return v >= 0 && v < SH_VARIABLES ? &sh_variables[v] : NULL; }
static double sh_time(const sh_twin *t) { return t->time_0 + t->cycles * SH_T_CYCLE; }

static int sh_find(const char *name)
{
    for (int v = 0; v < SH_VARIABLES; v++)
        if (strcmp(sh_variables[v].name, name) == 0)
            return v;
    return -1;
}

static int sh_finite(double x) { return x - x == 0.0; }

static void sh_put(double *row, int i, double x)
{
    if (sh_entries[i].first < 0)
        return;
    row[sh_entries[i].first] = x;
    if (sh_entries[i].second >= 0)
        row[sh_entries[i].second] = x;
}

static void sh_defaults(sh_twin *t)
{
    memset(t, 0, sizeof *t);
    memcpy(t->A, sh_record, sizeof sh_record);
    memcpy(t->row, sh_first_row, sizeof sh_first_row);
    memcpy(t->input, sh_first_input, sizeof sh_first_input);
    memcpy(t->beginning, sh_beginning, sizeof sh_beginning);
    t->input_time = SH_START;
    for (int i = 0; i <= SH_SECONDS; i++) {
        t->lowest[i] = HUGE_VAL;
        t->highest[i] = -HUGE_VAL;
    }
}

/* Where vessel and boom are inputs: true motion of the tip, and the one that the PLC makes of its motion unit. */
static void sh_vessel(double *row, const double *input)
{
#if SH_VESSEL
    double given[SH_VESSEL], tip[6];
    memcpy(given, input, sizeof given);
    sh_kernel_tip(given, sh_boom, tip);
    memcpy(row + SH_TRUE, tip, 3 * sizeof(double));
    memcpy(row + SH_MOTION, tip + 3, 3 * sizeof(double));
#else
    (void)row;
    (void)input;
#endif
}

static void sh_all_inputs(sh_twin *t)
{
    for (int i = 0; i < SH_INPUTS; i++)
        sh_put(t->row, i, t->input[i]);
    sh_vessel(t->row, t->input);
}

static int sh_known_mode(double x)
{
    for (int i = 0; i < SH_MODES; i++)
        if (x == sh_modes[i])
            return 1;
    return 0;
}

/* Whether a variable may have this value. */
static int sh_allowed(int v, double x)
{
    const sh_variable *row = sh_row(v);
    if (!sh_finite(x))
        return SH_NO_NUMBER;
    if (x < row->least || x > row->most || (row->type != SH_REAL && x != floor(x)))
        return SH_OUT_OF_RANGE;
    if (sh_places[v].kind == SH_OF_INPUT && sh_places[v].at == SH_MODE_INPUT && !sh_known_mode(x))
        return SH_OUT_OF_RANGE;
    return SH_OK;
}

/* Whether a variable may be set to this value now. */
static int sh_may_set(const sh_twin *t, int v, double x)
{
    const sh_variable *row = sh_row(v);
    if (row == NULL || row->causality == SH_OUTPUT || (row->causality == SH_FIXED && t->started != 0.0))
        return SH_NOT_NOW;
    return sh_allowed(v, x);
}

static int sh_set(sh_twin *t, int v, double x)
{
    int answer = sh_may_set(t, v, x);
    if (answer != SH_OK)
        return answer;
    sh_place p = sh_places[v];
    if (p.kind == SH_OF_INPUT) {
        t->input[p.at] = x;
        if (t->started == 0.0 || t->input_time == SH_START || sh_entries[p.at].at_once)
            sh_put(t->row, p.at, x);
        if (SH_VESSEL && (t->started == 0.0 || t->input_time == SH_START))
            sh_vessel(t->row, t->input);
    } else if (p.kind == SH_OF_LANE) {
        t->A[p.at] = x;
    } else if (p.kind == SH_OF_BEGINNING) {
        t->beginning[p.at] = x;
    } else {
        t->input_time = x;
    }
    t->observed = 0.0;
    return SH_OK;
}

/* Reading changes nothing that is carried: the PLC's cycle of now is calculated on a copy. */
static void sh_look(sh_twin *t)
{
    if (t->observed == 0.0) {
        memcpy(t->seen, t->A, sizeof t->A);
        sh_observe(t->seen, t->row, t->sensed);
        t->observed = 1.0;
    }
}

static int sh_start(sh_twin *t, double time)
{
    if (t->started != 0.0)
        return SH_NOT_NOW;
    if (!sh_finite(time))
        return SH_NO_NUMBER;
    if (fabs(time) > SH_MOST_TIME)
        return SH_OUT_OF_RANGE;
    sh_all_inputs(t);
#if SH_TENSION >= 0
    t->beginning[0] = t->row[SH_TENSION] / SH_G - t->beginning[1];
#endif
    sh_rest(t->A, t->row, t->beginning);
    t->time_0 = t->host_time = time;
    t->cycles = 0.0;
    t->started = 1.0;
    t->observed = 0.0;
    sh_motion_take(&t->motion, 0.0, t->row + SH_MOTION);
    sh_look(t);
    for (int i = 0; i < SH_STATES; i++)
        if (!sh_finite(t->A[i]))
            t->lost = 1.0;
    return t->lost != 0.0 ? SH_DIVERGED : SH_OK;
}

/* Quintic through s, v, a at both ends of a step of h, at its part x. */
static void sh_between(double *to, const double *from, const double *end, double h, double x)
{
    double v_0 = from[1] * h, a_0 = from[2] * h * h, v_1 = end[1] * h, a_1 = end[2] * h * h;
    double d = end[0] - from[0];
    double c_3 = 10.0 * d - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1;
    double c_4 = -15.0 * d + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1;
    double c_5 = 6.0 * d - 3.0 * v_0 - 3.0 * v_1 - 0.5 * a_0 + 0.5 * a_1;
    to[0] = from[0] + x * (v_0 + x * (0.5 * a_0 + x * (c_3 + x * (c_4 + x * c_5))));
    to[1] = (v_0 + x * (a_0 + x * (3.0 * c_3 + x * (4.0 * c_4 + x * 5.0 * c_5)))) / h;
    to[2] = (a_0 + x * (6.0 * c_3 + x * (12.0 * c_4 + x * 20.0 * c_5))) / (h * h);
}

/* Where a motion is after h, its acceleration held. */
static void sh_held(double *to, const double *tip, double h)
{
    to[0] = tip[0] + h * (tip[1] + 0.5 * h * tip[2]);
    to[1] = tip[1] + h * tip[2];
}

/* The true motion is the one that the PLC is shown, where the host gives one alone. */
static void sh_same_motion(double *row)
{
#if SH_TRUE >= 0 && !SH_VESSEL
    memcpy(row + SH_TRUE, row + SH_MOTION, 3 * sizeof(double));
#else
    (void)row;
#endif
}

/* What holds at the end of a step of h: as given for it, else the tip's acceleration and everything else held. */
static void sh_end_row(sh_twin *t, double *end, double h)
{
    memcpy(end, t->row, sizeof t->row);
    if (t->input_time == SH_END) {
        for (int i = 0; i < SH_INPUTS; i++)
            if (!sh_entries[i].at_once)
                sh_put(end, i, t->input[i]);
        sh_vessel(end, t->input);
    } else {
        sh_held(end + SH_MOTION, t->row + SH_MOTION, h);
#if SH_VESSEL
        sh_held(end + SH_TRUE, t->row + SH_TRUE, h);
#endif
        sh_same_motion(end);
    }
}

/* The row at the end of cycle j of n. */
static void sh_row_of(sh_twin *t, double *to, const double *from, const double *end, int j, int n)
{
    memcpy(to, j == n ? end : from, sizeof t->row);
    if (j < n) {
        double x = (double)j / n;
        sh_between(to + SH_MOTION, from + SH_MOTION, end + SH_MOTION, n * SH_T_CYCLE, x);
#if SH_VESSEL
        sh_between(to + SH_TRUE, from + SH_TRUE, end + SH_TRUE, n * SH_T_CYCLE, x);
#endif
        sh_same_motion(to);
#if SH_TENSION >= 0
        to[SH_TENSION] = from[SH_TENSION] + x * (end[SH_TENSION] - from[SH_TENSION]);
#endif
#if SH_SPEED >= 0
        to[SH_SPEED] = from[SH_SPEED] + x * (end[SH_SPEED] - from[SH_SPEED]);
#endif
    }
#if SH_SPEED >= 0
    to[SH_SPEED + 1] = t->row[SH_SPEED + 1] + 0.5 * SH_T_CYCLE * (t->row[SH_SPEED] + to[SH_SPEED]);
#endif
}

/* The tip's motion of the present cycle, for the envelope. */
static void sh_remember(sh_twin *t)
{
    double s = t->row[SH_MOTION], v = t->row[SH_MOTION + 1];
    double per_second = ceil(1.0 / SH_T_CYCLE);
    double slot = fmod(floor(t->cycles / per_second), SH_SECONDS + 1.0);
    int i = slot >= 0.0 && slot <= SH_SECONDS ? (int)slot : 0; /* whatever the count is, inside */
    if (fmod(t->cycles, per_second) == 0.0) {
        t->lowest[i] = HUGE_VAL;
        t->highest[i] = -HUGE_VAL;
    }
    t->lowest[i] = s < t->lowest[i] ? s : t->lowest[i];
    t->highest[i] = s > t->highest[i] ? s : t->highest[i];
    t->count += 1.0;
    t->sum_s += s;
    t->sum_s2 += s * s;
    t->sum_v2 += v * v;
}

/* By how much a host's time may be beside another [s]: a part of a cycle, and the rounding of its own numbers. */
static double sh_room(double time)
{
    return fmin(1e-4 * SH_T_CYCLE + 4.0 * DBL_EPSILON * fabs(time), 0.25 * SH_T_CYCLE);
}

/* By how much a host's sum of steps may be beside the count: each addition is off by half of its last digit [s]. */
static double sh_drift(const sh_twin *t, double time)
{
    return 1e-4 * SH_T_CYCLE + DBL_EPSILON * (t->cycles + 4.0) * fmax(fabs(time), fabs(t->time_0));
}

/* Whether a step begins where the last one ended: by the host's own clock, which may be a sum, or by the count. */
static int sh_on_time(const sh_twin *t, double time)
{
    double room = sh_room(time), apart = fabs(time - sh_time(t));
    return apart <= sh_drift(t, time) && (apart <= room || fabs(time - t->host_time) <= room);
}

/* A step; alone: what the host gives for it is judged as a motion here. */
static int sh_go(sh_twin *t, double time, double h, int alone)
{
    double n = floor(h / SH_T_CYCLE + 0.5);
    if (t->started == 0.0)
        return SH_NOT_NOW;
    if (t->lost != 0.0)
        return SH_DIVERGED;
    if (!(n >= 1.0 && n <= 1e6 && fabs(h - n * SH_T_CYCLE) <= sh_room(time) && sh_on_time(t, time)))
        return SH_WRONG_STEP;
    double from[SH_ROW], end[SH_ROW], ahead[SH_ROW];
    if (t->input_time == SH_START)
        sh_all_inputs(t);
    if (alone && t->input_time == SH_START)
        sh_motion_take(&t->motion, t->cycles * SH_T_CYCLE, t->row + SH_MOTION);
    sh_end_row(t, end, n * SH_T_CYCLE);
    memcpy(from, t->row, sizeof from);
    for (int j = 1; j <= (int)n; j++) {
        sh_row_of(t, ahead, from, end, j, (int)n);
        sh_remember(t);
        sh_advance(t->A, t->row, ahead);
        memcpy(t->row, ahead, sizeof ahead);
        t->cycles += 1.0;
        for (int i = 0; i < SH_STATES; i++)
            if (!sh_finite(t->A[i]))
                t->lost = 1.0;
        if (t->lost != 0.0)
            return SH_DIVERGED;
    }
    if (alone && t->input_time == SH_END)
        sh_motion_take(&t->motion, t->cycles * SH_T_CYCLE, t->row + SH_MOTION);
    t->host_time = time + h;
    t->observed = 0.0;
    return SH_OK;
}

static int sh_step(sh_twin *t, double time, double h) { return sh_go(t, time, h, 1); }
