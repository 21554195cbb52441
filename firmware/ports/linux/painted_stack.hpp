// A thread on a stack whose use can be read: it is painted before the start, what lost its paint was used.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace hexload::port {

// Below it lies a page that cannot be touched: an overflow ends the process.
class PaintedStack {
  public:
    static constexpr std::uint32_t bytes = 256 * 1024;

    PaintedStack();

    // Runs `work` on this stack and returns when it is done; what it throws is thrown here.
    void run(const std::function<void()>& work);

    // Bytes never used so far. From any thread; walks over them.
    std::uint32_t margin_bytes() const;

  private:
    struct Unmap {
        void operator()(std::uint64_t* words) const noexcept;
    };
    std::unique_ptr<std::uint64_t, Unmap> words_;
};

} // namespace hexload::port
