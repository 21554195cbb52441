#include <hexload_sim/trajectory.hpp>

#include "motion_file.hpp"

#include "platform_file/input_error.hpp"

#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/random.hpp>
#include <hexload_sim/rotation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace hexload::sim {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double rad_per_deg = pi / 180.0;

// A scalar function of time with two derivatives.
struct Scalar {
    double value;
    double rate;
    double acceleration;
};

// 0 before t = 0, 1 after t = span; in between the quintic with zero rate and acceleration at both ends.
Scalar smooth_step(double t_s, double span_s) {
    if (t_s >= span_s) {
        return {1.0, 0.0, 0.0};
    }
    if (t_s <= 0.0) {
        return {0.0, 0.0, 0.0};
    }
    const double s = t_s / span_s;
    return {s * s * s * (10.0 + s * (-15.0 + 6.0 * s)), 30.0 * s * s * (1.0 - s) * (1.0 - s) / span_s,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (span_s * span_s)};
}

Motion scaled(const Motion& motion, const Scalar& factor) {
    return {factor.value * motion.q, factor.value * motion.rate + factor.rate * motion.q,
            factor.value * motion.acceleration + 2.0 * factor.rate * motion.rate +
                factor.acceleration * motion.q};
}

class PaperTrajectory : public Trajectory {
  public:
    explicit PaperTrajectory(const PaperMotion& settings) : settings_(settings) {
        amplitude_ << settings.amplitude_x_m, settings.amplitude_y_m, 0.0, 0.0, 0.0,
            settings.amplitude_yaw_deg * rad_per_deg;
    }

    Motion at(double t_s) const override {
        const double w = 2.0 * pi * settings_.frequency_hz;
        const Motion sine{amplitude_ * std::sin(w * t_s), amplitude_ * w * std::cos(w * t_s),
                          -amplitude_ * w * w * std::sin(w * t_s)};
        return scaled(sine, smooth_step(t_s, settings_.run_in_s));
    }

  private:
    PaperMotion settings_;
    Vector6 amplitude_;
};

// sin and cos of many phases w t + phi. At whole milliseconds by the angle sum from the tick at which a block
// of them began: with what a sine turns by since then, known from a table, that takes a product in place of
// both functions, is right within a few roundings of 1, and depends on t alone, not on what was asked before.
class Phases {
  public:
    struct Unit {
        double sin;
        double cos;
    };

    void add(double w_rad_s, double phase_rad) {
        sines_.push_back({w_rad_s, phase_rad});
        for (std::size_t tick = 0; tick < block_ticks; ++tick) {
            turns_[tick].push_back(unit(w_rad_s * (static_cast<double>(tick) * default_tick_s)));
        }
        begin_.resize(sines_.size());
        now_.resize(sines_.size());
    }

    // In the order of add(); valid until the next call.
    const std::vector<Unit>& at(double t_s) const {
        const double ticks = std::round(t_s / default_tick_s);
        if (ticks < 0.0 || ticks > most_ticks ||
            std::abs(ticks * default_tick_s - t_s) > same_instant * t_s) {
            evaluate(t_s, now_);
            return now_;
        }
        const auto tick = static_cast<std::size_t>(ticks);
        const std::size_t block = tick / block_ticks;
        if (block != block_) {
            evaluate(static_cast<double>(block * block_ticks) * default_tick_s, begin_);
            block_ = block;
        }
        const std::vector<Unit>& turn = turns_[tick % block_ticks];
        for (std::size_t n = 0; n < now_.size(); ++n) {
            now_[n] = {begin_[n].sin * turn[n].cos + begin_[n].cos * turn[n].sin,
                       begin_[n].cos * turn[n].cos - begin_[n].sin * turn[n].sin};
        }
        return now_;
    }

  private:
    static constexpr std::size_t block_ticks = 64;
    static constexpr double most_ticks = 1e9;       // 11 days
    static constexpr double same_instant = 4.5e-16; // of a time: two roundings of it

    struct Sine {
        double w_rad_s;
        double phase_rad;
    };

    static Unit unit(double phase_rad) {
        return {std::sin(phase_rad), std::cos(phase_rad)};
    }

    void evaluate(double t_s, std::vector<Unit>& units) const {
        for (std::size_t n = 0; n < sines_.size(); ++n) {
            units[n] = unit(sines_[n].w_rad_s * t_s + sines_[n].phase_rad);
        }
    }

    std::vector<Sine> sines_;
    std::array<std::vector<Unit>, block_ticks> turns_;
    mutable std::size_t block_ = static_cast<std::size_t>(-1);
    mutable std::vector<Unit> begin_;
    mutable std::vector<Unit> now_;
};

