#include <hexload_sim/run_directory.hpp>

#include "run_meta.hpp"
#include "run_target.hpp"

#include "platform_file/input_error.hpp"

#include <hexload_sim/rotation.hpp>

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <system_error>
#include <utility>

namespace hexload::sim {
namespace {

constexpr std::size_t flush_bytes = 1U << 16U;

std::string leg_columns(const char* name) {
    std::string columns;
    for (int leg = 1; leg <= 6; ++leg) {
        columns += fmt::format(",{}{}", name, leg);
    }
    return columns;
}

std::string log_header(bool velocity_sensor) {
    return fmt::format("t{}{}{}", leg_columns("dl"), velocity_sensor ? leg_columns("vl") : "",
                       leg_columns("f"));
}

std::string truth_header() {
    return fmt::format(
        "t,x,y,z,roll,pitch,yaw,vx,vy,vz,wx,wy,wz,ref_x,ref_y,ref_z,ref_roll,ref_pitch,ref_yaw{}{}{}",
        leg_columns("dl"), leg_columns("vl"), leg_columns("f"));
}

template <typename Real, typename Values> void add_all(CsvFile& csv, const Values& values) {
    for (int i = 0; i < values.size(); ++i) {
        csv.add(static_cast<Real>(values(i)));
    }
}

void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream stream(path, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) {
        throw InputError(path.string() + ": cannot be written");
    }
}

} // namespace

void CsvFile::Closer::operator()(std::FILE* file) const noexcept {
    (void)std::fclose(file); // of one that is given up: what was written is checked before
}

CsvFile::CsvFile(const std::filesystem::path& path, const std::string& header)
    : path_(path), file_(std::fopen(path.c_str(), "wb")), pending_(header + "\n") {
    if (!file_) {
        throw InputError(path_.string() + ": cannot be written");
    }
    pending_.reserve(2 * flush_bytes);
}

template <typename Real> void CsvFile::add(Real value) {
    if (row_begun_) {
        pending_ += ',';
    }
    row_begun_ = true;
    std::array<char, 32> text; // the longest double has 24 characters
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
    pending_.append(text.data(), end);
}
template void CsvFile::add<float>(float);
template void CsvFile::add<double>(double);

void CsvFile::end_row() {
    pending_ += '\n';
    row_begun_ = false;
    if (pending_.size() > flush_bytes) {
        flush();
    }
}

void CsvFile::flush() {
    if (std::fwrite(pending_.data(), 1, pending_.size(), file_.get()) != pending_.size()) {
        throw InputError(path_.string() + ": cannot be written");
    }
    pending_.clear();
}

void CsvFile::close() {
    flush();
    if (std::fclose(file_.release()) != 0) {
        throw InputError(path_.string() + ": cannot be written");
    }
}

RunDirectory::RunDirectory(const std::filesystem::path& target, bool replace)
    : target_(without_slash(target)), replace_(replace) {
    check_target(target_, replace_);
    folder_ = std::make_unique<PrivateFolder>(target_);
    partial_ = folder_->path();
}

RunDirectory::~RunDirectory() {
    if (!finished_) {
        remove_run(partial_);
    }
}

std::filesystem::path RunDirectory::file(const std::string& name) const {
    return partial_ / name;
}

void RunDirectory::write_inputs(const Scenario& scenario) {
    Scenario resolved = scenario;
    resolved.platform = "platform.toml";
    std::filesystem::copy_file(scenario.platform, file("platform.toml"));
    if (auto* motion = std::get_if<FileMotion>(&resolved.trajectory)) {
        std::filesystem::copy_file(motion->path, file("trajectory.csv"));
        motion->path = "trajectory.csv";
    }
    write_text(file("scenario.toml"), to_toml(resolved));
    has_velocity_ = scenario.sensors.velocity_sensor;
    log_ = std::make_unique<CsvFile>(file("log.csv"), log_header(has_velocity_));
    truth_ = std::make_unique<CsvFile>(file("truth.csv"), truth_header());
}

void RunDirectory::write_rig(const std::filesystem::path& rig) {
    std::filesystem::copy_file(rig, file("rig.toml"));
}

void RunDirectory::write(const Tick& tick) {
    if (tick.sample) {
        log_->add(tick.sample->t_s);
        add_all<float>(*log_, tick.sample->displacement_m); // exact: the sensors deliver float32
        if (has_velocity_) {
            add_all<float>(*log_, tick.sample->velocity_m_s);
        }
        add_all<float>(*log_, tick.sample->force_n);
        log_->end_row();
    }
    truth_->add(tick.t_s);
    add_all<double>(*truth_, tick.pose.p_m);
    add_all<double>(*truth_, rpy_from_rotation(tick.pose.R));
    add_all<double>(*truth_, tick.twist.v_m_s);
    add_all<double>(*truth_, tick.twist.w_rad_s);
    add_all<double>(*truth_, tick.reference.q);
    add_all<double>(*truth_, tick.legs.displacement_m);
    add_all<double>(*truth_, tick.legs.velocity_m_s);
    add_all<double>(*truth_, tick.legs.force_n);
    truth_->end_row();
}

void RunDirectory::finish(const Scenario& scenario, const PlatformFile& platform, const Simulator& simulator,
                          const RunResult& result) {
    log_->close();
    truth_->close();
    write_text(file("meta.json"), run_meta_json(scenario, platform, simulator, result));
    sync_folder(partial_); // else a power cut after the renaming leaves empty files where a run was
    while (!take_place()) {
        // Another run has taken the place meanwhile.
    }
    sync_names(target_.has_parent_path() ? target_.parent_path() : ".");
    finished_ = true;
}

// Old away, new into place, old deleted: at each moment one of the two is there whole. False: another run was
// faster.
bool RunDirectory::take_place() {
    check_target(target_, replace_);
    const std::filesystem::path old = partial_.string() + ".replaced";
    std::error_code error;
    std::filesystem::rename(target_, old, error);
    const bool has_old = !error;
    if (error && error != std::errc::no_such_file_or_directory) {
        throw InputError(target_.string() + ": cannot be moved away: " + error.message());
    }
    if (has_old) {
        try {
            check_target(old, replace_); // it may have changed since the first look
        } catch (const InputError&) {
            std::filesystem::rename(old, target_, error);
            throw;
        }
    }
    std::filesystem::rename(partial_, target_, error);
    if (!error) {
        remove_run(old);
        return true;
    }
    if (error == std::errc::directory_not_empty || error == std::errc::file_exists) {
        remove_run(old);
        return false;
    }
    if (has_old) {
        std::error_code ignored; // the first error is the one to report
        std::filesystem::rename(old, target_, ignored);
    }
    throw InputError(target_.string() + ": cannot be written: " + error.message());
}

} // namespace hexload::sim
