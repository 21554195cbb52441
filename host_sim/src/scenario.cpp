#include <hexload_sim/scenario.hpp>

#include "scenario_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace hexload::sim {
namespace {

enum class MotionKind { paper, multisine, work, file, standstill }; // in the order of TrajectorySettings

constexpr std::array<Choice<MotionKind>, 5> motion_kinds{{{"paper", MotionKind::paper},
                                                          {"multisine", MotionKind::multisine},
                                                          {"work", MotionKind::work},
                                                          {"file", MotionKind::file},
                                                          {"standstill", MotionKind::standstill}}};

TrajectorySettings default_motion(MotionKind kind) {
    switch (kind) {
    case MotionKind::paper:
        return PaperMotion{};
    case MotionKind::multisine:
        return MultisineMotion{};
    case MotionKind::work:
        return WorkMotion{};
    case MotionKind::file:
        return FileMotion{};
    case MotionKind::standstill:
        break;
    }
    return StandstillMotion{};
}

TrajectorySettings read_trajectory(TomlReader table, const std::filesystem::path& folder) {
    MotionKind kind{};
    table.require("kind");
    table.choice("kind", kind, motion_kinds);
    TrajectorySettings settings = default_motion(kind);
    std::visit([&](auto& motion) { visit_motion(table, motion); }, settings);
    if (auto* file = std::get_if<FileMotion>(&settings)) {
        std::string path;
        table.require("path");
        table.text("path", path);
        file->path = folder / path;
    }
    table.refuse_unknown_keys();
    if (const auto* multisine = std::get_if<MultisineMotion>(&settings);
        multisine != nullptr && !(multisine->frequency_min_hz < multisine->frequency_max_hz)) {
        table.fail("frequency_max_hz", fmt::format("{}", multisine->frequency_max_hz),
                   fmt::format("more than frequency_min_hz = {}", multisine->frequency_min_hz));
    }
    return settings;
}

LoadChange read_load_change(TomlReader& table) {
    LoadChange change;
    for (const char* key : {"at_s", "mass_kg"}) {
        table.require(key);
    }
    visit_load_change(table, change);
    table.refuse_unknown_keys();
    if (const auto fault = find_inertia_fault(change.load.inertia_com_kg_m2, InertiaRule::non_negative)) {
        table.fail("inertia_com_kg_m2", *fault, "none negative, none above the sum of the other two");
    }
    if (change.load.mass_kg == 0.0 && !change.load.inertia_com_kg_m2.isZero(0.0)) {
        table.fail("inertia_com_kg_m2", "inertia without mass", "zeros where mass_kg = 0");
    }
    return change;
}

std::vector<LoadChange> read_loads(std::vector<TomlReader> tables) {
    std::vector<LoadChange> loads;
    for (TomlReader& table : tables) {
        const LoadChange change = read_load_change(table);
        if (loads.empty() && change.at_s != 0.0) {
            table.fail("at_s", fmt::format("{}", change.at_s), "0 for the first load");
        }
        if (!loads.empty() && !(change.at_s >= loads.back().at_s + shortest_tick_s)) {
            table.fail("at_s", fmt::format("{}", change.at_s),
                       fmt::format("at least one tick after the load at {} s", loads.back().at_s));
        }
        loads.push_back(change);
    }
    return loads;
}

void check_friction(const TomlReader& actuators, const FrictionSettings& friction) {
    const bool is_coulomb = friction.law == FrictionLaw::coulomb;
    for (int leg = 0; leg < 6; ++leg) {
        const double static_n = friction.static_n(leg);
        if (is_coulomb ? static_n != 0.0 : static_n < friction.coulomb_n(leg)) {
            actuators.fail("static_friction_n", fmt::format("{} in leg {}", static_n, leg + 1),
                           is_coulomb
                               ? "0 where friction_law = \"coulomb\""
                               : fmt::format("at least coulomb_friction_n = {}", friction.coulomb_n(leg)));
        }
    }
}

ElectricSettings read_electric(TomlReader table) {
    ElectricSettings electric;
    visit_electric(table, electric);
    table.refuse_unknown_keys();
    check_friction(table, electric.friction);
    return electric;
}

HydraulicSettings read_hydraulics(TomlReader table) {
    HydraulicSettings hydraulics;
    visit_hydraulics(table, hydraulics);
    table.refuse_unknown_keys();
    if (!(hydraulics.tank_pressure_pa < hydraulics.supply_pressure_pa)) {
        table.fail("tank_pressure_pa", fmt::format("{}", hydraulics.tank_pressure_pa),
                   fmt::format("less than supply_pressure_pa = {}", hydraulics.supply_pressure_pa));
    }
    check_friction(table, hydraulics.friction);
    return hydraulics;
}

toml::table write_trajectory(const TrajectorySettings& settings) {
    TomlWriter writer;
    writer.text("kind", std::string(motion_kinds[settings.index()].name));
    std::visit([&](const auto& motion) { visit_motion(writer, motion); }, settings);
    if (const auto* file = std::get_if<FileMotion>(&settings)) {
        writer.text("path", file->path.string());
    }
    return writer.take();
}

toml::array write_loads(const std::vector<LoadChange>& loads) {
    toml::array tables;
    for (const LoadChange& change : loads) {
        TomlWriter writer;
        visit_load_change(writer, change);
        tables.push_back(writer.take());
    }
    return tables;
}

template <typename Visit> toml::table written(Visit visit) {
    TomlWriter writer;
    visit(writer);
    return writer.take();
}

} // namespace

