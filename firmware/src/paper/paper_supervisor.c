#include "paper/paper_supervisor.h"

#include "algebra/real.h"
#include "configuration/health.h"
#include "front_end/residual_test.h"
#include "paper/paper_tolerances.h"

#include <stdbool.h>

/// Mean NIS of a filter that fits its model: the number of measured rates.
#define IDEAL_NIS HEXLOAD_REAL(3.0)

/// Above, sigmas are too small by more than 1.3: 13 standard deviations of the mean.
#define MISFIT_NIS HEXLOAD_REAL(5.0)

/// What a misfit may have left in a parameter is more than the filter's own sigma: sqrt(1 + 1).
#define LARGEST_KEPT HEXLOAD_REAL(1.4142136)

/// Prior sigmas beyond which no load of that mass is.
#define FARTHEST_SIGMAS HEXLOAD_REAL(10.0)

void hexload_paper_supervisor_init(hexload_paper_supervisor_t* self) {
    *self = (hexload_paper_supervisor_t){.nis_mean = IDEAL_NIS, .factor = HEXLOAD_REAL(1.0)};
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        self->kept[k] = HEXLOAD_REAL(1.0);
    }
}

/// By what lasts in innovations, or by their mean.
static hexload_real_t factor_of(const hexload_paper_supervisor_t* self, hexload_real_t mismatch) {
    hexload_real_t factor = mismatch;
    if (self->nis_mean > MISFIT_NIS) {
        factor = hexload_max(factor, hexload_sqrt(self->nis_mean / IDEAL_NIS));
    }
    return factor;
}

/// How well the innovations of now and of the whole run fit the model.
static void measure_fit(hexload_paper_supervisor_t* self, const hexload_config_t* config,
                        const hexload_paper_filter_t* filter, hexload_real_t mismatch) {
    // One spike must not turn the verdict: a tick raises the mean by half the way to the threshold at most.
    const hexload_real_t weight = config->tick_s / config->paper.nis_time_constant_s;
    const hexload_real_t most = HEXLOAD_REAL(0.5) * (MISFIT_NIS - IDEAL_NIS);
    self->nis_mean += hexload_min(weight * (filter->nis - self->nis_mean), most);
    self->factor = factor_of(self, mismatch);
}

static bool is_or_was_misfit(const hexload_paper_supervisor_t* self) {
    return (self->factor > HEXLOAD_REAL(1.0)) || self->has_kept;
}

/// What misfits have left in each parameter.
HEXLOAD_RARE static void keep(hexload_paper_supervisor_t* self,
                              const hexload_real_t own_sigma[HEXLOAD_PAPER_DIM]) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        const hexload_real_t ratio = self->has_kept ? own_sigma[k] / self->last_sigma[k] : HEXLOAD_REAL(1.0);
        self->kept[k] = hexload_residual_kept(self->kept[k], ratio * ratio, self->factor);
        self->last_sigma[k] = own_sigma[k];
    }
    self->has_kept = true;
}

/// The filter's sigmas widened by what its innovations have too much and by what no motion tells.
static void widen(const hexload_paper_supervisor_t* self, const hexload_paper_filter_t* filter,
                  hexload_real_t weight_error, hexload_estimate_t* estimate) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        const hexload_real_t open = hexload_paper_tolerances_covariance(filter, weight_error, k, k);
        estimate->sigma[k] = self->kept[k] * estimate->own_sigma[k];
        if (open > HEXLOAD_REAL(0.0)) {
            estimate->sigma[k] = hexload_sqrt(hexload_fma(estimate->sigma[k], estimate->sigma[k], open));
        }
    }
}

/// Prior sigma of a parameter.
static hexload_real_t prior_sigma(const hexload_paper_config_t* paper, int parameter) {
    return parameter == HEXLOAD_PAPER_DZ ? paper->prior_dz_sigma_m
                                         : paper->prior_inertia_sigma_kg_m2[parameter - HEXLOAD_PAPER_IXX];
}

/// The factor that sigmas need for some body to have the parameters, no principal inertia of which exceeds
/// the sum of the others, within three sigma; and for them to be, within one, where the configuration says
/// that they may be, which begins at zero.
static hexload_real_t needed_factor(const hexload_paper_config_t* paper, const hexload_estimate_t* estimate) {
    const hexload_real_t* I = &estimate->value[HEXLOAD_PAPER_IXX];
    const hexload_real_t* sigma = &estimate->sigma[HEXLOAD_PAPER_IXX];
    const hexload_real_t largest = hexload_max(I[0], hexload_max(I[1], I[2]));
    const hexload_real_t excess = HEXLOAD_REAL(2.0) * largest - (I[0] + I[1] + I[2]);
    hexload_real_t factor = excess / (HEXLOAD_REAL(3.0) * (sigma[0] + sigma[1] + sigma[2]));
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        const hexload_real_t beyond =
            hexload_abs(estimate->value[k]) - FARTHEST_SIGMAS * prior_sigma(paper, k);
        factor = hexload_max(factor, beyond / estimate->sigma[k]);
    }
    return factor;
}

