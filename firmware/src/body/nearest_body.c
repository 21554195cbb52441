#include "body/body_model.h"

#include "algebra/linalg.h"

#include <string.h>

enum {
    DIM = HEXLOAD_LOAD_DIM, ///< also the entries of a symmetric 4 x 4 matrix: both spaces are the same
    AXES = 4,
    SWEEPS = 6, ///< of Jacobi's rotations: he needs 4 or 5 for a float
    MOST_STEPS = 40,
};

/// The pseudo-inertia keeps this share of its own scale, so that rounding does not undo what was found.
#define MARGIN HEXLOAD_REAL(1e-5)
/// Where the path ends: mu, per square of the distance.
#define LAST_GAP HEXLOAD_REAL(1e-5)
/// By how much mu falls at a time.
#define SHRINKAGE HEXLOAD_REAL(0.05)

/// Entries of the pseudo-inertia [S h; h^T m], lower triangle by rows.
enum { S_XX, S_XY, S_YY, S_XZ, S_YZ, S_ZZ, H_X, H_Y, H_Z, MASS };

#define SQRT_2 HEXLOAD_REAL(1.4142135623730951)

/// A symmetric 4 x 4 matrix as a vector of the same length: lower triangle by rows, times sqrt(2) off the
/// diagonal.
typedef hexload_real_t vector_t[DIM];

/// Find Pi = C + K Z with Pi and Z positive semidefinite and Z Pi = 0: of the nearest pseudo-inertia Pi, Z is
/// the force that holds it inside. All in sigmas: Pi is the seen one less its margin, row and column k
/// divided by sqrt(sigma of its diagonal entry k).
typedef struct cone_problem {
    hexload_real_t K[DIM][DIM]; ///< covariance of Pi
    vector_t C;
    vector_t scale; ///< Pi / scale is the pseudo-inertia
} cone_problem_t;

/// X = Z - Pi on the path Z Pi = mu E: Z and Pi have the axes of X, and its eigenvalues are z - mu / z.
typedef struct path_point {
    vector_t X;
    hexload_real_t axes[AXES][AXES]; ///< one a row
    hexload_real_t eigenvalue[AXES]; ///< of X
    hexload_real_t z[AXES];          ///< of Z
    hexload_real_t pi[AXES];         ///< of Pi
    vector_t move;                   ///< K Z
    vector_t residual;               ///< Pi - K Z - C
    hexload_real_t residual_square;
    hexload_real_t distance_square; ///< Z . K Z
} path_point_t;

static hexload_real_t dot(const vector_t a, const vector_t b) {
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int k = 0; k < DIM; k++) {
        sum += a[k] * b[k];
    }
    return sum;
}

static void to_matrix(const vector_t v, hexload_real_t A[AXES][AXES]) {
    for (int i = 0; i < AXES; i++) {
        for (int j = 0; j < i; j++) {
            A[i][j] = HEXLOAD_REAL(0.5) * SQRT_2 * v[ROW(i) + j];
            A[j][i] = A[i][j];
        }
        A[i][i] = v[ROW(i) + i];
    }
}

/// V A V^T for the rows of V.
static void turn(hexload_real_t V[AXES][AXES], const vector_t v, vector_t turned) {
    hexload_real_t A[AXES][AXES];
    to_matrix(v, A);
    for (int i = 0; i < AXES; i++) {
        hexload_real_t row[AXES];
        for (int k = 0; k < AXES; k++) {
            row[k] = V[i][0] * A[0][k] + V[i][1] * A[1][k] + V[i][2] * A[2][k] + V[i][3] * A[3][k];
        }
        for (int j = 0; j <= i; j++) {
            const hexload_real_t entry =
                row[0] * V[j][0] + row[1] * V[j][1] + row[2] * V[j][2] + row[3] * V[j][3];
            turned[ROW(i) + j] = i == j ? entry : SQRT_2 * entry;
        }
    }
}

/// One of Jacobi's rotations: A_pq becomes zero.
static void rotate(hexload_real_t A[AXES][AXES], hexload_real_t axes[AXES][AXES], int p, int q) {
    const hexload_real_t one = HEXLOAD_REAL(1.0);
    const hexload_real_t apart = HEXLOAD_REAL(0.5) * (A[q][q] - A[p][p]);
    const hexload_real_t off = A[p][q];
    const hexload_real_t length = hexload_sqrt(apart * apart + off * off);
    if (!(length > HEXLOAD_REAL(0.0))) {
        return;
    }
    const hexload_real_t tangent = off / (apart < HEXLOAD_REAL(0.0) ? apart - length : apart + length);
    const hexload_real_t cosine = one / hexload_sqrt(one + tangent * tangent);
    const hexload_real_t sine = tangent * cosine;
    A[p][p] -= tangent * off;
    A[q][q] += tangent * off;
    A[p][q] = HEXLOAD_REAL(0.0);
    A[q][p] = HEXLOAD_REAL(0.0);
    for (int k = 0; k < AXES; k++) {
        if (k != p && k != q) {
            const hexload_real_t turned = cosine * A[k][p] - sine * A[k][q];
            A[k][q] = sine * A[k][p] + cosine * A[k][q];
            A[q][k] = A[k][q];
            A[k][p] = turned;
            A[p][k] = turned;
        }
        const hexload_real_t axis = cosine * axes[p][k] - sine * axes[q][k];
        axes[q][k] = sine * axes[p][k] + cosine * axes[q][k];
        axes[p][k] = axis;
    }
}

