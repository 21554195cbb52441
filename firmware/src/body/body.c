#include "body/body_model.h"

#include "algebra/linalg.h"

enum { DIM = HEXLOAD_LOAD_DIM };

/// Share of the mass that its sigma may have for a centre of mass. With r = sigma_m / m first order leaves
/// out a mean of r sigma and a part 4 r^2 of the sigma.
#define LARGEST_MASS_SIGMA HEXLOAD_REAL(0.1)

/// The axes of each entry of the tensor, enum hexload_inertia.
static const int AXES[HEXLOAD_I_DIM][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

void hexload_body_see_from(const hexload_real_t point_m[3], const hexload_real_t theta[DIM],
                           hexload_real_t seen[DIM]) {
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    hexload_real_t sum[3]; // h + h': the tensor is I - (r . s) E + (r s^T + s r^T) / 2
    hexload_real_t moved = HEXLOAD_REAL(0.0);
    seen[HEXLOAD_LOAD_M] = theta[HEXLOAD_LOAD_M];
    for (int k = 0; k < 3; k++) {
        seen[HEXLOAD_LOAD_HX + k] = theta[HEXLOAD_LOAD_HX + k] - theta[HEXLOAD_LOAD_M] * point_m[k];
        sum[k] = theta[HEXLOAD_LOAD_HX + k] + seen[HEXLOAD_LOAD_HX + k];
        moved += point_m[k] * sum[k];
    }
    for (int entry = 0; entry < HEXLOAD_I_DIM; entry++) {
        const int i = AXES[entry][0];
        const int j = AXES[entry][1];
        const hexload_real_t product = half * (point_m[i] * sum[j] + point_m[j] * sum[i]);
        seen[HEXLOAD_LOAD_IXX + entry] =
            theta[HEXLOAD_LOAD_IXX + entry] + (i == j ? product - moved : product);
    }
}

void hexload_body_spread_from(const hexload_real_t point_m[3],
                              const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                              hexload_real_t spread[DIM][DIM]) {
    hexload_real_t half_way[DIM][DIM]; // columns of T P
    for (int j = 0; j < DIM; j++) {
        hexload_real_t column[DIM];
        for (int i = 0; i < DIM; i++) {
            column[i] = covariance[i >= j ? ROW(i) + j : ROW(j) + i];
        }
        hexload_body_see_from(point_m, column, half_way[j]);
    }
    for (int i = 0; i < DIM; i++) {
        hexload_real_t row[DIM];
        for (int j = 0; j < DIM; j++) {
            row[j] = half_way[j][i];
        }
        hexload_body_see_from(point_m, row, spread[i]);
    }
}

bool hexload_body_find_com(const hexload_real_t theta[DIM], hexload_real_t mass_variance_kg2,
                           hexload_real_t com_m[3]) {
    const hexload_real_t mass_kg = theta[HEXLOAD_LOAD_M];
    const hexload_real_t limit_kg = LARGEST_MASS_SIGMA * mass_kg;
    const bool is_known = limit_kg > HEXLOAD_REAL(0.0) && mass_variance_kg2 <= limit_kg * limit_kg;
    for (int k = 0; k < 3; k++) {
        com_m[k] = is_known ? theta[HEXLOAD_LOAD_HX + k] / mass_kg : HEXLOAD_REAL(0.0);
    }
    return is_known;
}

/// First order leaves out (h h^T - h . h E) / m of the errors of h about the centre of mass, of which an
/// entry's root mean square is at most 2 / m times their variances along its two axes, on the diagonal the
/// two others.
static bool is_first_order(hexload_real_t spread[DIM][DIM], const hexload_body_t* body) {
    hexload_real_t h_variance[3];
    for (int k = 0; k < 3; k++) {
        h_variance[k] = spread[HEXLOAD_LOAD_HX + k][HEXLOAD_LOAD_HX + k];
    }
    for (int entry = 0; entry < HEXLOAD_I_DIM; entry++) {
        const int i = AXES[entry][0];
        const int j = AXES[entry][1];
        const hexload_real_t sum =
            i == j ? h_variance[(i + 1) % 3] + h_variance[(i + 2) % 3] : h_variance[i] + h_variance[j];
        const hexload_real_t left_out = HEXLOAD_REAL(2.0) * sum / body->mass_kg;
        if (!(left_out <= HEXLOAD_REAL(0.5) * body->inertia_sigma_kg_m2[entry])) {
            return false;
        }
    }
    return true;
}

void hexload_body_describe(const hexload_real_t theta[DIM],
                           const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES], hexload_body_t* body) {
    hexload_real_t seen[DIM];
    hexload_real_t spread[DIM][DIM];
    *body = (hexload_body_t){.mass_kg = theta[HEXLOAD_LOAD_M],
                             .mass_sigma_kg = hexload_sqrt(covariance[0]),
                             .is_consistent = hexload_body_is_consistent(theta)};
    body->has_com = hexload_body_find_com(theta, covariance[0], body->com_m);
    if (!body->has_com) {
        return;
    }
    hexload_body_see_from(body->com_m, theta, seen);
    hexload_body_spread_from(body->com_m, covariance, spread);
    for (int k = 0; k < 3; k++) {
        const int row = HEXLOAD_LOAD_HX + k;
        body->com_sigma_m[k] = hexload_sqrt(spread[row][row]) / body->mass_kg;
    }
    for (int entry = 0; entry < HEXLOAD_I_DIM; entry++) {
        const int row = HEXLOAD_LOAD_IXX + entry;
        body->inertia_kg_m2[entry] = seen[row];
        body->inertia_sigma_kg_m2[entry] = hexload_sqrt(spread[row][row]);
    }
    body->has_inertia = is_first_order(spread, body);
    if (!body->has_inertia) {
        for (int entry = 0; entry < HEXLOAD_I_DIM; entry++) {
            body->inertia_kg_m2[entry] = HEXLOAD_REAL(0.0);
            body->inertia_sigma_kg_m2[entry] = HEXLOAD_REAL(0.0);
        }
    }
}
