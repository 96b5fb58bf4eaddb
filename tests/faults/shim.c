/* Faults in what a process asks of libc, preloaded (LD_PRELOAD) into it and all of its children.

   Every call that changes a file below a folder is counted; at the n-th, a fault happens. Python, HDF5, SQLite,
   DuckDB and the rest all come through here, because they call libc. Order and meaning of the fields of `struct
   control` are those of injector.py, which shares them with all processes through one mapped file.

   A command can be held before a call: it waits there, and a fork of it has each fault that is asked for, so that what
   it computed before is computed once. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum kind { NONE, FAIL, FAIL_ON, FULL, KILL, TORN };
enum call { OPEN, WRITE, SYNC, RENAME, MAKE, REMOVE, CALLS };
enum turn { FORK, GO_ON, END }; /* what a held command is asked to do */
enum { LOGGED = 4096, LOOK = 500, FILES = 1024 }; /* calls in the log; time between two looks [us]; open files */

struct logged {
    int32_t call, open, others; /* kind; open files below the folder; threads beside this one */
    char path[212];
};

struct control {
    int64_t kind, at, error, count, fired, struck, calls[CALLS]; /* fault, its call from 1 on, errno; what was counted */
    int64_t memory_at, memory_least, memory_count;       /* allocation that fails from 1 on; those of that size count */
    int64_t clock, still;                                /* added to the wall clock [ns]; all that it shows, or 0 */
    int64_t hold, held, alone;                           /* call to hold before; whether it waits, and has no other
                                                            thread and no open file below the folder */
    int64_t go, turn, done, status;                      /* number and kind of what it is asked to do; of what is done
                                                            the number and exit status */
    int64_t limit, log;                                  /* longest life of a fork [ms]; whether calls are logged */
    char below[4096];                                    /* folder, with a slash at its end */
    struct logged logged[LOGGED];
};

static struct control nothing, *control = &nothing;

__attribute__((constructor)) static void attach(void)
{
    const char *file = getenv("STILLHOOK_FAULTS");
    int fd = file ? (int)syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC, 0) : -1;
    if (fd < 0)
        return;
    void *memory = (void *)syscall(SYS_mmap, NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    syscall(SYS_close, fd);
    if (memory != MAP_FAILED)
        control = memory;
}

/* Path of an open file or folder; the working folder's for AT_FDCWD. */
static int path_of(int fd, char *path, size_t size)
{
    char link[64] = "/proc/self/cwd";
    if (fd != AT_FDCWD)
        snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = syscall(SYS_readlinkat, AT_FDCWD, link, path, size - 1);
    path[length > 0 ? length : 0] = 0;
    return length > 0;
}

static __thread char place[8192]; /* path of the last file that was found below the folder */

static int below(int folder, const char *path)
{
    char whole[8192];
    size_t length = strlen(control->below);
    if (!length || !path)
        return 0;
    if (path[0] != '/') {
        if (!path_of(folder, whole, 4096))
            return 0;
        strcat(whole, "/");
        strncat(whole, path, 4000);
        path = whole;
    }
    if (strncmp(path, control->below, length))
        return 0;
    snprintf(place, sizeof place, "%s", path);
    return 1;
}

static int file_below(int fd)
{
    char path[4096];
    return control->below[0] && path_of(fd, path, sizeof path) && path[0] == '/' && below(AT_FDCWD, path); /* no pipe */
}

/* Open files below the folder. Places in all files are kept or, with `back`, as they were kept: forks share them. */
static int open_files(off_t *places, int back)
{
    int number = 0;
    DIR *all = opendir("/proc/self/fd");
    for (struct dirent *each; all && (each = readdir(all));) {
        int fd = atoi(each->d_name);
        if (fd >= FILES || each->d_name[0] == '.')
            continue;
        number += file_below(fd);
        if (places && !back)
            places[fd] = lseek(fd, 0, SEEK_CUR);
        else if (places && places[fd] >= 0)
            lseek(fd, places[fd], SEEK_SET);
    }
    if (all)
        closedir(all);
    return number;
}

