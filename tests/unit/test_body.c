#include "body/pseudo_inertia.h"
#include "hexload/estimate.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, COVARIANCES = HEXLOAD_LOAD_COVARIANCES };

static const int ENTRY[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

/// Parameters about O_A of a body with a central tensor, by the parallel-axis theorem.
static void theta_of(double mass_kg, const double com_m[3], const double central[6], double theta[DIM]) {
    theta[0] = mass_kg;
    for (int k = 0; k < 3; k++) {
        theta[1 + k] = mass_kg * com_m[k];
    }
    for (int n = 0; n < 6; n++) {
        const int i = ENTRY[n][0], j = ENTRY[n][1];
        const double square = i == j ? com_m[0] * com_m[0] + com_m[1] * com_m[1] + com_m[2] * com_m[2] : 0.0;
        theta[4 + n] = central[n] + mass_kg * (square - com_m[i] * com_m[j]);
    }
}

/// Mass, centre of mass and central tensor, written independently of the firmware.
static void derive(const double theta[DIM], double derived[DIM]) {
    derived[0] = theta[0];
    for (int k = 0; k < 3; k++) {
        derived[1 + k] = theta[1 + k] / theta[0];
    }
    for (int n = 0; n < 6; n++) {
        const int i = ENTRY[n][0], j = ENTRY[n][1];
        const double square = i == j ? theta[1] * theta[1] + theta[2] * theta[2] + theta[3] * theta[3] : 0.0;
        derived[4 + n] = theta[4 + n] - (square - theta[1 + i] * theta[1 + j]) / theta[0];
    }
}

/// A body of twenty point masses: whatever they are, their parameters are consistent.
static void random_body(uint64_t* seed, double theta[DIM]) {
    memset(theta, 0, DIM * sizeof theta[0]);
    for (int n = 0; n < 20; n++) {
        const double mass_kg = 10.0 + 9.0 * uniform(seed);
        const double r[3] = {0.3 * uniform(seed), 0.3 * uniform(seed), 0.3 + 0.3 * uniform(seed)};
        const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        theta[0] += mass_kg;
        for (int k = 0; k < 3; k++) {
            theta[1 + k] += mass_kg * r[k];
        }
        for (int e = 0; e < 6; e++) {
            const int i = ENTRY[e][0], j = ENTRY[e][1];
            theta[4 + e] += mass_kg * ((i == j ? square : 0.0) - r[i] * r[j]);
        }
    }
}

/// L L^T of a random lower triangle whose rows are as large as size; L is kept for samples.
static void random_covariance(uint64_t* seed, const double size[DIM], double L[DIM][DIM],
                              hexload_real_t packed[COVARIANCES]) {
    memset(L, 0, DIM * sizeof L[0]);
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j < i; j++) {
            L[i][j] = 0.4 * size[i] * uniform(seed);
        }
        L[i][i] = size[i];
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = 0; k <= j; k++) {
                sum += L[i][k] * L[j][k];
            }
            packed[i * (i + 1) / 2 + j] = (hexload_real_t)sum;
        }
    }
}

static void to_real(const double from[DIM], hexload_real_t to[DIM]) {
    for (int k = 0; k < DIM; k++) {
        to[k] = (hexload_real_t)from[k];
    }
}

/// Length of a difference of parameters in sigmas: of L^-1 (a - b).
static double sigmas_between(double L[DIM][DIM], const hexload_real_t a[DIM], const double b[DIM]) {
    double white[DIM], sum = 0.0;
    for (int i = 0; i < DIM; i++) {
        white[i] = (double)a[i] - b[i];
        for (int k = 0; k < i; k++) {
            white[i] -= L[i][k] * white[k];
        }
        white[i] /= L[i][i];
        sum += white[i] * white[i];
    }
    return sqrt(sum);
}

static const double USUAL_SIZE[DIM] = {0.5, 0.4, 0.4, 2.0, 4.0, 4.0, 2.0, 2.0, 2.0, 2.0};

static void describe(const double theta[DIM], hexload_body_t* body) {
    uint64_t seed = 1;
    double L[DIM][DIM];
    hexload_real_t value[DIM], covariance[COVARIANCES];
    to_real(theta, value);
    random_covariance(&seed, USUAL_SIZE, L, covariance);
    hexload_body_describe(value, covariance, body);
}

