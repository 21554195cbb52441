#include "support.hpp"

#include "platform_file/input_error.hpp"
#include <hexload_sim/trajectory.hpp>

#include <array>
#include <string>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

const std::string platform_text = R"([geometry]
base_hinges_m = [[0.6, 0.1, 0], [-0.2, 0.56, 0], [-0.4, 0.46, 0], [-0.4, -0.46, 0], [-0.2, -0.56, 0], [0.6, -0.1, 0]]
platform_hinges_m = [[0.28, 0.28, 0], [0.1, 0.39, 0], [-0.39, 0.1, 0], [-0.39, -0.1, 0], [0.1, -0.39, 0], [0.28, -0.28, 0]]
home_leg_length_m = 0.87
stroke_m = [-0.3, 0.3]
[platform]
mass_kg = 100.0
com_m = [0.0, 0.0, 0.0]
inertia_kg_m2 = [25.0, 25.0, 44.0, 0.0, 0.0, 0.0]
[environment]
gravity_m_s2 = 9.81
[sensors]
displacement_sigma_m = 20e-6
velocity_sigma_m_s = 1e-3
force_sigma_n = 5.0
[load]
known_mass_kg = 500.0
[estimator]
kind = "paper"
)";

const std::string scenario_text = R"(name = "test"
platform = "platform.toml"
[simulation]
duration_s = 1.0
[[load]]
at_s = 0.0
mass_kg = 500.0
inertia_com_kg_m2 = [25.0, 25.0, 25.0, 0.0, 0.0, 0.0]
[[load]]
at_s = 0.5
mass_kg = 100.0
[trajectory]
kind = "multisine"
[hydraulics]
supply_pressure_pa = 21e6
[sensors]
delay_ticks = 1
)";

// One edit of a good file, and the message that must follow the file's name.
struct Refusal {
    std::string good;
    std::string bad;
    std::string message;
};

std::string edited(const std::string& text, const Refusal& refusal) {
    const std::size_t position = text.find(refusal.good);
    REQUIRE(position != std::string::npos);
    return std::string(text).replace(position, refusal.good.size(), refusal.bad);
}

template <typename Load> std::string message_of(Load load, const std::filesystem::path& path) {
    try {
        load(path);
    } catch (const InputError& error) {
        const std::string message = error.what();
        REQUIRE(message.rfind(path.string() + ":", 0) == 0);
        return message.substr(path.string().size() + 1);
    }
    return "accepted";
}

