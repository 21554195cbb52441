// The run as it happens, for those who watch on LCM: leg samples and, from the plant, what no sensor shows.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/simulator.hpp>

#include <hexload_lcm/innovation_t.hpp>
#include <hexload_lcm/leg_sample_t.hpp>
#include <hexload_lcm/load_truth_t.hpp>
#include <hexload_lcm/namespace.hpp>
#include <hexload_lcm/platform_state_t.hpp>
#include <hexload_lcm/session.hpp>
#include <hexload_lcm/wrench_t.hpp>

namespace hexload::sim {

enum class PublishSamples {
    yes,
    no, // they are on LCM already, for the controller
};

class LcmPublisher {
  public:
    // Throws message::SessionError.
    LcmPublisher(const std::string& url, const Geometry& geometry, PublishSamples samples);

    // Once per tick, with the load that the platform carries in it.
    void publish(const Tick& tick, const Load& load);

    // After the estimator's step: its measurement update.
    void publish(const UpdateTrace& trace);

    // Messages that LCM did not take.
    std::uint64_t failed() const;

  private:
    message::Session session_;
    Geometry geometry_;
    PublishSamples publishes_samples_;
    message::Publisher<leg_sample_t> samples_{session_};
    message::Publisher<platform_state_t> states_{session_};
    message::Publisher<load_truth_t> loads_{session_};
    message::Publisher<wrench_t> wrenches_{session_};
    message::Publisher<innovation_t> innovations_{session_};
};

} // namespace hexload::sim