Scenario load_scenario(const std::filesystem::path& path) {
    const toml::table root = parse_toml_file(path);
    TomlReader reader(path.string(), root);
    Scenario scenario;
    for (const char* key : {"name", "platform", "trajectory"}) {
        reader.require(key);
    }
    reader.text("name", scenario.name);
    reader.text("description", scenario.description);
    std::string platform;
    reader.text("platform", platform);
    scenario.platform = path.parent_path() / platform;

    TomlReader simulation = reader.table("simulation");
    visit_simulation(simulation, scenario);
    simulation.refuse_unknown_keys();
    if (reader.has("load")) {
        scenario.loads = read_loads(reader.tables("load"));
    }
    scenario.trajectory = read_trajectory(reader.table("trajectory"), path.parent_path());
    TomlReader limits = reader.table("limits");
    visit_limits(limits, scenario.limits);
    limits.refuse_unknown_keys();
    TomlReader machine = reader.table("machine");
    visit_machine(machine, scenario.machine);
    machine.refuse_unknown_keys();
    TomlReader legs = reader.table("legs");
    visit_leg_bars(legs, scenario.leg_bars);
    legs.refuse_unknown_keys();
    scenario.hydraulics = read_hydraulics(reader.table("hydraulics"));
    scenario.electric = read_electric(reader.table("electric"));
    TomlReader controller = reader.table("controller");
    scenario.states_servo = controller.has("proportional_1_m") || controller.has("pressure_feedback_1_n");
    visit_controller(controller, scenario.controller);
    controller.refuse_unknown_keys();
    TomlReader sensors = reader.table("sensors");
    visit_sensors(sensors, scenario.sensors);
    sensors.refuse_unknown_keys();
    reader.refuse_unknown_keys();
    return scenario;
}

std::string to_toml(const Scenario& scenario) {
    toml::table root;
    root.insert("name", scenario.name);
    root.insert("description", scenario.description);
    root.insert("platform", scenario.platform.string());
    root.insert("simulation", written([&](TomlWriter& w) { visit_simulation(w, scenario); }));
    root.insert("load", write_loads(scenario.loads));
    root.insert("trajectory", write_trajectory(scenario.trajectory));
    root.insert("limits", written([&](TomlWriter& w) { visit_limits(w, scenario.limits); }));
    root.insert("machine", written([&](TomlWriter& w) { visit_machine(w, scenario.machine); }));
    root.insert("legs", written([&](TomlWriter& w) { visit_leg_bars(w, scenario.leg_bars); }));
    root.insert("hydraulics", written([&](TomlWriter& w) { visit_hydraulics(w, scenario.hydraulics); }));
    root.insert("electric", written([&](TomlWriter& w) { visit_electric(w, scenario.electric); }));
    root.insert("controller", written([&](TomlWriter& w) { visit_controller(w, scenario.controller); }));
    root.insert("sensors", written([&](TomlWriter& w) { visit_sensors(w, scenario.sensors); }));
    std::ostringstream document;
    document << root << '\n';
    return document.str();
}

ActuatorLimits actuator_limits(const Geometry& geometry, const Scenario& scenario) {
    const ElectricSettings& electric = scenario.electric;
    if (electric.exists()) { // each drive has a supply of its own
        return {electric.speed_limit_m_s, electric.stall_force_n(), 6.0 * electric.speed_limit_m_s};
    }
    const HydraulicSettings& oil = scenario.hydraulics;
    return {Hydraulics(oil, geometry.stroke_min_m, geometry.stroke_max_m).speed_gain_m_s(),
            (oil.supply_pressure_pa - oil.tank_pressure_pa) *
                std::min(oil.piston_area_m2, oil.rod_side_area_m2),
            scenario.limits.pump_flow_m3_s / std::max(oil.piston_area_m2, oil.rod_side_area_m2)};
}

MotionLimits motion_limits(const Geometry& geometry, const Scenario& scenario) {
    const LimitSettings& used = scenario.limits;
    const ActuatorLimits limits = actuator_limits(geometry, scenario);
    return {used.stroke_share * geometry.stroke_min_m, used.stroke_share * geometry.stroke_max_m,
            used.valve_share * limits.leg_speed_m_s, limits.speed_sum_m_s};
}

} // namespace hexload::sim