class MultisineTrajectory : public Trajectory {
  public:
    MultisineTrajectory(const MultisineMotion& settings, RandomStream random) : run_in_s_(settings.run_in_s) {
        const auto bands = static_cast<double>(settings.sines);
        for (int coordinate = 0; coordinate < 6; ++coordinate) {
            const double limit =
                coordinate < 3 ? settings.translation_m : settings.rotation_deg * rad_per_deg;
            std::vector<Sine>& sines = sines_[static_cast<std::size_t>(coordinate)];
            double sum = 0.0;
            for (std::int64_t n = 0; n < settings.sines; ++n) {
                const auto band = static_cast<double>(n);
                // One random frequency per band, so that no two coordinates move alike.
                const double position = (band + random.uniform()) / bands;
                const double frequency_hz =
                    settings.frequency_min_hz +
                    position * (settings.frequency_max_hz - settings.frequency_min_hz);
                const double w_rad_s = 2.0 * pi * frequency_hz;
                phases_.add(w_rad_s, random.uniform(0.0, 2.0 * pi));
                sines.push_back({1.0 / frequency_hz, w_rad_s});
                sum += sines.back().amplitude;
            }
            for (Sine& sine : sines) {
                sine.amplitude *= limit / sum;
            }
        }
    }

    Motion at(double t_s) const override {
        Motion motion;
        auto unit = phases_.at(t_s).begin();
        for (int coordinate = 0; coordinate < 6; ++coordinate) {
            for (const Sine& sine : sines_[static_cast<std::size_t>(coordinate)]) {
                const double a = scale_ * sine.amplitude;
                motion.q(coordinate) += a * unit->sin;
                motion.rate(coordinate) += a * sine.w_rad_s * unit->cos;
                motion.acceleration(coordinate) -= a * sine.w_rad_s * sine.w_rad_s * unit->sin;
                ++unit;
            }
        }
        return scaled(motion, smooth_step(t_s, run_in_s_));
    }

    void shrink(double factor) {
        scale_ *= factor;
    }

  private:
    struct Sine {
        double amplitude;
        double w_rad_s;
    };
    double run_in_s_;
    double scale_ = 1.0;
    std::array<std::vector<Sine>, 6> sines_;
    Phases phases_; // of all sines, one coordinate after the other
};

class WorkTrajectory : public Trajectory {
  public:
    WorkTrajectory(const WorkMotion& settings, std::vector<Vector6> targets)
        : settings_(settings), targets_(std::move(targets)) {}

    // Dwell at target k, then the move to target k + 1.
    Motion at(double t_s) const override {
        const double period_s = settings_.dwell_s + settings_.move_s;
        const auto index = std::min(static_cast<std::size_t>(t_s / period_s), targets_.size() - 2);
        const double since_dwell_s = t_s - static_cast<double>(index) * period_s - settings_.dwell_s;
        const Vector6& from = targets_[index];
        const Vector6 step = targets_[index + 1] - from;
        const Scalar share = smooth_step(since_dwell_s, settings_.move_s);
        return {from + share.value * step, share.rate * step, share.acceleration * step};
    }

  private:
    WorkMotion settings_;
    std::vector<Vector6> targets_;
};

// Cubic Hermite through the rows, slopes from central differences.
class FileTrajectory : public Trajectory {
  public:
    explicit FileTrajectory(std::vector<MotionFileRow> rows) : rows_(std::move(rows)) {
        slopes_.resize(rows_.size(), Vector6::Zero()); // at rest at both ends
        for (std::size_t i = 1; i + 1 < rows_.size(); ++i) {
            slopes_[i] = (rows_[i + 1].q - rows_[i - 1].q) / (rows_[i + 1].t_s - rows_[i - 1].t_s);
        }
    }

    Motion at(double t_s) const override {
        if (t_s <= rows_.front().t_s) {
            return {rows_.front().q};
        }
        if (t_s >= rows_.back().t_s) {
            return {rows_.back().q};
        }
        const auto after = std::upper_bound(rows_.begin(), rows_.end(), t_s,
                                            [](double t, const MotionFileRow& row) { return t < row.t_s; });
        const auto i = static_cast<std::size_t>(after - rows_.begin()) - 1;
        const double span_s = rows_[i + 1].t_s - rows_[i].t_s;
        const double s = (t_s - rows_[i].t_s) / span_s;
        const Vector6 step = rows_[i + 1].q - rows_[i].q;
        const Vector6 m0 = slopes_[i] * span_s;
        const Vector6 m1 = slopes_[i + 1] * span_s;
        const Vector6 c2 = 3.0 * step - 2.0 * m0 - m1;
        const Vector6 c3 = m0 + m1 - 2.0 * step;
        return {rows_[i].q + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2.0 * c2 + s * 3.0 * c3)) / span_s,
                (2.0 * c2 + s * 6.0 * c3) / (span_s * span_s)};
    }

  private:
    std::vector<MotionFileRow> rows_;
    std::vector<Vector6> slopes_;
};

class StandstillTrajectory : public Trajectory {
  public:
    explicit StandstillTrajectory(const StandstillMotion& settings) : pose_(settings.pose) {}

    Motion at(double) const override {
        return {pose_};
    }

  private:
    Vector6 pose_;
};

