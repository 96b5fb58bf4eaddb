/* A plain interface, for hosts that call functions of a library themselves (Java by JNA, Python by ctypes, MATLAB): SI.
 * Signs: tip up positive; payout and wire out: paid out positive. An answer of 0 is good; stillhook_words says the
 * others.
 */
#include <stdlib.h>
#if defined(_WIN32)
#define SH_SHOWN __declspec(dllexport)
#else
#define SH_SHOWN __attribute__((visibility("default")))
#endif

SH_SHOWN void *stillhook_new(double wire_out, double v_op, double mode) /* wire_out, mode: NaN for the case's */
{
    sh_exchange *e = malloc(sizeof *e);
    if (e != NULL) {
        sh_exchange_new(e);
        e->s_w_start = wire_out;
        e->v_op = v_op;
        e->mode = mode;
    }
    return e;
}

SH_SHOWN void stillhook_free(void *e) { free(e); }

/* F_w tension at the crane tip [N]; s_tip, v_tip, a_tip its motion; new_step: 1 at the first call of a step. */
SH_SHOWN int stillhook_exchange(void *e, double time, double F_w, double s_tip, double v_tip, double a_tip,
                                int new_step, double *payout, double *s_w)
{
    sh_sample sample = {time, F_w, s_tip, v_tip, a_tip};
    sh_reply reply = {0.0, 0.0};
    if (e == NULL || payout == NULL || s_w == NULL)
        return SH_NOT_NOW;
    int answer = sh_exchange_at(e, sample, new_step, &reply);
    if (answer == SH_OK) {
        *payout = reply.payout;
        *s_w = reply.s_w;
    }
    return answer;
}

#if SH_BOOM
/* The same of a case with a boom: heave, roll, pitch, slew, main, knuckle, unit_heave, each with rate and acceleration. */
SH_SHOWN int stillhook_exchange_vessel(void *e, double time, double F_w, const double *vessel, int new_step,
                                       double *payout, double *s_w)
{
    double given[SH_BOOM], tip[6];
    if (vessel == NULL)
        return SH_NOT_NOW;
    memcpy(given, vessel, sizeof given);
    sh_kernel_tip(given, sh_boom, tip);
    return stillhook_exchange(e, time, F_w, tip[3], tip[4], tip[5], new_step, payout, s_w);
}
#endif

SH_SHOWN double stillhook_get(void *e, const char *name) /* any output at the last PLC cycle; NaN for none */
{
    return e == NULL || name == NULL ? NAN : sh_get(&((sh_exchange *)e)->trial.twin, sh_find(name));
}

SH_SHOWN const char *stillhook_text(void *e, const char *name) /* an output in words: causes, outside, contradiction */
{
    return e == NULL || name == NULL ? "" : sh_text(&((sh_exchange *)e)->trial.twin, sh_find(name));
}

/* The state as bytes, stillhook_size() of them, with a checksum; what is no such state is refused and changes nothing. */
SH_SHOWN int64_t stillhook_size(void) { return (int64_t)sh_exchange_size(); }
SH_SHOWN void stillhook_save(const void *e, void *bytes) { sh_exchange_save(e, bytes); }
SH_SHOWN int stillhook_restore(void *e, const void *bytes, int64_t size)
{
    return e == NULL || bytes == NULL || size < 0 ? SH_NO_STATE : sh_exchange_restore(e, bytes, (size_t)size);
}
SH_SHOWN const char *stillhook_why(const void *e) /* what was wrong with the last state that was refused */
{
    return e == NULL ? "" : ((const sh_exchange *)e)->why;
}
SH_SHOWN const char *stillhook_words(int answer) { return sh_words(answer); }
SH_SHOWN const char *stillhook_identity(void) { return sh_identity(); }
