/* A host without Python: loads an FMU's library of FMI 2, gives it the tip's motion of a table, prints signals.
 *
 * host LIBRARY GUID MOTION.txt T_CYCLE IN_s IN_v IN_a INPUT_TIME OUT...
 * MOTION: one line with s v a per cycle; input_time 0, so that row k + 1 goes to step k. IN..., INPUT_TIME, OUT: value
 * references. Prints OUT at every point with 17 digits, then on standard error the seconds that the steps took.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <stdarg.h>
#include <time.h>
#ifdef _WIN32
#include <windows.h>
#define LOAD(file) ((void *)LoadLibraryA(file))
static void *look(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
#define LOAD(file) dlopen(file, RTLD_NOW)
static void *look(void *library, const char *name) { return dlsym(library, name); }
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;

static void say(void *e, const char *name, int status, const char *category, const char *text, ...)
{
    va_list rest;
    (void)e;
    va_start(rest, text);
    fprintf(stderr, "%s %d %s: ", name, status, category);
    vfprintf(stderr, text, rest);
    fprintf(stderr, "\n");
    va_end(rest);
}

#define ASK(result, name, ...) result (*name)(__VA_ARGS__); *(void **)&name = look(library, #name)
#define SURE(call)                                       \
    if ((call) != 0) {                                   \
        fprintf(stderr, "failed: %s\n", #call);          \
        return 1;                                        \
    }

int main(int argc, char **argv)
{
    if (argc < 10)
        return 2;
    void *library = LOAD(argv[1]);
    if (library == NULL) {
        fprintf(stderr, "cannot load %s\n", argv[1]);
        return 2;
    }
    ASK(void *, fmi2Instantiate, const char *, int, const char *, const char *, const callbacks *, int, int);
    ASK(int, fmi2SetupExperiment, void *, int, double, double, int, double);
    ASK(int, fmi2EnterInitializationMode, void *);
    ASK(int, fmi2ExitInitializationMode, void *);
    ASK(int, fmi2SetReal, void *, const unsigned *, size_t, const double *);
    ASK(int, fmi2SetInteger, void *, const unsigned *, size_t, const int *);
    ASK(int, fmi2GetReal, void *, const unsigned *, size_t, double *);
    ASK(int, fmi2DoStep, void *, double, double, int);
    ASK(int, fmi2Terminate, void *);
    ASK(void, fmi2FreeInstance, void *);
    double cycle = atof(argv[4]), (*tip)[3] = NULL;
    unsigned in[3], option = (unsigned)atoi(argv[8]), wanted[64];
    int end = 0, n = argc - 9, rows = 0, room = 0;
    for (int i = 0; i < 3; i++)
        in[i] = (unsigned)atoi(argv[5 + i]);
    for (int i = 0; i < n && i < 64; i++)
        wanted[i] = (unsigned)atoi(argv[9 + i]);
    FILE *table = fopen(argv[3], "r");
    if (table == NULL)
        return 2;
    for (;; rows++) {
        if (rows == room && (tip = realloc(tip, (size_t)(room = 2 * room + 1024) * sizeof *tip)) == NULL)
            return 2;
        if (fscanf(table, "%lf %lf %lf", &tip[rows][0], &tip[rows][1], &tip[rows][2]) != 3)
            break;
    }
    fclose(table);
    callbacks host = {say, calloc, free, NULL, NULL};
    void *c = fmi2Instantiate("hosted", 1, argv[2], "", &host, 0, 0);
    if (c == NULL)
        return 1;
    double *results = malloc((size_t)rows * (size_t)n * sizeof *results);
    SURE(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0))
    SURE(fmi2SetInteger(c, &option, 1, &end))
    SURE(fmi2EnterInitializationMode(c))
    SURE(fmi2SetReal(c, in, 3, tip[0]))
    SURE(fmi2ExitInitializationMode(c))
    SURE(fmi2GetReal(c, wanted, (size_t)n, results))
    clock_t start = clock();
    for (int k = 0; k + 1 < rows; k++) {
        SURE(fmi2SetReal(c, in, 3, tip[k + 1]))
        SURE(fmi2DoStep(c, k * cycle, cycle, 1))
        SURE(fmi2GetReal(c, wanted, (size_t)n, results + (size_t)(k + 1) * (size_t)n))
    }
    fprintf(stderr, "%.6f\n", (double)(clock() - start) / CLOCKS_PER_SEC);
    for (int k = 0; k < rows; k++)
        for (int i = 0; i < n; i++)
            printf("%.17g%c", results[(size_t)k * (size_t)n + (size_t)i], i == n - 1 ? '\n' : ' ');
    SURE(fmi2Terminate(c))
    fmi2FreeInstance(c);
    return 0;
}