/// Where they need a larger factor sigmas have it. @return whether the largest one is enough.
static bool make_possible(hexload_paper_supervisor_t* self, const hexload_paper_config_t* paper,
                          hexload_estimate_t* estimate) {
    const hexload_real_t needed = needed_factor(paper, estimate);
    const hexload_real_t most = hexload_sqrt(paper->inconsistent_nis / IDEAL_NIS);
    if (!(needed <= HEXLOAD_REAL(1.0))) {
        const hexload_real_t factor = hexload_min(needed, most);
        self->factor *= factor;
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            estimate->sigma[k] *= factor;
        }
    }
    return needed <= most;
}

/// Whether the motion has shown a parameter is a matter of what it can lower: of sigma without the declared
/// tolerances, and before that of the filter's own.
static hexload_verdict_t judge_parameter(const hexload_paper_config_t* paper,
                                         const hexload_paper_filter_t* filter,
                                         const hexload_estimate_t* estimate, int parameter) {
    const hexload_real_t scale =
        hexload_max(hexload_abs(estimate->value[parameter]), prior_sigma(paper, parameter));
    const hexload_real_t limit = paper->converged_relative_sigma * scale;
    const hexload_real_t open =
        hexload_paper_tolerances_covariance(filter, HEXLOAD_REAL(0.0), parameter, parameter);
    if (estimate->sigma[parameter] * estimate->sigma[parameter] <= hexload_fma(limit, limit, open)) {
        return HEXLOAD_VERDICT_CONVERGED;
    }
    return estimate->own_sigma[parameter] <= HEXLOAD_REAL(0.5) * prior_sigma(paper, parameter)
               ? HEXLOAD_VERDICT_CONVERGING
               : HEXLOAD_VERDICT_NOT_EXCITED;
}

/// Where innovations show that the machine is not its model, sigma has that by its order of magnitude only,
/// and nothing counts as converged; after that nothing of which more may be left than the filter's own sigma.
HEXLOAD_RARE static void judge_misfit(const hexload_paper_supervisor_t* self, hexload_estimate_t* estimate,
                                      uint32_t* health) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        if ((self->factor > HEXLOAD_REAL(1.0)) || (self->kept[k] > LARGEST_KEPT)) {
            hexload_health_set(health, HEXLOAD_HEALTH_MODEL_MISFIT);
            if (estimate->parameter_verdict[k] < HEXLOAD_VERDICT_MISFIT) {
                estimate->parameter_verdict[k] = HEXLOAD_VERDICT_MISFIT;
            }
        }
        if (estimate->parameter_verdict[k] > estimate->verdict) {
            estimate->verdict = estimate->parameter_verdict[k];
        }
    }
}

uint32_t hexload_paper_supervisor_judge(hexload_paper_supervisor_t* self, const hexload_config_t* config,
                                        const hexload_paper_filter_t* filter, hexload_real_t mismatch,
                                        hexload_real_t weight_error, hexload_estimate_t* estimate) {
    const hexload_paper_config_t* paper = &config->paper;
    uint32_t health = 0;
    for (int k = HEXLOAD_PAPER_DIM; k < HEXLOAD_PARAMETERS_MAX; k++) {
        estimate->value[k] = HEXLOAD_REAL(0.0);
        estimate->sigma[k] = HEXLOAD_REAL(0.0);
        estimate->own_sigma[k] = HEXLOAD_REAL(0.0);
        estimate->parameter_verdict[k] = HEXLOAD_VERDICT_CONVERGED;
    }
    hexload_paper_filter_read(filter, estimate->value, estimate->own_sigma);
    measure_fit(self, config, filter, mismatch);
    if (is_or_was_misfit(self)) {
        keep(self, estimate->own_sigma);
    }
    widen(self, filter, weight_error, estimate);
    estimate->nis = filter->nis;
    estimate->nis_mean = self->nis_mean;
    estimate->verdict = HEXLOAD_VERDICT_CONVERGED;
    const bool fits_model = make_possible(self, paper, estimate) && self->nis_mean <= paper->inconsistent_nis;
    for (int parameter = 0; parameter < HEXLOAD_PAPER_DIM; parameter++) {
        const hexload_verdict_t verdict =
            fits_model ? judge_parameter(paper, filter, estimate, parameter) : HEXLOAD_VERDICT_INCONSISTENT;
        estimate->parameter_verdict[parameter] = verdict;
        if (verdict > estimate->verdict) {
            estimate->verdict = verdict;
        }
        if (verdict == HEXLOAD_VERDICT_NOT_EXCITED) {
            hexload_health_set(&health, HEXLOAD_HEALTH_NOT_EXCITED);
        }
    }
    if (!fits_model) {
        hexload_health_set(&health, HEXLOAD_HEALTH_INCONSISTENT);
    }
    if (is_or_was_misfit(self)) {
        judge_misfit(self, estimate, &health);
    }
    return health;
}

hexload_real_t hexload_paper_supervisor_possible(const hexload_paper_supervisor_t* self,
                                                 hexload_real_t mismatch) {
    return self->factor / factor_of(self, mismatch);
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
