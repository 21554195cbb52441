#include "machine.h"

#include <math.h>
#include <string.h>

hexload_config_t paper_machine(void) {
    hexload_config_t config;
    hexload_config_default(&config);
    config.kind = HEXLOAD_KIND_PAPER;
    memset(&config.tolerances, 0, sizeof config.tolerances); // what moves here is this machine exactly
    config.actuator_effects.leg_share = HEXLOAD_REAL(0.0);
    config.momentum.timing_s = HEXLOAD_REAL(0.0);
    return config;
}

hexload_config_t crooked_machine(void) {
    hexload_config_t config = paper_machine();
    uint64_t seed = 20;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 3; k++) {
            config.geometry.base_hinge_m[leg][k] += (hexload_real_t)(0.03 * uniform(&seed));
            config.geometry.platform_hinge_m[leg][k] += (hexload_real_t)(0.02 * uniform(&seed));
        }
        config.geometry.home_leg_length_m[leg] += (hexload_real_t)(0.01 * uniform(&seed));
    }
    config.platform.com_m[0] = HEXLOAD_REAL(0.03);
    config.platform.com_m[1] = HEXLOAD_REAL(-0.02);
    config.platform.com_m[2] = HEXLOAD_REAL(-0.05);
    config.platform.inertia_kg_m2[HEXLOAD_I_XX] +=
        HEXLOAD_REAL(0.29); // m (y^2 + z^2) and so on: central tensor kept
    config.platform.inertia_kg_m2[HEXLOAD_I_YY] += HEXLOAD_REAL(0.34);
    config.platform.inertia_kg_m2[HEXLOAD_I_ZZ] += HEXLOAD_REAL(0.13);
    config.platform.inertia_kg_m2[HEXLOAD_I_XY] += HEXLOAD_REAL(0.06); // -m x y
    config.platform.inertia_kg_m2[HEXLOAD_I_XZ] += HEXLOAD_REAL(0.15);
    config.platform.inertia_kg_m2[HEXLOAD_I_YZ] += HEXLOAD_REAL(-0.10);
    return config;
}

void rotation_of(const pose_t* pose, double R[3][3]) {
    const double cr = cos(pose->rpy[0]), sr = sin(pose->rpy[0]);
    const double cp = cos(pose->rpy[1]), sp = sin(pose->rpy[1]);
    const double cy = cos(pose->rpy[2]), sy = sin(pose->rpy[2]);
    const double rotation[3][3] = {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr},
                                   {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr},
                                   {-sp, cp * sr, cp * cr}};
    memcpy(R, rotation, sizeof rotation);
}

void leg_displacements(const hexload_config_t* config, double home_height_m, const pose_t* pose,
                       double displacement_m[6]) {
    double R[3][3];
    rotation_of(pose, R);
    for (int leg = 0; leg < 6; leg++) {
        const hexload_real_t* a = config->geometry.platform_hinge_m[leg];
        const hexload_real_t* b = config->geometry.base_hinge_m[leg];
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            const double Ra = R[k][0] * (double)a[0] + R[k][1] * (double)a[1] + R[k][2] * (double)a[2];
            const double L = pose->p_m[k] + (k == 2 ? home_height_m : 0.0) + Ra - (double)b[k];
            square += L * L;
        }
        displacement_m[leg] = sqrt(square) - (double)config->geometry.home_leg_length_m[leg];
    }
}

/// The pose after a small translation or rotation of size `step` about base axis `k % 3`.
static void displaced_lengths(const hexload_config_t* config, double home_height_m, const pose_t* pose, int k,
                              double step, double displacement_m[6]) {
    pose_t moved = *pose;
    double R[3][3];
    rotation_of(pose, R);
    if (k < 3) {
        moved.p_m[k] += step;
        leg_displacements(config, home_height_m, &moved, displacement_m);
        return;
    }
    // Rotate the lever R a exactly, then ask for the length with the hinge already turned (rpy = 0).
    const int i = (k - 3 + 1) % 3, j = (k - 3 + 2) % 3;
    double lever[6][3];
    for (int leg = 0; leg < 6; leg++) {
        const hexload_real_t* a = config->geometry.platform_hinge_m[leg];
        for (int row = 0; row < 3; row++) {
            lever[leg][row] = R[row][0] * (double)a[0] + R[row][1] * (double)a[1] + R[row][2] * (double)a[2];
        }
        const double u = lever[leg][i], v = lever[leg][j];
        lever[leg][i] = cos(step) * u - sin(step) * v;
        lever[leg][j] = sin(step) * u + cos(step) * v;
        double square = 0.0;
        for (int row = 0; row < 3; row++) {
            const double L = pose->p_m[row] + (row == 2 ? home_height_m : 0.0) + lever[leg][row] -
                             (double)config->geometry.base_hinge_m[leg][row];
            square += L * L;
        }
        displacement_m[leg] = sqrt(square) - (double)config->geometry.home_leg_length_m[leg];
    }
}

void leg_jacobian(const hexload_config_t* config, double home_height_m, const pose_t* pose, double J[6][6]) {
    const double step = 1e-5; // truncation step^2 ~ 1e-10, rounding 1e-16 / step ~ 1e-11
    for (int k = 0; k < 6; k++) {
        double ahead[6], behind[6];
        displaced_lengths(config, home_height_m, pose, k, step, ahead);
        displaced_lengths(config, home_height_m, pose, k, -step, behind);
        for (int leg = 0; leg < 6; leg++) {
            J[leg][k] = (ahead[leg] - behind[leg]) / (2.0 * step);
        }
    }
}

void solve6(double A[6][6], double b[6], double x[6]) {
    for (int c = 0; c < 6; c++) {
        int best = c;
        for (int r = c + 1; r < 6; r++) {
            best = fabs(A[r][c]) > fabs(A[best][c]) ? r : best;
        }
        for (int k = 0; k < 6; k++) {
            const double swapped = A[c][k];
            A[c][k] = A[best][k];
            A[best][k] = swapped;
        }
        const double swapped = b[c];
        b[c] = b[best];
        b[best] = swapped;
        for (int r = c + 1; r < 6; r++) {
            const double factor = A[r][c] / A[c][c];
            b[r] -= factor * b[c];
            for (int k = c; k < 6; k++) {
                A[r][k] -= factor * A[c][k];
            }
        }
    }
    for (int r = 5; r >= 0; r--) {
        x[r] = b[r];
        for (int k = r + 1; k < 6; k++) {
            x[r] -= A[r][k] * x[k];
        }
        x[r] /= A[r][r];
    }
}

double uniform(uint64_t* seed) {
    // SplitMix64 (Steele, Lea, Flood 2014, doi 10.1145/2660193.2660195)
    *seed += 0x9E3779B97F4A7C15u;
    uint64_t z = *seed;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1.0p-52 - 1.0;
}

double normal(uint64_t* seed) {
    const double radius = sqrt(-2.0 * log(0.5 * (uniform(seed) + 1.0) + 0x1.0p-60));
    return radius * cos(3.14159265358979323846 * uniform(seed));
}