static void assert_body(const hexload_body_t* body, double mass_kg, const double com_m[3],
                        const double central[6]) {
    TEST_ASSERT_TRUE(body->has_com && body->has_inertia && body->is_consistent);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1, mass_kg), mass_kg, (double)body->mass_kg);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, com_m[k]), com_m[k], (double)body->com_m[k]);
    }
    const double about_origin = mass_kg * (com_m[0] * com_m[0] + com_m[1] * com_m[1] + com_m[2] * com_m[2]);
    for (int n = 0; n < 6; n++) { // ten operations with numbers of the size about O_A
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(10, about_origin + fabs(central[n])), central[n],
                                  (double)body->inertia_kg_m2[n]);
    }
}

static void test_sphere_and_box_come_out_as_they_went_in(void) {
    // GIVEN a sphere of 80 kg and 0.2 m, and a box of 120 kg and 0.3 x 0.5 x 0.8 m, beside and above O_A
    static const double sphere_com[3] = {0.4, -0.3, 0.7}, box_com[3] = {-0.2, 0.1, 0.5};
    const double ball = 0.4 * 80.0 * 0.2 * 0.2;
    const double sphere[6] = {ball, ball, ball, 0.0, 0.0, 0.0};
    const double box[6] = {10.0 * (0.25 + 0.64), 10.0 * (0.09 + 0.64), 10.0 * (0.09 + 0.25), 0.0, 0.0, 0.0};
    double theta[DIM];
    hexload_body_t body;
    // WHEN their parameters about O_A are described THEN mass, centre and central tensor are theirs
    theta_of(80.0, sphere_com, sphere, theta);
    describe(theta, &body);
    assert_body(&body, 80.0, sphere_com, sphere);
    theta_of(120.0, box_com, box, theta);
    describe(theta, &body);
    assert_body(&body, 120.0, box_com, box);
}

static void test_products_keep_the_sign_of_tensor_entries(void) {
    // GIVEN a box turned by 30 degrees about z: its Ixy is (Ixx' - Iyy') sin cos
    static const double com_m[3] = {0.1, 0.2, 0.3};
    const double c = cos(0.5235987755982988), s = 0.5, a = 9.0, b = 4.0;
    const double turned[6] = {a * c * c + b * s * s, a * s * s + b * c * c, 7.0, (a - b) * s * c, 0.0, 0.0};
    double theta[DIM];
    hexload_body_t body;
    theta_of(100.0, com_m, turned, theta);
    // WHEN it is described THEN the products are those entries
    describe(theta, &body);
    assert_body(&body, 100.0, com_m, turned);
}

static void test_sigmas_are_those_of_finite_differences(void) {
    uint64_t seed = 5;
    for (int n = 0; n < 50; n++) {
        // GIVEN a body, and a covariance with correlations
        double theta[DIM], L[DIM][DIM], variance[DIM] = {0};
        hexload_real_t value[DIM], covariance[COVARIANCES];
        hexload_body_t body;
        random_body(&seed, theta);
        random_covariance(&seed, USUAL_SIZE, L, covariance);
        to_real(theta, value);
        hexload_body_describe(value, covariance, &body);
        // WHEN each column of its root moves mass, centre of mass and central tensor, by central differences
        for (int k = 0; k < DIM; k++) {
            double up[DIM], down[DIM], high[DIM], low[DIM];
            for (int i = 0; i < DIM; i++) {
                up[i] = theta[i] + 1e-4 * L[i][k];
                down[i] = theta[i] - 1e-4 * L[i][k];
            }
            derive(up, high);
            derive(down, low);
            for (int i = 0; i < DIM; i++) {
                const double slope = (high[i] - low[i]) / 2e-4;
                variance[i] += slope * slope;
            }
        }
        // THEN the sigmas are the roots of the sums, to roundings of variances that are differences, and to
        // those of the differences in double
        const double tolerance = ROUNDINGS(200, 1.0) + 1e-7;
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, 1.0, (double)body.mass_sigma_kg / sqrt(variance[0]));
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, 1.0, (double)body.com_sigma_m[k] / sqrt(variance[1 + k]));
        }
        for (int k = 0; k < 6; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, 1.0,
                                      (double)body.inertia_sigma_kg_m2[k] / sqrt(variance[4 + k]));
        }
    }
}

