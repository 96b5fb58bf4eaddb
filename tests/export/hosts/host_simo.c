/* A mock of SIMO for an external DLL force: two bodies, a crane whose heave is given, and a load that hangs on the
 * forces of the library alone. Trapezoidal rule with iterations, as SIMO may repeat a step.
 *
 * Arguments: library, file with a tip height [m] in every line, step [s], mass of the load [kg], weight [N], wire out
 * [m], iterations. Prints time, height of the load above its start [m] and tension [N] of every step.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(_WIN32)
#include <windows.h>
static void *find(const char *file, const char *name) { return (void *)GetProcAddress(LoadLibraryA(file), name); }
#else
#include <dlfcn.h>
static void *find(const char *file, const char *name)
{
    void *library = dlopen(file, RTLD_NOW);
    return library ? dlsym(library, name) : NULL;
}
#endif

typedef void (*Force)(int *, float *, double *, int *, int *, float *, int *, float *, float *, int *, float *, float *,
                      int *, int *, int *, int *, int *, int *, int *, char *, double *, double *, double *, float *,
                      int *);

static Force force;
static double state[24];
static float tip[7] = {0.0f, 0.0f, 30.0f, 0.0f, 0.0f, 2.0f, 0.0f};

/* Force on a body in global axes; moments of both are checked against the arms. */
static double force_on(int body, double time, double h, int step, int iteration)
{
    int none = 0, info[12] = {0}, bodies[2] = {1, 2}, error = 0, ints = 2, reals = 7;
    float info_r[6] = {0}, stor[9] = {0}, unused = 0.0f;
    double other = 0.0;
    char text[120] = {0};
    info[2] = body;
    info[4] = 2;
    info[5] = step;
    info[7] = info[8] = 1;
    info[11] = iteration;
    info_r[0] = (float)time;
    info_r[1] = (float)h;
    force(&none, &unused, &other, &none, info, info_r, &none, &unused, &unused, bodies, tip, &unused, &none, &none,
          &none, &ints, &reals, &none, &none, text, state, &other, &other, stor, &error);
    if (error != 0) {
        printf("error %d\n", error);
        exit(3);
    }
    if (fabs(stor[0]) + fabs(stor[1]) + fabs(stor[3]) + fabs(stor[4]) + fabs(stor[5]) > 1e-3f * fabs(stor[2])) {
        printf("not vertical\n");
        exit(4);
    }
    return 1000.0 * stor[2];
}

int main(int argc, char **argv)
{
    double h, m, W, length, x = 0.0, v = 0.0, F, top;
    int passes, n = 0;
    FILE *heights = fopen(argc > 2 ? argv[2] : "", "r");
    if (heights == NULL || argc < 8)
        return 1;
    force = (Force)find(argv[1], "gfexfo_");
    if (force == NULL)
        return 2;
    h = atof(argv[3]), m = atof(argv[4]), W = atof(argv[5]), length = atof(argv[6]), passes = atoi(argv[7]);
    if (fscanf(heights, "%lf", &top) != 1)
        return 1;
    state[2] = top;
    state[14] = top + 30.0 - 2.0 - length;
    F = force_on(2, 0.0, h, 1, 0);
    printf("0 0 %.17g\n", F);
    while (fscanf(heights, "%lf", &top) == 1) {
        double x_1 = x + h * v, v_1 = v, F_1 = F;
        state[2] = top;
        n++;
        for (int i = 0; i < passes; i++) {
            state[14] = 30.0 - 2.0 - length + x_1;
            F_1 = force_on(2, n * h, h, n + 1, i);
            if (fabs(F_1 + force_on(1, n * h, h, n + 1, i)) > 1e-3 * fabs(F_1))
                return 5;
            v_1 = v + 0.5 * h * (F + F_1 - 2.0 * W) / m;
            x_1 = x + 0.5 * h * (v + v_1);
        }
        x = x_1, v = v_1, F = F_1;
        printf("%.17g %.17g %.17g\n", n * h, x, F);
    }
    fclose(heights);
    return 0;
}
