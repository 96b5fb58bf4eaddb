#include "iec_std_lib.h"
#include "accessor.h"
#include "POUS.h"
#ifdef _WIN32
#define stillhook_shown __declspec(dllexport)
#else
#define stillhook_shown __attribute__((visibility("default")))
#endif
TIME __CURRENT_TIME;
BOOL __DEBUG;
#include "POUS.c"
stillhook_shown size_t stillhook_size(void) {{ return sizeof({block}); }}
stillhook_shown void stillhook_start(void *memory) {{ {block}_init__(memory, 0); }}
stillhook_shown void stillhook_cycles(void *memory, const double *in, double *out, size_t n)
{{
    {block} *b = memory;
    for (; n--; in += {n_in}, out += {n_out}) {{
{put}
        {block}_body__(b);
{get}
    }}
}}
