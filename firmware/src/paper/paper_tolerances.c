#include "paper/paper_tolerances.h"

#include "algebra/real.h"

enum { GAIN, MASS, CENTRE, WEIGHT, SOURCES };

/// Errors of a parameter for one standard deviation of each source.
static void find_errors(const hexload_paper_filter_t* filter, hexload_real_t weight_error, int parameter,
                        hexload_real_t error[SOURCES]) {
    const hexload_paper_constants_t* constants = &filter->constants;
    const hexload_tolerances_t* open = &constants->tolerances;
    const hexload_real_t one = HEXLOAD_REAL(1.0);
    const hexload_real_t two = HEXLOAD_REAL(2.0);
    const hexload_real_t share = constants->mass_share;
    const hexload_real_t rest = one - share;
    const hexload_real_t dz_m = filter->param[HEXLOAD_PAPER_DZ];
    const hexload_real_t lever_m = dz_m - constants->com_offset_m[2] / rest;
    const hexload_real_t steiner = constants->reduced_mass_kg * lever_m * lever_m;
    const bool is_across = parameter == HEXLOAD_PAPER_IXX || parameter == HEXLOAD_PAPER_IYY;
    for (int n = 0; n < SOURCES; n++) {
        error[n] = HEXLOAD_REAL(0.0);
    }
    if (parameter == HEXLOAD_PAPER_DZ) {
        error[MASS] = open->platform_mass * rest * lever_m;
        error[CENTRE] = -open->platform_com_m * rest / share;
        error[WEIGHT] = -weight_error * rest * lever_m;
        return;
    }
    const hexload_real_t inertia = constants->inertia_kg_m2[parameter - HEXLOAD_PAPER_IXX] +
                                   filter->param[parameter] + (is_across ? steiner : HEXLOAD_REAL(0.0));
    error[GAIN] = hexload_max(open->force_gain, weight_error) * inertia;
    if (is_across) {
        error[MASS] = -open->platform_mass * steiner * (two - share);
        error[CENTRE] = open->platform_com_m * two * constants->reduced_mass_kg / share * dz_m;
    }
}

hexload_real_t hexload_paper_tolerances_covariance(const hexload_paper_filter_t* filter,
                                                   hexload_real_t weight_error, int i, int j) {
    const hexload_paper_constants_t* constants = &filter->constants;
    hexload_real_t first[SOURCES];
    hexload_real_t second[SOURCES];
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    const hexload_real_t* other = first;
    find_errors(filter, weight_error, i, first);
    if (i != j) {
        find_errors(filter, weight_error, j, second);
        other = second;
    }
    for (int n = 0; n < SOURCES; n++) {
        sum = hexload_fma(first[n], other[n], sum);
    }
    if (i == j && i >= HEXLOAD_PAPER_IXX) {
        const hexload_real_t own =
            constants->tolerances.platform_inertia * constants->platform_inertia_kg_m2[i - HEXLOAD_PAPER_IXX];
        sum = hexload_fma(own, own, sum);
    }
    return sum;
}