static void assert_no_inertia(const hexload_body_t* body) {
    TEST_ASSERT_FALSE(body->has_inertia);
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_TRUE(body->inertia_kg_m2[k] == 0 && body->inertia_sigma_kg_m2[k] == 0);
    }
}

static void test_unknown_mass_gives_no_centre_of_mass_and_no_number_that_is_none(void) {
    static const double masses[] = {0.0, -3.0, 4.9, 5.1}; // sigma: 0.5 kg
    for (int n = 0; n < 4; n++) {
        // GIVEN a mass of which the sigma is more, or less, than a tenth
        uint64_t seed = 3;
        double theta[DIM], L[DIM][DIM];
        hexload_real_t value[DIM], covariance[COVARIANCES];
        hexload_body_t body;
        random_body(&seed, theta);
        theta[0] = masses[n];
        to_real(theta, value);
        random_covariance(&seed, USUAL_SIZE, L, covariance);
        // WHEN it is described THEN centre of mass and tensor are unknown, and zero, or the centre is there
        hexload_body_describe(value, covariance, &body);
        TEST_ASSERT_EQUAL(n == 3, body.has_com);
        TEST_ASSERT_FALSE(body.is_consistent);
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_EQUAL(n == 3, body.com_m[k] != 0);
            TEST_ASSERT_EQUAL(n == 3, body.com_sigma_m[k] != 0);
        }
        if (!body.has_com) {
            assert_no_inertia(&body);
        }
    }
}

static void test_tensor_is_unknown_while_first_order_leaves_out_half_a_sigma(void) {
    // GIVEN 300 kg whose h_z has a sigma of 30 kg m, or 120: errors of 3, or 48, kg m^2 by its square over
    // the mass, twice as many at worst, beside 20 of Ixx
    static const double sigmas[] = {30.0, 120.0};
    for (int n = 0; n < 2; n++) {
        uint64_t seed = 4;
        double theta[DIM], L[DIM][DIM];
        double size[DIM] = {0.5, 0.4, 0.4, sigmas[n], 20.0, 20.0, 20.0, 20.0, 20.0, 20.0};
        hexload_real_t value[DIM], covariance[COVARIANCES];
        hexload_body_t body;
        const double com_m[3] = {0.0, 0.0, 0.0}, central[6] = {20.0, 20.0, 20.0, 0.0, 0.0, 0.0};
        theta_of(300.0, com_m, central, theta);
        to_real(theta, value);
        random_covariance(&seed, size, L, covariance);
        // WHEN it is described THEN the centre of mass is known with its sigma, and the tensor only the first
        // time
        hexload_body_describe(value, covariance, &body);
        TEST_ASSERT_TRUE(body.has_com && body.is_consistent);
        TEST_ASSERT_TRUE((double)body.com_sigma_m[2] > 0.9 * sigmas[n] / 300.0);
        TEST_ASSERT_EQUAL(n == 0, body.has_inertia);
        if (n == 1) {
            assert_no_inertia(&body);
        }
    }
}

static void test_an_entry_is_unknown_by_the_moment_along_either_of_its_axes(void) {
    // GIVEN 100 kg at its centre, one moment with a sigma of 1 kg m, by whose square the entries of the
    // tensor that it counts in are open by 2 / 100 = 0.02 kg m^2; and one of these entries with a sigma of
    // 0.035 or 0.045, all others with 10
    static const int along[6][2] = {{1, 2}, {2, 0}, {0, 1},
                                    {0, 1}, {0, 2}, {1, 2}}; // of xx, yy, zz, xy, xz, yz
    for (int n = 0; n < 24; n++) {
        const int entry = n / 4, axis = along[entry][n / 2 % 2];
        const double com_m[3] = {0.0, 0.0, 0.0}, central[6] = {10.0, 10.0, 10.0, 0.0, 0.0, 0.0};
        double theta[DIM], sigma[DIM] = {0.0, 1e-2, 1e-2, 1e-2, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0};
        hexload_real_t value[DIM], covariance[COVARIANCES] = {0};
        hexload_body_t body;
        theta_of(100.0, com_m, central, theta);
        to_real(theta, value);
        sigma[1 + axis] = 1.0;
        sigma[4 + entry] = n % 2 == 0 ? 0.035 : 0.045;
        for (int k = 1; k < DIM; k++) {
            covariance[k * (k + 1) / 2 + k] = (hexload_real_t)(sigma[k] * sigma[k]);
        }
        // WHEN it is described THEN the tensor is known where that is less than half of each sigma
        hexload_body_describe(value, covariance, &body);
        TEST_ASSERT_EQUAL(n % 2 == 1, body.has_inertia);
    }
}

