/* A mock of OrcaFlex for the native external function: it carries the functions of OrcFxAPI that are needed, loads the
 * library, and drives it through statics, steps with iterations, a stored and a resumed simulation.
 *
 * Arguments: library, parameters, file of rows "time F_w[N] s v a new", row before which the simulation is stored and
 * resumed (-1: never), data name, units (SI or US). Prints the rate of every row in m/s, or the recorded error.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>
#if defined(_WIN32)
#include <windows.h>
#define CALL __stdcall
#define API __declspec(dllexport)
static void *find(const char *file, const char *name) { return (void *)GetProcAddress(LoadLibraryA(file), name); }
#else
#include <dlfcn.h>
#define CALL
#define API __attribute__((visibility("default")))
static void *find(const char *file, const char *name)
{
    void *library = dlopen(file, RTLD_NOW);
    return library ? dlsym(library, name) : NULL;
}
#endif

#pragma pack(push, 1)
typedef struct {
    int Size, Action;
    double SimulationTime, Value;
    int Successful;
    void *ObjectHandle;
    const void *lpObjectExtra;
    const wchar_t *lpObjectParameters;
    const void *lpWorkingDataHandle;
    void *lpData;
    const wchar_t *lpDataSourceName;
    void *lpStateData;
    int LengthOfStateData;
    const wchar_t *lpDataName;
    const void *lpInstantaneousCalculationData;
    const wchar_t *lpModelDirectory;
    int UpdateDuringStatics;
    void *lpLogData;
    int LengthOfLogData, ResultID, NewTimeStep;
    void *lpStructValue, *ModelHandle;
    const wchar_t *lpModelFileName;
    void *DataObjectHandle;
    int CanResumeSimulation;
} Info;
typedef struct {
    void *handle;
    int type;
    wchar_t name[50];
} ObjectInfo;
typedef struct {
    char before[76];
    double RigidBodyPos[3];
} ObjectExtra;
typedef struct {
    int PeriodNum, Unused;
    double FromTime, ToTime;
} Period;
#pragma pack(pop)
typedef void(CALL *Function)(Info *);
typedef void(CALL *Register)(uint32_t *);

static int model, winch, vessel;
static double row[6], force = 1.0, length = 1.0;
static char recorded[700];

API void CALL C_GetModelHandle(void *object, void **handle, int *status)
{
    *status = object == &winch ? 0 : 4;
    *handle = &model;
}
API void CALL C_ObjectCalledW(void *handle, const wchar_t *name, ObjectInfo *info, int *status)
{
    *status = handle == &model && wcscmp(name, L"Vessel") == 0 ? 0 : 23;
    info->handle = &vessel;
}
API void CALL C_GetUnitsConversionFactorW(void *object, const wchar_t *units, double *factor, int *status)
{
    *status = object == &winch ? 0 : 4;
    *factor = wcscmp(units, L"FF") == 0 ? force : length;
}
API void CALL C_GetVarIDW(void *object, const wchar_t *name, int *id, int *status)
{
    static const wchar_t *const names[] = {L"Tension", L"Z", L"GZ-Velocity", L"GZ-Acceleration"};
    *status = 26;
    for (int i = 0; i < 4; i++)
        if (wcscmp(name, names[i]) == 0 && object == (i == 0 ? (void *)&winch : (void *)&vessel))
            *status = 0, *id = 100 + i;
}
API void CALL C_GetTimeHistory2W(void *object, const void *extra, const Period *period, int id, double *value,
                                 int *status)
{
    *status = period->PeriodNum == 32005 && extra != NULL && object != NULL ? 0 : 11;
    const double *at = ((const ObjectExtra *)extra)->RigidBodyPos; /* it heaves there, and heels with that */
    *value = id == 100 ? row[1] / 1000.0 * force : row[id - 99] * length;
    if (id != 100)
        *value *= 1.0 + (0.01 * at[0] + 0.02 * at[1]) / length;
}
API void CALL C_RecordExternalFunctionErrorW(Info *info, const wchar_t *text, int *status)
{
    size_t n = 0;
    for (; text[n] && n < sizeof recorded - 1; n++)
        recorded[n] = (char)text[n];
    recorded[n] = 0;
    *status = info == NULL;
}

static int call(Function function, Info *info, int action)
{
    info->Action = action;
    function(info);
    if (recorded[0])
        printf("error %s\n", recorded);
    return recorded[0] == 0;
}

int main(int argc, char **argv)
{
    Function function;
    Register registered;
    uint32_t capabilities = 0;
    Info info;
    wchar_t parameters[1000], name[100];
    int n = 0, at = argc > 4 ? atoi(argv[4]) : -1;
    FILE *rows = fopen(argc > 3 ? argv[3] : "", "r");
    if (rows == NULL || argc < 7)
        return 1;
    function = (Function)find(argv[1], "StillhookWinch");
    registered = (Register)find(argv[1], "RegisterCapabilities");
    if (function == NULL || registered == NULL)
        return 2;
    registered(&capabilities);
    printf("capabilities %u\n", (unsigned)capabilities);
    if (strcmp(argv[6], "US") == 0) {
        force = 1.0 / 4.4482216152605;
        length = 1.0 / 0.3048;
    }
    for (n = 0; argv[2][n]; n++)
        parameters[n] = argv[2][n] == ';' ? L'\n' : (wchar_t)argv[2][n];
    parameters[n] = 0;
    for (n = 0; argv[5][n]; n++)
        name[n] = (wchar_t)argv[5][n];
    name[n] = 0;
    memset(&info, 0, sizeof info);
    info.Size = (int)sizeof info;
    info.ObjectHandle = &winch;
    info.lpObjectParameters = parameters;
    info.lpDataName = name;
    info.CanResumeSimulation = 1;
    if (!call(function, &info, 10) || !call(function, &info, 0))
        return 3;
    for (n = 0; fscanf(rows, "%lf %lf %lf %lf %lf %lf", row, row + 1, row + 2, row + 3, row + 4, row + 5) == 6; n++) {
        if (n == at) { /* stored to a file and freed; then loaded in what may be another process */
            void *kept;
            call(function, &info, 3);
            kept = malloc((size_t)info.LengthOfStateData);
            memcpy(kept, info.lpStateData, (size_t)info.LengthOfStateData);
            call(function, &info, 4);
            call(function, &info, 1);
            info.lpStateData = kept;
            if (!call(function, &info, 0))
                return 3;
            memset(kept, 0, (size_t)info.LengthOfStateData);
            free(kept);
        }
        info.SimulationTime = row[0];
        info.NewTimeStep = (int)row[5];
        if (!call(function, &info, 2))
            return 3;
        printf("%.17g\n", info.Value / length);
    }
    call(function, &info, 1);
    fclose(rows);
    return info.lpData != NULL;
}
