#include <hexload/hexload.h>

#include <stdio.h>

static hexload_paper_t estimator; // all memory there is: no heap, no hidden statics

int main(void) {
    hexload_config_t config;
    const char* bad_field = NULL;
    hexload_config_default(&config); // the paper's machine; set your own geometry, masses and sensors
    config.paper.load_mass_kg = 500; // known beforehand, as in the paper
    if (hexload_config_check(&config, &bad_field) != HEXLOAD_OK) {
        printf("check %s\n", bad_field);
        return 1;
    }
    if (hexload_paper_init(&estimator, &config) != HEXLOAD_OK) {
        return 1;
    }
    for (uint32_t tick = 0; tick < 100; tick++) { // your 1 ms task
        const hexload_leg_sample_t sample = {.tick = tick,
                                             .displacement_m = {0},
                                             .velocity_m_s = {0},
                                             .force_n = {1074, 1074, 1074, 1074, 1074, 1074}};
        hexload_estimate_t estimate;
        if (hexload_paper_tick(&estimator, &config, &sample, &estimate) == HEXLOAD_OK && tick == 99) {
            printf("dz %.3f m, verdict %s\n", (double)estimate.value[HEXLOAD_PAPER_DZ],
                   hexload_verdict_name(estimate.verdict));
        }
    }
    return 0;
}
