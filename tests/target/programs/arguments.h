/// @file arguments.h
/// The words of the command line that the host has given by semihosting.
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include <stdbool.h>

/// The words after the program's name. They stay valid. @return false when there are not `count` of them.
bool arguments_read(const char* words[], int count);

#endif
