#include "motion.h"

#include <math.h>

static const double pi = 3.14159265358979323846;
static const double gravity_m_s2 = 9.81;

motion_t random_motion(uint64_t seed, double translation_m, double rotation_rad) {
    motion_t motion;
    for (int k = 0; k < 6; k++) {
        for (int n = 0; n < 2; n++) {
            motion.amplitude[k][n] =
                0.5 * (k < 3 ? translation_m : rotation_rad) * (0.75 + 0.25 * uniform(&seed));
            motion.frequency_hz[k][n] = 1.65 + 1.35 * uniform(&seed);
            motion.phase_rad[k][n] = pi * uniform(&seed);
        }
    }
    return motion;
}

motion_t paper_motion(double tilt_rad) {
    const motion_t motion = {
        .amplitude = {{0.2}, {0.2}, {0.0}, {tilt_rad}, {tilt_rad}, {0.2 * 3.14159265358979323846 / 180.0}},
        .frequency_hz = {{0.5}, {0.5}, {0.0}, {1.1}, {1.3}, {0.5}},
    };
    return motion;
}

pose_t pose_at(const motion_t* motion, double t_s) {
    pose_t pose;
    for (int k = 0; k < 6; k++) {
        double sum = 0.0;
        for (int n = 0; n < 2; n++) {
            sum += motion->amplitude[k][n] *
                   sin(2.0 * pi * motion->frequency_hz[k][n] * t_s + motion->phase_rad[k][n]);
        }
        *(k < 3 ? &pose.p_m[k] : &pose.rpy[k - 3]) = sum;
    }
    return pose;
}

/// Velocity of O_A and angular velocity in base axes, by central differences of pose and rotation.
static void twist_at(const motion_t* motion, double t_s, double v[3], double w[3]) {
    const double h = 1e-5;
    const pose_t ahead = pose_at(motion, t_s + h), behind = pose_at(motion, t_s - h),
                 now = pose_at(motion, t_s);
    double Ra[3][3], Rb[3][3], R[3][3], S[3][3];
    rotation_of(&ahead, Ra);
    rotation_of(&behind, Rb);
    rotation_of(&now, R);
    for (int i = 0; i < 3; i++) {
        v[i] = (ahead.p_m[i] - behind.p_m[i]) / (2.0 * h);
        for (int j = 0; j < 3; j++) { // [w]x = R' R^T
            S[i][j] = 0.0;
            for (int k = 0; k < 3; k++) {
                S[i][j] += (Ra[i][k] - Rb[i][k]) / (2.0 * h) * R[j][k];
            }
        }
    }
    w[0] = 0.5 * (S[2][1] - S[1][2]);
    w[1] = 0.5 * (S[0][2] - S[2][0]);
    w[2] = 0.5 * (S[1][0] - S[0][1]);
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/// Adds a body's momentum about the home position of O_A, [linear; angular], and the moment of its weight.
static void add_momentum(const body_t* body, const motion_t* motion, double t_s, double mu[6],
                         double weight[6]) {
    const pose_t pose = pose_at(motion, t_s);
    double R[3][3], v[3], w[3], c[3], wc[3], r[3], linear[3], spin[3], w_body[3], arm[3];
    rotation_of(&pose, R);
    twist_at(motion, t_s, v, w);
    for (int i = 0; i < 3; i++) {
        c[i] = R[i][0] * body->com_m[0] + R[i][1] * body->com_m[1] + R[i][2] * body->com_m[2];
        w_body[i] = R[0][i] * w[0] + R[1][i] * w[1] + R[2][i] * w[2];
        r[i] = pose.p_m[i] + c[i];
    }
    cross(w, c, wc);
    const double* I = body->inertia_com_kg_m2;
    const double spin_body[3] = {I[0] * w_body[0] + I[3] * w_body[1] + I[4] * w_body[2],
                                 I[3] * w_body[0] + I[1] * w_body[1] + I[5] * w_body[2],
                                 I[4] * w_body[0] + I[5] * w_body[1] + I[2] * w_body[2]};
    for (int i = 0; i < 3; i++) {
        linear[i] = body->mass_kg * (v[i] + wc[i]);
        spin[i] = R[i][0] * spin_body[0] + R[i][1] * spin_body[1] + R[i][2] * spin_body[2];
    }
    cross(r, linear, arm);
    const double down[3] = {0.0, 0.0, -body->mass_kg * gravity_m_s2};
    double moment[3];
    cross(r, down, moment);
    for (int i = 0; i < 3; i++) {
        mu[i] += linear[i];
        mu[3 + i] += arm[i] + spin[i];
        weight[i] += down[i];
        weight[3 + i] += moment[i];
    }
}

/// The empty platform as a body: its tensor moved from O_A to its centre of mass.
static body_t platform_body(const hexload_config_t* config) {
    const hexload_platform_t* platform = &config->platform;
    body_t body = {.mass_kg = (double)platform->mass_kg};
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        body.com_m[k] = (double)platform->com_m[k];
        square += body.com_m[k] * body.com_m[k];
    }
    const double* c = body.com_m;
    const double product[3] = {c[0] * c[1], c[0] * c[2], c[1] * c[2]};
    for (int k = 0; k < 3; k++) {
        body.inertia_com_kg_m2[k] =
            (double)platform->inertia_kg_m2[k] - body.mass_kg * (square - c[k] * c[k]);
        body.inertia_com_kg_m2[3 + k] = (double)platform->inertia_kg_m2[3 + k] + body.mass_kg * product[k];
    }
    return body;
}

