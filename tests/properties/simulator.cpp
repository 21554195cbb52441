#include "support.hpp"

#include <hexload_sim/run_directory.hpp>
#include <hexload_sim/simulator.hpp>

#include <fstream>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr const char* files[] = {"scenario.toml", "platform.toml", "log.csv", "truth.csv", "meta.json"};

Scenario short_scenario(const std::string& name, std::int64_t seed) {
    Scenario scenario = load_scenario(scenario_path(name));
    scenario.duration_s = 0.5;
    scenario.seed = seed;
    return scenario;
}

std::filesystem::path write_run(const ScratchFolder& scratch, const std::string& name,
                                const Scenario& scenario) {
    const PlatformFile platform = load_platform_file(scenario.platform);
    Simulator simulator(platform, scenario);
    RunDirectory directory(scratch.path(name), false);
    directory.write_inputs(scenario);
    const RunCounts counts =
        run(simulator, nullptr, [&](const Tick& tick, const auto&) { directory.write(tick); });
    directory.finish(scenario, platform, simulator, {.counts = counts});
    return scratch.path(name);
}

std::size_t lines_of(const std::filesystem::path& path) {
    const std::string text = read_text(path);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// Refuses every third sample, answers the others.
class FussyLink : public EstimatorLink {
  public:
    std::span<const std::string_view> parameter_names() const override {
        return {};
    }
    std::span<const EstimateRow> step(const LegSample& sample) override {
        if (sample.tick % 3 == 0) {
            ++refused_;
            return {};
        }
        row_.t_s = sample.t_s;
        return {&row_, 1};
    }
    std::uint32_t refused() const override {
        return refused_;
    }
    std::string last_refusal() const override {
        return "fussy";
    }
    std::vector<HealthCount> health_counts() const override {
        return {};
    }
    std::vector<double> load_changes_s() const override {
        return {};
    }

  private:
    EstimateRow row_;
    std::uint32_t refused_ = 0;
};

} // namespace

SCENARIO("the same seed gives the same bytes in every file") {
    GIVEN("two runs of one seed and one of another, with all sensor faults") {
        ScratchFolder scratch;
        const auto first = write_run(scratch, "first", short_scenario("faults", 5));
        const auto again = write_run(scratch, "again", short_scenario("faults", 5));
        const auto other = write_run(scratch, "other", short_scenario("faults", 6));
        WHEN("their files are compared") {
            THEN("the first two are equal") {
                for (const char* file : files) {
                    CAPTURE(file);
                    CHECK(read_text(first / file).size() > 100);
                    CHECK(read_text(first / file) == read_text(again / file));
                }
            }
            THEN("another seed gives another log") {
                CHECK(read_text(first / "log.csv") != read_text(other / "log.csv"));
            }
            THEN("the noise does not reach the motion") {
                CHECK(read_text(first / "truth.csv") == read_text(other / "truth.csv"));
            }
        }
    }
    GIVEN("two seeds of a multisine") {
        ScratchFolder scratch;
        const auto first = write_run(scratch, "first", short_scenario("multisine", 5));
        const auto other = write_run(scratch, "other", short_scenario("multisine", 6));
        WHEN("their motions are compared") {
            THEN("they differ") {
                CHECK(read_text(first / "truth.csv") != read_text(other / "truth.csv"));
            }
        }
    }
}

SCENARIO("a run directory is a scenario that reproduces itself") {
    GIVEN("a run of a motion from file") {
        ScratchFolder scratch;
        Scenario scenario = short_scenario("faults", 5);
        scenario.trajectory = FileMotion{
            scratch.write("motion.csv", "t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n0.5,0.02,0.01,0,0,0,0.01\n")};
        const auto first = write_run(scratch, "first", scenario);
        WHEN("its own scenario.toml is run") {
            const auto again = write_run(scratch, "again", load_scenario(first / "scenario.toml"));
            THEN("every file is the same") {
                for (const char* file : files) {
                    CAPTURE(file);
                    CHECK(read_text(first / file) == read_text(again / file));
                }
            }
        }
    }
}

