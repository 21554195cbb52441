// Which folder a run may take the place of, and the folders that it works in.
#pragma once

#include <filesystem>

namespace hexload::sim {

// "run/" names the same folder as "run".
std::filesystem::path without_slash(const std::filesystem::path& target);

// Throws InputError unless there is nothing at `target`, or an empty folder, or, with `replace`, a run
// directory.
void check_target(const std::filesystem::path& target, bool replace);

// A new folder beside `target` that no other run has; makes the folders above it. It is locked as long as
// this object lives: what a run that was killed has left there, which nobody has locked, is deleted. Throws
// InputError.
class PrivateFolder {
  public:
    explicit PrivateFolder(const std::filesystem::path& target);
    PrivateFolder(const PrivateFolder&) = delete;
    PrivateFolder& operator=(const PrivateFolder&) = delete;
    ~PrivateFolder();

    const std::filesystem::path& path() const {
        return path_;
    }

  private:
    std::filesystem::path path_;
    int lock_ = -1;
};

// The files of a folder, and the folder itself, are on the disk when this returns. Throws InputError.
void sync_folder(const std::filesystem::path& folder);

// The names in a folder are on the disk; a file system that cannot say so is not asked twice.
void sync_names(const std::filesystem::path& folder) noexcept;

// Deletes the files that a run writes, and the folder if that leaves it empty: never anything else.
void remove_run(const std::filesystem::path& folder) noexcept;

} // namespace hexload::sim
