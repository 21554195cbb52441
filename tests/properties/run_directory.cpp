#include "support.hpp"

#include "platform_file/input_error.hpp"
#include <hexload_sim/run_directory.hpp>
#include <hexload_sim/simulator.hpp>

#include <memory>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

// A run of half a second, tick by tick, so that several can go on at the same time.
class Run {
  public:
    Run(const std::filesystem::path& target, std::int64_t seed, bool replace)
        : scenario_(scenario_of(seed)), platform_(load_platform_file(scenario_.platform)),
          simulator_(platform_, scenario_), directory_(target, replace) {
        directory_.write_inputs(scenario_);
    }

    void step() {
        directory_.write(simulator_.step());
        ++counts_.ticks;
    }
    void finish() {
        while (counts_.ticks < simulator_.ticks()) {
            step();
        }
        directory_.finish(scenario_, platform_, simulator_, {.counts = counts_});
    }

  private:
    static Scenario scenario_of(std::int64_t seed) {
        Scenario scenario = load_scenario(scenario_path("multisine"));
        scenario.duration_s = 0.5;
        scenario.seed = seed;
        return scenario;
    }

    Scenario scenario_;
    PlatformFile platform_;
    Simulator simulator_;
    RunDirectory directory_;
    RunCounts counts_;
};

void write_run(const std::filesystem::path& target, std::int64_t seed, bool replace = false) {
    Run(target, seed, replace).finish();
}

// Every file of `run` is that of `expected`, byte for byte, and there is no other.
bool is_same_run(const std::filesystem::path& run, const std::filesystem::path& expected) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(run)) {
        ++files;
        if (read_text(entry.path()) != read_text(expected / entry.path().filename())) {
            return false;
        }
    }
    const auto begin = std::filesystem::directory_iterator(expected);
    return files == static_cast<std::size_t>(std::distance(begin, std::filesystem::directory_iterator()));
}

std::size_t entries_of(const std::filesystem::path& folder) {
    const auto begin = std::filesystem::directory_iterator(folder);
    return static_cast<std::size_t>(std::distance(begin, std::filesystem::directory_iterator()));
}

std::string refusal_of(const std::filesystem::path& target) {
    try {
        RunDirectory(target, true);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

} // namespace

SCENARIO("two runs with one target at the same time never mix") {
    GIVEN("what the runs of two seeds leave behind, each on its own") {
        ScratchFolder scratch;
        const auto folder = scratch.path("both");
        std::filesystem::create_directory(folder);
        write_run(scratch.path("one"), 1);
        write_run(scratch.path("two"), 2);
        REQUIRE_FALSE(is_same_run(scratch.path("one"), scratch.path("two")));
        WHEN("both write the same target in turns, with leave to replace it") {
            Run first(folder / "run", 1, true);
            first.step();
            Run second(folder / "run", 2, true);
            second.step();
            first.step();
            first.finish();
            THEN("each is whole when it has finished, and nothing else stays") {
                CHECK(is_same_run(folder / "run", scratch.path("one")));
                second.finish();
                CHECK(is_same_run(folder / "run", scratch.path("two")));
                CHECK(entries_of(folder) == 1);
            }
        }
        WHEN("the one that finishes later has no leave to replace the other") {
            Run first(folder / "run", 1, false);
            {
                Run second(folder / "run", 2, false);
                first.finish();
                THEN("it is refused, and the other stays whole") {
                    CHECK_THROWS_AS(second.finish(), InputError);
                    CHECK(is_same_run(folder / "run", scratch.path("one")));
                }
            }
            CHECK(entries_of(folder) == 1);
        }
    }
}

SCENARIO("a run directory takes the place of a run directory and of nothing else") {
    GIVEN("a run") {
        ScratchFolder scratch;
        const auto run = scratch.path("run");
        write_run(run, 1);
        WHEN("it is replaced, with a report in it and the target written with a slash at its end") {
            scratch.write("run/report.html", "page");
            write_run(scratch.path("run/"), 2, true);
            write_run(scratch.path("expected"), 2);
            THEN("the new run is there, whole, and nothing of the old one") {
                CHECK(is_same_run(run, scratch.path("expected")));
            }
        }
        WHEN("there is a file in it that no run writes") {
            scratch.write("run/notes.txt", "mine");
            THEN("it is refused with the file's name") {
                const std::string message =
                    run.string() + ": found notes.txt in it, expected a run directory";
                CHECK(refusal_of(run).find(message) == 0);
                CHECK(read_text(run / "notes.txt") == "mine");
            }
        }
        WHEN("such a file comes while the next run goes on") {
            Run next(run, 2, true);
            scratch.write("run/notes.txt", "mine");
            THEN("that run is refused, and the old one is where it was") {
                CHECK_THROWS_AS(next.finish(), InputError);
                CHECK(read_text(run / "notes.txt") == "mine");
                CHECK(std::filesystem::exists(run / "log.csv"));
            }
        }
        WHEN("its meta.json is another program's") {
            scratch.write("run/meta.json", "{\"name\": \"paper\"}");
            THEN("it is refused") {
                CHECK(refusal_of(run).find("found a meta.json that is not of a run") != std::string::npos);
            }
        }
        WHEN("the target is a symbolic link to it") {
            std::filesystem::create_directory_symlink(run, scratch.path("link"));
            THEN("it is refused, with and without a slash") {
                CHECK(refusal_of(scratch.path("link")).find("found a symbolic link") != std::string::npos);
                CHECK(refusal_of(scratch.path("link/")).find("found a symbolic link") != std::string::npos);
            }
        }
    }
    GIVEN("the root folder and an empty folder") {
        ScratchFolder scratch;
        std::filesystem::create_directory(scratch.path("empty"));
        THEN("the first is refused, and the second is used") {
            CHECK(refusal_of("/").find("/: found a folder above the working directory") == 0);
            write_run(scratch.path("empty"), 1);
            CHECK(std::filesystem::exists(scratch.path("empty") / "meta.json"));
        }
    }
}
