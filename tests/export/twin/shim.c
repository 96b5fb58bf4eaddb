/* The functions of core.h for Python's ctypes; included behind the generated source. */
#include <stdlib.h>
#ifdef _WIN32
#define SHOWN __declspec(dllexport)
#else
#define SHOWN __attribute__((visibility("default")))
#endif
SHOWN void *twin_new(void) { sh_twin *t = malloc(sizeof *t); if (t) sh_defaults(t); return t; }
SHOWN void twin_free(void *t) { free(t); }
SHOWN int64_t twin_size(void) { return (int64_t)sh_size(); }
SHOWN const char *twin_identity(void) { return sh_identity(); }
SHOWN int twin_find(const char *name) { return sh_find(name); }
SHOWN int twin_set(void *t, int v, double x) { return sh_set(t, v, x); }
SHOWN double twin_get(void *t, int v) { return sh_get(t, v); }
SHOWN const char *twin_text(void *t, int v) { return sh_text(t, v); }
SHOWN int twin_start(void *t, double time) { return sh_start(t, time); }
SHOWN int twin_step(void *t, double time, double h) { return sh_step(t, time, h); }
SHOWN double twin_time(void *t) { return sh_time(t); }
SHOWN int64_t twin_state_size(void) { return (int64_t)sh_state_size(0); }
SHOWN void twin_save(void *t, unsigned char *to) { sh_state_write(to, "SHTWIN_2", NULL, 0, t); }
SHOWN int twin_restore(void *t, const unsigned char *from, int64_t size, char *why)
{
    return sh_state_read(from, (size_t)size, "SHTWIN_2", NULL, 0, t, why, 300);
}
SHOWN void twin_put(void *t, int64_t at, double x) { ((double *)t)[at] = x; } /* any number, as a fault would */
SHOWN int64_t twin_at(int which) /* places of numbers among those of a state */
{
    const int64_t places[] = {0, offsetof(sh_twin, row) / 8, offsetof(sh_twin, input) / 8,
                              offsetof(sh_twin, beginning) / 8, offsetof(sh_twin, time_0) / 8,
                              offsetof(sh_twin, lowest) / 8, offsetof(sh_twin, seen) / 8};
    return places[which];
}
SHOWN const char *twin_name(int i) { return sh_numbers[i].name; }
