/* Call a kernel of a library on a stored memory: call_kernel LIBRARY KERNEL INPUT OUTPUT.
 *
 * The input: three numbers of 64 bits (bytes of memory; numbers in the block of arguments; addresses among them), the
 * memory, the block with addresses that count from the memory's beginning, and the places of the addresses in the block.
 * The output is the memory afterwards. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

static int64_t *numbers(FILE *file, int64_t count) {
    int64_t *read = malloc(count * sizeof *read);
    if (fread(read, sizeof *read, count, file) != (size_t)count) exit(3);
    return read;
}

int main(int argc, char **argv) {
    FILE *input = fopen(argv[3], "rb");
    int64_t *sizes = numbers(input, 3);
    char *memory = (char *)numbers(input, sizes[0] / 8);
    int64_t *block = numbers(input, sizes[1]), *places = numbers(input, sizes[2]);
    for (int64_t k = 0; k < sizes[2]; k++) block[places[k]] += (int64_t)(intptr_t)memory;
    void *library = OPEN(argv[1]);
    if (!library) return 4;
    int (*kernel)(void *) = (int (*)(void *))FIND(library, argv[2]);
    if (!kernel) return 5;
    int status = kernel(block);
    FILE *output = fopen(argv[4], "wb");
    fwrite(memory, 1, sizes[0], output);
    fclose(output);
    return status;
}
