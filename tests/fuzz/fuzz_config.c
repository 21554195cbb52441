/// Configurations of arbitrary bytes: refused, or started and ticked.
#include "bytes.h"

#include "hexload/hexload.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static hexload_t estimator;
    bytes_t bytes = {data, size};
    hexload_config_t config;
    hexload_estimate_t estimate;
    const char* bad_field = NULL;
    hexload_config_default(&config);
    config.kind = (hexload_kind_t)(take_byte(&bytes) % (HEXLOAD_KINDS + 1));
    while (bytes.left > 0) { // numbers at arbitrary places
        uint16_t at;
        take(&bytes, &at, sizeof at);
        const size_t place = sizeof(uint32_t) * (at % (sizeof config / sizeof(uint32_t)));
        if (place != offsetof(hexload_config_t, kind)) {
            take(&bytes, (uint8_t*)&config + place, sizeof(uint32_t));
        }
    }
    const hexload_status_t status = hexload_config_check(&config, &bad_field);
    PROMISE((status == HEXLOAD_OK) == (bad_field == NULL));
    const hexload_status_t started = hexload_init(&estimator, &config);
    PROMISE(status == HEXLOAD_OK || started == HEXLOAD_ERR_CONFIG);
    for (uint32_t tick = 0; started == HEXLOAD_OK && tick < 40; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.force_n[leg] = (hexload_real_t)(700.0 + tick % 7u);
            sample.displacement_m[leg] = (hexload_real_t)(1e-5 * tick);
            sample.velocity_m_s[leg] = HEXLOAD_REAL(0.01);
        }
        (void)(hexload_tick(&estimator, &config, &sample, &estimate) == HEXLOAD_OK);
    }
    return 0;
}
