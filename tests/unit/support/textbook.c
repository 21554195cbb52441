#include "textbook.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void scene_at(scene_t* scene, uint32_t tick) {
    const body_t load = {450.0, {0.06, -0.04, 0.3}, {25.0, 30.0, 20.0, 1.0, -2.0, 0.5}};
    const motion_t motion = random_motion(4, 0.05, 0.15);
    scene->config = crooked_machine();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&scene->kinematics, &scene->config));
    scene->sample =
        perfect_sample(&scene->config, &load, &motion, (double)scene->kinematics.home_height_m, tick);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&scene->kinematics, &scene->config,
                                                               &scene->sample, &scene->motion));
}

void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

void times_transposed(const double* A, const double* B, int rows, int columns, int inner, double* out) {
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            double sum = 0.0;
            for (int k = 0; k < inner; k++) {
                sum += A[i * inner + k] * B[j * inner + k];
            }
            out[i * columns + j] = sum;
        }
    }
}

void invert(const double* A, int n, double* inverse) {
    enum { LARGEST = 20 };
    double rows[LARGEST][2 * LARGEST] = {{0}};
    for (int i = 0; i < n; i++) {
        memcpy(rows[i], &A[i * n], (size_t)n * sizeof *A);
        rows[i][n + i] = 1.0;
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k; i < n; i++) {
            pivot = fabs(rows[i][k]) > fabs(rows[pivot][k]) ? i : pivot;
        }
        TEST_ASSERT_TRUE(rows[pivot][k] != 0.0);
        for (int j = 0; j < 2 * n; j++) {
            const double above = rows[k][j];
            rows[k][j] = rows[pivot][j];
            rows[pivot][j] = above;
        }
        for (int j = 2 * n - 1; j >= k; j--) {
            rows[k][j] /= rows[k][k];
        }
        for (int i = 0; i < n; i++) {
            const double share = i == k ? 0.0 : rows[i][k];
            for (int j = k; j < 2 * n; j++) {
                rows[i][j] -= share * rows[k][j];
            }
        }
    }
    for (int i = 0; i < n; i++) {
        memcpy(&inverse[i * n], &rows[i][n], (size_t)n * sizeof *inverse);
    }
}

double weigh_polynomial(int degree, int n, double* weight) {
    enum { MOST = 4 };
    const int terms = degree / 2 + 1;
    double normal_equations[MOST * MOST] = {0}, inverse[MOST * MOST];
    for (int a = 0; a < terms; a++) {
        for (int b = 0; b < terms; b++) {
            for (int j = 1; j <= n; j++) {
                normal_equations[a * terms + b] += 2.0 * pow(j, 2 * (a + b));
            }
        }
    }
    invert(normal_equations, terms, inverse);
    for (int j = 1; j <= n; j++) {
        weight[j - 1] = 0.0;
        for (int b = 0; b < terms; b++) {
            weight[j - 1] += inverse[b] * pow(j, 2 * b);
        }
    }
    return inverse[0];
}

void random_covariance(uint64_t* seed, int n, const double* sigma, double* covariance) {
    double factor[16 * 16] = {0};
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            factor[i * n + j] = sigma[i] * (0.5 * uniform(seed) + (i == j ? 1.0 : 0.0));
        }
    }
    times_transposed(factor, factor, n, n, n, covariance);
}

void twist_of(const hexload_motion_t* motion, const double speed_m_s[6], double twist[6]) {
    double J[6][6], right[6];
    for (int leg = 0; leg < 6; leg++) {
        right[leg] = speed_m_s[leg];
        for (int k = 0; k < 6; k++) {
            J[leg][k] = (double)motion->J[leg][k];
        }
    }
    solve6(J, right, twist);
}

void momentum_of(const hexload_motion_t* motion, const double twist[6], const double theta[10],
                 double momentum[6]) {
    const double* v = twist;
    const double* w = &twist[3];
    const double I[3][3] = {{theta[HEXLOAD_LOAD_IXX], theta[HEXLOAD_LOAD_IXY], theta[HEXLOAD_LOAD_IXZ]},
                            {theta[HEXLOAD_LOAD_IXY], theta[HEXLOAD_LOAD_IYY], theta[HEXLOAD_LOAD_IYZ]},
                            {theta[HEXLOAD_LOAD_IXZ], theta[HEXLOAD_LOAD_IYZ], theta[HEXLOAD_LOAD_IZZ]}};
    double p[3], h[3] = {0}, local[3] = {0}, spin[3] = {0}, turned[3], lifted[3], moved[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (double)motion->p_m[k];
        for (int j = 0; j < 3; j++) {
            h[k] += (double)motion->R[k][j] * theta[HEXLOAD_LOAD_HX + j];
            local[k] += (double)motion->R[j][k] * w[j];
        }
    }
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                spin[k] += (double)motion->R[k][i] * I[i][j] * local[j];
            }
        }
    }
    cross(w, h, turned);
    cross(h, v, lifted);
    for (int k = 0; k < 3; k++) {
        momentum[k] = theta[HEXLOAD_LOAD_M] * v[k] + turned[k];
    }
    cross(p, momentum, moved);
    for (int k = 0; k < 3; k++) {
        momentum[3 + k] = moved[k] + lifted[k] + spin[k];
    }
}

void regressor_of(const hexload_motion_t* motion, const double twist[6], double Y[6][10]) {
    for (int k = 0; k < 10; k++) {
        double alone[10] = {0}, momentum[6];
        alone[k] = 1.0;
        momentum_of(motion, twist, alone, momentum);
        for (int a = 0; a < 6; a++) {
            Y[a][k] = momentum[a];
        }
    }
}

void pushes_of(const hexload_motion_t* motion, double Jw[6][6]) {
    for (int leg = 0; leg < 6; leg++) {
        double p[3], force[3], moved[3];
        for (int k = 0; k < 3; k++) {
            p[k] = (double)motion->p_m[k];
            force[k] = (double)motion->J[leg][k];
        }
        cross(p, force, moved);
        for (int k = 0; k < 3; k++) {
            Jw[k][leg] = force[k];
            Jw[3 + k][leg] = (double)motion->J[leg][3 + k] + moved[k];
        }
    }
}

void momenta_of_legs(const hexload_motion_t* motion, const double theta[10], double columns[6][6]) {
    for (int leg = 0; leg < 6; leg++) {
        double speed[6] = {0}, twist[6], momentum[6];
        speed[leg] = 1.0;
        twist_of(motion, speed, twist);
        momentum_of(motion, twist, theta, momentum);
        for (int a = 0; a < 6; a++) {
            columns[a][leg] = momentum[a];
        }
    }
}

void weights_of(const hexload_motion_t* motion, double gravity_m_s2, double G[6][10]) {
    memset(G, 0, 60 * sizeof G[0][0]);
    G[2][HEXLOAD_LOAD_M] = -gravity_m_s2;
    for (int k = 0; k < 4; k++) { // (x, y, z) x (0, 0, -g) = (-g y, g x, 0)
        G[3][k] = -gravity_m_s2 * (double)(k == 0 ? motion->p_m[1] : motion->R[1][k - 1]);
        G[4][k] = gravity_m_s2 * (double)(k == 0 ? motion->p_m[0] : motion->R[0][k - 1]);
    }
}

void add_noise_of(double columns[6][6], const double variance[6], double covariance[6][6]) {
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            for (int leg = 0; leg < 6; leg++) {
                covariance[a][b] += columns[a][leg] * variance[leg] * columns[b][leg];
            }
        }
    }
}