static void test_a_body_that_is_known_exactly_has_all_its_numbers(void) {
    // GIVEN parameters without any variance, as of a platform WHEN they are described THEN centre of mass and
    // tensor are there, with sigmas of zero
    uint64_t seed = 16;
    const hexload_real_t none[COVARIANCES] = {0};
    double theta[DIM];
    hexload_real_t value[DIM];
    hexload_body_t body;
    random_body(&seed, theta);
    to_real(theta, value);
    hexload_body_describe(value, none, &body);
    TEST_ASSERT_TRUE(body.has_com && body.has_inertia && body.is_consistent);
    TEST_ASSERT_TRUE(body.mass_sigma_kg == 0);
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_TRUE(body.inertia_sigma_kg_m2[k] == 0);
    }
}

static void test_bodies_of_point_masses_are_consistent_and_their_own_nearest(void) {
    uint64_t seed = 6;
    for (int n = 0; n < 500; n++) {
        // GIVEN any body WHEN it is described THEN it is consistent
        double theta[DIM], L[DIM][DIM];
        hexload_real_t value[DIM], nearest[DIM], covariance[COVARIANCES], distance = 1;
        hexload_body_t body;
        random_body(&seed, theta);
        to_real(theta, value);
        random_covariance(&seed, USUAL_SIZE, L, covariance);
        hexload_body_describe(value, covariance, &body);
        TEST_ASSERT_TRUE(body.is_consistent);
        // AND the nearest consistent parameters are its own, to the bit
        TEST_ASSERT_TRUE(hexload_body_nearest(value, covariance, nearest, &distance));
        TEST_ASSERT_EQUAL_MEMORY(value, nearest, sizeof value);
        TEST_ASSERT_TRUE(distance == 0);
    }
}

static void test_what_no_body_has_is_inconsistent(void) {
    static const double com_m[3] = {0.1, -0.2, 0.4};
    static const double central[][6] = {
        {12.0, 5.0, 6.0, 0.0, 0.0, 0.0},    // Ixx > Iyy + Izz
        {5.0, 12.0, 6.0, 0.0, 0.0, 0.0},    //
        {5.0, 6.0, 12.0, 0.0, 0.0, 0.0},    //
        {-1.0, 5.0, 5.0, 0.0, 0.0, 0.0},    //
        {10.0, 10.0, 12.0, 6.1, 0.0, 0.0},  // second moments 6, 6, 4: the product of x and y is beyond both
        {10.0, 10.0, 12.0, 0.0, 0.0, -5.0}, // beyond sqrt(6 x 4)
    };
    hexload_body_t body;
    double theta[DIM];
    // GIVEN tensors against the triangle inequality, in these axes or others, WHEN they are described THEN
    // they are inconsistent
    for (size_t n = 0; n < sizeof central / sizeof central[0]; n++) {
        theta_of(100.0, com_m, central[n], theta);
        describe(theta, &body);
        TEST_ASSERT_FALSE(body.is_consistent);
    }
    // AND so is a tensor about O_A that is too small for where the centre of mass is
    theta_of(100.0, com_m, (const double[6]){5.0, 5.0, 5.0, 0.0, 0.0, 0.0}, theta);
    describe(theta, &body);
    TEST_ASSERT_TRUE(body.is_consistent);
    theta[3] *= 2.0;
    describe(theta, &body);
    TEST_ASSERT_FALSE(body.is_consistent);
}

/// Whether some body has these parameters within three sigmas, of which all but one are zero.
static bool is_granted(double mass_kg, double h_x, double I_xx, int parameter, double sigma) {
    const hexload_real_t theta[DIM] = {
        (hexload_real_t)mass_kg, (hexload_real_t)h_x, 0, 0, (hexload_real_t)I_xx,
        HEXLOAD_REAL(2.0),       HEXLOAD_REAL(2.0)};
    hexload_real_t sigmas[DIM] = {0};
    sigmas[parameter] = (hexload_real_t)sigma;
    return hexload_pseudo_inertia_is_positive(theta, sigmas);
}

