// The plant's only solver of linear equations, compiled once: elimination with row pivoting, which compiles
// in a fraction of the time of Eigen's solvers. For the beginning of a run, not for its steps.
#pragma once

#include <hexload_sim/types.hpp>

namespace hexload::sim {

// x of A x = b, to the bit what Eigen's LU gives of rows in sequence. Not finite if A is singular.
Vector6 solve(const Matrix6& A, const Vector6& b);

// X of A X = B, column by column.
Matrix6 solve_columns(const Matrix6& A, const Matrix6& B);

} // namespace hexload::sim
