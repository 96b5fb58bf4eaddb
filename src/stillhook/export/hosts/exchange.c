/* A winch in a host whose steps are its own: PLC cycles run as the host's time passes them. The same as exchange.py,
 * which says what is held and what is interpolated.
 */
#define SH_ROUNDING 1e-6 /* part of a PLC cycle */
#define SH_CHARGE 0.02   /* part by which the first tension may differ from the load that a gas charge is set for */

typedef struct {
    double time, F_w, s_tip, v_tip, a_tip;
} sh_sample;

typedef struct {
    double payout, s_w;
} sh_reply;

/* A time of the host, and the winch at the last PLC cycle before it. */
typedef struct {
    sh_twin twin;
    sh_sample sample;
    double cycles;
} sh_mark;

/* Plain data without pointers: its bytes are the saved state. */
typedef struct {
    char identity[72];
    double started, s_w_start, v_op, mode; /* s_w_start, mode: NaN for those of the case */
    sh_sample first;
    sh_mark accepted, trial;
} sh_exchange;

static void sh_exchange_new(sh_exchange *e)
{
    memset(e, 0, sizeof *e);
    strncpy(e->identity, sh_identity(), sizeof e->identity - 1);
    e->s_w_start = e->mode = NAN;
}

static int sh_put_input(sh_twin *t, const char *name, double x)
{
    return sh_set(t, sh_find(name), x);
}

static int sh_put_sample(sh_twin *t, const sh_exchange *e, sh_sample s)
{
    int answer = sh_put_input(t, "F_w", s.F_w);
    if (answer == SH_OK)
        answer = sh_put_input(t, "s_tip", s.s_tip - e->first.s_tip);
    if (answer == SH_OK)
        answer = sh_put_input(t, "v_tip", s.v_tip);
    return answer == SH_OK ? sh_put_input(t, "a_tip", s.a_tip) : answer;
}

static sh_reply sh_reply_of(sh_twin *t)
{
    sh_reply now = {0.0 - sh_get(t, sh_find("v_w")), sh_get(t, sh_find("s_w"))};
    return now;
}

/* The winch standing under the first tension, with a tip that stands. */
static int sh_exchange_begin(sh_exchange *e, sh_sample s, sh_reply *reply)
{
    sh_twin *t = &e->accepted.twin;
    int answer;
    if (SH_LOAD_FIXED && fabs(s.F_w - SH_WIRE_WEIGHT) > SH_CHARGE * SH_WIRE_WEIGHT)
        return SH_OUT_OF_RANGE;
    e->first = s;
    sh_defaults(t);
    answer = sh_put_input(t, "input_time", SH_END);
    if (answer == SH_OK && e->s_w_start == e->s_w_start)
        answer = sh_put_input(t, "s_w_start", e->s_w_start);
    if (answer == SH_OK && e->mode == e->mode)
        answer = sh_put_input(t, "mode", e->mode);
    if (answer == SH_OK)
        answer = sh_put_input(t, "F_w", s.F_w);
    if (answer == SH_OK)
        answer = sh_start(t, 0.0);
    if (answer == SH_OK)
        answer = sh_put_input(t, "v_op", e->v_op);
    if (answer != SH_OK)
        return answer;
    e->accepted.sample = s;
    e->accepted.cycles = 0.0;
    e->trial = e->accepted;
    e->started = 1.0;
    *reply = sh_reply_of(t);
    return SH_OK;
}

/* The host's course at a time between two samples: tension on a line, tip on the quintic through both. */
static sh_sample sh_course(const sh_sample *a, const sh_sample *b, double time)
{
    double h = b->time - a->time;
    sh_sample s = *b;
    if (h > 0.0) {
        double from[3] = {a->s_tip, a->v_tip, a->a_tip}, end[3] = {b->s_tip, b->v_tip, b->a_tip}, to[3];
        double x = (time - a->time) / h;
        sh_between(to, from, end, h, x);
        s.F_w = a->F_w + x * (b->F_w - a->F_w);
        s.s_tip = to[0];
        s.v_tip = to[1];
        s.a_tip = to[2];
    }
    s.time = time;
    return s;
}