static void test_what_some_body_has_within_three_sigmas_is_granted_and_no_more(void) {
    // GIVEN Ixx = 10 beside Iyy = Izz = 2, whose second moment (Iyy + Izz - Ixx) / 2 = -3 WHEN it may be half
    // of three sigmas more THEN sigma has to be above 2
    TEST_ASSERT_FALSE(is_granted(1.0, 0.0, 10.0, HEXLOAD_LOAD_IYY, 1.99));
    TEST_ASSERT_TRUE(is_granted(1.0, 0.0, 10.0, HEXLOAD_LOAD_IYY, 2.01));
    // AND a mass of -1 kg needs a sigma above a third
    TEST_ASSERT_FALSE(is_granted(-1.0, 0.0, 2.0, HEXLOAD_LOAD_M, 0.33));
    TEST_ASSERT_TRUE(is_granted(-1.0, 0.0, 2.0, HEXLOAD_LOAD_M, 0.34));
    // AND h = 3 kg m of 1 kg takes 9 of a second moment of 1: h^2 is 6 h sigma less to first order
    TEST_ASSERT_FALSE(is_granted(1.0, 3.0, 2.0, HEXLOAD_LOAD_HX, 0.44));
    TEST_ASSERT_TRUE(is_granted(1.0, 3.0, 2.0, HEXLOAD_LOAD_HX, 0.45));
}

/// Parameters of a pseudo-inertia V^T diag(eigenvalue) V, V a product of rotations in the planes of the axes.
static void theta_of_eigenvalues(const double V[4][4], const double eigenvalue[4], double theta[DIM]) {
    double pseudo[4][4] = {{0}};
    for (int a = 0; a < 4; a++) {
        for (int i = 0; i < 4; i++) {
            for (int j = 0; j < 4; j++) {
                pseudo[i][j] += eigenvalue[a] * V[a][i] * V[a][j];
            }
        }
    }
    const double trace = pseudo[0][0] + pseudo[1][1] + pseudo[2][2];
    theta[0] = pseudo[3][3];
    for (int k = 0; k < 3; k++) {
        theta[1 + k] = pseudo[3][k];
        theta[4 + k] = trace - pseudo[k][k];
    }
    theta[7] = -pseudo[0][1];
    theta[8] = -pseudo[0][2];
    theta[9] = -pseudo[1][2];
}

static void random_rotation4(uint64_t* seed, double V[4][4]) {
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            V[i][j] = i == j ? 1.0 : 0.0;
        }
    }
    for (int p = 0; p < 4; p++) {
        for (int q = p + 1; q < 4; q++) {
            const double angle = 3.0 * uniform(seed);
            for (int k = 0; k < 4; k++) {
                const double first = cos(angle) * V[p][k] - sin(angle) * V[q][k];
                V[q][k] = sin(angle) * V[p][k] + cos(angle) * V[q][k];
                V[p][k] = first;
            }
        }
    }
}

