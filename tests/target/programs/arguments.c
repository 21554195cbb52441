#include "arguments.h"

#include "semihosting.h"

#include <string.h>

bool arguments_read(const char* words[], int count) {
    static char line[512];
    char* rest = NULL;
    if (!semihosting_command_line(line, sizeof line) || strtok_r(line, " ", &rest) == NULL) {
        return false;
    }
    for (int n = 0; n < count; n++) {
        words[n] = strtok_r(NULL, " ", &rest);
        if (words[n] == NULL) {
            return false;
        }
    }
    return true;
}