SCENARIO("a rig reproduces itself, and its hinges do not follow the seed of the run") {
    GIVEN("a run of the scenario with every effect") {
        ScratchFolder scratch;
        const auto first = write_run(scratch, "first", short_scenario("rig", 5));
        WHEN("its own scenario.toml is run") {
            const auto again = write_run(scratch, "again", load_scenario(first / "scenario.toml"));
            THEN("every file is the same") {
                for (const char* file : files) {
                    CAPTURE(file);
                    CHECK(read_text(first / file) == read_text(again / file));
                }
            }
        }
        WHEN("meta.json is compared with that of another seed") {
            const auto other = write_run(scratch, "other", short_scenario("rig", 6));
            const auto rig_of = [](const std::filesystem::path& run) {
                const std::string text = read_text(run / "meta.json");
                const std::size_t start = text.find("\"rig\"");
                REQUIRE(start != std::string::npos);
                return text.substr(start, text.find("\"seed\"", start) - start);
            };
            THEN("the rig is the same, and names its hinges") {
                CHECK(rig_of(first) == rig_of(other));
                CHECK(rig_of(first).find("platform_hinges_m") != std::string::npos);
            }
        }
    }
}

SCENARIO("a run has a truth row per tick and a log row per sample that arrived") {
    GIVEN("a run of 0.5 s that loses samples") {
        ScratchFolder scratch;
        Scenario scenario = short_scenario("faults", 5);
        scenario.sensors.dropout_probability = 0.2;
        const PlatformFile platform = load_platform_file(scenario.platform);
        Simulator simulator(platform, scenario);
        FussyLink link;
        std::size_t estimates = 0;
        const RunCounts counts = run(simulator, &link, [&](const Tick&, std::span<const EstimateRow> rows) {
            estimates += rows.size();
        });
        const auto directory = write_run(scratch, "run", scenario);
        WHEN("rows are counted") {
            THEN("they add up") {
                CHECK(counts.ticks == 501);
                CHECK(counts.missing > 0);
                CHECK(counts.refused > 0);
                CHECK(counts.ticks == counts.missing + counts.refused + estimates);
                CHECK(lines_of(directory / "truth.csv") == 1 + counts.ticks);
                CHECK(lines_of(directory / "log.csv") == 1 + counts.ticks - counts.missing);
            }
        }
    }
}

SCENARIO("a run directory is whole or absent") {
    GIVEN("a run that stops half-way") {
        ScratchFolder scratch;
        const Scenario scenario = short_scenario("paper", 1);
        {
            RunDirectory directory(scratch.path("run"), false);
            directory.write_inputs(scenario);
        }
        WHEN("the folder is looked at") {
            THEN("nothing is left") {
                CHECK_FALSE(std::filesystem::exists(scratch.path("run")));
                CHECK(std::filesystem::is_empty(scratch.path("")));
            }
        }
    }
    GIVEN("a run directory that exists") {
        ScratchFolder scratch;
        const auto path = write_run(scratch, "run", short_scenario("paper", 1));
        WHEN("it is written again without leave to replace it") {
            THEN("it is refused and kept") {
                CHECK_THROWS_WITH_AS(RunDirectory(path, false),
                                     (path.string() + ": exists already; --force replaces it").c_str(),
                                     std::runtime_error);
                CHECK(std::filesystem::exists(path / "meta.json"));
            }
        }
    }
}

SCENARIO("the paper's motion leaves the parasitic tilt of a usual servo") {
    GIVEN("the paper's scenario, ten seconds") {
        Scenario scenario = load_scenario(scenario_path("paper_clean"));
        WHEN("it has run in for two seconds") {
            double tilt_rad = 0.0;
            double amplitude_m = 0.0;
            Simulator simulator(load_platform_file(scenario.platform), scenario);
            run(simulator, nullptr, [&](const Tick& tick, const auto&) {
                if (tick.t_s > 2.0) {
                    tilt_rad = std::max({tilt_rad, std::abs(tick.pose.R(2, 1)), std::abs(tick.pose.R(0, 2))});
                    amplitude_m = std::max(amplitude_m, tick.pose.p_m.x());
                }
            });
            // The order that oil stiffness and loop gain give: kilonewtons over N/um, centimetres over a
            // radius.
            THEN("tilt is of the order of a milliradian, and x of its reference") {
                CHECK(tilt_rad > 0.3e-3);
                CHECK(tilt_rad < 5e-3);
                CHECK(std::abs(amplitude_m - 0.2) < 0.02);
            }
        }
    }
}
