#include <hexload_sim/simulator.hpp>

#include "platform_file/input_error.hpp"

#include <hexload_sim/kinematics.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexload::sim {
namespace {

MassProperties loaded(const Machine& machine, const Load& load) {
    return mass_properties(machine.platform) + mass_properties(load);
}

Legs static_force_n(const Machine& machine, const MassProperties& body, const SixLegBars& leg_bars) {
    return standing_leg_forces(machine.geometry, body, leg_bars, machine.gravity, Pose{}).array();
}

int servo_steps(const Scenario& scenario, double tick_s) {
    return scenario.controller.reads_sensors
               ? 1
               : std::max(1, static_cast<int>(std::ceil(tick_s / servo_s - 1e-9)));
}

// RK4 steps of a servo step, of which a scenario has so many per millisecond.
int substeps_of(const Scenario& scenario, double step_s) {
    const double steps = static_cast<double>(scenario.substeps) * (step_s / 1e-3);
    return std::max(1, static_cast<int>(std::ceil(steps - 1e-9)));
}

std::uint32_t ticks_of_run(const Scenario& scenario, double tick_s) {
    const double ticks = std::round(scenario.duration_s / tick_s) + 1.0;
    if (ticks > std::numeric_limits<std::uint32_t>::max()) {
        throw InputError(
            fmt::format("simulation.duration_s: found {:g} s of ticks of {:g} s, expected at most 2^32 ticks",
                        scenario.duration_s, tick_s));
    }
    return static_cast<std::uint32_t>(ticks);
}

} // namespace

Simulator::Simulator(const PlatformFile& platform, const Scenario& scenario)
    : platform_(platform), scenario_(scenario), machine_(true_machine(platform, scenario.machine)),
      trajectory_(make_trajectory(scenario.trajectory, platform.geometry,
                                  motion_limits(platform.geometry, scenario), scenario.duration_s,
                                  static_cast<std::uint64_t>(scenario.seed))),
      tick_s_(platform.sensors.tick_s), servo_steps_(servo_steps(scenario, tick_s_)),
      step_s_(tick_s_ / servo_steps_),
      plant_(machine_.geometry, machine_.gravity, scenario.hydraulics, substeps_of(scenario, step_s_),
             scenario.leg_bars, scenario.sensors.low_passes, step_s_, scenario.electric),
      controller_(scenario.controller, actuator_limits(platform.geometry, scenario).leg_speed_m_s,
                  static_force_n(machine_, body_at_start(), scenario.leg_bars), step_s_),
      sensors_(scenario.sensors, platform.sensors, static_cast<std::uint64_t>(scenario.seed)),
      ticks_(ticks_of_run(scenario, tick_s_)) {
    refuse_hasty_loads();
    plant_.reset(start_pose(), body_at_start());
    controller_.hold(plant_.state().hydraulics.spool, plant_.legs().force_n);
    watch(scenario.sensors.force_delay_s, force_glimpse_);
    watch(scenario.sensors.velocity_delay_s, velocity_glimpse_);
}

std::uint32_t Simulator::tick_at(double t_s) const {
    return static_cast<std::uint32_t>(std::lround(t_s / tick_s_));
}

void Simulator::refuse_hasty_loads() const {
    for (std::size_t n = 1; n < scenario_.loads.size(); ++n) {
        const double before_s = scenario_.loads[n - 1].at_s;
        if (tick_at(scenario_.loads[n].at_s) <= tick_at(before_s)) {
            throw InputError(fmt::format(
                "load[{}].at_s: found {}, expected at least one tick of {:g} s after the load at {} s", n,
                scenario_.loads[n].at_s, tick_s_, before_s));
        }
    }
}

void Simulator::watch(double delay_s, std::optional<std::size_t>& glimpse) {
    if (const double ago = delay_of(delay_s, tick_s_).share; ago > 0.0) {
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
    tick.t_s = time_of_tick_s(tick_, tick_s_);
    tick.reference = trajectory_->at(tick.t_s);
    tick.pose = plant_.pose();
    tick.twist = plant_.twist();
    tick.legs = plant_.legs();
    tick.sample = sensors_.sample(tick_, transducers(tick.legs));
    const LegState& measured = scenario_.controller.reads_sensors ? sensors_.reading() : tick.legs;
    advance(0, controller_.step(leg_reference(tick.reference), measured));
    for (int step = 1; step < servo_steps_; ++step) {
        const Motion reference = trajectory_->at(tick.t_s + step * step_s_);
        advance(step, controller_.step(leg_reference(reference), plant_.legs()));
    }
    ++tick_;
    return tick;
}

// Glimpses are of a tick, the plant's of a step of the servo.
void Simulator::advance(int step, const Legs& command) {
    if (servo_steps_ == 1) {
        plant_.advance(command, glimpses_);
        return;
    }
    std::vector<Glimpse> now;
    std::vector<Glimpse*> whose;
    for (Glimpse& each : glimpses_) {
        const double passed = each.share * servo_steps_;
        if (std::min(static_cast<int>(passed), servo_steps_ - 1) == step) {
            now.push_back({passed - step, {}});
            whose.push_back(&each);
        }
    }
    plant_.advance(command, now);
    for (std::size_t n = 0; n < now.size(); ++n) {
        whose[n]->transducers = now[n].transducers;
    }
}

double Simulator::set_load(const Load& load) {
    const double at_s = time_of_tick_s(tick_, tick_s_);
    const auto next = scenario_.loads.begin() + static_cast<std::ptrdiff_t>(next_load_);
    const auto later = std::find_if(next, scenario_.loads.end(),
                                    [at_s](const LoadChange& change) { return change.at_s > at_s; });
    scenario_.loads.insert(later, {at_s, load});
    return at_s;
}

double Simulator::set_sensor_fault(int leg, const SensorFault& fault) {
    const double at_s = time_of_tick_s(tick_, tick_s_);
    sensors_.set_fault(leg - 1, fault);
    sensor_faults_.push_back({at_s, leg, fault});
    return at_s;
}

void Simulator::change_load() {
    if (next_load_ < scenario_.loads.size() && tick_ >= tick_at(scenario_.loads[next_load_].at_s)) {
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