const std::array<Refusal, 28> platform_refusals{{
    {"kind = \"paper\"", "kind = \"papre\"",
     R"(19: estimator.kind: found "papre", expected one of "momentum", "momentum_effects", "paper")"},
    {"kind = \"paper\"", "prior = \"wide\"",
     R"(19: estimator.prior: found "wide", expected one of "safe", "printed")"},
    {"kind = \"paper\"", "filter = \"paper\"",
     "19: estimator.filter: found an unknown key, expected one of bias_sigma_n, coulomb_sigma_n, "
     "friction_speed_m_s, from_known_mass, kind, prior, tilt_sigma_rad, viscous_sigma_n_s_m"},
    {"kind = \"paper\"", "kindd = \"paper\"",
     "19: estimator.kindd: found an unknown key, did you mean estimator.kind?"},
    {"[estimator]", "[estimater]", "18: estimater: found an unknown key, did you mean estimator?"},
    {"[sensors]", "[sensor]", "12: sensor: found an unknown key, did you mean sensors?"},
    {"force_sigma_n =", "force_sigma =",
     "15: sensors.force_sigma: found an unknown key, did you mean sensors.force_sigma_n?"},
    {"velocity_sigma_m_s =", "velocity_sigma_mm_s =",
     "14: sensors.velocity_sigma_mm_s: found an unknown key, did you mean sensors.velocity_sigma_m_s?"},
    {"velocity_sigma_m_s = 1e-3", "velocity = true",
     "12: sensors.velocity_sigma_m_s: found nothing, expected this key"},
    {"[load]",
     "# Pr\xc3\xbc"
     "fstand\n# Pr\xfc"
     "fstand\n[load]",
     "17: found byte 0xfc, which is no UTF-8 but may be Latin-1, expected UTF-8: iconv -f latin1 -t utf-8 "
     "p.toml > utf8-p.toml"},
    {"[geometry]", "\xff\xfe[geometry]",
     "1: found text in UTF-16, expected UTF-8: iconv -f utf-16 -t utf-8 p.toml > utf8-p.toml"},
    {"[load]", "[actuators]\nleg_force_n = 0\n[load]",
     "17: actuators.leg_force_n: found 0, expected N, from 0.001 to 1e8"},
    {"mass_kg = 100.0", "mass_kg = \"100\"",
     R"(7: platform.mass_kg: found "100", expected kg, from 0.001 to 100000)"},
    {"mass_kg = 100.0", "mass_kg = -100.0",
     "7: platform.mass_kg: found -100.0, expected kg, from 0.001 to 100000"},
    {"mass_kg = 100.0", "mass_kg = nan", "7: platform.mass_kg: found nan, expected kg, from 0.001 to 100000"},
    {"mass_kg = 100.0", "", "6: platform.mass_kg: found nothing, expected this key"},
    {"com_m = [0.0, 0.0, 0.0]", "com_m = [0.0, 0.0]",
     "8: platform.com_m: found an array of 2, expected an array of 3"},
    {"com_m = [0.0, 0.0, 0.0]", "com_m = [0.0, true, 0.0]",
     "8: platform.com_m[1]: found true, expected m, from -20 to 20 (not mm)"},
    {"inertia_kg_m2 = [25.0, 25.0, 44.0,", "inertia_kg_m2 = [25.0, 25.0, 54.0,",
     "9: platform.inertia_kg_m2: found principal moments 25, 25, 54 kg m^2 about the centre of mass, "
     "expected all "
     "positive, none above the sum of the other two"},
    {"com_m = [0.0, 0.0, 0.0]", "com_m = [0.0, 0.0, 0.6]",
     "9: platform.inertia_kg_m2: found principal moments -11, -11, 44 kg m^2 about the centre of mass, "
     "expected all "
     "positive, none above the sum of the other two"},
    {"known_mass_kg = 500.0", "known_mass_kg = -1",
     "17: load.known_mass_kg: found -1, expected kg, from 0.001 to 1e6; of an unknown load no such key"},
    {"force_sigma_n = 5.0", "force_sigma_n = 0.0",
     "15: sensors.force_sigma_n: found 0.0, expected N, from 1e-6 to 1e5"},
    {"stroke_m = [-0.3, 0.3]", "stroke_m = [0.3, -0.3]",
     "5: geometry.stroke_m: found [0.3, -0.3], expected [min, max] with min < max"},
    {"stroke_m = [-0.3, 0.3]", "stroke_m = [0.1, 0.3]",
     "5: geometry.stroke_m: found leg 1 at 0.00402205 m in the home pose, expected home inside (0.1, 0.3) m, "
     "displacements from the home length"},
    {"home_leg_length_m = 0.87", "home_leg_length_m = 0.1",
     "4: geometry.home_leg_length_m: found mean length 0.1 m, too short to reach from base to platform "
     "hinges, "
     "expected legs that can be assembled at home"},
    {"home_leg_length_m = 0.87", "home_leg_length_m = [0.87, 0.87]",
     "4: geometry.home_leg_length_m: found an array of 2, expected an array of 6"},
    {"[0.28, 0.28, 0], [0.1,", "[0.28, 0.28], [0.1,",
     "3: geometry.platform_hinges_m[0]: found an array of 2, expected an array of 3"},
    {"[[0.28, 0.28, 0], [0.1, 0.39, 0], [-0.39, 0.1, 0], [-0.39, -0.1, 0], [0.1, -0.39, 0], [0.28, -0.28, "
     "0]]",
     "[[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0], [0.4, 0, 0], [0.5, 0, 0]]",
     "3: geometry.platform_hinges_m: found six hinges on one line, expected hinges that span a plane"},
}};

