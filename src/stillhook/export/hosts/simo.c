/* External DLL force of SIMO: winch and wire between a crane vessel and a load, both bodies of SIMO. There is no public
 * interface of a DLL that sets the length of SIMO's own couplings; this one hangs the load by forces on both bodies.
 *
 * Argument list of GFEXFO as a public coupling of SIMO with SAMS has it (NTNU, 2022): IINFO holds mode, module,
 * body, body type, number of bodies, step, steps, substep, substeps, gravity, store, iteration; RINFO time, step,
 * gravity, densities of water and air, depth; STATE a row of twelve double precision numbers for each body, of which
 * the first six are position [m] and angles [rad]; STOR six forces [kN, kN m] in global axes at the body's origin.
 *
 * KXFO: number of the crane's body, of the load's. RXFO: tip on the crane's body x, y, z; hook point on the load x, y,
 * z [m]; tension at the start [kN], 0 for the case's weight. Plain numbers of the wire are SH_WIRE_....
 */
#if defined(_WIN32)
#define SH_FORTRAN __declspec(dllexport)
#else
#define SH_FORTRAN __attribute__((visibility("default")))
#endif

enum { SI_BODY = 2, SI_BODIES = 4, SI_STEP = 5, SI_SUBSTEP = 7, SI_SUBSTEPS = 8, SI_ITERATION = 11, SI_STATE = 12 };
enum { SI_PASSES = 8 };
#define SI_CLOSE 1e-3 /* tension that two passes may differ by [N] */

typedef struct {
    double time, tip, apart; /* height of the tip and distance tip to hook [m] */
    double unit[3];          /* with a boom: heights of the motion unit's place, and 1 m ahead and to port of it [m] */
} si_place;

/* One winch in a run: no memory of SIMO's own is public. A second winch is another copy of the library. */
static struct {
    sh_exchange exchange;
    si_place now, last, before; /* the two accepted ones */
    int known, step, substep;
    double apart_0, stretch_0, s_w_0;
} si;

/* Speed and acceleration at the newest of three places, on the parabola through them. */
static void si_rates(double t, double x, double t_1, double x_1, double t_2, double x_2, int known, double *v, double *a)
{
    double d_1 = known > 0 && t > t_1 ? (x - x_1) / (t - t_1) : 0.0;
    double d_2 = known > 1 && t_1 > t_2 ? (x_1 - x_2) / (t_1 - t_2) : d_1;
    double c = known > 1 && t > t_2 ? (d_1 - d_2) / (t - t_2) : 0.0;
    *v = d_1 + c * (t - t_1);
    *a = 2.0 * c;
}

/* A point of a body in global axes: angles roll, pitch, yaw [rad], turned in the order yaw, pitch, roll. */
static void si_point(const double *body, const float *local, double *arm, double *place)
{
    double cx = cos(body[3]), sx = sin(body[3]), cy = cos(body[4]), sy = sin(body[4]);
    double cz = cos(body[5]), sz = sin(body[5]);
    double R[3][3] = {{cz * cy, -sz * cx + cz * sy * sx, sz * sx + cz * sy * cx},
                      {sz * cy, cz * cx + sz * sy * sx, -cz * sx + sz * sy * cx},
                      {-sy, cy * sx, cy * cx}};
    for (int i = 0; i < 3; i++) {
        arm[i] = R[i][0] * local[0] + R[i][1] * local[1] + R[i][2] * local[2];
        place[i] = body[i] + arm[i];
    }
}

static double si_tension(double stretch, double rate, double s_w)
{
    double k = SH_WIRE_EA / (SH_WIRE_L_0 + fmax(s_w, 0.0));
    double m = SH_WIRE_MASS + SH_WIRE_MU * fmax(s_w, 0.0) / 3.0;
    return fmax(k * stretch + 2.0 * SH_WIRE_ZETA * sqrt(m / k) * k * rate, 0.0);
}

/* The tip as the PLC reads it. */
static void si_seen(double *tip)
{
#if SH_BOOM
    double z[3][3];
    for (int i = 0; i < 3; i++) {
        z[i][0] = si.now.unit[i];
        si_rates(si.now.time, z[i][0], si.last.time, si.last.unit[i], si.before.time, si.before.unit[i], si.known,
                 &z[i][1], &z[i][2]);
    }
    sh_seen(z, tip);
#else
    tip[0] = si.now.tip;
    si_rates(si.now.time, si.now.tip, si.last.time, si.last.tip, si.before.time, si.before.tip, si.known, &tip[1],
             &tip[2]);
#endif
}

static int si_begin(const float *rxfo)
{
    double tip[3];
    si.known = 0;
    si_seen(tip);
    sh_sample s = {si.now.time, rxfo[6] > 0.0f ? 1000.0 * rxfo[6] : SH_WIRE_WEIGHT, tip[0], 0.0, 0.0};
    sh_reply reply;
    int answer;
    sh_exchange_new(&si.exchange);
    answer = sh_exchange_at(&si.exchange, s, 1, &reply);
    si.apart_0 = si.now.apart;
    si.s_w_0 = reply.s_w;
    si.stretch_0 = s.F_w * (SH_WIRE_L_0 + reply.s_w) / SH_WIRE_EA;
    return answer;
}

/* Time of a substep: SIMO's is of single precision, which after a day no longer tells substeps apart, so the substeps
 * since the last call are counted where both agree to what single precision holds. */
