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
