/* What a host reads of a winch: signals, limits, envelope, and texts. */

/* Peak-to-peak of the tip over the last 30 s [m]. */
static double sh_span(const sh_twin *t)
{
    double lo = t->row[SH_MOTION], hi = lo;
    for (int j = 0; j <= SH_SECONDS; j++) {
        lo = fmin(lo, t->lowest[j]);
        hi = fmax(hi, t->highest[j]);
    }
    return hi - lo;
}

/* Mean period of the tip's motion since the start, that of a narrow spectrum: by its deviation over that of its speed
 * [s]. */
static double sh_period(const sh_twin *t)
{
    double mean = t->sum_s / t->count;
    return 6.283185307179586 * sqrt(fmax(t->sum_s2 / t->count - mean * mean, 0.0) / (t->sum_v2 / t->count));
}

/* Whether condition i is within the envelope now; 1 where it cannot be judged yet, or has no meaning. */
static int sh_inside(sh_twin *t, int i)
{
    double x = 0.0, gone = t->cycles * SH_T_CYCLE;
    int follows = t->row[SH_MODE_COLUMN] > 0.0, judged = 1;
    if (!SH_CERTIFIED)
        return 0;
    switch (i) {
    case SH_LOAD: x = t->beginning[0]; break;
    case SH_WIRE: x = t->seen[SH_WIRE_OUT]; break;
    case SH_SPAN:
        x = sh_span(t);
        judged = follows && (gone >= SH_SECONDS || x > sh_most[i]);
        break;
    case SH_PERIOD:
        judged = follows && gone >= 2.0 * SH_SECONDS && t->sum_v2 > 0.0;
        x = judged ? sh_period(t) : 0.0;
        break;
    case SH_MODE:
        for (int j = 0; j < SH_MODES; j++)
            if (t->row[SH_MODE_COLUMN] == sh_modes[j])
                return sh_validated[j] > 0.0;
        return 0;
    default:
        for (int j = 0; j < SH_INPUTS; j++)
            if (sh_share[j] > 0.0 && t->input[j] < 1.0)
                return 0;
        return 1;
    }
    return !judged || (x >= sh_least[i] && x <= sh_most[i]);
}

static int sh_valid(sh_twin *t, int i)
{
    if (i >= 0)
        return sh_inside(t, i);
    for (i = 0; i < SH_CONDITIONS; i++)
        if (!sh_inside(t, i))
            return 0;
    return 1;
}

/* How many cycles of now pass a limit, 0 or 1, and how many did since the start. */
static double sh_now(sh_twin *t, int i) { return t->seen[sh_limits[i].at] - t->A[sh_limits[i].at]; }

static double sh_status(sh_twin *t)
{
    if (t->lost != 0.0)
        return 2.0;
    for (int i = 0; i < SH_LIMITS; i++)
        if (t->seen[sh_limits[i].at] > 0.0)
            return 1.0;
    return 0.0;
}

static double sh_get(sh_twin *t, int v)
{
    const sh_variable *row = sh_row(v);
    sh_twin other;
    if (row == NULL)
        return NAN;
    if (row->causality == SH_OUTPUT && t->started == 0.0) {
        memcpy(&other, t, sizeof other);
        sh_start(&other, 0.0);
        return sh_get(&other, v);
    }
    sh_place p = sh_places[v];
    if (row->causality == SH_OUTPUT)
        sh_look(t);
    switch (p.kind) {
    case SH_OF_INPUT: return t->input[p.at];
    case SH_OF_LANE: return t->A[p.at];
    case SH_OF_BEGINNING: return t->beginning[p.at];
    case SH_OF_OPTION: return t->input_time;
    case SH_OF_SEEN: return t->seen[p.at];
    case SH_OF_SENSED: return t->sensed[p.at];
    case SH_OF_LIMIT: return sh_now(t, p.at) > 0.0 ? 1.0 : 0.0;
    case SH_OF_DURATION: return t->A[sh_limits[p.at].at] * SH_T_CYCLE;
    case SH_OF_STATUS: return sh_status(t);
    case SH_OF_VALID: return sh_valid(t, p.at);
    case SH_OF_ONE: return sh_motion_says(&t->motion)[0] == 0;
    default: return NAN;
    }
}

static void sh_word(char *text, const char *word)
{
    size_t n = strlen(text);
    if (strstr(text, word) == NULL)
        snprintf(text + n, SH_TEXT_LENGTH - n, "%s%s", n > 0 ? ", " : "", word);
}

static const char *sh_causes(sh_twin *t)
{
    t->causes[0] = 0;
    if (t->lost != 0.0)
        sh_word(t->causes, "diverged");
    for (int i = 0; i < SH_LIMITS && t->started != 0.0; i++)
        if (t->seen[sh_limits[i].at] > 0.0)
            sh_word(t->causes, sh_limits[i].word);
    return t->causes[0] ? t->causes : "ok";
}

static const char *sh_outside(sh_twin *t)
{
    static const char *const conditions[SH_CONDITIONS] = {
        "load", "wire out", "tip motion over 30 s", "period of the tip", "mode", "loss of a hydraulic power unit"};
    t->outside[0] = 0;
    for (int i = 0; i < SH_CONDITIONS; i++)
        if (SH_CERTIFIED && !sh_inside(t, i))
            sh_word(t->outside, conditions[i]);
    return SH_CERTIFIED ? t->outside : "not validated";
}

static const char *sh_text(sh_twin *t, int v)
{
    const sh_variable *row = sh_row(v);
    if (row == NULL || row->type != SH_TEXT)
        return "";
    if (t->started != 0.0)
        sh_look(t);
    if (sh_places[v].kind == SH_OF_APART)
        return sh_motion_says(&t->motion);
    return sh_places[v].kind == SH_OF_CAUSES ? sh_causes(t) : sh_outside(t);
}