/// Eigenvalues of X and their axes.
static void find_axes(path_point_t* point) {
    hexload_real_t A[AXES][AXES];
    to_matrix(point->X, A);
    for (int i = 0; i < AXES; i++) {
        for (int k = 0; k < AXES; k++) {
            point->axes[i][k] = i == k ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0);
        }
    }
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        for (int p = 0; p < AXES - 1; p++) {
            for (int q = p + 1; q < AXES; q++) {
                rotate(A, point->axes, p, q);
            }
        }
    }
    for (int i = 0; i < AXES; i++) {
        point->eigenvalue[i] = A[i][i];
    }
}

/// The matrix with the point's axes and other eigenvalues.
static void compose(const path_point_t* point, const hexload_real_t eigenvalue[AXES], vector_t v) {
    memset(v, 0, sizeof(vector_t));
    for (int axis = 0; axis < AXES; axis++) {
        const hexload_real_t* a = point->axes[axis];
        for (int i = 0; i < AXES; i++) {
            for (int j = 0; j <= i; j++) {
                v[ROW(i) + j] += (i == j ? eigenvalue[axis] : SQRT_2 * eigenvalue[axis]) * a[i] * a[j];
            }
        }
    }
}

/// Z and Pi that X stands for at mu, and what is missing.
static void evaluate(const cone_problem_t* problem, hexload_real_t mu, path_point_t* point) {
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    vector_t Z;
    for (int i = 0; i < AXES; i++) {
        const hexload_real_t x = hexload_abs(point->eigenvalue[i]);
        const hexload_real_t larger = half * (x + hexload_sqrt(x * x + HEXLOAD_REAL(4.0) * mu));
        const hexload_real_t smaller = mu / larger;
        const bool is_held = point->eigenvalue[i] > HEXLOAD_REAL(0.0);
        point->z[i] = is_held ? larger : smaller;
        point->pi[i] = is_held ? smaller : larger;
    }
    compose(point, point->z, Z);
    compose(point, point->pi, point->residual);
    for (int k = 0; k < DIM; k++) {
        point->move[k] = dot(problem->K[k], Z);
        point->residual[k] -= point->move[k] + problem->C[k];
    }
    point->residual_square = dot(point->residual, point->residual);
    point->distance_square = dot(Z, point->move);
}

/// Solves A x = b for a symmetric positive definite A, of which the lower triangle is read and lost; x in
/// place of b.
static void solve(hexload_real_t A[DIM][DIM], vector_t b) {
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            hexload_real_t sum = A[i][j];
            for (int k = 0; k < j; k++) {
                sum -= A[i][k] * A[j][k];
            }
            A[i][j] = i == j ? HEXLOAD_REAL(1.0) / hexload_sqrt(sum) : sum * A[j][j];
        }
        for (int k = 0; k < i; k++) {
            b[i] -= A[i][k] * b[k];
        }
        b[i] *= A[i][i];
    }
    for (int i = DIM - 1; i >= 0; i--) {
        for (int k = i + 1; k < DIM; k++) {
            b[i] -= A[k][i] * b[k];
        }
        b[i] *= A[i][i];
    }
}

/// One of Newton's steps of X. In the axes of X the change of Z is G with (K + (pi_i + pi_j) / (z_i + z_j)) G
/// = residual, and that of X is G (z_i + z_j + pi_i + pi_j) / (z_i + z_j): definite, and large only on the
/// diagonal.
static void improve(const cone_problem_t* problem, path_point_t* point) {
    hexload_real_t half_way[DIM][DIM];
    hexload_real_t A[DIM][DIM];
    hexload_real_t back[AXES][AXES];
    vector_t stiffness;
    vector_t step;
    vector_t change;
    for (int k = 0; k < DIM; k++) {
        turn(point->axes, problem->K[k], half_way[k]);
    }
    for (int i = 0; i < AXES; i++) {
        for (int j = 0; j <= i; j++) {
            stiffness[ROW(i) + j] = (point->pi[i] + point->pi[j]) / (point->z[i] + point->z[j]);
        }
        for (int k = 0; k < AXES; k++) {
            back[i][k] = point->axes[k][i];
        }
    }
    for (int k = 0; k < DIM; k++) {
        vector_t column;
        for (int j = 0; j < DIM; j++) {
            column[j] = half_way[j][k];
        }
        turn(point->axes, column, A[k]);
        A[k][k] += stiffness[k];
    }
    turn(point->axes, point->residual, step);
    solve(A, step);
    for (int k = 0; k < DIM; k++) {
        step[k] *= HEXLOAD_REAL(1.0) + stiffness[k];
    }
    turn(back, step, change);
    for (int k = 0; k < DIM; k++) {
        point->X[k] += change[k];
    }
}

