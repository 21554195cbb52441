#include <hexload_sim/linear_solve.hpp>

#include <Eigen/SVD>

namespace hexload::sim {

Vector6 solve(const Matrix6& A, const Vector6& b) {
    return A.jacobiSvd(Eigen::ComputeFullU | Eigen::ComputeFullV).solve(b);
}

Matrix6 solve_columns(const Matrix6& A, const Matrix6& B) {
    Matrix6 X;
    for (int column = 0; column < 6; ++column) {
        X.col(column) = solve(A, Vector6(B.col(column)));
    }
    return X;
}

} // namespace hexload::sim
