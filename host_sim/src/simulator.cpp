#include <hexload_sim/simulator.hpp>

#include "platform_file/input_error.hpp"

#include <hexload_sim/kinematics.hpp>

#include <algorithm>
#include <cmath>

namespace hexload::sim {
namespace {

double speed_gain_m_s(const PlatformFile& platform, const Scenario& scenario) {
    return Hydraulics(scenario.hydraulics, platform.geometry.stroke_min_m, platform.geometry.stroke_max_m)
        .speed_gain_m_s();
}

MassProperties loaded(const Machine& machine, const Load& load) {
    return mass_properties(machine.platform) + mass_properties(load);
}

Legs static_force_n(const Machine& machine, const MassProperties& body, const SixLegBars& leg_bars) {
    return standing_leg_forces(machine.geometry, body, leg_bars, machine.gravity, Pose{}).array();
}

std::uint32_t tick_of(double t_s) {
    return static_cast<std::uint32_t>(std::lround(t_s / tick_s));
}

} // namespace

Simulator::Simulator(const PlatformFile& platform, const Scenario& scenario)
    : platform_(platform), scenario_(scenario), machine_(true_machine(platform, scenario.machine)),
      trajectory_(make_trajectory(scenario.trajectory, platform.geometry,
                                  motion_limits(platform.geometry, scenario.hydraulics, scenario.limits),
                                  scenario.duration_s, static_cast<std::uint64_t>(scenario.seed))),
      plant_(machine_.geometry, machine_.gravity, scenario.hydraulics, static_cast<int>(scenario.substeps),
             scenario.leg_bars, scenario.sensors.low_passes),
      controller_(scenario.controller, speed_gain_m_s(platform, scenario),
                  static_force_n(machine_, body_at_start(), scenario.leg_bars)),
      sensors_(scenario.sensors, platform.sensors, static_cast<std::uint64_t>(scenario.seed)),
      ticks_(tick_of(scenario.duration_s) + 1) {
    plant_.reset(start_pose(), body_at_start());
    controller_.hold(plant_.state().hydraulics.spool, plant_.legs().force_n);
    watch(scenario.sensors.force_delay_s, force_glimpse_);
    watch(scenario.sensors.velocity_delay_s, velocity_glimpse_);
}

void Simulator::watch(double delay_s, std::optional<std::size_t>& glimpse) {
    if (const double ago = delay_of(delay_s).share; ago > 0.0) {
        glimpse = glimpses_.size();
        glimpses_.push_back({1.0 - ago, plant_.transducers(plant_.legs())});
    }
}

// Where the servo, which knows the nominal hinges, would have brought the platform.
Pose Simulator::start_pose() const {
    const Pose wanted = trajectory_->at(0.0).pose();
    if (!scenario_.machine.has_hinge_errors()) {
        return wanted;
    }
    const auto found =
        forward_kinematics(machine_.geometry, leg_displacement(platform_.geometry, wanted), wanted);
    if (!found) {
        throw InputError(
            "machine: found hinge errors with which the legs do not meet the first pose, expected "
            "smaller ones");
    }
    return *found;
}

LegState Simulator::transducers(const LegState& legs) const {
    LegState seen = plant_.transducers(legs);
    if (force_glimpse_) {
        seen.force_n = glimpses_[*force_glimpse_].transducers.force_n;
    }
    if (velocity_glimpse_) {
        seen.velocity_m_s = glimpses_[*velocity_glimpse_].transducers.velocity_m_s;
    }
    return seen;
}

MassProperties Simulator::body_at_start() const {
    return loaded(machine_, scenario_.loads.front().load);
}

Tick Simulator::step() {
    change_load();
    Tick tick;
    tick.index = tick_;
    tick.t_s = static_cast<double>(tick_) / 1000.0;
    tick.reference = trajectory_->at(tick.t_s);
    tick.pose = plant_.pose();
    tick.twist = plant_.twist();
    tick.legs = plant_.legs();
    tick.sample = sensors_.sample(tick_, transducers(tick.legs));
    const LegState& measured = scenario_.controller.reads_sensors ? sensors_.reading() : tick.legs;
    plant_.advance(controller_.step(leg_reference(tick.reference), measured), glimpses_);
    ++tick_;
    return tick;
}

double Simulator::set_load(const Load& load) {
    const double at_s = static_cast<double>(tick_) / 1000.0;
    const auto next = scenario_.loads.begin() + static_cast<std::ptrdiff_t>(next_load_);
    const auto later = std::find_if(next, scenario_.loads.end(),
                                    [at_s](const LoadChange& change) { return change.at_s > at_s; });
    scenario_.loads.insert(later, {at_s, load});
    return at_s;
}

double Simulator::set_sensor_fault(int leg, const SensorFault& fault) {
    const double at_s = static_cast<double>(tick_) / 1000.0;
    sensors_.set_fault(leg - 1, fault);
    sensor_faults_.push_back({at_s, leg, fault});
    return at_s;
}

void Simulator::change_load() {
    if (next_load_ < scenario_.loads.size() && tick_ >= tick_of(scenario_.loads[next_load_].at_s)) {
        plant_.set_body(loaded(machine_, scenario_.loads[next_load_].load));
        ++next_load_;
    }
}

LegReference Simulator::leg_reference(const Motion& motion) const {
    const LegVectors legs = leg_vectors(platform_.geometry, motion.pose());
    return {(legs.length_m - platform_.geometry.home_leg_length_m).array(),
            (jacobian(legs) * motion.twist().stacked()).array()};
}

RunCounts run(Simulator& simulator, EstimatorLink* link, const TickObserver& observer, Pacer* pacer) {
    RunCounts counts;
    while (counts.ticks < simulator.ticks()) {
        const Tick tick = simulator.step();
        if (pacer != nullptr) {
            pacer->wait(); // with the sample ready, so that it leaves on time
        }
        ++counts.ticks;
        std::span<const EstimateRow> estimates;
        if (!tick.sample) {
            ++counts.missing;
        } else if (link != nullptr) {
            estimates = link->step(*tick.sample);
        }
        if (observer) {
            observer(tick, estimates);
        }
    }
    counts.refused = link != nullptr ? link->refused() : 0;
    return counts;
}

} // namespace hexload::sim
