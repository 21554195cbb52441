/// @file bytes.h
/// What a fuzz target takes its input from: bytes, one after the other; zeros when there are no more.
#ifndef HEXLOAD_FUZZ_BYTES_H
#define HEXLOAD_FUZZ_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct bytes {
    const uint8_t* at;
    size_t left;
} bytes_t;

static inline void take(bytes_t* bytes, void* out, size_t size) {
    const size_t count = size < bytes->left ? size : bytes->left;
    memset(out, 0, size);
    memcpy(out, bytes->at, count);
    bytes->at += count;
    bytes->left -= count;
}

static inline uint8_t take_byte(bytes_t* bytes) {
    uint8_t byte;
    take(bytes, &byte, sizeof byte);
    return byte;
}

static inline float take_float(bytes_t* bytes) {
    float number;
    take(bytes, &number, sizeof number);
    return number;
}

/// Ends the program with words where a promise is broken; the fuzzer keeps the input.
#define PROMISE(what)                                                                                        \
    do {                                                                                                     \
        if (!(what)) {                                                                                       \
            (void)fprintf(stderr, "%s:%d: broken: %s\n", __FILE__, __LINE__, #what);                         \
            abort();                                                                                         \
        }                                                                                                    \
    } while (0)

#ifndef __cplusplus
int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
#endif

#endif