/* The host's course a part of a cycle ahead: tension and acceleration of the tip held. */
static sh_sample sh_course_ahead(sh_sample s, double time)
{
    double h = time - s.time;
    s.s_tip += h * (s.v_tip + 0.5 * h * s.a_tip);
    s.v_tip += h * s.a_tip;
    s.time = time;
    return s;
}

static int sh_cycle_to(sh_exchange *e, sh_twin *t, sh_sample end, double k)
{
    int answer = sh_put_sample(t, e, end);
    return answer == SH_OK ? sh_step(t, k * sh_cycle(), sh_cycle()) : answer;
}

/* The answer at a sample. new_step: the host began a new step, so that its last sample is accepted unless the time went
 * back behind it. What is refused changes nothing. */
static int sh_exchange_at(sh_exchange *e, sh_sample s, int new_step, sh_reply *reply)
{
    double T = sh_cycle(), room = SH_ROUNDING * T, n, x;
    sh_mark *mark = &e->trial;
    sh_twin next;
    sh_reply now, then;
    int answer;
    if (!sh_finite(s.time) || !sh_finite(s.F_w) || !sh_finite(s.s_tip) || !sh_finite(s.v_tip) || !sh_finite(s.a_tip))
        return SH_NO_NUMBER;
    if (s.F_w < 0.0)
        s.F_w = 0.0; /* a wire cannot push */
    if (e->started == 0.0 || s.time <= e->first.time + room)
        return sh_exchange_begin(e, s, reply);
    if (new_step && mark->sample.time > e->accepted.sample.time && s.time > mark->sample.time)
        e->accepted = e->trial;
    if (s.time < e->accepted.sample.time - room)
        return SH_WRONG_STEP;
    e->trial = e->accepted;
    n = floor((s.time - e->first.time) / T + SH_ROUNDING);
    for (; mark->cycles < n; mark->cycles += 1.0) {
        sh_sample end = sh_course(&e->accepted.sample, &s, e->first.time + (mark->cycles + 1.0) * T);
        if ((answer = sh_cycle_to(e, &mark->twin, end, mark->cycles)) != SH_OK)
            return answer;
    }
    mark->sample = s;
    now = sh_reply_of(&mark->twin);
    *reply = now;
    x = (s.time - e->first.time) / T - n;
    if (x <= SH_ROUNDING)
        return SH_OK;
    next = mark->twin;
    answer = sh_cycle_to(e, &next, sh_course_ahead(s, e->first.time + (n + 1.0) * T), n);
    if (answer != SH_OK)
        return answer;
    then = sh_reply_of(&next);
    double change = then.payout - now.payout;
    double off = then.s_w - now.s_w - T * (now.payout + 0.5 * change);
    reply->payout = now.payout + x * change;
    reply->s_w = now.s_w + T * x * (now.payout + 0.5 * x * change) + x * off;
    return SH_OK;
}

/* Go on from saved bytes. */
static int sh_exchange_restore(sh_exchange *e, const void *bytes, size_t size)
{
    if (size != sizeof *e || strncmp((const char *)bytes, sh_identity(), sizeof e->identity) != 0)
        return 0;
    memcpy(e, bytes, size);
    if (e->started != 0.0 && e->trial.sample.time > e->accepted.sample.time)
        e->accepted = e->trial;
    return 1;
}

/* What an answer of the core means to a user. */
static const char *sh_words(int answer)
{
    static const char *const words[] = {
        "ok",
        "the winch's state is no number any more: shorten the host's step",
        "the time went back before the last accepted step: restore the state that was stored with that time",
        "the host gave NaN or infinity: check the results that it reads",
        SH_LOAD_FIXED ? "the gas is charged for the load of the case: the first tension must be its weight within 2 %"
                      : "a value is outside the range of the crane: check tension, wire out and mode",
        "the library has no such input: write it again with stillhook external"};
    return answer >= 0 && answer <= 5 ? words[answer] : "?";
}
