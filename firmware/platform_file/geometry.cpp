#include "geometry.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexload::platform {
namespace {

// A leg force error is amplified by the condition number; past this the platform cannot be controlled.
constexpr double condition_limit = 1e3;
constexpr double collinear_ratio = 1e-6;
constexpr double rounding_m = 1e-9; // of a leg length

Matrix36 columns(const std::array<Vector3, 6>& points) {
    Matrix36 matrix;
    for (int leg = 0; leg < 6; ++leg) {
        matrix.col(leg) = points[static_cast<std::size_t>(leg)];
    }
    return matrix;
}

// By the eigenvalues of a square matrix, squares of the hinges' spread: the SVD of a 3 x 6 matrix takes long
// to compile.
bool on_one_line(const Matrix36& points) {
    const Matrix36 centred = points.colwise() - points.rowwise().mean();
    const Matrix3 scatter = centred * centred.transpose();
    const Vector3 spread_squared = scatter.jacobiSvd().singularValues();
    return spread_squared(1) <= collinear_ratio * collinear_ratio * spread_squared(0) ||
           spread_squared(0) == 0.0;
}

// Ratio of extreme singular values, moments divided by the platform radius so that all entries are
// comparable.
double scaled_condition(const Matrix6& J, double radius_m) {
    Matrix6 scaled = J;
    scaled.rightCols<3>() /= radius_m;
    const Vector6 values = scaled.jacobiSvd().singularValues();
    return values(5) > 0.0 ? values(0) / values(5) : std::numeric_limits<double>::infinity();
}

struct HomeLegs {
    Vector6 length_m;
    Matrix6 jacobian; // row i: [e_i^T, (a_i x e_i)^T], e_i along leg i
};

// Where R = I.
HomeLegs legs_at_home(const Geometry& geometry) {
    HomeLegs home;
    for (int leg = 0; leg < 6; ++leg) {
        const auto i = static_cast<std::size_t>(leg);
        const Vector3& arm_m = geometry.platform_hinges_m[i];
        const Vector3 leg_m = Vector3(0.0, 0.0, geometry.home_height_m) + arm_m - geometry.base_hinges_m[i];
        home.length_m(leg) = leg_m.norm();
        const Vector3 direction = leg_m / home.length_m(leg);
        home.jacobian.row(leg) << direction.transpose(), arm_m.cross(direction).transpose();
    }
    return home;
}

} // namespace

double derive_home_height_m(const Geometry& geometry) {
    const Matrix36 offset_m = columns(geometry.platform_hinges_m) - columns(geometry.base_hinges_m);
    const double wanted_m = geometry.home_leg_length_m.mean();
    const auto mean_length_m = [&](double height_m) {
        return (offset_m.colwise() + Vector3(0.0, 0.0, height_m)).colwise().norm().mean();
    };
    // Above the highest base hinge every leg grows with the height, so bisection finds the only solution.
    double low_m = -offset_m.row(2).minCoeff();
    double high_m = low_m + wanted_m;
    if (!(mean_length_m(low_m) < wanted_m)) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    for (double middle_m = 0.5 * (low_m + high_m); low_m < middle_m && middle_m < high_m;
         middle_m = 0.5 * (low_m + high_m)) {
        (mean_length_m(middle_m) < wanted_m ? low_m : high_m) = middle_m;
    }
    return high_m;
}

std::optional<GeometryFault> find_geometry_fault(const Geometry& geometry) {
    const Matrix36 platform_hinges_m = columns(geometry.platform_hinges_m);
    if (on_one_line(columns(geometry.base_hinges_m))) {
        return GeometryFault{"base_hinges_m", "six hinges on one line", "hinges that span a plane"};
    }
    if (on_one_line(platform_hinges_m)) {
        return GeometryFault{"platform_hinges_m", "six hinges on one line", "hinges that span a plane"};
    }
    if (!std::isfinite(geometry.home_height_m)) {
        return GeometryFault{
            "home_leg_length_m",
            fmt::format("mean length {:.6g} m, too short to reach from base to platform hinges",
                        geometry.home_leg_length_m.mean()),
            "legs that can be assembled at home"};
    }
    const HomeLegs home = legs_at_home(geometry);
    const Vector6 home_m = home.length_m - geometry.home_leg_length_m;
    for (int leg = 0; leg < 6; ++leg) {
        if (home_m(leg) <= geometry.stroke_min_m || home_m(leg) >= geometry.stroke_max_m) {
            return GeometryFault{"stroke_m",
                                 fmt::format("leg {} at {:.6g} m in the home pose", leg + 1,
                                             std::abs(home_m(leg)) < rounding_m ? 0.0 : home_m(leg)),
                                 fmt::format("home inside ({}, {}) m, displacements from the home length",
                                             geometry.stroke_min_m, geometry.stroke_max_m)};
        }
    }
    const double radius_m = platform_hinges_m.colwise().norm().maxCoeff();
    const double condition = scaled_condition(home.jacobian, radius_m);
    if (condition > condition_limit) {
        return GeometryFault{
            "platform_hinges_m", fmt::format("Jacobian condition {:.3g} at home", condition),
            fmt::format("at most {:g} (legs too close to a singular arrangement)", condition_limit)};
    }
    return std::nullopt;
}

} // namespace hexload::platform
