#include "lcm_plant_commands.hpp"

#include "platform_file/mass_properties.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace hexload::sim {
namespace {

Load load_of(const plant_command_t& command) {
    const double* entries = command.inertia_kg_m2;
    Load load;
    load.mass_kg = command.mass_kg;
    load.com_m = Vector3(command.com_m);
    load.inertia_com_kg_m2 << entries[0], entries[3], entries[4], //
        entries[3], entries[1], entries[5],                       //
        entries[4], entries[5], entries[2];
    return load;
}

} // namespace

LcmPlantCommands::LcmPlantCommands(const std::string& url, Simulator& simulator,
                                   std::function<void(const std::string&)> report)
    : session_(url), simulator_(simulator), report_(std::move(report)) {
    session_.subscribe<plant_command_t>([this](const plant_command_t& command) { take(command); });
}

void LcmPlantCommands::take() {
    while (session_.handle(std::chrono::milliseconds{0})) {
    }
}

void LcmPlantCommands::take(const plant_command_t& command) {
    switch (command.kind) {
    case plant_command_t::SET_LOAD:
        report_(set_load(command));
        break;
    case plant_command_t::SENSOR_FAULT:
        report_(set_sensor_fault(command));
        break;
    default:
        report_(fmt::format("command refused: found kind {}, expected 1 or 2", command.kind));
    }
}

std::string LcmPlantCommands::set_load(const plant_command_t& command) {
    const Load load = load_of(command);
    if (!std::isfinite(load.mass_kg) || load.mass_kg < 0.0 || !load.com_m.allFinite() ||
        !load.inertia_com_kg_m2.allFinite()) {
        return fmt::format("load refused: found {} kg, expected numbers, and no negative mass", load.mass_kg);
    }
    if (const auto fault =
            platform::find_inertia_fault(load.inertia_com_kg_m2, platform::InertiaRule::non_negative)) {
        return fmt::format("load refused: inertia: {}", *fault);
    }
    if (load.mass_kg == 0.0 && !load.inertia_com_kg_m2.isZero(0.0)) {
        return "load refused: found inertia without mass";
    }
    return fmt::format("a load of {:g} kg from {:.3f} s on, by command", load.mass_kg,
                       simulator_.set_load(load));
}

std::string LcmPlantCommands::set_sensor_fault(const plant_command_t& command) {
    if (command.leg < 1 || command.leg > 6 || !std::isfinite(command.force_offset_n)) {
        return fmt::format("sensor fault refused: found leg {} with {} N, expected 1 to 6 and a number",
                           command.leg, command.force_offset_n);
    }
    const SensorFault fault{command.force_offset_n, command.velocity_negated != 0};
    return fmt::format("leg {}: force sensor {:+g} N, velocity {} from {:.3f} s on, by command", command.leg,
                       fault.force_offset_n, fault.velocity_negated ? "negated" : "right",
                       simulator_.set_sensor_fault(command.leg, fault));
}

} // namespace hexload::sim