static double si_time(const int *iinfo, float shown, double sub)
{
    double grid = sub > 0.0 ? floor(shown / sub + 0.5) * sub : shown;
    double n = ((double)iinfo[SI_STEP] - si.step) * (iinfo[SI_SUBSTEPS] > 1 ? iinfo[SI_SUBSTEPS] : 1) +
               ((double)iinfo[SI_SUBSTEP] - si.substep);
    double counted = si.now.time + n * sub;
    int agree = fabs(counted - shown) <= 0.25 * sub + 2.0 * (double)FLT_EPSILON * fabs((double)shown);
    return si.exchange.started != 0.0 && n >= 0.0 && agree ? counted : grid;
}

/* Tension at the present places: winch and wire agree on it after some passes. */
static int si_solve(int new_step, double *F)
{
    double tip[3], rate, unused;
    sh_reply reply = {0.0, si.s_w_0};
    si_seen(tip);
    si_rates(si.now.time, si.now.apart, si.last.time, si.last.apart, si.before.time, si.before.apart, si.known, &rate,
             &unused);
    *F = si.exchange.trial.sample.F_w;
    for (int pass = 0; pass < SI_PASSES; pass++) {
        sh_sample s = {si.now.time, *F, tip[0], tip[1], tip[2]};
        double found, stretch;
        int answer = sh_exchange_at(&si.exchange, s, new_step && pass == 0, &reply);
        if (answer != SH_OK)
            return answer;
        stretch = si.stretch_0 + si.now.apart - si.apart_0 - (reply.s_w - si.s_w_0);
        found = si_tension(stretch, rate - reply.payout, reply.s_w);
        if (fabs(found - *F) < SI_CLOSE)
            break;
        *F = found;
    }
    return SH_OK;
}

SH_FORTRAN void gfexfo_(int *iwa, float *rwa, double *dwa, int *ipdms, int *iinfo, float *rinfo, int *npcur,
                        float *curcor, float *curvel, int *kxfo, float *rxfo, float *rhxfo, int *ixfo, int *iextf,
                        int *icoord, int *nint, int *nrea, int *nsto, int *nstr, char *chext, double *state,
                        double *gamma, double *vellot, float *stor, int *ierr)
{
    double arm[2][3], at[2][3], F = 0.0, sub, time;
    int crane = kxfo[0], load = kxfo[1], body = iinfo[SI_BODY], first, answer = SH_OK;
    (void)iwa, (void)rwa, (void)dwa, (void)ipdms, (void)npcur, (void)curcor, (void)curvel, (void)rhxfo, (void)ixfo;
    (void)iextf, (void)icoord, (void)nsto, (void)nstr, (void)chext, (void)gamma, (void)vellot;
    *ierr = -20;
    if (*nint < 2 || *nrea < 7 || crane < 1 || load < 1 || crane > iinfo[SI_BODIES] || load > iinfo[SI_BODIES] ||
        crane == load || (body != crane && body != load))
        return;
    sub = rinfo[1] / (iinfo[SI_SUBSTEPS] > 1 ? iinfo[SI_SUBSTEPS] : 1);
    time = si_time(iinfo, rinfo[0], sub);
    si_point(state + SI_STATE * (crane - 1), rxfo, arm[0], at[0]);
    si_point(state + SI_STATE * (load - 1), rxfo + 3, arm[1], at[1]);
    double e[3] = {at[0][0] - at[1][0], at[0][1] - at[1][1], at[0][2] - at[1][2]};
    double apart = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    *ierr = -21;
    if (!(apart > 0.0))
        return;
    first = si.exchange.started == 0.0 || time <= si.exchange.first.time || iinfo[SI_STEP] < si.step;
    int new_step = !first && (iinfo[SI_STEP] != si.step || iinfo[SI_SUBSTEP] != si.substep);
    if (new_step && time > si.now.time) {
        si.before = si.last;
        si.last = si.now;
        si.known = si.known < 2 ? si.known + 1 : 2;
    }
    si.step = iinfo[SI_STEP];
    si.substep = iinfo[SI_SUBSTEP];
    si.now.time = time;
    si.now.tip = at[0][2];
    si.now.apart = apart;
#if SH_BOOM
    for (int j = 0; j < 3; j++) {
        float local[3];
        double unused[3], place[3];
        for (int i = 0; i < 3; i++)
            local[i] = (float)(rxfo[i] - sh_lever[i] + (i == j - 1));
        si_point(state + SI_STATE * (crane - 1), local, unused, place);
        si.now.unit[j] = place[2];
    }
#endif
    if (first) {
        answer = si_begin(rxfo);
        F = si.exchange.first.F_w;
        si.last = si.before = si.now;
    } else {
        answer = si_solve(new_step, &F);
    }
    *ierr = -answer;
    if (answer != SH_OK)
        return;
    double sign = body == load ? 0.001 : -0.001, *r = arm[body == load], f[3];
    for (int i = 0; i < 3; i++)
        f[i] = sign * F * e[i] / apart;
    for (int i = 0; i < 3; i++) {
        stor[i] = (float)f[i];
        stor[3 + i] = (float)(r[(i + 1) % 3] * f[(i + 2) % 3] - r[(i + 2) % 3] * f[(i + 1) % 3]);
    }
}