static void test_where_all_entries_are_as_uncertain_the_nearest_has_its_negative_eigenvalues_cut(void) {
    // GIVEN a covariance by which the pseudo-inertia's entries are independent, with variance 1, off the
    // diagonal 1/2: then sigmas are lengths of matrices
    double columns[DIM][DIM], unit[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    hexload_real_t covariance[COVARIANCES];
    int column = 0;
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j <= i; j++, column++) {
            // the matrix with 1 / sqrt(2) at (i, j) and (j, i): eigenvalues +-1 / sqrt(2)
            double pair[4][4], plus_minus[4] = {0.0, 0.0, 0.0, 0.0};
            memcpy(pair, unit, sizeof pair);
            plus_minus[i] = i == j ? 1.0 : sqrt(0.5);
            if (i != j) {
                plus_minus[j] = -sqrt(0.5);
                for (int k = 0; k < 4; k++) {
                    pair[i][k] = sqrt(0.5) * (unit[i][k] + unit[j][k]);
                    pair[j][k] = sqrt(0.5) * (unit[i][k] - unit[j][k]);
                }
            }
            theta_of_eigenvalues((const double(*)[4])pair, plus_minus, columns[column]);
        }
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = 0; k < DIM; k++) {
                sum += columns[k][i] * columns[k][j];
            }
            covariance[i * (i + 1) / 2 + j] = (hexload_real_t)sum;
        }
    }
    uint64_t seed = 7;
    for (int n = 0; n < 200; n++) {
        // WHEN a pseudo-inertia of known eigenvalues, one to three of them negative, is brought inside
        double V[4][4], eigenvalue[4], cut[4], theta[DIM], expected[DIM], square = 0.0;
        hexload_real_t value[DIM], nearest[DIM], distance;
        random_rotation4(&seed, V);
        for (int a = 0; a < 4; a++) {
            const double sign = a == 0 ? -1.0 : a == 3 ? 1.0 : uniform(&seed);
            eigenvalue[a] = sign * (2.5 + 2.0 * uniform(&seed));
            cut[a] = eigenvalue[a] > 0.0 ? eigenvalue[a] : 0.0;
            square += (eigenvalue[a] - cut[a]) * (eigenvalue[a] - cut[a]);
        }
        theta_of_eigenvalues((const double(*)[4])V, eigenvalue, theta);
        theta_of_eigenvalues((const double(*)[4])V, cut, expected);
        to_real(theta, value);
        TEST_ASSERT_TRUE(hexload_body_nearest(value, covariance, nearest, &distance));
        // THEN its negative eigenvalues have become zero; the end of the path is 1e-5 of the distance off or
        // more
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * sqrt(square), sqrt(square), (double)distance);
        for (int k = 0; k < DIM; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(2e-3 * (1.0 + sqrt(square)), expected[k], (double)nearest[k]);
        }
    }
}

static void test_nearest_is_consistent_and_nearer_to_every_body(void) {
    uint64_t seed = 8;
    int inconsistent = 0;
    for (int n = 0; n < 400; n++) {
        // GIVEN an estimate of a body with errors of its covariance, early (large) or late
        double theta[DIM], L[DIM][DIM], size[DIM], truth[DIM], hat[DIM], other[DIM];
        hexload_real_t value[DIM], nearest[DIM], again[DIM], covariance[COVARIANCES], distance, none;
        const double times = pow(10.0, 1.0 + uniform(&seed));
        for (int k = 0; k < DIM; k++) {
            size[k] = times * USUAL_SIZE[k];
        }
        random_body(&seed, truth);
        random_covariance(&seed, size, L, covariance);
        for (int i = 0; i < DIM; i++) {
            theta[i] = normal(&seed);
        }
        for (int i = 0; i < DIM; i++) {
            hat[i] = truth[i];
            for (int k = 0; k <= i; k++) {
                hat[i] += L[i][k] * theta[k];
            }
        }
        to_real(hat, value);
        TEST_ASSERT_TRUE(hexload_body_nearest(value, covariance, nearest, &distance));
        if (!(distance > 0)) {
            continue;
        }
        inconsistent++;
        // WHEN it is brought inside THEN a body has the result, which is its own nearest
        TEST_ASSERT_TRUE(hexload_body_nearest(nearest, covariance, again, &none));
        TEST_ASSERT_TRUE(none == 0);
        TEST_ASSERT_EQUAL_MEMORY(nearest, again, sizeof nearest);
        // AND the distance is the one moved
        const double moved = sigmas_between(L, nearest, hat);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * (1.0 + moved), moved, (double)distance);
        // AND to the truth and to any other body the angle there is right or obtuse, which makes it the
        // nearest: before^2 >= moved^2 + after^2, short of the margin and of the end of the path
        for (int b = 0; b < 20; b++) {
            memcpy(other, truth, sizeof other);
            if (b > 0) {
                random_body(&seed, other);
            }
            const double before = sigmas_between(L, value, other);
            const double after = sigmas_between(L, nearest, other);
            TEST_ASSERT_TRUE(before * before + 0.01 * (1.0 + moved) * (1.0 + after) >=
                             moved * moved + after * after);
        }
    }
    printf("%d of 400 were inconsistent\n", inconsistent);
    TEST_ASSERT_GREATER_THAN_INT(100, inconsistent);
}

