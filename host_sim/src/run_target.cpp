#include "run_target.hpp"

#include "platform_file/input_error.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hexload::sim {
namespace {

namespace fs = std::filesystem;
using platform::InputError;

// trajectory.csv: of a scenario with a motion file. rig.toml: of a controller that knows its rig.
// report.html: what `hexload report` adds to a run.
constexpr std::array<std::string_view, 9> run_files{"scenario.toml", "platform.toml", "trajectory.csv",
                                                    "rig.toml",      "log.csv",       "truth.csv",
                                                    "estimates.csv", "meta.json",     "report.html"};
// Together in no JSON but a run's.
constexpr std::array<std::string_view, 4> meta_keys{"\"tick_s\"", "\"health_ticks\"", "\"mass_matrix_home\"",
                                                    "\"coupling_matrix_home\""};

InputError refusal(const fs::path& target, const std::string& found) {
    return InputError(
        fmt::format("{}: found {}, expected a run directory (meta.json of a run, and beside it only {}), an "
                    "empty folder, or none yet; nothing was deleted",
                    target.string(), found, fmt::join(run_files, ", ")));
}

bool is_at_or_above(const fs::path& folder, const fs::path& path) {
    const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
    return end == folder.end();
}

// What `target` is that must not be moved: renaming it would take the ground from under a shell or a user.
std::optional<std::string> protected_place(const fs::path& target) {
    std::error_code error;
    const fs::path folder = fs::canonical(target, error);
    if (error) {
        return std::nullopt; // it is not there
    }
    const fs::path working = fs::canonical(fs::current_path(error), error);
    if (!error && is_at_or_above(folder, working)) {
        return folder == working ? "the working directory" : "a folder above the working directory";
    }
    const char* home = std::getenv("HOME");
    const fs::path home_folder = fs::canonical(home != nullptr ? home : "/", error);
    if (!error && is_at_or_above(folder, home_folder)) {
        return folder == home_folder ? "the home folder" : "a folder above the home folder";
    }
    return std::nullopt;
}

bool is_meta_of_run(const fs::path& path) {
    std::ostringstream content;
    content << std::ifstream(path, std::ios::binary).rdbuf();
    const std::string text = content.str();
    return std::all_of(meta_keys.begin(), meta_keys.end(),
                       [&](std::string_view key) { return text.find(key) != std::string::npos; });
}

// The first thing that shows that a folder with something in it is no run directory.
std::optional<std::string> foreign_content(const fs::path& folder) {
    std::optional<std::string> found;
    bool has_meta = false;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool is_file = entry.symlink_status().type() == fs::file_type::regular;
        const bool is_known = std::find(run_files.begin(), run_files.end(), name) != run_files.end();
        if ((!is_known || !is_file) && (!found || name < *found)) { // the same name at every try
            found = name;
        }
        has_meta = has_meta || (name == "meta.json" && is_file);
    }
    if (found) {
        return *found + " in it";
    }
    if (!has_meta) {
        return "files without meta.json";
    }
    if (!is_meta_of_run(folder / "meta.json")) {
        return "a meta.json that is not of a run";
    }
    return std::nullopt;
}

constexpr std::string_view partial_suffix = ".partial";

enum class IfTaken { give_up, wait };

// A lock of the folder that ends with the process, however that ends; -1: another one has it, or the file
// system has no such locks.
int lock_of(const fs::path& folder, IfTaken if_taken) {
    const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (descriptor >= 0 && flock(descriptor, if_taken == IfTaken::wait ? LOCK_EX : LOCK_EX | LOCK_NB) != 0) {
        close(descriptor);
        return -1;
    }
    return descriptor;
}

// ".NAME.PROCESS.NUMBER.partial" of a target NAME.
bool is_partial_of(const std::string& target, const std::string& name) {
    const std::string prefix = "." + target + ".";
    if (!name.starts_with(prefix) || !name.ends_with(partial_suffix) ||
        name.size() <= prefix.size() + partial_suffix.size()) {
        return false;
    }
    const std::string_view numbers =
        std::string_view(name).substr(prefix.size(), name.size() - prefix.size() - partial_suffix.size());
    return numbers.find_first_not_of("0123456789.") == std::string_view::npos &&
           std::ranges::count(numbers, '.') == 1;
}

