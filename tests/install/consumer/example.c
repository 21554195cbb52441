#include <hexload/hexload.h>

#include <stdio.h>

static hexload_t estimator; // all memory there is: no heap, no hidden statics

int main(void) {
    hexload_config_t config;
    hexload_config_default(&config);      // the paper's machine; set your own geometry, masses and sensors
    hexload_config_set_momentum(&config); // then the filter's lag and prior that go with them
    if (hexload_init(&estimator, &config) != HEXLOAD_OK) {
        return 1; // hexload_config_check() names the field
    }
    for (uint32_t tick = 0; tick < 1000; tick++) { // your 1 ms task; here at home and at rest
        const hexload_leg_sample_t sample = {.tick = tick, .force_n = {1074, 1074, 1074, 1074, 1074, 1074}};
        static hexload_estimate_t estimate; // stays where a sample is refused, or none is complete yet
        if (hexload_tick(&estimator, &config, &sample, &estimate) == HEXLOAD_OK && tick == 999) {
            printf("mass %.2f +- %.2f kg, verdict %s\n", (double)estimate.value[HEXLOAD_LOAD_M],
                   (double)estimate.sigma[HEXLOAD_LOAD_M], hexload_verdict_name(estimate.verdict));
        }
    }
    return 0;
}
