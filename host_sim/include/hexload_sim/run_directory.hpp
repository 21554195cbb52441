// What a run leaves behind: scenario.toml, platform.toml, rig.toml where the controller has one, log.csv,
// truth.csv, estimates.csv, meta.json. The same scenario and seed give the same bytes; no host name or path
// goes in, and what was measured by a clock only in real time.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/pacer.hpp>
#include <hexload_sim/simulator.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hexload::sim {

class PrivateFolder;

// CSV rows of shortest round-trip numbers. Throws InputError when the disk refuses.
class CsvFile {
  public:
    CsvFile(const std::filesystem::path& path, const std::string& header);

    template <typename Real> void add(Real value); // float or double
    void end_row();
    void close();

  private:
    struct Closer {
        void operator()(std::FILE* file) const noexcept;
    };
    void flush();

    std::filesystem::path path_;
    std::unique_ptr<std::FILE, Closer> file_;
    std::string pending_;
    bool row_begun_ = false;
};

struct RunResult {
    RunCounts counts;
    std::vector<HealthCount> health = {};
    std::vector<double> load_changes_s = {}; // when the estimator detected a load change
    std::vector<InputFault> input_faults = {};
    std::optional<BusCounts> bus = {}; // nothing: in process
    PacingResult pacing = {};
};

// Written in a private folder beside its final name and renamed by finish(), so that a run directory is whole
// or absent, and that runs with one target at the same time never share a file. What is replaced is a run
// directory and nothing else: a folder with the meta.json of a run and only files that a run has. A folder
// that is empty may be used. Refused whatever `replace` says: the working directory, the home folder and what
// is above them, symbolic links, files, folders with anything else in them. What a killed run with the same
// target left beside it is deleted.
class RunDirectory {
  public:
    // A slash at the end of target means nothing. Throws InputError if target exists and may not be replaced,
    // or cannot be created.
    RunDirectory(const std::filesystem::path& target, bool replace);
    RunDirectory(const RunDirectory&) = delete;
    RunDirectory& operator=(const RunDirectory&) = delete;
    ~RunDirectory();

    std::filesystem::path file(const std::string& name) const;

    // scenario.toml with all defaults, platform.toml verbatim, and the trajectory file if there is one.
    void write_inputs(const Scenario& scenario);

    // rig.toml, verbatim.
    void write_rig(const std::filesystem::path& rig);

    // A row of log.csv, without vl1 ... vl6 where the machine has no velocity sensor (unless the sample is
    // lost) and of truth.csv.
    void write(const Tick& tick);

    // meta.json, then the final name. Throws InputError if target has become what may not be replaced; of
    // several runs with one target and `replace`, the last one to finish is there, whole.
    void finish(const Scenario& scenario, const PlatformFile& platform, const Simulator& simulator,
                const RunResult& result);

  private:
    bool take_place();

    std::unique_ptr<PrivateFolder> folder_;
    std::filesystem::path target_;
    bool replace_;
    std::filesystem::path partial_;
    bool finished_ = false;
    bool has_velocity_ = true;
    std::unique_ptr<CsvFile> log_;
    std::unique_ptr<CsvFile> truth_;
};

} // namespace hexload::sim