const std::array<Refusal, 27> scenario_refusals{{
    {"kind = \"multisine\"", "kind = \"sine\"",
     R"(13: trajectory.kind: found "sine", expected one of "paper", "multisine", "work", "file", "standstill")"},
    {"kind = \"multisine\"", "run_in_s = 1.0", "12: trajectory.kind: found nothing, expected this key"},
    {"kind = \"multisine\"", "kind = \"paper\"\nsines = 3",
     "14: trajectory.sines: found an unknown key, expected one of amplitude_x_m, amplitude_y_m, "
     "amplitude_yaw_deg, "
     "frequency_hz, kind, run_in_s"},
    {"kind = \"multisine\"", "kind = \"multisine\"\nfrequency_max_hz = 0.1",
     "14: trajectory.frequency_max_hz: found 0.1, expected more than frequency_min_hz = 0.2"},
    {"kind = \"multisine\"", "kind = \"multisine\"\nsines = 2.5",
     "14: trajectory.sines: found 2.5, expected a whole number from 1 to 1000"},
    {"kind = \"multisine\"", "kind = \"file\"", "12: trajectory.path: found nothing, expected this key"},
    {"name = \"test\"", "", "1: name: found nothing, expected this key"},
    {"name = \"test\"", "name = \"test\"\ncolour = 3",
     "2: colour: found an unknown key, expected one of controller, description, electric, hydraulics, legs, "
     "limits, "
     "load, "
     "machine, name, "
     "platform, sensors, simulation, trajectory"},
    {"name = \"test\"", "name = ", "1: Error while parsing key-value pair"},
    {"duration_s = 1.0", "duration_s = 0", "4: simulation.duration_s: found 0, expected 0.001 to 4e6 s"},
    {"duration_s = 1.0", "substeps = 0",
     "4: simulation.substeps: found 0, expected a whole number from 1 to 1000"},
    {"mass_kg = 500.0", "mass_kg = -1.0", "7: load[0].mass_kg: found -1.0, expected a number >= 0"},
    {"inertia_com_kg_m2 = [25.0, 25.0, 25.0,", "inertia_com_kg_m2 = [25.0, 25.0, 51.0,",
     "8: load[0].inertia_com_kg_m2: found principal moments 25, 25, 51 kg m^2 about the centre of mass, "
     "expected none "
     "negative, none above the sum of the other two"},
    {"mass_kg = 500.0", "mass_kg = 0.0",
     "8: load[0].inertia_com_kg_m2: found inertia without mass, expected zeros where mass_kg = 0"},
    {"at_s = 0.0", "at_s = 0.2", "6: load[0].at_s: found 0.2, expected 0 for the first load"},
    {"at_s = 0.5", "at_s = 0.0",
     "10: load[1].at_s: found 0, expected at least one tick after the load at 0 s"},
    {"supply_pressure_pa = 21e6", "tank_pressure_pa = 30e6",
     "15: hydraulics.tank_pressure_pa: found 30000000, expected less than supply_pressure_pa = 21000000"},
    {"[hydraulics]", "[legs]\nrod_mass_kg = -1.0\n[hydraulics]",
     "15: legs.rod_mass_kg: found -1.0, expected a number >= 0"},
    {"[hydraulics]", "[legs]\nrod_mass_kg = [1.0, 1.0, 1.0, 1.0, 1.0, -1.0]\n[hydraulics]",
     "15: legs.rod_mass_kg[5]: found -1.0, expected a number >= 0"},
    {"[hydraulics]", "[legs]\nrod_mass_kg = \"heavy\"\n[hydraulics]",
     "15: legs.rod_mass_kg: found \"heavy\", expected a number >= 0, or an array of 6 of them"},
    {"[hydraulics]", "[machine]\ntilt_rad = [0.01, 0.6]\n[hydraulics]",
     "15: machine.tilt_rad[1]: found 0.6, expected a number from -0.5 to 0.5"},
    {"[hydraulics]", "[machine]\nhinge_error_sigma_m = -1e-3\n[hydraulics]",
     "15: machine.hinge_error_sigma_m: found -0.001, expected a number >= 0"},
    {"[hydraulics]", "[machine]\ntilt = 0.1\n[hydraulics]",
     "15: machine.tilt: found an unknown key, did you mean machine.tilt_rad?"},
    {"supply_pressure_pa = 21e6", "friction_law = \"dahl\"",
     R"(15: hydraulics.friction_law: found "dahl", expected one of "coulomb", "stribeck", "lugre")"},
    {"supply_pressure_pa = 21e6",
     "friction_law = \"lugre\"\ncoulomb_friction_n = 50.0\nstatic_friction_n = 40.0",
     "17: hydraulics.static_friction_n: found 40 in leg 1, expected at least coulomb_friction_n = 50"},
    {"supply_pressure_pa = 21e6", "static_friction_n = 40.0",
     "15: hydraulics.static_friction_n: found 40 in leg 1, expected 0 where friction_law = \"coulomb\""},
    {"delay_ticks = 1", "force_delay_s = -1e-4",
     "17: sensors.force_delay_s: found -1e-04, expected a number from 0 to 1"},
}};

} // namespace

SCENARIO("platform files with a mistake are refused") {
    GIVEN("a good platform file") {
        ScratchFolder scratch;
        WHEN("it is read as it is") {
            THEN("it is accepted") {
                CHECK(message_of(load_platform_file, scratch.write("p.toml", platform_text)) == "accepted");
            }
        }
        WHEN("one thing in it is wrong") {
            THEN("the message names line, key, what was found and what was expected") {
                for (const Refusal& refusal : platform_refusals) {
                    CHECK(message_of(load_platform_file,
                                     scratch.write("p.toml", edited(platform_text, refusal))) ==
                          refusal.message);
                }
            }
        }
        WHEN("it has a table's header at which toml++ would end the program") {
            THEN("it is refused as any other") {
                for (const char* header : {"[=]\n", "[[=]]\n", "a = 1\n[ ,"}) {
                    CHECK(message_of(load_platform_file, scratch.write("p.toml", header)) ==
                          " found text that is no TOML, expected [table] headers and key = value");
                }
            }
        }
        WHEN("it does not exist") {
            THEN("the message says so") {
                CHECK(message_of(load_platform_file, scratch.path("none.toml")) ==
                      " found no such file, expected a TOML file");
            }
        }
    }
}