/// S = tr(I) / 2 E - I. Linear in theta.
static void to_pseudo_inertia(const hexload_real_t theta[DIM], hexload_real_t pseudo[DIM]) {
    const hexload_real_t* I = &theta[HEXLOAD_LOAD_IXX];
    const hexload_real_t half_trace =
        HEXLOAD_REAL(0.5) * (I[HEXLOAD_I_XX] + I[HEXLOAD_I_YY] + I[HEXLOAD_I_ZZ]);
    pseudo[S_XX] = half_trace - I[HEXLOAD_I_XX];
    pseudo[S_YY] = half_trace - I[HEXLOAD_I_YY];
    pseudo[S_ZZ] = half_trace - I[HEXLOAD_I_ZZ];
    pseudo[S_XY] = -I[HEXLOAD_I_XY];
    pseudo[S_XZ] = -I[HEXLOAD_I_XZ];
    pseudo[S_YZ] = -I[HEXLOAD_I_YZ];
    memcpy(&pseudo[H_X], &theta[HEXLOAD_LOAD_HX], 3 * sizeof pseudo[0]);
    pseudo[MASS] = theta[HEXLOAD_LOAD_M];
}

static void from_pseudo_inertia(const hexload_real_t pseudo[DIM], hexload_real_t theta[DIM]) {
    hexload_real_t* I = &theta[HEXLOAD_LOAD_IXX];
    I[HEXLOAD_I_XX] = pseudo[S_YY] + pseudo[S_ZZ];
    I[HEXLOAD_I_YY] = pseudo[S_XX] + pseudo[S_ZZ];
    I[HEXLOAD_I_ZZ] = pseudo[S_XX] + pseudo[S_YY];
    I[HEXLOAD_I_XY] = -pseudo[S_XY];
    I[HEXLOAD_I_XZ] = -pseudo[S_XZ];
    I[HEXLOAD_I_YZ] = -pseudo[S_YZ];
    memcpy(&theta[HEXLOAD_LOAD_HX], &pseudo[H_X], 3 * sizeof theta[0]);
    theta[HEXLOAD_LOAD_M] = pseudo[MASS];
}

/// What the pseudo-inertia must keep on its diagonal, by its own size and sigma; and 1 / sqrt(sigma) of each
/// row.
static void find_scales(const hexload_real_t pseudo[DIM], hexload_real_t K[DIM][DIM],
                        hexload_real_t margin[AXES], hexload_real_t row_scale[AXES]) {
    hexload_real_t mean = HEXLOAD_REAL(0.0);
    for (int i = 0; i < AXES; i++) {
        const hexload_real_t size = hexload_abs(pseudo[ROW(i) + i]);
        const hexload_real_t sigma = hexload_max(hexload_sqrt(K[ROW(i) + i][ROW(i) + i]), MARGIN * size);
        row_scale[i] = HEXLOAD_REAL(1.0) / hexload_sqrt(sigma);
        margin[i] = MARGIN * (size + sigma);
        mean += i < 3 ? margin[i] / HEXLOAD_REAL(3.0) : HEXLOAD_REAL(0.0);
    }
    for (int i = 0; i < 3; i++) { // the same whatever the axes
        margin[i] = mean;
    }
}

/// Covariance of the pseudo-inertia's entries about a point.
static void spread_pseudo_inertia(const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                                  const hexload_real_t point_m[3], hexload_real_t K[DIM][DIM]) {
    hexload_real_t spread[DIM][DIM];
    hexload_real_t half_way[DIM][DIM];
    hexload_body_spread_from(point_m, covariance, spread);
    for (int k = 0; k < DIM; k++) {
        to_pseudo_inertia(spread[k], half_way[k]);
    }
    for (int k = 0; k < DIM; k++) {
        hexload_real_t column[DIM];
        for (int j = 0; j < DIM; j++) {
            column[j] = half_way[j][k];
        }
        to_pseudo_inertia(column, K[k]);
    }
}

