/* Run a file of `surrogate export` from C: run_model LIBRARY MODEL BATCH STEPS NAME...
 *
 * LIBRARY is the shared library of ONNX Runtime. Standard input: times, indentations and edge of BATCH x STEPS numbers,
 * tabor and modulus_ratio of BATCH numbers, all of type double. Standard output: the outputs NAME, one after the other,
 * likewise.
 *
 * The C API of ONNX Runtime is a table of functions, to which versions only append. Its header, onnxruntime_c_api.h,
 * is no part of the Python package, so that the few functions needed here are taken by their numbers.
 */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef void *Handle; /* of an environment, a session, options, a tensor; of a status, NULL means success */
typedef struct {
    Handle *(*table)(uint32_t version);
} Base;

enum { ERROR_MESSAGE = 2, ENVIRONMENT = 3, SESSION = 7, RUN = 9, OPTIONS = 10 };
enum { TENSOR = 49, DATA = 51, COUNT = 64, SHAPE = 65, MEMORY = 69 };
enum { API_VERSION = 17, DOUBLE = 11, WARNING = 2, MOST = 16 };

static Handle *api;

static void check(Handle status)
{
    if (status) {
        fprintf(stderr, "%s\n", ((const char *(*)(Handle))api[ERROR_MESSAGE])(status));
        exit(1);
    }
}

/* Read an array of rank 1 or 2 from standard input. */
static Handle tensor(Handle memory, int rank, int64_t batch, int64_t steps)
{
    int64_t dims[2] = {batch, steps};
    size_t size = rank == 1 ? batch : batch * steps;
    double *values = malloc(size * sizeof *values);
    Handle made = NULL;

    if (fread(values, sizeof *values, size, stdin) != size)
        exit(2);
    check(((Handle(*)(Handle, void *, size_t, const int64_t *, size_t, int, Handle *))api[TENSOR])(
        memory, values, size * sizeof *values, dims, rank, DOUBLE, &made));
    return made;
}

int main(int argc, char **argv)
{
    const char *inputs[] = {"times", "indentations", "edge", "tabor", "modulus_ratio"};
    const int ranks[] = {2, 2, 2, 1, 1};
    Handle environment = NULL, options = NULL, session = NULL, memory = NULL, given[5], found[MOST] = {NULL};
    Handle library = argc > 5 && argc <= 5 + MOST ? dlopen(argv[1], RTLD_NOW) : NULL;
    if (!library)
        return 3;
    api = ((Base * (*)(void)) dlsym(library, "OrtGetApiBase"))()->table(API_VERSION);
    const int64_t batch = atoll(argv[3]), steps = atoll(argv[4]);
    const size_t wanted = argc - 5;

    check(((Handle(*)(int, const char *, Handle *))api[ENVIRONMENT])(WARNING, "run_model", &environment));
    check(((Handle(*)(Handle *))api[OPTIONS])(&options));
    check(((Handle(*)(Handle, const char *, Handle, Handle *))api[SESSION])(environment, argv[2], options, &session));
    check(((Handle(*)(int, int, Handle *))api[MEMORY])(0, 0, &memory));
    for (int i = 0; i < 5; i++)
        given[i] = tensor(memory, ranks[i], batch, steps);
    check(((Handle(*)(Handle, Handle, const char **, Handle *, size_t, char **, size_t, Handle *))api[RUN])(
        session, NULL, inputs, given, 5, argv + 5, wanted, found));
    for (size_t i = 0; i < wanted; i++) {
        Handle shape = NULL;
        double *values = NULL;
        size_t size = 0;
        check(((Handle(*)(Handle, Handle *))api[SHAPE])(found[i], &shape));
        check(((Handle(*)(Handle, size_t *))api[COUNT])(shape, &size));
        check(((Handle(*)(Handle, double **))api[DATA])(found[i], &values));
        fwrite(values, sizeof *values, size, stdout);
    }
    return 0;
}
