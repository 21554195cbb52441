#include "configuration/config_fields.h"

#include <stddef.h>

#define NAME(field, ...) #field,

/// Of the fields, by hexload_config_find_bad().
static const char* const NAMES[] = {CONFIG_RANGES(NAME) CONFIG_CONTRADICTIONS(NAME)};

hexload_status_t hexload_config_check(const hexload_config_t* config, const char** bad_field) {
    const int bad = hexload_config_find_bad(config);
    if (bad_field != NULL) {
        *bad_field = bad < 0 ? NULL : NAMES[bad];
    }
    return bad < 0 ? HEXLOAD_OK : HEXLOAD_ERR_CONFIG;
}