/* Threads of this process beside this one; one more where it is not the command but a child of it. */
static int others(void)
{
    int number = getpid() != getpgrp();
    DIR *all = opendir("/proc/self/task");
    for (struct dirent *each; all && (each = readdir(all));)
        number += each->d_name[0] != '.';
    if (all)
        closedir(all);
    return number - 1;
}

/* Exit status of a fork, which is killed after its time, and all that it started with it. */
static int status_of(pid_t child)
{
    int status = 0;
    int64_t left = 1000 * control->limit;
    for (; waitpid(child, &status, WNOHANG) == 0; left -= LOOK) {
        if (left < 0)
            kill(child, SIGKILL);
        usleep(LOOK);
    }
    kill(-child, SIGKILL);
    return status;
}

/* Wait before a call; returns in a fork, which is to have a fault, and in the command when it is to go on. */
static void wait_here(void)
{
    int64_t count = control->count, calls[CALLS], last = control->go;
    off_t places[FILES];
    memset(places, -1, sizeof places);
    memcpy(calls, control->calls, sizeof calls);
    control->alone = !others() && !open_files(places, 0);
    __atomic_store_n(&control->held, 1, __ATOMIC_SEQ_CST);
    for (;;) {
        while (__atomic_load_n(&control->go, __ATOMIC_SEQ_CST) == last)
            usleep(LOOK);
        last = control->go;
        if (control->turn == END)
            _exit(0);
        control->count = count;
        memcpy(control->calls, calls, sizeof calls);
        for (int fd = 1; fd < 3; fd++)
            syscall(SYS_ftruncate, fd, places[fd]);
        open_files(places, 1);
        if (control->turn == GO_ON)
            return;
        pid_t child = fork();
        if (child == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            setpgid(0, 0);
            return;
        }
        control->status = status_of(child);
        __atomic_store_n(&control->done, last, __ATOMIC_SEQ_CST);
    }
}

static void note(enum call call, int64_t number)
{
    if (number > LOGGED)
        return;
    struct logged *entry = &control->logged[number - 1];
    snprintf(entry->path, sizeof entry->path, "%s", place + strlen(control->below));
    entry->call = call;
    entry->open = open_files(NULL, 0);
    entry->others = others();
}

/* The fault that a call is to have: 0 none, else an errno, or -1 to write half of it and die. */
static int fault(enum call call)
{
    if (control->hold && control->hold == control->count + 1 && getpid() == getsid(0))
        wait_here();
    int64_t number = __atomic_add_fetch(&control->count, 1, __ATOMIC_SEQ_CST), kind = control->kind;
    __atomic_add_fetch(&control->calls[call], 1, __ATOMIC_SEQ_CST);
    if (control->log)
        note(call, number);
    int on = kind == FAIL_ON || kind == FULL;
    if (kind == NONE || number < control->at || (number > control->at && !on))
        return 0;
    if (kind == FULL && (call == REMOVE || call == SYNC || call == RENAME))
        return 0; /* which a full disk still does */
    if (control->fired++ == 0)
        control->struck = call;
    if (kind == KILL || (kind == TORN && call != WRITE))
        kill(getpid(), SIGKILL);
    return kind == TORN ? -1 : (int)control->error;
}

#define REFUSED(call, folder, path)                                                                                          \
    do {                                                                                                               \
        int problem = below(folder, path) ? fault(call) : 0;                                                           \
        if (problem) {                                                                                                 \
            errno = problem;                                                                                           \
            return -1;                                                                                                 \
        }                                                                                                              \
    } while (0)

static int changes(int flags) { return (flags & O_ACCMODE) != O_RDONLY || flags & (O_CREAT | O_TRUNC); }

static int open_at(int folder, const char *path, int flags, unsigned mode)
{
    if (changes(flags))
        REFUSED(OPEN, folder, path);
    return (int)syscall(SYS_openat, folder, path, flags, mode);
}

