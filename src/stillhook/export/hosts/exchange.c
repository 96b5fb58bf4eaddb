/* A winch in a host whose steps are its own: PLC cycles run as the host's time passes them. The same as exchange.py,
 * which says what is held and what is interpolated.
 */
#define SH_ROUNDING 1e-6 /* part of a PLC cycle by which a host's time may be beside one and still be it */
#define SH_HOST "SHHOST_2" /* kind of a saved state, with the version of its format */
#define SH_MOST_STEPS 1e6  /* PLC cycles in one step of a host */
#define SH_LARGEST 1e12    /* largest number of a host in a saved state */
#define SH_CHARGE 0.02   /* part by which the first tension may differ from the load that a gas charge is set for */

typedef struct {
    double time, F_w, s_tip, v_tip, a_tip;
} sh_sample;

typedef struct {
    double payout, s_w;
} sh_reply;

/* A time of the host: PLC cycles that it has made, and part of the next; the winch after them. */
typedef struct {
    sh_twin twin;
    sh_sample sample;
    double cycles, part;
} sh_mark;

typedef struct {
    double started, s_w_start, v_op, mode; /* s_w_start, mode: NaN for those of the case */
    sh_sample first;
    sh_mark accepted, trial;
    char why[300]; /* what was wrong with a saved state */
} sh_exchange;

