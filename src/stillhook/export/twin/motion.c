/* Whether position, speed and acceleration of the tip that a host gives are one motion: the change of one against the
 * integral of the next, both without what is slower than SH_LEAK, by their squares over the last 15 to 30 s.
 */
#define SH_LEAK 5.0    /* [s]: a speed off by 0.01 m/s makes 5 cm */
#define SH_BLOCK 15.0  /* [s] */
#define SH_LEAST 10.0  /* time from which on it is judged [s] */
#define SH_UNLIKE 0.35 /* difference over the larger of both, by deviations: steps of a sixth of a period make 0.1 */
#define SH_SMALL 0.05  /* differences that are none [m, m/s] */

enum { SH_CHANGE, SH_INTEGRAL, SH_BOTH, SH_SQUARES };

/* Doubles alone: they are part of a saved state. Of position and speed, and of speed and acceleration: change of the
 * first and integral of the second, and squares of both and of their difference over this block and the one before. */
typedef struct {
    double given, time, last[3], change[2], integral[2];
    double now, before; /* time of the blocks [s] */
    double of_now[2][SH_SQUARES], of_before[2][SH_SQUARES];
} sh_motion;

static void sh_motion_take(sh_motion *m, double time, const double *tip)
{
    double h = m->given != 0.0 ? fmax(time - m->time, 0.0) : 0.0, leak = exp(-h / SH_LEAK);
    if (m->now >= SH_BLOCK) {
        memcpy(m->of_before, m->of_now, sizeof m->of_now);
        memset(m->of_now, 0, sizeof m->of_now);
        m->before = m->now;
        m->now = 0.0;
    }
    for (int i = 0; i < 2 && m->given != 0.0; i++) {
        m->change[i] = leak * m->change[i] + tip[i] - m->last[i];
        m->integral[i] = leak * m->integral[i] + 0.5 * h * (m->last[i + 1] + tip[i + 1]);
        double both = m->change[i] - m->integral[i];
        m->of_now[i][SH_CHANGE] += h * m->change[i] * m->change[i];
        m->of_now[i][SH_INTEGRAL] += h * m->integral[i] * m->integral[i];
        m->of_now[i][SH_BOTH] += h * both * both;
    }
    m->now += h;
    m->time = time;
    m->given = 1.0;
    memcpy(m->last, tip, sizeof m->last);
}

static double sh_motion_deviation(const sh_motion *m, int i, int of)
{
    return sqrt((m->of_now[i][of] + m->of_before[i][of]) / (m->now + m->before));
}

/* What contradicts what, "" for nothing, or while it cannot be said yet. */
static const char *sh_motion_says(const sh_motion *m)
{
    static const char *const words[2] = {"position and speed of the tip are not one motion",
                                         "speed and acceleration of the tip are not one motion"};
    for (int i = 0; i < 2 && m->now + m->before >= SH_LEAST; i++) {
        double apart = sh_motion_deviation(m, i, SH_BOTH);
        double most = fmax(sh_motion_deviation(m, i, SH_CHANGE), sh_motion_deviation(m, i, SH_INTEGRAL));
        if (apart > SH_SMALL && apart > SH_UNLIKE * most)
            return words[i];
    }
    return "";
}

/* Whether it may be the memory of a twin at a time [s], beside which a host's own is by a cycle and its rounding. */
static int sh_motion_sound(const sh_motion *m, double time)
{
    const double *x = &m->given, *squares = &m->of_now[0][0];
    for (size_t i = 0; i < sizeof *m / sizeof *x; i++)
        if (!(fabs(x[i]) <= 1e300))
            return 0;
    for (int i = 0; i < 4 * SH_SQUARES; i++)
        if (squares[i] < 0.0)
            return 0;
    return (m->given == 0.0 || m->given == 1.0) && m->now >= 0.0 && m->before >= 0.0 && m->time <= time * (1.0 + 1e-6) + 2.0 * SH_T_CYCLE;
}
