#include <hexload_sim/linear_solve.hpp>

#include <cmath>
#include <utility>

namespace hexload::sim {
namespace {

using Rows6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

// Sum over `count` columns from `begin` of row times x.
double row_times(const Rows6& A, int row, const Vector6& x, int begin, int count) {
    return A.row(row).segment(begin, count).transpose().cwiseProduct(x.segment(begin, count)).sum();
}

// Brings the row with the largest entry of the column to the diagonal.
void pivot(Rows6& A, Vector6& b, int column) {
    int largest = column;
    for (int row = column + 1; row < 6; ++row) {
        if (std::abs(A(row, column)) > std::abs(A(largest, column))) {
            largest = row;
        }
    }
    A.row(column).swap(A.row(largest));
    std::swap(b(column), b(largest));
}

} // namespace

Vector6 solve(const Matrix6& matrix, const Vector6& b) {
    Rows6 A = matrix; // becomes L below its diagonal and U from there on
    Vector6 x = b;
    for (int column = 0; column < 6; ++column) {
        pivot(A, x, column);
        for (int row = column + 1; row < 6; ++row) {
            A(row, column) /= A(column, column);
            for (int k = column + 1; k < 6; ++k) {
                A(row, k) -= A(row, column) * A(column, k);
            }
        }
    }
    for (int row = 1; row < 6; ++row) {
        x(row) -= row_times(A, row, x, 0, row);
    }
    for (int row = 5; row >= 0; --row) {
        x(row) = (x(row) - row_times(A, row, x, row + 1, 5 - row)) / A(row, row);
    }
    return x;
}

Matrix6 solve_columns(const Matrix6& A, const Matrix6& B) {
    Matrix6 X;
    for (int column = 0; column < 6; ++column) {
        X.col(column) = solve(A, Vector6(B.col(column)));
    }
    return X;
}

} // namespace hexload::sim