#define MODE_OF(flags)                                                                                                 \
    unsigned mode = 0;                                                                                                 \
    if ((flags) & (O_CREAT | O_TMPFILE)) {                                                                             \
        va_list more;                                                                                                  \
        va_start(more, flags);                                                                                         \
        mode = va_arg(more, unsigned);                                                                                 \
        va_end(more);                                                                                                  \
    }

int open(const char *path, int flags, ...) { MODE_OF(flags) return open_at(AT_FDCWD, path, flags, mode); }
int open64(const char *path, int flags, ...) { MODE_OF(flags) return open_at(AT_FDCWD, path, flags, mode); }
int openat(int folder, const char *path, int flags, ...) { MODE_OF(flags) return open_at(folder, path, flags, mode); }
int openat64(int folder, const char *path, int flags, ...) { MODE_OF(flags) return open_at(folder, path, flags, mode); }
int __open_2(const char *path, int flags) { return open_at(AT_FDCWD, path, flags, 0); }
int __open64_2(const char *path, int flags) { return open_at(AT_FDCWD, path, flags, 0); }
int creat(const char *path, mode_t mode) { return open_at(AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC, mode); }

static FILE *stream(const char *name, const char *path, const char *mode)
{
    int problem = mode[0] != 'r' && below(AT_FDCWD, path) ? fault(OPEN) : 0;
    if (problem) {
        errno = problem;
        return NULL;
    }
    FILE *(*real)(const char *, const char *) = (FILE * (*)(const char *, const char *)) dlsym(RTLD_NEXT, name);
    return real(path, mode);
}

FILE *fopen(const char *path, const char *mode) { return stream("fopen", path, mode); }
FILE *fopen64(const char *path, const char *mode) { return stream("fopen64", path, mode); }

/* Half of what is to be written, then the end, or the rest of a full disk. */
static ssize_t written(int fd, const void *data, size_t size, off_t place, int number)
{
    int problem = file_below(fd) ? fault(WRITE) : 0;
    if (problem && (problem < 0 || (control->kind == FULL && control->fired == 1)) && size > 1) {
        ssize_t half = number == SYS_write ? syscall(SYS_write, fd, data, size / 2)
                                           : syscall(SYS_pwrite64, fd, data, size / 2, place);
        if (problem > 0)
            return half;
    }
    if (problem < 0)
        kill(getpid(), SIGKILL);
    if (problem) {
        errno = problem;
        return -1;
    }
    return number == SYS_write ? syscall(SYS_write, fd, data, size) : syscall(SYS_pwrite64, fd, data, size, place);
}

ssize_t write(int fd, const void *data, size_t size) { return written(fd, data, size, 0, SYS_write); }
ssize_t pwrite(int fd, const void *data, size_t n, off_t at) { return written(fd, data, n, at, SYS_pwrite64); }
ssize_t pwrite64(int fd, const void *data, size_t n, off_t at) { return written(fd, data, n, at, SYS_pwrite64); }

#define REFUSED_FILE(call, fd)                                                                                         \
    do {                                                                                                               \
        int problem = file_below(fd) ? fault(call) : 0;                                                                \
        if (problem < 0)                                                                                               \
            kill(getpid(), SIGKILL);                                                                                   \
        if (problem) {                                                                                                 \
            errno = problem;                                                                                           \
            return -1;                                                                                                 \
        }                                                                                                              \
    } while (0)