/// The problem as seen from a point: near the centre of mass Pi is nearly in blocks.
static void pose_problem(const hexload_real_t theta[DIM],
                         const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                         const hexload_real_t point_m[3], cone_problem_t* problem) {
    hexload_real_t seen[DIM];
    hexload_real_t margin[AXES];
    hexload_real_t row_scale[AXES];
    spread_pseudo_inertia(covariance, point_m, problem->K);
    hexload_body_see_from(point_m, theta, seen);
    to_pseudo_inertia(seen, problem->C);
    find_scales(problem->C, problem->K, margin, row_scale);
    for (int i = 0; i < AXES; i++) {
        for (int j = 0; j <= i; j++) {
            const hexload_real_t product = row_scale[i] * row_scale[j];
            problem->scale[ROW(i) + j] = i == j ? product : SQRT_2 * product;
        }
        problem->C[ROW(i) + i] -= margin[i];
    }
    for (int k = 0; k < DIM; k++) {
        problem->C[k] *= problem->scale[k];
        for (int j = 0; j < DIM; j++) {
            problem->K[k][j] *= problem->scale[k] * problem->scale[j];
        }
    }
}

/// theta moved by K Z.
static void move_theta(const hexload_real_t theta[DIM], const cone_problem_t* problem,
                       const path_point_t* point, const hexload_real_t point_m[3],
                       hexload_real_t moved[DIM]) {
    const hexload_real_t back_m[3] = {-point_m[0], -point_m[1], -point_m[2]};
    hexload_real_t pseudo[DIM];
    hexload_real_t change[DIM];
    for (int k = 0; k < DIM; k++) {
        pseudo[k] = point->move[k] / problem->scale[k];
    }
    from_pseudo_inertia(pseudo, change);
    hexload_body_see_from(back_m, change, moved);
    for (int k = 0; k < DIM; k++) {
        moved[k] += theta[k];
    }
}

/// Where to look from: the centre of mass, unless it is so far off that rounding would take over.
static void choose_point(const hexload_real_t theta[DIM], hexload_real_t mass_variance_kg2,
                         hexload_real_t point_m[3]) {
    const hexload_real_t* I = &theta[HEXLOAD_LOAD_IXX];
    const hexload_real_t size = hexload_abs(I[0]) + hexload_abs(I[1]) + hexload_abs(I[2]);
    const bool has_com = hexload_body_find_com(theta, mass_variance_kg2, point_m);
    if (has_com && theta[HEXLOAD_LOAD_M] * dot3(point_m, point_m) > size) {
        memset(point_m, 0, 3 * sizeof point_m[0]);
    }
}

/// Eigenvalues cut where they are, the answer if all entries were as uncertain, and a path from there on.
/// @return mu where it begins.
static hexload_real_t begin_path(const cone_problem_t* problem, path_point_t* point) {
    hexload_real_t mu = HEXLOAD_REAL(0.1);
    for (int k = 0; k < DIM; k++) {
        point->X[k] = -problem->C[k];
    }
    find_axes(point);
    for (int i = 0; i < AXES; i++) {
        const hexload_real_t x = hexload_max(point->eigenvalue[i], HEXLOAD_REAL(0.0));
        mu = hexload_max(mu, HEXLOAD_REAL(0.1) * x * x);
    }
    evaluate(problem, mu, point);
    return mu;
}

bool hexload_body_nearest(const hexload_real_t theta[DIM],
                          const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                          hexload_real_t nearest[DIM], hexload_real_t* distance_sigmas) {
    cone_problem_t problem;
    path_point_t point;
    hexload_real_t point_m[3];
    hexload_real_t moved[DIM];
    memcpy(nearest, theta, DIM * sizeof theta[0]);
    *distance_sigmas = HEXLOAD_REAL(0.0);
    if (hexload_body_is_consistent(theta)) {
        return true;
    }
    choose_point(theta, covariance[0], point_m);
    pose_problem(theta, covariance, point_m, &problem);
    hexload_real_t mu = begin_path(&problem, &point);
    for (int step = 0; step < MOST_STEPS; step++) {
        improve(&problem, &point);
        find_axes(&point);
        evaluate(&problem, mu, &point);
        if (!isfinite(point.residual_square)) {
            return false;
        }
        const hexload_real_t last = LAST_GAP * hexload_max(HEXLOAD_REAL(1.0), point.distance_square);
        if (mu > last && point.residual_square <= mu) {
            mu = hexload_max(last, SHRINKAGE * mu);
            evaluate(&problem, mu, &point);
        } else if (mu <= last && point.residual_square <= HEXLOAD_REAL(0.01) * mu) {
            move_theta(theta, &problem, &point, point_m, moved);
            if (hexload_body_is_consistent(moved)) {
                memcpy(nearest, moved, sizeof moved);
                *distance_sigmas = hexload_sqrt(point.distance_square);
                return true;
            }
        }
    }
    return false;
}