static void sh_exchange_new(sh_exchange *e)
{
    memset(e, 0, sizeof *e);
    e->s_w_start = e->mode = NAN;
    sh_defaults(&e->trial.twin);
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

#if SH_BOOM
/* An angle by its sine, each with rate and acceleration. */
static void sh_angle(const double *sine, double *angle)
{
    double c = sqrt(fmax(1.0 - sine[0] * sine[0], 1e-9));
    angle[0] = asin(fmax(fmin(sine[0], 1.0), -1.0));
    angle[1] = sine[1] / c;
    angle[2] = (sine[2] + sine[0] * angle[1] * angle[1]) / c;
}

/* The tip as the PLC makes it: from the heights of the motion unit's place and of those 1 m ahead and 1 m to port of it,
 * each with rate and acceleration. The same as `Exchange.of_heights`. */
static void sh_seen(const double z[3][3], double *tip)
{
    double given[SH_BOOM], out[6], ahead[3], port[3], roll[3], c[3];
    memcpy(given, sh_level, sizeof given);
    for (int i = 0; i < 3; i++) {
        ahead[i] = z[1][i] - z[0][i];
        port[i] = z[2][i] - z[0][i];
        given[i] = given[SH_BOOM - 3 + i] = z[0][i];
    }
    double *pitch = given + 6;
    sh_angle(ahead, pitch);
    c[0] = cos(pitch[0]);
    c[1] = -ahead[0] * pitch[1];
    c[2] = -c[0] * pitch[1] * pitch[1] - ahead[0] * pitch[2];
    roll[0] = port[0] / c[0];
    roll[1] = (port[1] - roll[0] * c[1]) / c[0];
    roll[2] = (port[2] - 2.0 * roll[1] * c[1] - roll[0] * c[2]) / c[0];
    sh_angle(roll, given + 3);
    sh_kernel_tip(given, sh_boom, out);
    memcpy(tip, out + 3, 3 * sizeof(double));
}
#endif

/* The winch standing under the first tension, with a tip that stands. */
static int sh_exchange_begin(sh_exchange *e, sh_sample s, sh_reply *reply)
{
    sh_mark m;
    sh_twin *t = &m.twin;
    int answer;
    if (SH_LOAD_FIXED && fabs(s.F_w - SH_WIRE_WEIGHT) > SH_CHARGE * SH_WIRE_WEIGHT)
        return SH_OUT_OF_RANGE;
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
    m.sample = s;
    m.cycles = m.part = 0.0;
    e->first = s;
    e->accepted = e->trial = m;
    e->started = 1.0;
    *reply = sh_reply_of(&e->trial.twin);
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
    return answer == SH_OK ? sh_go(t, k * sh_cycle(), sh_cycle(), 0) : answer;
}

/* Part of a PLC cycle by which a host's time may be beside one and still be it. */
static double sh_rounding(double time)
{
    return SH_ROUNDING + fmin(2.0 * DBL_EPSILON * fabs(time) / sh_cycle(), 0.01);
}

/* PLC cycles that the host has made at a time, and part of the next: from those of the sample before. A step that is a
 * whole number of cycles to the rounding of the host's times is one. */
static void sh_counted(const sh_mark *before, double time, double *cycles, double *part)
{
    double x = fmax(time - before->sample.time, 0.0) / sh_cycle(), near = floor(x + 0.5), more;
    if (fabs(x - near) <= 1e-9 + 2.0 * DBL_EPSILON * fabs(time) / sh_cycle())
        x = near;
    *part = before->part + (x - floor(x));
    more = floor(*part + sh_rounding(time));
    *cycles = before->cycles + floor(x) + more;
    *part -= more;
}

/* The answer at a sample. new_step: the host began a new step, so that its last sample is accepted unless the time went
 * back behind it. What is refused changes nothing. */
static int sh_exchange_at(sh_exchange *e, sh_sample s, int new_step, sh_reply *reply)
{
    double T = sh_cycle(), room = sh_rounding(s.time) * T, n, x, done;
    const sh_mark *before = &e->accepted;
    sh_mark mark;
    sh_twin next;
    sh_sample from, end;
    sh_reply now, then;
    int answer;
    if (!sh_finite(s.time) || !sh_finite(s.F_w) || !sh_finite(s.s_tip) || !sh_finite(s.v_tip) || !sh_finite(s.a_tip))
        return SH_NO_NUMBER;
    if (s.F_w < 0.0)
        s.F_w = 0.0; /* a wire cannot push */
    if (e->started == 0.0 || s.time <= e->first.time + room)
        return sh_exchange_begin(e, s, reply);
    if (new_step && e->trial.sample.time > before->sample.time && s.time > e->trial.sample.time)
        before = &e->trial;
    if (s.time < before->sample.time - room)
        return SH_WRONG_STEP;
    mark = *before;
    done = mark.cycles;
    sh_counted(&mark, s.time, &n, &x);
    if (!(n - done <= SH_MOST_STEPS))
        return SH_WRONG_STEP;
    from = mark.sample; /* times from the cycle before the last sample on */
    from.time = mark.part * T;
    end = s;
    end.time = (n - done + x) * T;
    for (; mark.cycles < n; mark.cycles += 1.0) {
        sh_sample at = sh_course(&from, &end, (mark.cycles - done + 1.0) * T);
        if ((answer = sh_cycle_to(e, &mark.twin, at, mark.cycles)) != SH_OK)
            return answer;
    }
    mark.sample = s;
    mark.part = x;
    sh_motion_take(&mark.twin.motion, s.time - e->first.time, (double[]){s.s_tip - e->first.s_tip, s.v_tip, s.a_tip});
    now = then = sh_reply_of(&mark.twin);
    if (x > sh_rounding(s.time)) {
        next = mark.twin;
        answer = sh_cycle_to(e, &next, sh_course_ahead(end, (n - done + 1.0) * T), n);
        if (answer != SH_OK)
            return answer;
        then = sh_reply_of(&next);
    } else {
        x = 0.0;
    }
    if (before == &e->trial)
        e->accepted = e->trial;
    e->trial = mark;
    double change = then.payout - now.payout;
    double off = then.s_w - now.s_w - T * (now.payout + 0.5 * change);
    reply->payout = now.payout + x * change;
    reply->s_w = now.s_w + T * x * (now.payout + 0.5 * x * change) + x * off;
    return SH_OK;
}

enum { SH_EXCHANGED = 17 }; /* numbers of an exchange beside its twin */

static size_t sh_exchange_size(void) { return sh_state_size(SH_EXCHANGED); }

/* The state after the last sample as bytes, sh_exchange_size() of them. A number that is not given is NaN: it goes with
 * a mark of its own, for a state holds no NaN. */
static void sh_exchange_save(const sh_exchange *e, unsigned char *bytes)
{
    const sh_mark *m = &e->trial;
    const double own[SH_EXCHANGED] = {e->started,
                                      e->s_w_start == e->s_w_start,
                                      e->s_w_start == e->s_w_start ? e->s_w_start : 0.0,
                                      e->mode == e->mode,
                                      e->mode == e->mode ? e->mode : 0.0,
                                      e->first.time,
                                      e->first.F_w,
                                      e->first.s_tip,
                                      e->first.v_tip,
                                      e->first.a_tip,
                                      m->sample.time,
                                      m->sample.F_w,
                                      m->sample.s_tip,
                                      m->sample.v_tip,
                                      m->sample.a_tip,
                                      m->part,
                                      e->v_op};
    sh_state_write(bytes, SH_HOST, own, SH_EXCHANGED, &m->twin);
}

static int sh_exchange_sound(const double *own, const sh_twin *t, char *why, size_t room)
{
    double T = sh_cycle(), most = fmax(fabs(own[5]), fabs(own[10]));
    for (int i = 0; i < SH_EXCHANGED; i++)
        if (!(fabs(own[i]) <= SH_LARGEST)) {
            snprintf(why, room, "number %d of the host is %.9g", i, own[i]);
            return 0;
        }
    if ((own[0] != 0.0 && own[0] != 1.0) || own[0] != t->started || (own[1] != 0.0 && own[1] != 1.0) ||
        (own[3] != 0.0 && own[3] != 1.0) || (own[3] != 0.0 && !sh_known_mode(own[4])) || own[6] < 0.0 ||
        own[11] < 0.0) {
        snprintf(why, room, "start, mode or tension of the host is none");
        return 0;
    }
    double apart = fabs((own[10] - own[5]) / T - t->cycles - own[15]);
    double allowed = SH_ROUNDING + 1e-9 * t->cycles + 4.0 * DBL_EPSILON * (t->cycles + 2.0) * most / T;
    if (own[15] <= -0.02 || own[15] >= 1.0 || apart > allowed) {
        snprintf(why, room, "%.9g cycles and a part of %.9g from %.9g s to %.9g s", t->cycles, own[15], own[5], own[10]);
        return 0;
    }
    return 1;
}

/* Go on from saved bytes; SH_NO_STATE changes nothing and says in e->why what is wrong. */
static int sh_exchange_restore(sh_exchange *e, const void *bytes, size_t size)
{
    double own[SH_EXCHANGED];
    sh_mark m;
    memset(&m, 0, sizeof m);
    if (sh_state_read(bytes, size, SH_HOST, own, SH_EXCHANGED, &m.twin, e->why, sizeof e->why) != SH_OK ||
        !sh_exchange_sound(own, &m.twin, e->why, sizeof e->why))
        return SH_NO_STATE;
    const sh_sample first = {own[5], own[6], own[7], own[8], own[9]};
    const sh_sample last = {own[10], own[11], own[12], own[13], own[14]};
    e->started = own[0];
    e->s_w_start = own[1] != 0.0 ? own[2] : NAN;
    e->mode = own[3] != 0.0 ? own[4] : NAN;
    e->v_op = own[16];
    e->first = first;
    m.sample = last;
    m.cycles = m.twin.cycles;
    m.part = own[15];
    e->accepted = e->trial = m;
    return SH_OK;
}

/* What an answer of the core means to a user. */
static const char *sh_words(int answer)
{
    static const char *const words[] = {
        "ok",
        "the winch's state is no number any more: shorten the host's step",
        "the time went back before the last accepted step, or ahead by more than 1e6 PLC cycles: restore the state that"
        " was stored with that time",
        "the host gave NaN or infinity: check the results that it reads",
        SH_LOAD_FIXED ? "the gas is charged for the load of the case: the first tension must be its weight within 2 %"
                      : "a value is outside the range of the crane: check tension, wire out and mode",
        "the library has no such input: write it again with stillhook external",
        "the stored state is damaged, or of another crane, case or version: begin the simulation anew"};
    return answer >= 0 && answer <= 6 ? words[answer] : "?";
}
