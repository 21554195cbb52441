#include "paper/paper_supervisor.h"

#include <string.h>

#include <stdbool.h>

void hexload_paper_supervisor_init(hexload_paper_supervisor_t* self) {
    self->nis_mean = HEXLOAD_REAL(3.0);
}

/// Prior sigma of a parameter.
static hexload_real_t prior_sigma(const hexload_paper_config_t* paper, int parameter) {
    return parameter == HEXLOAD_PAPER_DZ ? paper->prior_dz_sigma_m
                                         : paper->prior_inertia_sigma_kg_m2[parameter - HEXLOAD_PAPER_IXX];
}

/// No principal inertia of a body exceeds the sum of the others; three sigma are granted.
static bool is_inertia_consistent(const hexload_estimate_t* estimate, int parameter) {
    const hexload_real_t* I = estimate->value;
    const hexload_real_t sum =
        I[HEXLOAD_PAPER_IXX] + I[HEXLOAD_PAPER_IYY] + I[HEXLOAD_PAPER_IZZ] - HEXLOAD_REAL(2.0) * I[parameter];
    const hexload_real_t spread = estimate->sigma[HEXLOAD_PAPER_IXX] + estimate->sigma[HEXLOAD_PAPER_IYY] +
                                  estimate->sigma[HEXLOAD_PAPER_IZZ];
    return sum + HEXLOAD_REAL(3.0) * spread > HEXLOAD_REAL(0.0);
}

static hexload_verdict_t judge_parameter(const hexload_paper_supervisor_t* self,
                                         const hexload_paper_config_t* paper,
                                         const hexload_estimate_t* estimate, int parameter) {
    const hexload_real_t sigma = estimate->sigma[parameter];
    if (self->nis_mean > paper->inconsistent_nis ||
        (parameter != HEXLOAD_PAPER_DZ && !is_inertia_consistent(estimate, parameter))) {
        return HEXLOAD_VERDICT_INCONSISTENT;
    }
    const hexload_real_t prior = prior_sigma(paper, parameter);
    const hexload_real_t scale = hexload_max(hexload_abs(estimate->value[parameter]), prior);
    if (sigma <= paper->converged_relative_sigma * scale) {
        return HEXLOAD_VERDICT_CONVERGED;
    }
    return sigma <= HEXLOAD_REAL(0.5) * prior ? HEXLOAD_VERDICT_CONVERGING : HEXLOAD_VERDICT_NOT_EXCITED;
}

void hexload_paper_supervisor_judge(hexload_paper_supervisor_t* self, const hexload_config_t* config,
                                    const hexload_paper_filter_t* filter, hexload_estimate_t* estimate,
                                    uint32_t* health) {
    const hexload_paper_config_t* paper = &config->paper;
    for (int k = HEXLOAD_PAPER_DIM; k < HEXLOAD_PARAMETERS_MAX; k++) {
        estimate->value[k] = HEXLOAD_REAL(0.0);
        estimate->sigma[k] = HEXLOAD_REAL(0.0);
        estimate->parameter_verdict[k] = HEXLOAD_VERDICT_CONVERGED;
    }
    hexload_paper_filter_read(filter, estimate->value, estimate->sigma);
    memcpy(estimate->own_sigma, estimate->sigma, sizeof estimate->own_sigma);
    // One spike must not turn the verdict: a tick raises the mean by half the way to the threshold at most.
    const hexload_real_t weight = config->tick_s / paper->nis_time_constant_s;
    const hexload_real_t most = HEXLOAD_REAL(0.5) * (paper->inconsistent_nis - HEXLOAD_REAL(3.0));
    self->nis_mean += hexload_min(weight * (filter->nis - self->nis_mean), most);
    estimate->nis = filter->nis;
    estimate->nis_mean = self->nis_mean;
    estimate->verdict = HEXLOAD_VERDICT_CONVERGED;
    for (int parameter = 0; parameter < HEXLOAD_PAPER_DIM; parameter++) {
        const hexload_verdict_t verdict = judge_parameter(self, paper, estimate, parameter);
        estimate->parameter_verdict[parameter] = verdict;
        if (verdict > estimate->verdict) {
            estimate->verdict = verdict;
        }
        if (verdict == HEXLOAD_VERDICT_NOT_EXCITED) {
            hexload_health_set(health, HEXLOAD_HEALTH_NOT_EXCITED);
        }
    }
    if (estimate->verdict == HEXLOAD_VERDICT_INCONSISTENT) {
        hexload_health_set(health, HEXLOAD_HEALTH_INCONSISTENT);
    }
}

const char* hexload_verdict_name(hexload_verdict_t verdict) {
    switch (verdict) {
    case HEXLOAD_VERDICT_CONVERGED:
        return "converged";
    case HEXLOAD_VERDICT_CONVERGING:
        return "converging";
    case HEXLOAD_VERDICT_NOT_EXCITED:
        return "not_excited";
    case HEXLOAD_VERDICT_MISFIT:
        return "misfit";
    case HEXLOAD_VERDICT_INCONSISTENT:
        return "inconsistent";
    default:
        return "unknown";
    }
}
