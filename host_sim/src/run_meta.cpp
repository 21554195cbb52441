#include "run_meta.hpp"

#include "scenario_fields.hpp"

#include "platform_file/tare.hpp"

#include <hexload_sim/dynamics.hpp>

#include <sstream>

namespace hexload::sim {
namespace {

toml::array rows(const Matrix6& matrix) {
    toml::array array;
    for (int row = 0; row < 6; ++row) {
        toml::array entries;
        for (int column = 0; column < 6; ++column) {
            entries.push_back(matrix(row, column) + 0.0); // no negative zeros
        }
        array.push_back(std::move(entries));
    }
    return array;
}

toml::table load_change(const LoadChange& change) {
    TomlWriter writer;
    writer.number("at_s", change.at_s);
    writer.number("mass_kg", change.load.mass_kg);
    writer.vector3("com_m", change.load.com_m);
    writer.tensor("inertia_com_kg_m2", change.load.inertia_com_kg_m2);
    toml::table table = writer.take();
    toml::array theta;
    for (const double entry : change.load.theta()) {
        theta.push_back(entry);
    }
    table.insert("theta", std::move(theta));
    return table;
}

toml::array load_changes(const std::vector<LoadChange>& loads) {
    toml::array array;
    for (const LoadChange& change : loads) {
        array.push_back(load_change(change));
    }
    return array;
}

// What commissioning would have to find: the machine that stands there, its legs and sensors.
toml::table rig(const Scenario& scenario, const Machine& machine) {
    TomlWriter writer;
    writer.vector3("gravity_m_s2", Vector3::Zero() - machine.gravity.up_m_s2);
    writer.points("base_hinges_m", machine.geometry.base_hinges_m);
    writer.points("platform_hinges_m", machine.geometry.platform_hinges_m);
    const Vector10 theta = theta_of(machine.platform);
    writer.numbers("platform_theta", {theta.data(), 10});
    visit_leg_bars(writer, scenario.leg_bars);
    visit_friction(writer,
                   scenario.electric.exists() ? scenario.electric.friction : scenario.hydraulics.friction);
    visit_sensors(writer, scenario.sensors);
    return writer.take();
}

toml::table sensor_sigma(const SensorSigma& sigma) {
    return toml::table{{"displacement_sigma_m", sigma.displacement_sigma_m},
                       {"velocity_sigma_m_s", sigma.velocity_sigma_m_s},
                       {"force_sigma_n", sigma.force_sigma_n}};
}

toml::table health_ticks(const std::vector<HealthCount>& health) {
    toml::table table;
    for (const HealthCount& count : health) {
        table.insert(count.name, static_cast<std::int64_t>(count.ticks));
    }
    return table;
}

toml::array times(const std::vector<double>& times_s) {
    toml::array array;
    for (const double time_s : times_s) {
        array.push_back(time_s);
    }
    return array;
}

toml::array input_faults(const std::vector<InputFault>& faults) {
    toml::array array;
    for (const InputFault& fault : faults) {
        array.push_back(toml::table{{"t_s", fault.t_s}, {"fault", fault.words}});
    }
    return array;
}

// Of commands during the run.
toml::array sensor_faults(const std::vector<LegSensorFault>& faults) {
    toml::array array;
    for (const LegSensorFault& fault : faults) {
        array.push_back(toml::table{{"at_s", fault.at_s},
                                    {"leg", fault.leg},
                                    {"force_offset_n", fault.fault.force_offset_n},
                                    {"velocity_negated", fault.fault.velocity_negated}});
    }
    return array;
}

std::int64_t whole(std::uint64_t count) {
    return static_cast<std::int64_t>(count);
}

// Frames are counted only in real time: commands and status pages go by the clock.
toml::table bus(const std::optional<BusCounts>& bus, Pacing pacing) {
    if (!bus) {
        return toml::table{{"name", "inproc"}};
    }
    toml::table table{
        {"name", bus->name},
        {"profile", bus->profile},
        {"samples", whole(bus->samples)},
        {"unsent", whole(bus->unsent)},
        {"saturated", whole(bus->saturated)},
        {"answers_expected", whole(bus->expected)},
        {"answers", whole(bus->answers)},
        {"answers_missing", whole(bus->missing)},
        {"answers_late", whole(bus->late)},
        {"rejoins", whole(bus->rejoins)},
        {"outages", whole(bus->outages)},
        {"events_missing", whole(bus->events_missing)},
    };
    if (pacing == Pacing::real_time) {
        table.insert("frames_sent", whole(bus->frames_sent));
        table.insert("frames_received", whole(bus->frames_received));
        table.insert("frames_refused", whole(bus->refused));
        table.insert("send_retries", whole(bus->send_retries));
        table.insert("send_failures", whole(bus->send_failures));
        table.insert("receive_drops", whole(bus->receive_drops));
        table.insert("error_frames", whole(bus->error_frames));
    }
    return table;
}

toml::table quantiles_us(const DurationHistogram& histogram) {
    return toml::table{{"p50", histogram.quantile_us(0.5)},
                       {"p90", histogram.quantile_us(0.9)},
                       {"p99", histogram.quantile_us(0.99)},
                       {"p99_9", histogram.quantile_us(0.999)},
                       {"max", histogram.longest_us()}};
}

toml::table pacing(const PacingResult& result) {
    toml::table table{{"mode", name_of(result.mode)}};
    if (result.counts != nullptr) {
        table.insert("periods", whole(result.counts->periods));
        table.insert("overruns", whole(result.counts->overruns));
        table.insert("lateness_us", quantiles_us(result.counts->lateness));
        table.insert("work_us", quantiles_us(result.counts->work));
        table.insert("real_time_priority", result.has_priority);
        table.insert("locked_memory", result.has_locked_memory);
    }
    return table;
}

} // namespace

std::string run_meta_json(const Scenario& scenario, const PlatformFile& platform, const Simulator& simulator,
                          const RunResult& result) {
    const MassProperties body = simulator.body_at_start();
    const Matrix3 home = Matrix3::Identity();
    const toml::table meta{
        {"name", scenario.name},
        {"description", scenario.description},
        {"version", HEXLOAD_VERSION},
        {"seed", scenario.seed},
        {"duration_s", scenario.duration_s},
        {"tick_s", platform.sensors.tick_s},
        {"substeps", scenario.substeps},
        {"rows", whole(result.counts.ticks - result.counts.missing)},
        {"missing", whole(result.counts.missing)},
        {"refused", whole(result.counts.refused)},
        {"loads", load_changes(simulator.loads())},
        {"rig", rig(scenario, simulator.machine())},
        {"sensors", sensor_sigma(simulator.sensor_sigma())},
        {"mass_matrix_home", rows(mass_matrix(body, home))},
        {"coupling_matrix_home", rows(coupling_matrix(body, home))},
        {"estimator", toml::table{{"kind", name_of(platform.estimator.kind)},
                                  {"prior", name_of(platform.estimator.prior)}}},
        {"health_ticks", health_ticks(result.health)},
        {"load_changes_detected_s", times(result.load_changes_s)},
        {"input_faults", input_faults(result.input_faults)},
        {"sensor_faults", sensor_faults(simulator.sensor_faults())},
        {"bus", bus(result.bus, result.pacing.mode)},
        {"pacing", pacing(result.pacing)},
    };
    std::ostringstream document;
    document << toml::json_formatter{meta} << '\n';
    return document.str();
}

} // namespace hexload::sim
