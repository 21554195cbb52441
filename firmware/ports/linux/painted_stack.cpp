#include "painted_stack.hpp"

#include <algorithm>
#include <cerrno>
#include <exception>
#include <system_error>

#include <pthread.h>
#include <sys/mman.h>

namespace hexload::port {
namespace {

constexpr std::uint64_t paint = 0xC0FFEE00C0FFEE00;
constexpr std::size_t guard_bytes = std::size_t{64} * 1024; // a multiple of every page size
constexpr std::size_t word_count = PaintedStack::bytes / sizeof paint;

struct Job {
    const std::function<void()>& work;
    std::exception_ptr thrown;
};

void* perform(void* argument) {
    Job& job = *static_cast<Job*>(argument);
    try {
        job.work();
    } catch (...) {
        job.thrown = std::current_exception();
    }
    return nullptr;
}

void require(int error, const char* what) {
    if (error != 0) {
        throw std::system_error(error, std::generic_category(), what);
    }
}

} // namespace

PaintedStack::PaintedStack() {
    void* memory = mmap(nullptr, guard_bytes + bytes, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
    require(memory == MAP_FAILED ? errno : 0, "stack");
    words_.reset(static_cast<std::uint64_t*>(memory) + guard_bytes / sizeof paint);
    require(mprotect(memory, guard_bytes, PROT_NONE) == 0 ? 0 : errno, "stack");
    std::fill_n(words_.get(), word_count, paint);
}

void PaintedStack::Unmap::operator()(std::uint64_t* words) const noexcept {
    munmap(words - guard_bytes / sizeof paint, guard_bytes + bytes);
}

void PaintedStack::run(const std::function<void()>& work) {
    Job job{work, nullptr};
    pthread_t thread{};
    pthread_attr_t attributes;
    require(pthread_attr_init(&attributes), "stack");
    int error = pthread_attr_setstack(&attributes, words_.get(), bytes);
    if (error == 0) {
        error = pthread_create(&thread, &attributes, perform, &job);
    }
    pthread_attr_destroy(&attributes);
    require(error, "thread");
    pthread_join(thread, nullptr);
    if (job.thrown) {
        std::rethrow_exception(job.thrown);
    }
}

std::uint32_t PaintedStack::margin_bytes() const {
    const std::uint64_t* end = words_.get() + word_count; // stacks grow downwards
    const std::uint64_t* used = std::find_if(static_cast<const std::uint64_t*>(words_.get()), end,
                                             [](std::uint64_t word) { return word != paint; });
    return static_cast<std::uint32_t>((used - words_.get()) * static_cast<std::ptrdiff_t>(sizeof paint));
}

} // namespace hexload::port