void remove_abandoned(const fs::path& target) noexcept {
    std::error_code error;
    const fs::path parent = target.has_parent_path() ? target.parent_path() : fs::path(".");
    fs::directory_iterator entry(parent, error);
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
        if (!is_partial_of(target.filename().string(), entry->path().filename().string())) {
            continue;
        }
        if (const int lock = lock_of(entry->path(), IfTaken::give_up); lock >= 0) {
            remove_run(entry->path());
            close(lock);
        }
    }
}

// Throws what check_target() does of a target that stays what it is meanwhile.
void look_at(const fs::path& target, bool replace) {
    std::error_code error;
    const fs::file_type type = fs::symlink_status(target, error).type();
    if (target.empty()) {
        throw refusal(target, "no name");
    }
    if (type == fs::file_type::not_found) {
        return;
    }
    if (type == fs::file_type::symlink) {
        throw refusal(target, "a symbolic link");
    }
    if (type != fs::file_type::directory) {
        throw refusal(target, error ? error.message() : "a file");
    }
    if (const auto place = protected_place(target)) {
        throw refusal(target, *place);
    }
    try {
        if (fs::is_empty(target)) {
            return;
        }
        if (const auto found = foreign_content(target)) {
            throw refusal(target, *found);
        }
    } catch (const fs::filesystem_error& fault) {
        throw refusal(target, "a folder that cannot be read (" + fault.code().message() + ")");
    }
    if (!replace) {
        throw InputError(target.string() + ": exists already; --force replaces it");
    }
}

using Identity = std::pair<dev_t, ino_t>;

// Of what has the name; nothing: nothing has.
std::optional<Identity> identity_of(const fs::path& target) {
    struct stat status = {};
    if (lstat(target.c_str(), &status) != 0) {
        return std::nullopt;
    }
    return Identity{status.st_dev, status.st_ino};
}

} // namespace

fs::path without_slash(const fs::path& target) {
    const fs::path normal = target.lexically_normal();
    return normal.has_filename() || normal == normal.root_path() ? normal : normal.parent_path();
}

void check_target(const fs::path& target, bool replace) {
    while (true) {
        const std::optional<Identity> before = identity_of(target);
        try {
            look_at(target, replace);
            return;
        } catch (const InputError&) {
            if (identity_of(target) == before) {
                throw;
            } // else another run has taken the place, and what was read was on its way out
        }
    }
}

PrivateFolder::PrivateFolder(const fs::path& target) {
    std::error_code error;
    if (target.has_parent_path()) {
        fs::create_directories(target.parent_path(), error);
    }
    remove_abandoned(target);
    for (int number = 0; !error; ++number) {
        path_ = target.parent_path() /
                fmt::format(".{}.{}.{}{}", target.filename().string(), getpid(), number, partial_suffix);
        if (fs::create_directory(path_, error)) { // false: it is there already, and another run's
            lock_ = lock_of(path_, IfTaken::wait);
            if (fs::exists(path_)) { // nobody took it for abandoned before the lock
                return;
            }
            close(lock_);
        }
    }
    throw InputError(target.string() + ": cannot be created: " + error.message());
}

PrivateFolder::~PrivateFolder() {
    if (lock_ >= 0) {
        close(lock_);
    }
}

void sync_folder(const fs::path& folder) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const int descriptor = open(entry.path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
        const bool is_synced = descriptor >= 0 && fsync(descriptor) == 0;
        const int fault = errno;
        if (descriptor >= 0) {
            close(descriptor);
        }
        if (!is_synced) {
            throw InputError(entry.path().string() + ": cannot be written: " + std::strerror(fault));
        }
    }
    sync_names(folder);
}

void sync_names(const fs::path& folder) noexcept {
    const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor >= 0) {
        (void)fsync(descriptor);
        close(descriptor);
    }
}

void remove_run(const fs::path& folder) noexcept {
    std::error_code ignored; // what cannot be deleted stays
    for (const std::string_view name : run_files) {
        fs::remove(folder / name, ignored);
    }
    fs::remove(folder, ignored);
}

} // namespace hexload::sim
