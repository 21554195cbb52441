#include "rivals.h"

#include "paper/paper_filter.c" // its two steps are static

static hexload_config_t config;
static hexload_paper_filter_t filter; // all of it
static hexload_paper_filter_t kalman; // its Kalman filter alone
static hexload_paper_model_t model;

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
    kalman = filter;
}

void own_filter_prepare(const rival_input_t* input) {
    memcpy(model.noise, input->Q, sizeof model.noise);
    for (int i = 0; i < RATES; i++) {
        model.by_dz[i] = input->N[i][HEXLOAD_PAPER_DZ];
        model.by_inertia[i] = input->N[i][HEXLOAD_PAPER_IXX + i];
        model.rate_step_rad_s[i] =
            add_row(&model, i, filter.param[HEXLOAD_PAPER_DZ], filter.param[HEXLOAD_PAPER_IXX + i], 0.0f);
        model.noise_lever_kg_m2[i] = 72.0f;
    }
}

static hexload_paper_step_t measurement_of(const rival_input_t* input) {
    hexload_paper_step_t measured;
    memcpy(measured.rate_rad_s, input->measured, sizeof measured.rate_rad_s);
    memcpy(measured.noise, input->R, sizeof measured.noise);
    memcpy(measured.noise_lever_kg_m2, model.noise_lever_kg_m2, sizeof measured.noise_lever_kg_m2);
    measured.is_predicted = true;
    return measured;
}

void kalman_filter_step(rival_input_t* input) {
    const hexload_paper_step_t measured = measurement_of(input);
    hexload_real_t S[3][3];
    hexload_real_t L[3][3];
    hexload_real_t whitened[3];
    predict(&kalman, &model);
    if (innovate(&kalman, &measured, S, L, whitened)) {
        correct(&kalman, L, whitened);
    }
}

void own_filter_step(rival_input_t* input) {
    uint32_t health = 0;
    predict(&filter, &model);
    add_jacobian_noise(&filter.jacobian_noise, &model.jacobian_noise);
    hexload_paper_step_t measured = measurement_of(input);
    update(&filter, &config, &measured, &health);
}

void kalman_filter_read(float parameters[PARAMETERS]) {
    memcpy(parameters, kalman.param, sizeof kalman.param);
}

void own_filter_read(float parameters[PARAMETERS]) {
    memcpy(parameters, filter.param, sizeof filter.param);
}