ssize_t writev(int fd, const struct iovec *parts, int count)
{
    REFUSED_FILE(WRITE, fd);
    return syscall(SYS_writev, fd, parts, count);
}
ssize_t sendfile(int to, int from, off_t *at, size_t size)
{
    REFUSED_FILE(WRITE, to);
    return syscall(SYS_sendfile, to, from, at, size);
}
ssize_t sendfile64(int to, int from, off_t *at, size_t size) { return sendfile(to, from, at, size); }
ssize_t copy_file_range(int from, off_t *a, int to, off_t *b, size_t size, unsigned flags)
{
    REFUSED_FILE(WRITE, to);
    return syscall(SYS_copy_file_range, from, a, to, b, size, flags);
}
int ftruncate(int fd, off_t size)
{
    REFUSED_FILE(WRITE, fd);
    return (int)syscall(SYS_ftruncate, fd, size);
}
int ftruncate64(int fd, off_t size) { return ftruncate(fd, size); }
int fsync(int fd)
{
    REFUSED_FILE(SYNC, fd);
    return (int)syscall(SYS_fsync, fd);
}
int fdatasync(int fd)
{
    REFUSED_FILE(SYNC, fd);
    return (int)syscall(SYS_fdatasync, fd);
}
int renameat2(int a, const char *from, int b, const char *to, unsigned flags)
{
    REFUSED(RENAME, b, to);
    return (int)syscall(SYS_renameat2, a, from, b, to, flags);
}
int rename(const char *from, const char *to) { return renameat2(AT_FDCWD, from, AT_FDCWD, to, 0); }
int renameat(int a, const char *from, int b, const char *to) { return renameat2(a, from, b, to, 0); }
int linkat(int a, const char *from, int b, const char *to, int flags)
{
    REFUSED(RENAME, b, to);
    return (int)syscall(SYS_linkat, a, from, b, to, flags);
}
int link(const char *from, const char *to) { return linkat(AT_FDCWD, from, AT_FDCWD, to, 0); }
int mkdirat(int folder, const char *path, mode_t mode)
{
    REFUSED(MAKE, folder, path);
    return (int)syscall(SYS_mkdirat, folder, path, mode);
}
int mkdir(const char *path, mode_t mode) { return mkdirat(AT_FDCWD, path, mode); }
int unlinkat(int folder, const char *path, int flags)
{
    REFUSED(REMOVE, folder, path);
    return (int)syscall(SYS_unlinkat, folder, path, flags);
}
int unlink(const char *path) { return unlinkat(AT_FDCWD, path, 0); }
int rmdir(const char *path) { return unlinkat(AT_FDCWD, path, AT_REMOVEDIR); }
int remove(const char *path) { return unlink(path); }
int chmod(const char *path, mode_t mode)
{
    REFUSED(MAKE, AT_FDCWD, path);
    return (int)syscall(SYS_fchmodat, AT_FDCWD, path, mode);
}

/* Memory: allocations of some size are counted, and one of them is refused. */
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);

static int none_left(size_t size)
{
    if (!control->memory_least || (int64_t)size < control->memory_least)
        return 0;
    int64_t number = __atomic_add_fetch(&control->memory_count, 1, __ATOMIC_SEQ_CST);
    if (number != control->memory_at)
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) { return none_left(size) ? NULL : __libc_malloc(size); }
void *calloc(size_t n, size_t size) { return none_left(n * size) ? NULL : __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { return none_left(size) ? NULL : __libc_realloc(old, size); }

/* The wall clock, which jumps; the monotonic one does not. */
int clock_gettime(clockid_t clock, struct timespec *now)
{
    int code = (int)syscall(SYS_clock_gettime, clock, now);
    if (code == 0 && clock == CLOCK_REALTIME && (control->clock || control->still)) {
        int64_t all = now->tv_sec * 1000000000LL + now->tv_nsec + control->clock;
        if (control->still)
            all = control->still;
        now->tv_sec = all / 1000000000LL;
        now->tv_nsec = all % 1000000000LL;
    }
    return code;
}
int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
    struct timespec exact;
    (void)zone;
    int code = clock_gettime(CLOCK_REALTIME, &exact);
    now->tv_sec = exact.tv_sec;
    now->tv_usec = exact.tv_nsec / 1000;
    return code;
}
time_t time(time_t *out)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out)
        *out = now.tv_sec;
    return now.tv_sec;
}
