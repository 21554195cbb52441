// The plant's only solver of linear equations, compiled once. For the beginning of a run, not for its steps:
// by singular values, of Eigen's solvers the slowest, and the one that compiles in a third of LU's time.
#pragma once

#include "platform_file/types.hpp"

namespace hexload::sim {

// x of A x = b; of a singular A the shortest x that comes nearest.
Vector6 solve(const Matrix6& A, const Vector6& b);

// X of A X = B, column by column.
Matrix6 solve_columns(const Matrix6& A, const Matrix6& B);

} // namespace hexload::sim