/// Wrench of the legs about O_A that makes the motion: rate of the momentum minus the weight's wrench.
static void leg_wrench(const hexload_config_t* config, const body_t* load, const motion_t* motion, double t_s,
                       double W[6]) {
    const double h = 1e-4; // truncation h^2 w^4 / 6 ~ 1e-5 relative at 3 Hz, below the sensors' noise
    const body_t platform = platform_body(config);
    double ahead[6] = {0}, behind[6] = {0}, now[6] = {0}, weight[6] = {0}, unused[6] = {0};
    add_momentum(&platform, motion, t_s + h, ahead, unused);
    add_momentum(load, motion, t_s + h, ahead, unused);
    add_momentum(&platform, motion, t_s - h, behind, unused);
    add_momentum(load, motion, t_s - h, behind, unused);
    add_momentum(&platform, motion, t_s, now, weight);
    add_momentum(load, motion, t_s, now, weight);
    for (int k = 0; k < 6; k++) {
        W[k] = (ahead[k] - behind[k]) / (2.0 * h) - weight[k];
    }
    const pose_t pose = pose_at(motion, t_s); // from the home position to O_A
    double shift[3];
    cross(pose.p_m, W, shift);
    for (int k = 0; k < 3; k++) {
        W[3 + k] -= shift[k];
    }
}

hexload_leg_sample_t perfect_sample(const hexload_config_t* config, const body_t* load,
                                    const motion_t* motion, double home_height_m, uint32_t tick) {
    const double t_s = (double)tick * (double)config->tick_s;
    const pose_t pose = pose_at(motion, t_s);
    hexload_leg_sample_t sample = {.tick = tick};
    double displacement_m[6], J[6][6], J_transposed[6][6], W[6], f[6], v[3], w[3];
    leg_displacements(config, home_height_m, &pose, displacement_m);
    leg_jacobian(config, home_height_m, &pose, J);
    twist_at(motion, t_s, v, w);
    leg_wrench(config, load, motion, t_s, W);
    for (int i = 0; i < 6; i++) {
        double rate = 0.0;
        for (int k = 0; k < 3; k++) {
            rate += J[i][k] * v[k] + J[i][3 + k] * w[k];
        }
        sample.displacement_m[i] = (hexload_real_t)displacement_m[i];
        sample.velocity_m_s[i] = (hexload_real_t)rate;
        for (int k = 0; k < 6; k++) {
            J_transposed[k][i] = J[i][k];
        }
    }
    solve6(J_transposed, W, f);
    for (int leg = 0; leg < 6; leg++) {
        sample.force_n[leg] = (hexload_real_t)f[leg];
    }
    return sample;
}

void add_noise(const hexload_config_t* config, uint64_t* seed, hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample->displacement_m[leg] += config->sensors.displacement_sigma_m * (hexload_real_t)normal(seed);
        sample->velocity_m_s[leg] += config->sensors.velocity_sigma_m_s * (hexload_real_t)normal(seed);
        sample->force_n[leg] += config->sensors.force_sigma_n * (hexload_real_t)normal(seed);
    }
}

void theta_of(const body_t* body, double theta[10]) {
    static const int entry[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const double* c = body->com_m;
    theta[0] = body->mass_kg;
    for (int k = 0; k < 3; k++) {
        theta[1 + k] = body->mass_kg * c[k];
    }
    for (int n = 0; n < 6; n++) {
        const int i = entry[n][0], j = entry[n][1];
        const double square = i == j ? c[0] * c[0] + c[1] * c[1] + c[2] * c[2] : 0.0;
        theta[4 + n] = body->inertia_com_kg_m2[n] + body->mass_kg * (square - c[i] * c[j]);
    }
}