static void test_where_rounding_hides_the_nearest_the_estimate_is_given_back(void) {
    // GIVEN estimates that no body has, with entries that lie up to eight decades apart, and far beyond their
    // sigmas
    uint64_t seed = 15;
    int given_back = 0;
    for (int n = 0; n < 300; n++) {
        double L[DIM][DIM];
        hexload_real_t value[DIM], nearest[DIM], covariance[COVARIANCES], distance = HEXLOAD_REAL(-1.0);
        hexload_body_t body;
        for (int i = 0, entry = 0; i < DIM; i++) {
            value[i] = (hexload_real_t)(30.0 * uniform(&seed) * pow(10.0, 4.0 * uniform(&seed)));
            for (int j = 0; j <= i; j++, entry++) {
                double sum = 0.0;
                L[i][j] = uniform(&seed) * pow(10.0, uniform(&seed));
                for (int k = 0; k <= j; k++) {
                    sum += L[i][k] * L[j][k];
                }
                covariance[entry] = (hexload_real_t)sum;
            }
        }
        value[0] = -hexload_abs(value[0]);
        // WHEN the nearest is asked for THEN it is one that a body has, or none is said to be found: within
        // bounded time, and the estimate comes back as it was
        if (hexload_body_nearest(value, covariance, nearest, &distance)) {
            hexload_body_describe(nearest, covariance, &body);
            TEST_ASSERT_TRUE(body.is_consistent && distance > HEXLOAD_REAL(0.0));
        } else {
            given_back++;
            TEST_ASSERT_EQUAL_MEMORY(value, nearest, sizeof value);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(0, given_back);
    TEST_ASSERT_LESS_THAN_INT(300, given_back);
}

static void test_numbers_that_are_none_are_given_back(void) {
    static const hexload_real_t broken[] = {(hexload_real_t)NAN, (hexload_real_t)INFINITY,
                                            (hexload_real_t)-INFINITY};
    uint64_t seed = 9;
    double theta[DIM], L[DIM][DIM];
    hexload_real_t value[DIM], nearest[DIM], covariance[COVARIANCES], distance;
    random_body(&seed, theta);
    theta[4] = -theta[4];
    to_real(theta, value);
    random_covariance(&seed, USUAL_SIZE, L, covariance);
    for (int n = 0; n < 3; n++) {
        // GIVEN an estimate or a covariance with a number that is not finite WHEN its nearest is asked for
        // THEN there is none, and the estimate comes back
        hexload_real_t spoilt[DIM], spoilt_covariance[COVARIANCES];
        memcpy(spoilt, value, sizeof spoilt);
        memcpy(spoilt_covariance, covariance, sizeof covariance);
        spoilt[5] = broken[n];
        spoilt_covariance[14] = broken[n];
        TEST_ASSERT_FALSE(hexload_body_nearest(spoilt, covariance, nearest, &distance));
        TEST_ASSERT_EQUAL_MEMORY(spoilt, nearest, sizeof spoilt);
        TEST_ASSERT_TRUE(distance == 0);
        TEST_ASSERT_FALSE(hexload_body_nearest(value, spoilt_covariance, nearest, &distance));
        TEST_ASSERT_EQUAL_MEMORY(value, nearest, sizeof value);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_sphere_and_box_come_out_as_they_went_in);
    RUN_TEST(test_products_keep_the_sign_of_tensor_entries);
    RUN_TEST(test_sigmas_are_those_of_finite_differences);
    RUN_TEST(test_unknown_mass_gives_no_centre_of_mass_and_no_number_that_is_none);
    RUN_TEST(test_tensor_is_unknown_while_first_order_leaves_out_half_a_sigma);
    RUN_TEST(test_an_entry_is_unknown_by_the_moment_along_either_of_its_axes);
    RUN_TEST(test_a_body_that_is_known_exactly_has_all_its_numbers);
    RUN_TEST(test_bodies_of_point_masses_are_consistent_and_their_own_nearest);
    RUN_TEST(test_what_no_body_has_is_inconsistent);
    RUN_TEST(test_what_some_body_has_within_three_sigmas_is_granted_and_no_more);
    RUN_TEST(test_where_all_entries_are_as_uncertain_the_nearest_has_its_negative_eigenvalues_cut);
    RUN_TEST(test_nearest_is_consistent_and_nearer_to_every_body);
    RUN_TEST(test_where_rounding_hides_the_nearest_the_estimate_is_given_back);
    RUN_TEST(test_numbers_that_are_none_are_given_back);
    return UNITY_END();
}
