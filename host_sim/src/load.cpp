#include <hexload_sim/load.hpp>

namespace hexload::sim {

Eigen::Matrix<double, 10, 1> Load::theta() const {
    const MassProperties body = mass_properties(*this);
    const Vector3& h = body.first_moment_kg_m;
    const Matrix3& I = body.inertia_kg_m2;
    return (Eigen::Matrix<double, 10, 1>() << mass_kg, h.x(), h.y(), h.z(), I(0, 0), I(1, 1), I(2, 2),
            I(0, 1), I(0, 2), I(1, 2))
        .finished();
}

MassProperties mass_properties(const Load& load) {
    return {load.mass_kg, load.mass_kg * load.com_m,
            load.inertia_com_kg_m2 + parallel_axis(load.mass_kg, load.com_m)};
}

} // namespace hexload::sim
