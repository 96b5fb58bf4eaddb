/* A twin as bytes that can be trusted: whose state it is, of which export, how long, its numbers, a checksum.
 *
 * Layout: 8 characters of the kind, with the version of the format; 64 of the identity, which holds the names of the
 * numbers; the count of numbers, the caller's numbers, and the twin's up to `seen`, all doubles as this machine has
 * them; CRC-32 (IEEE 802.3, as of zlib) of all before, four bytes, the lowest first.
 */
enum { SH_KIND = 8, SH_NAME = 64, SH_HEAD = SH_KIND + SH_NAME + 8, SH_CHECKSUM = 4 };
#define SH_CARRIED (offsetof(struct sh_twin, seen) / sizeof(double))
#define SH_MOST_CYCLES 9007199254740992.0 /* 2^53, up to which a double counts one by one */
#define SH_MOST_TIP 1e6                   /* [m] */

static uint32_t sh_crc(const unsigned char *bytes, size_t size)
{
    static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                       0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                       0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t crc = 0xffffffff;
    for (size_t i = 0; i < size; i++) {
        crc = table[(crc ^ bytes[i]) & 15] ^ (crc >> 4);
        crc = table[(crc ^ (bytes[i] >> 4)) & 15] ^ (crc >> 4);
    }
    return ~crc;
}

static size_t sh_state_size(size_t count) { return SH_HEAD + sizeof(double) * (count + SH_CARRIED) + SH_CHECKSUM; }

static void sh_state_write(unsigned char *to, const char *kind, const double *own, size_t count, const sh_twin *t)
{
    double all = (double)(count + SH_CARRIED);
    size_t body = sh_state_size(count) - SH_CHECKSUM;
    memcpy(to, kind, SH_KIND);
    memcpy(to + SH_KIND, sh_identity(), SH_NAME);
    memcpy(to + SH_KIND + SH_NAME, &all, sizeof all);
    if (count > 0)
        memcpy(to + SH_HEAD, own, count * sizeof(double));
    memcpy(to + SH_HEAD + count * sizeof(double), t, SH_CARRIED * sizeof(double));
    uint32_t crc = sh_crc(to, body);
    for (int i = 0; i < SH_CHECKSUM; i++)
        to[body + (size_t)i] = (unsigned char)(crc >> (8 * i));
}

static int sh_refuse(char *why, size_t room, const char *name, double x, double least, double most)
{
    snprintf(why, room, "%s = %.9g, allowed is %.9g to %.9g", name, x, least, most);
    return SH_NO_STATE;
}

static int sh_whole(double x, double most) { return x >= 0.0 && x <= most && x == floor(x); }
static int sh_same(double a, double b) { return memcmp(&a, &b, sizeof a) == 0; }

static int sh_check_number(const sh_number *n, double x, double same, double cycles, char *why, size_t room)
{
    switch (n->is) {
    case SH_IS_SAME:
        return sh_same(x, same) ? SH_OK : sh_refuse(why, room, n->name, x, same, same);
    case SH_IS_COUNT:
        return sh_whole(x, cycles) ? SH_OK : sh_refuse(why, room, n->name, x, 0.0, cycles);
    case SH_IS_CODE:
        if (x == 0.0 || sh_known_mode(x))
            return SH_OK;
        snprintf(why, room, "%s = %.9g is no mode", n->name, x);
        return SH_NO_STATE;
    default:
        return x >= n->least && x <= n->most ? SH_OK : sh_refuse(why, room, n->name, x, n->least, n->most);
    }
}

/* The lane: what is not calculated from cycle to cycle is that of the export, or follows from the beginning. */
static int sh_check_lane(const sh_twin *t, char *why, size_t room)
{
    double own[SH_LANE];
    memcpy(own, sh_record, sizeof own);
#ifndef SH_ALONE
    if (t->started != 0.0) {
        double beginning[SH_BEGINNING];
        memcpy(beginning, t->beginning, sizeof beginning);
        memcpy(own + SH_TICK, t->row, sizeof t->row);
        sh_kernel_prepare(own, beginning);
    }
#endif
    for (int i = 0; i < SH_LANE; i++)
        if (!sh_same(t->A[i], sh_record[i]) || sh_numbers[i].is == SH_IS_SAME)
            if (sh_check_number(&sh_numbers[i], t->A[i], own[i], t->cycles, why, room) != SH_OK)
                return SH_NO_STATE;
    return SH_OK;
}

/* What a host has set, and the beginning: in the range of their variables, else as exported. */
static int sh_check_set(const sh_twin *t, char *why, size_t room)
{
    int free_beginning[SH_BEGINNING] = {0};
    for (int v = 0; v < SH_VARIABLES; v++) {
        sh_place p = sh_places[v];
        double x = 0.0, first = 0.0;
        const sh_number *column = NULL;
        switch (sh_variables[v].causality == SH_OUTPUT ? SH_OF_SEEN : p.kind) {
        case SH_OF_INPUT:
            x = t->input[p.at];
            first = sh_entries[p.at].first < 0 ? x : t->row[sh_entries[p.at].first];
            column = sh_entries[p.at].first < 0 ? NULL : &sh_row_numbers[sh_entries[p.at].first];
            break;
        case SH_OF_LANE: x = first = t->A[p.at]; break;
        case SH_OF_BEGINNING:
            free_beginning[p.at] = 1;
            x = first = t->beginning[p.at];
            break;
        case SH_OF_OPTION: x = first = t->input_time; break;
        default: continue;
        }
        if (sh_allowed(v, x) != SH_OK || sh_allowed(v, first) != SH_OK)
            return sh_refuse(why, room, sh_variables[v].name, sh_allowed(v, x) != SH_OK ? x : first,
                             sh_variables[v].least, sh_variables[v].most);
        if (column != NULL && sh_check_number(column, x, x, t->cycles, why, room) != SH_OK)
            return SH_NO_STATE;
    }
#if SH_TENSION >= 0 /* the load is what the first tension carries */
    free_beginning[0] = t->started != 0.0;
#endif
    for (int i = 0; i < SH_BEGINNING; i++)
        if (!free_beginning[i] && !sh_same(t->beginning[i], sh_beginning[i]))
            return sh_refuse(why, room, "beginning", t->beginning[i], sh_beginning[i], sh_beginning[i]);
    return fabs(t->beginning[0]) <= 1e9 ? SH_OK : sh_refuse(why, room, "load", t->beginning[0], 0.0, 1e9);
}