bool within(const Motion& motion, const Geometry& geometry, const MotionLimits& limits) {
    const Legs displacement_m = leg_displacement(geometry, motion.pose()).array();
    const Legs speed_m_s = leg_velocity(geometry, motion.pose(), motion.twist()).array().abs();
    return displacement_m.minCoeff() >= limits.stroke_min_m &&
           displacement_m.maxCoeff() <= limits.stroke_max_m && speed_m_s.maxCoeff() <= limits.leg_speed_m_s &&
           speed_m_s.sum() <= limits.speed_sum_m_s;
}

std::unique_ptr<Trajectory> make_multisine(const MultisineMotion& settings, const Geometry& geometry,
                                           const MotionLimits& limits, double duration_s,
                                           std::uint64_t seed) {
    constexpr double shrink_factor = 0.97;
    constexpr int shrinks_max = 200; // down to 0.2 % of the wanted amplitudes
    auto trajectory =
        std::make_unique<MultisineTrajectory>(settings, RandomStream(seed, RandomPurpose::trajectory));
    for (int shrinks = 0; shrinks < shrinks_max; ++shrinks) {
        if (keeps_limits(*trajectory, geometry, limits, duration_s)) {
            return trajectory;
        }
        trajectory->shrink(shrink_factor);
    }
    throw InputError(
        "trajectory: found no multisine inside the limits of stroke, leg speed and flow, expected wider "
        "limits or a lower frequency");
}

// A move is a straight line in q with the speed profile of smooth_step, so a single-move trajectory shows it.
bool move_keeps_limits(const WorkMotion& settings, const Vector6& from, const Vector6& to,
                       const Geometry& geometry, const MotionLimits& limits) {
    const WorkTrajectory move(settings, {from, to});
    return keeps_limits(move, geometry, limits, settings.dwell_s + settings.move_s);
}

std::unique_ptr<Trajectory> make_work(const WorkMotion& settings, const Geometry& geometry,
                                      const MotionLimits& limits, double duration_s, std::uint64_t seed) {
    constexpr int draws_max = 1000;
    RandomStream random(seed, RandomPurpose::trajectory);
    const auto draw = [&] {
        Vector6 target;
        for (int coordinate = 0; coordinate < 6; ++coordinate) {
            const double reach = coordinate < 3 ? settings.reach_m : settings.rotation_deg * rad_per_deg;
            target(coordinate) = random.uniform(-reach, reach);
        }
        return target;
    };
    const auto moves = static_cast<std::size_t>(std::ceil(duration_s / (settings.dwell_s + settings.move_s)));
    std::vector<Vector6> targets{Vector6::Zero()};
    for (int draws = 0; targets.size() < moves + 1; ++draws) {
        const Vector6 target = draw();
        if (move_keeps_limits(settings, targets.back(), target, geometry, limits)) {
            targets.push_back(target);
            draws = 0;
        } else if (draws == draws_max) {
            throw InputError(
                "trajectory: found no target inside the limits of stroke, leg speed and flow, expected a "
                "smaller reach or slower moves");
        }
    }
    return std::make_unique<WorkTrajectory>(settings, std::move(targets));
}

constexpr double looked_at_s = 1e-3; // of a motion: whatever the controller's tick, it is the same

template <typename... Cases> struct Overloaded : Cases... { using Cases::operator()...; };
template <typename... Cases> Overloaded(Cases...) -> Overloaded<Cases...>; // clang 14 does not deduce it

} // namespace

Pose Motion::pose() const {
    return {q.head<3>(), rotation_from_rpy(q.tail<3>())};
}

Twist Motion::twist() const {
    return {rate.head<3>(), rpy_rate_to_angular_velocity(q.tail<3>()) * rate.tail<3>()};
}

bool keeps_limits(const Trajectory& trajectory, const Geometry& geometry, const MotionLimits& limits,
                  double duration_s) {
    const auto ticks = static_cast<std::int64_t>(std::round(duration_s / looked_at_s));
    for (std::int64_t tick = 0; tick <= ticks; ++tick) {
        if (!within(trajectory.at(static_cast<double>(tick) * looked_at_s), geometry, limits)) {
            return false;
        }
    }
    return true;
}

std::unique_ptr<Trajectory> make_trajectory(const TrajectorySettings& settings, const Geometry& geometry,
                                            const MotionLimits& limits, double duration_s,
                                            std::uint64_t seed) {
    using Result = std::unique_ptr<Trajectory>;
    return std::visit(
        Overloaded{
            [](const PaperMotion& paper) -> Result { return std::make_unique<PaperTrajectory>(paper); },
            [&](const MultisineMotion& multisine) {
                return make_multisine(multisine, geometry, limits, duration_s, seed);
            },
            [&](const WorkMotion& work) { return make_work(work, geometry, limits, duration_s, seed); },
            [](const FileMotion& file) -> Result {
                return std::make_unique<FileTrajectory>(read_motion_file(file.path));
            },
            [](const StandstillMotion& still) -> Result {
                return std::make_unique<StandstillTrajectory>(still);
            }},
        settings);
}

} // namespace hexload::sim
