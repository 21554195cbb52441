/// @file boot_options.h
/// What a commissioning tool, a boot loader or an emulator may leave in memory before a controller starts:
/// the port of an emulated board serves any machine and rig. A product's configuration is in its flash
/// (`hexload export`).
#ifndef HEXLOAD_BOOT_OPTIONS_H
#define HEXLOAD_BOOT_OPTIONS_H

#include "app/app.h"

#include <stdint.h>

#define HEXLOAD_BOOT_OPTIONS_MARK 0x33304C48u // "HL03"

typedef struct hexload_boot_options {
    uint32_t mark;              ///< HEXLOAD_BOOT_OPTIONS_MARK: the rest holds
    uint32_t sample_timeout_ms; ///< 0: the default
    uint32_t config_bytes;      ///< sizeof config; 0: the port's own configuration stays
    uint32_t nonce_seed[2];     ///< of hexload_port_t, another at each start; 0: none
    hexload_config_t config;
} hexload_boot_options_t;

/// Takes over what is there. Not for the 1 ms path.
/// @return HEXLOAD_ERR_CONFIG: of another version of hexload; nothing is changed then.
static inline hexload_status_t hexload_boot_options_take(const hexload_boot_options_t* options,
                                                         hexload_config_t* config,
                                                         hexload_app_settings_t* settings) {
    if (options->mark != HEXLOAD_BOOT_OPTIONS_MARK) {
        return HEXLOAD_OK;
    }
    if (options->config_bytes != 0u && options->config_bytes != sizeof *config) {
        return HEXLOAD_ERR_CONFIG;
    }
    if (options->config_bytes != 0u) {
        *config = options->config;
    }
    if (options->sample_timeout_ms != 0u) {
        settings->sample_timeout_ms = options->sample_timeout_ms;
    }
    return HEXLOAD_OK;
}

/// The seed of this start's nonces; 0: nobody has left one.
static inline uint64_t hexload_boot_options_seed(const hexload_boot_options_t* options) {
    return options->mark != HEXLOAD_BOOT_OPTIONS_MARK
               ? 0
               : (uint64_t)options->nonce_seed[1] << 32 | options->nonce_seed[0];
}

#endif
