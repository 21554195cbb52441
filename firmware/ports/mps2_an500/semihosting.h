/// @file semihosting.h
/// Files, arguments and exit status of the machine that runs the emulator or holds the debugger (Arm
/// semihosting, version 2). Each call stops the processor until the host has answered: not for the 1 ms path.
#ifndef HEXLOAD_MPS2_AN500_SEMIHOSTING_H
#define HEXLOAD_MPS2_AN500_SEMIHOSTING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// Exit status of a processor fault.
enum { SEMIHOSTING_STATUS_FAULT = 70 };

typedef enum semihosting_mode {
    SEMIHOSTING_READ = 1,
    SEMIHOSTING_WRITE = 5
} semihosting_mode_t; // "rb", "wb"

/// @return a handle, negative when the host cannot open the file.
int32_t semihosting_open(const char* path, semihosting_mode_t mode);

/// @return false when fewer bytes were there, or could be written.
bool semihosting_read(int32_t file, void* bytes, size_t count);
bool semihosting_write(int32_t file, const void* bytes, size_t count);

/// @return false when the host could not write what was still to be written.
bool semihosting_close(int32_t file);

/// The command line, words separated by blanks. @return false when it is longer than the buffer.
bool semihosting_command_line(char* buffer, size_t size);

_Noreturn void semihosting_exit(int status);

#endif