SCENARIO("machines with a singular home pose are refused") {
    GIVEN("platform hinges in the same shape as the base hinges, 0.7 times as large") {
        ScratchFolder scratch;
        const std::string similar =
            "[[0.42, 0.07, 0], [-0.14, 0.392, 0], [-0.28, 0.322, 0], [-0.28, -0.322, 0], "
            "[-0.14, -0.392, 0], [0.42, -0.07, 0]]";
        const std::string platform = "[[0.28, 0.28, 0], [0.1, 0.39, 0], [-0.39, 0.1, 0], [-0.39, -0.1, 0], "
                                     "[0.1, -0.39, 0], [0.28, -0.28, 0]]";
        const auto path = scratch.write("p.toml", edited(platform_text, {platform, similar, ""}));
        WHEN("the file is read") {
            const std::string message = message_of(load_platform_file, path);
            THEN("the message says that the Jacobian is singular") {
                CHECK(message.find("3: geometry.platform_hinges_m: found Jacobian condition") == 0);
                CHECK(message.find("expected at most 1000") != std::string::npos);
            }
        }
    }
}

SCENARIO("scenario files with a mistake are refused") {
    GIVEN("a good scenario file") {
        ScratchFolder scratch;
        WHEN("it is read as it is") {
            THEN("it is accepted") {
                CHECK(message_of(load_scenario, scratch.write("s.toml", scenario_text)) == "accepted");
            }
        }
        WHEN("one thing in it is wrong") {
            THEN("the message names line, key, what was found and what was expected") {
                for (const Refusal& refusal : scenario_refusals) {
                    const std::string message =
                        message_of(load_scenario, scratch.write("s.toml", edited(scenario_text, refusal)));
                    CHECK(message.substr(0, refusal.message.size()) == refusal.message);
                }
            }
        }
        WHEN("it does not exist") {
            THEN("the message says so") {
                CHECK(message_of(load_scenario, scratch.path("none.toml")) ==
                      " found no such file, expected a TOML file");
            }
        }
    }
}

SCENARIO("trajectory files with a mistake are refused") {
    GIVEN("a good trajectory file") {
        ScratchFolder scratch;
        const std::string text = "t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n1,0.1,0,0,0,0,0\n";
        const auto message = [&](const Refusal& refusal) {
            const auto make = [](const std::filesystem::path& path) {
                make_trajectory(FileMotion{path}, Geometry{}, MotionLimits{}, 1.0, 1);
            };
            return message_of(make, scratch.write("m.csv", edited(text, refusal)));
        };
        WHEN("one thing in it is wrong") {
            THEN("the message names line, column, what was found and what was expected") {
                CHECK(message({"1,0.1", "1,0.1", ""}) == "accepted");
                CHECK(message({"yaw", "jaw", ""}) == "1: header: found \"t,x,y,z,roll,pitch,jaw\", expected "
                                                     "\"t,x,y,z,roll,pitch,yaw\"");
                CHECK(message({"1,0.1", "1,abc", ""}) == "3: x: found \"abc\", expected a finite number");
                CHECK(message({"1,0.1", "1,nan", ""}) == "3: x: found \"nan\", expected a finite number");
                CHECK(message({"1,0.1,0", "1,0.1", ""}) ==
                      "3: pitch: found too few columns, expected seven columns");
                CHECK(message({"1,0.1", "1,0,0.1", ""}) ==
                      "3: yaw: found more columns, expected seven columns");
                CHECK(message({"1,0.1", "0,0.1", ""}) ==
                      "3: t: found 0.000000, expected a time after the row above");
                CHECK(message({"1,0.1,0,0,0,0,0\n", "", ""}) == " found 1 rows, expected at least two");
            }
        }
        WHEN("it does not exist") {
            THEN("the message says so") {
                CHECK_THROWS_WITH_AS(
                    make_trajectory(FileMotion{scratch.path("none.csv")}, Geometry{}, MotionLimits{}, 1.0, 1),
                    doctest::Contains("found no such file, expected a trajectory CSV"), InputError);
            }
        }
    }
}
