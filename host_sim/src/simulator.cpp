#include <hexload_sim/simulator.hpp>

#include <hexload_sim/kinematics.hpp>

#include <cmath>

namespace hexload::sim {
namespace {

double speed_gain_m_s(const PlatformFile& platform, const Scenario& scenario) {
    return Hydraulics(scenario.hydraulics, platform.geometry.stroke_min_m, platform.geometry.stroke_max_m)
        .speed_gain_m_s();
}

MassProperties loaded(const PlatformFile& platform, const Load& load) {
    return mass_properties(platform.platform) + mass_properties(load);
}

Legs static_force_n(const PlatformFile& platform, const MassProperties& body, const LegBars& leg_bars) {
    return standing_leg_forces(platform.geometry, body, leg_bars, platform.gravity_m_s2, Pose{}).array();
}

std::uint32_t tick_of(double t_s) {
    return static_cast<std::uint32_t>(std::lround(t_s / tick_s));
}

} // namespace

Simulator::Simulator(const PlatformFile& platform, const Scenario& scenario)
    : platform_(platform), scenario_(scenario),
      trajectory_(make_trajectory(scenario.trajectory, platform.geometry,
                                  motion_limits(platform.geometry, scenario.hydraulics, scenario.limits),
                                  scenario.duration_s, static_cast<std::uint64_t>(scenario.seed))),
      plant_(platform.geometry, platform.gravity_m_s2, scenario.hydraulics,
             static_cast<int>(scenario.substeps), scenario.leg_bars),
      controller_(scenario.controller, speed_gain_m_s(platform, scenario),
                  static_force_n(platform, body_at_start(), scenario.leg_bars)),
      sensors_(scenario.sensors, platform.sensors, static_cast<std::uint64_t>(scenario.seed)),
      ticks_(tick_of(scenario.duration_s) + 1) {
    plant_.reset(trajectory_->at(0.0).pose(), body_at_start());
    controller_.hold(plant_.state().hydraulics.spool, plant_.legs().force_n);
}

MassProperties Simulator::body_at_start() const {
    return loaded(platform_, scenario_.loads.front().load);
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
    tick.sample = sensors_.sample(tick_, tick.legs);
    plant_.advance(controller_.step(leg_reference(tick.reference), tick.legs));
    ++tick_;
    return tick;
}

void Simulator::change_load() {
    if (next_load_ < scenario_.loads.size() && tick_ >= tick_of(scenario_.loads[next_load_].at_s)) {
        plant_.set_body(loaded(platform_, scenario_.loads[next_load_].load));
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
