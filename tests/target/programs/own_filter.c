#include "rivals.h"

#include "paper_filter.c" // its two steps are static

static hexload_config_t config;
static hexload_paper_filter_t filter;

void own_filter_start(const rival_filter_t* start) {
    hexload_config_default(&config);
    hexload_paper_filter_init(&filter, &config);
    memcpy(filter.rate_rad_s, &start->x[0], sizeof filter.rate_rad_s);
    memcpy(filter.param, &start->x[RATES], sizeof filter.param);
    for (int i = 0; i < RIVAL_STATES; i++) {
        for (int j = 0; j < RIVAL_STATES; j++) {
            if (i < RATES && j < RATES) {
                filter.rate_cov[i][j] = start->P[i][j];
            } else if (i < RATES) {
                filter.cross_cov[i][j - RATES] = start->P[i][j];
            } else if (j >= RATES) {
                filter.param_cov[i - RATES][j - RATES] = start->P[i][j];
            }
        }
    }
}

void own_filter_step(const rival_input_t* input) {
    hexload_paper_model_t model = {.jacobian_noise = {{0}}};
    hexload_real_t noise[3][3];
    uint32_t health = 0;
    memcpy(model.noise, input->Q, sizeof model.noise);
    memcpy(noise, input->R, sizeof noise);
    for (int i = 0; i < RATES; i++) {
        model.by_dz[i] = input->N[i][HEXLOAD_PAPER_DZ];
        model.by_inertia[i] = input->N[i][HEXLOAD_PAPER_IXX + i];
        model.rate_step_rad_s[i] = times_row(&model, i, filter.param);
        model.inertia_kg_m2[i] = 50.0f;
        model.cautious_inertia_kg_m2[i] = 60.0f;
    }
    predict(&filter, &model);
    update(&filter, &config, input->measured, noise, &health);
}

void own_filter_read(float parameters[PARAMETERS]) {
    memcpy(parameters, filter.param, sizeof filter.param);
}
