// The loop of the paper's Figure 4, tick by tick: trajectory -> controller -> hydraulics and mechanics ->
// sensors.
#pragma once

#include <hexload_sim/controller.hpp>
#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/pacer.hpp>
#include <hexload_sim/plant.hpp>
#include <hexload_sim/scenario.hpp>
#include <hexload_sim/sensors.hpp>
#include <hexload_sim/trajectory.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hexload::sim {

// All there is to know about one tick.
struct Tick {
    std::uint32_t index = 0;
    double t_s = 0.0;
    Motion reference;
    Pose pose;                       // truth
    Twist twist;                     // truth
    LegState legs;                   // truth: neither sensor errors nor low-passes
    std::optional<LegSample> sample; // what the estimator sees; nothing: lost
};

// Of a leg, 1 to 6, from a time on.
struct LegSensorFault {
    double at_s = 0.0;
    int leg = 0;
    SensorFault fault;
};

class Simulator {
  public:
    // At rest, in static equilibrium with the first load at the trajectory's first pose. Throws InputError
    // for a motion that cannot be made or started.
    Simulator(const PlatformFile& platform, const Scenario& scenario);
    Simulator(const Simulator&) = delete; // controller and trajectory belong to this plant
    Simulator& operator=(const Simulator&) = delete;

    // From sample to sample, the platform file's.
    double tick_s() const {
        return tick_s_;
    }

    // Ticks of the whole run, from 0 s to duration_s inclusive.
    std::uint32_t ticks() const {
        return ticks_;
    }

    // The run has as many ticks as have been made.
    void end_now() {
        ticks_ = tick_;
    }

    // Samples this instant, then moves the plant to the next tick.
    Tick step();

    const Plant& plant() const {
        return plant_;
    }
    const SensorSigma& sensor_sigma() const {
        return sensors_.sigma();
    }
    MassProperties body_at_start() const;

    // The machine that stands there; the platform file is what is known of it.
    const Machine& machine() const {
        return machine_;
    }

    // The load that the platform carries in the tick that step() returned last.
    const Load& load() const {
        return scenario_.loads[next_load_ - 1].load;
    }

    // From the next tick on; returns its time in s. A change that the scenario has for later comes all the
    // same.
    double set_load(const Load& load);

    // Likewise, of a leg, 1 to 6.
    double set_sensor_fault(int leg, const SensorFault& fault);

    // The scenario's, and those of set_load().
    const std::vector<LoadChange>& loads() const {
        return scenario_.loads;
    }
    const std::vector<LegSensorFault>& sensor_faults() const {
        return sensor_faults_;
    }

  private:
    std::uint32_t tick_at(double t_s) const;
    void refuse_hasty_loads() const;
    void change_load();
    void advance(int step, const Legs& command);
    void watch(double delay_s, std::optional<std::size_t>& glimpse);
    Pose start_pose() const;
    LegState transducers(const LegState& legs) const;
    LegReference leg_reference(const Motion& motion) const;

    PlatformFile platform_;
    Scenario scenario_;
    Machine machine_;
    std::unique_ptr<Trajectory> trajectory_;
    double tick_s_;
    int servo_steps_; // of a tick
    double step_s_;   // of the servo
    Plant plant_;
    Controller controller_;
    Sensors sensors_;
    std::uint32_t ticks_;
    std::uint32_t tick_ = 0;
    std::size_t next_load_ = 1;
    std::vector<LegSensorFault> sensor_faults_;
    std::vector<Glimpse> glimpses_; // of the tick before, for channels late by a fraction of a tick
    std::optional<std::size_t> force_glimpse_;
    std::optional<std::size_t> velocity_glimpse_;
};

struct RunCounts {
    std::uint32_t ticks = 0;
    std::uint32_t missing = 0; // samples lost by the sensors
    std::uint32_t refused = 0; // samples refused by the estimator
};

// Called after each tick with the estimates that came in it.
using TickObserver = std::function<void(const Tick&, std::span<const EstimateRow>)>;

// Runs the whole scenario in closed loop. Without a link (nullptr) the plant runs alone; the observer may be
// empty. Without a pacer (nullptr) ticks follow each other as fast as they are done. Neither starts nor
// finishes the link. Throws LinkError.
RunCounts run(Simulator& simulator, EstimatorLink* link, const TickObserver& observer = {},
              Pacer* pacer = nullptr);

} // namespace hexload::sim
