#define EIGEN_NO_MALLOC // fixed sizes need none
#include "rivals.h"

#include <Eigen/Core>
#include <Eigen/Cholesky>

namespace {

template <int rows, int columns>
using Matrix = Eigen::Matrix<float, rows, columns, columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
using Square = Matrix<RIVAL_STATES, RIVAL_STATES>;

} // namespace

void eigen_filter_step(rival_filter_t* self, const rival_input_t* input) {
    Eigen::Map<Matrix<RIVAL_STATES, 1>> x(self->x);
    Eigen::Map<Square> P(&self->P[0][0]);
    const Eigen::Map<const Matrix<RATES, PARAMETERS>> N(&input->N[0][0]);
    const Eigen::Map<const Matrix<RATES, RATES>> Q(&input->Q[0][0]), R(&input->R[0][0]);
    auto rate = P.topLeftCorner<RATES, RATES>();
    auto cross = P.topRightCorner<RATES, PARAMETERS>();
    auto parameter = P.bottomRightCorner<PARAMETERS, PARAMETERS>();

    x.head<RATES>() += N * x.tail<PARAMETERS>();
    const Matrix<RATES, PARAMETERS> moved = cross + N * parameter;
    rate += N * cross.transpose() + moved * N.transpose() + Q;
    cross = moved;

    const Matrix<RATES, RATES> S = rate + R;
    const Eigen::LLT<Matrix<RATES, RATES>> root(S);
    const Matrix<RATES, 1> innovation = Eigen::Map<const Matrix<RATES, 1>>(input->measured) - x.head<RATES>();
    const Matrix<RATES, 1> y = root.matrixL().solve(innovation);
    const Matrix<RATES, RATES> U = root.matrixL().solve(Matrix<RATES, RATES>(rate));
    const Matrix<RATES, PARAMETERS> V = root.matrixL().solve(moved);
    x.head<RATES>() += U.transpose() * y;
    x.tail<PARAMETERS>() += V.transpose() * y;
    rate -= U.transpose() * U;
    cross -= U.transpose() * V;
    parameter -= V.transpose() * V;
}
