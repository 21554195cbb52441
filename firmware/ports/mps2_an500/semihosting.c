#include "semihosting.h"

#include <string.h>

enum operation {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20
};

static int32_t call(enum operation operation, const void* arguments) {
    register uint32_t r0 __asm("r0") = operation;
    register const void* r1 __asm("r1") = arguments;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}

int32_t semihosting_open(const char* path, semihosting_mode_t mode) {
    const uint32_t arguments[] = {(uint32_t)path, (uint32_t)mode, strlen(path)};
    return call(SYS_OPEN, arguments);
}

bool semihosting_read(int32_t file, void* bytes, size_t count) {
    const uint32_t arguments[] = {(uint32_t)file, (uint32_t)bytes, count};
    return call(SYS_READ, arguments) == 0; // the answer is the number of bytes not read
}

bool semihosting_write(int32_t file, const void* bytes, size_t count) {
    const uint32_t arguments[] = {(uint32_t)file, (uint32_t)bytes, count};
    return call(SYS_WRITE, arguments) == 0;
}

bool semihosting_close(int32_t file) {
    const uint32_t arguments[] = {(uint32_t)file};
    return call(SYS_CLOSE, arguments) == 0;
}

bool semihosting_command_line(char* buffer, size_t size) {
    const uint32_t arguments[] = {(uint32_t)buffer, size};
    return call(SYS_GET_CMDLINE, arguments) == 0;
}

_Noreturn void semihosting_exit(int status) {
    const uint32_t application_exit = 0x20026; // ADP_Stopped_ApplicationExit
    const uint32_t arguments[] = {application_exit, (uint32_t)status};
    for (;;) {
        (void)call(SYS_EXIT_EXTENDED, arguments);
    }
}