/* What is remembered of the tip. */
static int sh_check_memory(const sh_twin *t, char *why, size_t room)
{
    if (!sh_whole(t->count, t->cycles))
        return sh_refuse(why, room, "count of the tip's motion", t->count, 0.0, t->cycles);
    if (!(fabs(t->sum_s) <= 1e30 && t->sum_s2 >= 0.0 && t->sum_s2 <= 1e300 && t->sum_v2 >= 0.0 && t->sum_v2 <= 1e300)) {
        snprintf(why, room, "sums of the tip's motion that no motion has");
        return SH_NO_STATE;
    }
    for (int i = 0; i <= SH_SECONDS; i++) {
        int blank = t->lowest[i] == HUGE_VAL && t->highest[i] == -HUGE_VAL;
        if (!blank && !(t->lowest[i] >= -SH_MOST_TIP && t->lowest[i] <= t->highest[i] && t->highest[i] <= SH_MOST_TIP))
            return sh_refuse(why, room, "lowest place of the tip", t->lowest[i], -SH_MOST_TIP, t->highest[i]);
    }
    return SH_OK;
}

static int sh_check_clock(const sh_twin *t, char *why, size_t room)
{
    double time;
    if (!((t->started == 0.0 || t->started == 1.0) && t->lost == 0.0)) {
        snprintf(why, room, "it has no numbers any more, or is neither started nor not");
        return SH_NO_STATE;
    }
    if (!sh_whole(t->cycles, t->started != 0.0 ? SH_MOST_CYCLES : 0.0))
        return sh_refuse(why, room, "cycles", t->cycles, 0.0, t->started != 0.0 ? SH_MOST_CYCLES : 0.0);
    if (!(fabs(t->time_0) <= SH_MOST_TIME))
        return sh_refuse(why, room, "time at the start", t->time_0, -SH_MOST_TIME, SH_MOST_TIME);
    time = sh_time(t);
    if (!(fabs(t->host_time) <= 2.0 * SH_MOST_TIME && fabs(t->host_time - time) <= sh_drift(t, t->host_time)))
        return sh_refuse(why, room, "the host's time", t->host_time, time, time);
    return SH_OK;
}

static int sh_check_twin(const sh_twin *t, char *why, size_t room)
{
    if (sh_check_clock(t, why, room) != SH_OK || sh_check_set(t, why, room) != SH_OK)
        return SH_NO_STATE;
    for (int i = 0; i < SH_ROW; i++)
        if (sh_check_number(&sh_row_numbers[i], t->row[i], sh_first_row[i], t->cycles, why, room) != SH_OK)
            return SH_NO_STATE;
    if (!sh_motion_sound(&t->motion, t->cycles * SH_T_CYCLE)) {
        snprintf(why, room, "a memory of the tip's motion that no motion has");
        return SH_NO_STATE;
    }
    return sh_check_lane(t, why, room) == SH_OK ? sh_check_memory(t, why, room) : SH_NO_STATE;
}

static int sh_state_read(const unsigned char *from, size_t size, const char *kind, double *own, size_t count, sh_twin *t,
                         char *why, size_t room)
{
    size_t all = sh_state_size(count), body = all - SH_CHECKSUM;
    double numbers;
    sh_twin made;
    uint32_t crc = 0;
    if (from == NULL || size < SH_HEAD || memcmp(from, kind, SH_KIND - 1) != 0) {
        snprintf(why, room, "%lu bytes that are no state of this kind", (unsigned long)size);
        return SH_NO_STATE;
    }
    if (memcmp(from, kind, SH_KIND) != 0) {
        snprintf(why, room, "another version of the format: save it again with this version");
        return SH_NO_STATE;
    }
    if (memcmp(from + SH_KIND, sh_identity(), SH_NAME) != 0) {
        snprintf(why, room, "it is of another crane, case or version");
        return SH_NO_STATE;
    }
    memcpy(&numbers, from + SH_KIND + SH_NAME, sizeof numbers);
    if (size != all || !sh_same(numbers, (double)(count + SH_CARRIED))) {
        snprintf(why, room, "%lu bytes in place of %lu", (unsigned long)size, (unsigned long)all);
        return SH_NO_STATE;
    }
    for (int i = 0; i < SH_CHECKSUM; i++)
        crc |= (uint32_t)from[body + (size_t)i] << (8 * i);
    if (crc != sh_crc(from, body)) {
        snprintf(why, room, "damaged: its checksum is not that of its bytes");
        return SH_NO_STATE;
    }
    memset(&made, 0, sizeof made);
    memcpy(&made, from + SH_HEAD + count * sizeof(double), SH_CARRIED * sizeof(double));
    if (sh_check_twin(&made, why, room) != SH_OK)
        return SH_NO_STATE;
    if (count > 0)
        memcpy(own, from + SH_HEAD, count * sizeof(double));
    *t = made;
    return SH_OK;
}
