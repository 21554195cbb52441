#include "links/can_link.hpp"

#include "app/app.h"
#include "bus/sample_assembly.h"

#include <hexload_sim/sensors.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <utility>

using namespace hexload::sim;
using namespace std::chrono_literals;

namespace {

using Clock = std::chrono::steady_clock;

// The controller's side of the bus, with everything that can be wrong with it.
struct Controller {
    hexload_bus_profile_t profile = HEXLOAD_BUS_FD;
    std::uint8_t state = HEXLOAD_APP_ESTIMATING; // as reported in answers
    std::uint8_t fault = HEXLOAD_FAULT_NONE;
    std::uint8_t filter = HEXLOAD_FILTER_PAPER;
    float known_mass_kg = 0.0F;
    std::uint32_t configuration = 0;               // 0: starts with any
    std::vector<hexload_bus_acknowledge_t> others; // of other programs' commands; go out with the next answer
    std::set<std::uint32_t> changes;               // ticks at which it detects a load change
    int lost_events = 0;                           // that it counts and that do not arrive
    int deaf_to = 0;                               // commands that it does not hear
    bool doubles_acknowledges = false;
    bool doubles_answers = false;
    bool doubles_differ = false;                                   // those answers, from the first
    std::function<void(std::deque<hexload_bus_frame_t>&)> network; // what becomes of the frames of an answer
    std::uint32_t silent_from = UINT32_MAX;                        // tick
    std::set<std::uint32_t> unanswered;                            // ticks
    std::map<std::uint32_t, std::uint32_t> instead; // answers to another tick than the one asked
    std::map<std::uint32_t, std::uint32_t> held;    // answer to a tick goes out after another tick
};

// A bus with that controller on it. Time passes only while somebody waits for a frame.
class ScriptedChannel final : public hexload::transport::CanChannel {
  public:
    ScriptedChannel(Controller& controller, Clock::time_point& now, bool& is_up)
        : controller_(controller), now_(now), is_up_(is_up) {
        name_ = "scripted";
        hexload_sample_assembly_init(&assembly_, controller.profile);
    }
    int descriptor() const override {
        return -1;
    }
    bool is_up() const override {
        return is_up_;
    }
    bool send(const hexload_bus_frame_t& frame, std::chrono::microseconds) override {
        if (!is_up_) {
            return false;
        }
        hexload_bus_command_t command;
        hexload_leg_sample_t sample;
        if (hexload_bus_decode_command(&frame, &command) == HEXLOAD_BUS_OK) {
            acknowledge(command);
        } else if (hexload_sample_assembly_add(&assembly_, &frame, &sample) == HEXLOAD_BUS_OK) {
            answer(sample.tick);
        }
        return true;
    }
    std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout) override {
        if (coming_.empty()) {
            now_ += timeout;
            return std::nullopt;
        }
        const hexload_bus_frame_t frame = coming_.front();
        coming_.pop_front();
        return frame;
    }

  private:
    void acknowledge(const hexload_bus_command_t& command) {
        if (controller_.deaf_to > 0) {
            --controller_.deaf_to;
            return;
        }
        if (command.kind == HEXLOAD_COMMAND_RESET) {
            controller_.state = HEXLOAD_APP_IDLE;
            controller_.fault = HEXLOAD_FAULT_NONE;
        } else if (command.kind == HEXLOAD_COMMAND_SELECT_FILTER) {
            controller_.filter = static_cast<std::uint8_t>(command.argument);
        } else if (command.kind == HEXLOAD_COMMAND_START) {
            controller_.state = HEXLOAD_APP_ESTIMATING;
            load_changes_ = 0;
        }
        const bool is_refused = command.kind == HEXLOAD_COMMAND_START && controller_.configuration != 0 &&
                                command.configuration != controller_.configuration;
        hexload_bus_acknowledge_t acknowledge{
            .kind = command.kind,
            .source = command.source,
            .session = command.session,
            .sequence = command.sequence,
            .counter = counter_++,
            .result = static_cast<std::uint8_t>(is_refused ? HEXLOAD_RESULT_OTHER_CONFIGURATION
                                                           : HEXLOAD_RESULT_DONE),
            .state = controller_.state,
            .fault = controller_.fault,
            .profile = static_cast<std::uint8_t>(controller_.profile),
            .known_mass_crc = hexload_bus_known_mass_crc(controller_.known_mass_kg)};
        hexload_bus_frame_t frame;
        hexload_bus_encode_acknowledge(&acknowledge, &frame);
        coming_.push_back(frame);
        if (controller_.doubles_acknowledges) { // a second controller counts its own
            acknowledge.counter += 8;
            hexload_bus_encode_acknowledge(&acknowledge, &frame);
            coming_.push_back(frame);
        }
    }

    void answer(std::uint32_t tick) {
        if (tick >= controller_.silent_from) {
            return;
        }
        for (const hexload_bus_acknowledge_t& other : controller_.others) {
            hexload_bus_frame_t frame;
            hexload_bus_encode_acknowledge(&other, &frame);
            coming_.push_back(frame);
        }
        controller_.others.clear();
        if (controller_.changes.contains(tick)) {
            send_load_change(tick);
        }
        if (const auto instead = controller_.instead.find(tick); instead != controller_.instead.end()) {
            send_answer(instead->second);
        } else if (!controller_.unanswered.contains(tick) && !controller_.held.contains(tick)) {
            send_answer(tick);
        }
        for (const auto& [held, until] : controller_.held) {
            if (until == tick) {
                send_answer(held);
            }
        }
    }

    void send_load_change(std::uint32_t tick) {
        ++load_changes_;
        if (controller_.lost_events > 0) {
            --controller_.lost_events;
            return;
        }
        const hexload_bus_load_change_t change{tick, load_changes_};
        hexload_bus_frame_t frame;
        hexload_bus_encode_load_change(&change, &frame);
        coming_.push_back(frame);
    }

    void send_answer(std::uint32_t tick) {
        if (controller_.profile == HEXLOAD_BUS_CLASSIC && tick % HEXLOAD_BUS_ANSWER_PERIOD != 0) {
            return;
        }
        hexload_bus_answer_t answer{};
        answer.tick = tick;
        answer.state = controller_.state;
        answer.fault = controller_.fault;
        answer.filter = controller_.filter;
        answer.estimate.value[0] = static_cast<hexload_real_t>(tick);
        answer.estimate.value[9] = static_cast<hexload_real_t>(tick + 1);
        paged_ = page_ == 0 ? answer : paged_; // all pages are of the answer that page 0 began
        paged_.tick = tick;
        const bool is_fd = controller_.profile == HEXLOAD_BUS_FD;
        for (int time = 0; time < (controller_.doubles_answers ? 2 : 1); ++time) {
            hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
            hexload_bus_answer_t given = is_fd ? answer : paged_;
            given.estimate.value[0] += time == 1 && controller_.doubles_differ ? HEXLOAD_REAL(1.0) : 0;
            given.health = time == 1 && controller_.doubles_differ ? 1 : 0;
            const int count = hexload_bus_encode_answer(controller_.profile, &given, page_, frames);
            std::deque<hexload_bus_frame_t> sent(frames, frames + count);
            if (controller_.network) {
                controller_.network(sent);
            }
            coming_.insert(coming_.end(), sent.begin(), sent.end());
        }
        page_ = (page_ + 1) % hexload_bus_answer_pages(paged_.filter);
    }

    Controller& controller_;
    Clock::time_point& now_;
    bool& is_up_;
    hexload_sample_assembly_t assembly_{};
    int page_ = 0;
    std::uint8_t counter_ = 0;
    std::uint16_t load_changes_ = 0;
    hexload_bus_answer_t paged_{};
    std::deque<hexload_bus_frame_t> coming_;
};

// A link, what it reported, and the controls of the other side.
class Bench {
  public:
    explicit Bench(bool real_time, hexload_bus_profile_t profile = HEXLOAD_BUS_FD) {
        controller.profile = profile;
        settings_.profile = profile;
        settings_.answer_timeout = 2000ms;
        settings_.report = [this](const std::string& line) { reported.push_back(line); };
        settings_.now = [this] { return now; };
        real_time_ = real_time;
    }
    EstimatorLink& link() {
        if (!link_) {
            auto channel = std::make_unique<ScriptedChannel>(controller, now, is_up);
            link_ = real_time_ ? make_real_time_link(std::move(channel), settings_)
                               : make_lockstep_link(std::move(channel), settings_);
        }
        return *link_;
    }
    std::vector<EstimateRow> step(std::uint32_t tick) {
        now += real_time_ ? 1ms : 0ms;
        LegSample sample;
        sample.tick = tick;
        sample.t_s = tick / 1000.0;
        const auto rows = link().step(sample);
        return {rows.begin(), rows.end()};
    }
    std::vector<EstimateRow> steps(std::uint32_t first, std::uint32_t last) {
        std::vector<EstimateRow> rows;
        for (std::uint32_t tick = first; tick <= last; ++tick) {
            const auto more = step(tick);
            rows.insert(rows.end(), more.begin(), more.end());
        }
        return rows;
    }
    BusCounts counts() {
        return *link().bus_counts();
    }
    // The settings, for another estimator.
    void select(EstimatorKind estimator) {
        settings_.estimator = estimator;
    }
    // The settings, for a platform file with the load's mass.
    void know(float mass_kg) {
        settings_.known_mass_crc = hexload_bus_known_mass_crc(mass_kg);
    }
    // The settings, for one that works with a configuration.
    void work_with(std::uint32_t configuration) {
        settings_.configuration = configuration;
    }
    std::uint16_t session() const {
        return settings_.session;
    }
    // The settings, for a simulator of another profile than the controller's.
    void speak(hexload_bus_profile_t profile) {
        settings_.profile = profile;
    }

    Controller controller;
    Clock::time_point now{};
    bool is_up = true;
    std::vector<std::string> reported;

  private:
    CanLinkSettings settings_;
    bool real_time_ = false;
    std::unique_ptr<EstimatorLink> link_;
};

// The failure and its message, "FAILURE: MESSAGE".
template <typename Action> std::string failure_of(Action action) {
    static const std::map<LinkFailure, std::string> names = {
        {LinkFailure::silent_controller, "silent"},    {LinkFailure::wrong_profile, "profile"},
        {LinkFailure::second_controller, "second"},    {LinkFailure::bus_down, "bus"},
        {LinkFailure::controller_fault, "controller"},
    };
    try {
        action();
    } catch (const LinkError& error) {
        return names.at(error.failure()) + ": " + error.what();
    }
    return "no failure";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

// Acknowledges of another simulator's commands, one for each number twice and more; whose they are, in words.
std::string hear_another(Bench& bench) {
    const auto session = static_cast<std::uint16_t>((bench.session() + 1) % HEXLOAD_BUS_SESSIONS);
    for (std::uint8_t sequence = 0; sequence < 40; ++sequence) {
        hexload_bus_acknowledge_t acknowledge{};
        acknowledge.kind = HEXLOAD_COMMAND_RESET;
        acknowledge.source = HEXLOAD_SOURCE_SIMULATOR;
        acknowledge.session = session;
        acknowledge.sequence = sequence;
        bench.controller.others.push_back(acknowledge);
    }
    return "another simulator (session " + std::to_string(session) + ")";
}

} // namespace

SCENARIO("in lockstep each tick has the answer of its own sample") {
    GIVEN("a controller that speaks FD") {
        Bench bench(false);
        bench.link().start();
        WHEN("100 ticks are run") {
            const auto rows = bench.steps(0, 99);
            THEN("there is a row of each") {
                REQUIRE(rows.size() == 100);
                for (std::size_t tick = 0; tick < 100; ++tick) {
                    CHECK(rows[tick].value[0] == static_cast<double>(tick));
                    CHECK(rows[tick].t_s == static_cast<double>(tick) / 1000.0);
                }
                CHECK(bench.counts().answers == 100);
            }
        }
    }
    GIVEN("a controller that speaks classic") {
        Bench bench(false, HEXLOAD_BUS_CLASSIC);
        bench.link().start();
        WHEN("100 ticks are run") {
            const auto rows = bench.steps(0, 99);
            THEN("every second one is answered, and 13 answers make a row of the tick of the first") {
                CHECK(bench.counts().samples == 100);
                CHECK(bench.counts().answers == 50);
                REQUIRE(rows.size() == 3);
                CHECK(rows[0].t_s == 0.0);
                CHECK(rows[1].t_s == 0.026);
                CHECK(rows[2].t_s == 0.052);
                CHECK(rows[1].value[0] == 26.0);
            }
        }
    }
}

SCENARIO("the controller is given the estimator to run, and its answers have that one's parameters") {
    GIVEN("a simulator that wants the momentum filter, in either profile and pacing") {
        for (const bool real_time : {false, true}) {
            for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
                CAPTURE(real_time);
                CAPTURE(hexload_bus_profile_name(profile));
                Bench bench(real_time, profile);
                bench.select(EstimatorKind::momentum);
                WHEN("the link starts and 104 ticks are run") {
                    bench.link().start();
                    const auto rows = bench.steps(0, 103);
                    THEN("the controller runs it, and there are rows of all ten: each tick's, or each "
                         "52nd's") {
                        CHECK(bench.controller.filter == HEXLOAD_FILTER_MOMENTUM);
                        CHECK(bench.link().parameter_names().size() == 10);
                        REQUIRE(rows.size() == (profile == HEXLOAD_BUS_FD ? 104 : 2));
                        CHECK(rows[1].t_s == (profile == HEXLOAD_BUS_FD ? 0.001 : 0.052));
                        CHECK(rows[1].value[9] == 1000.0 * rows[1].t_s + 1.0);
                    }
                }
            }
        }
    }
    GIVEN("a controller that runs the other one all the same, in lockstep") {
        Bench bench(false);
        bench.link().start();
        bench.controller.filter = HEXLOAD_FILTER_MOMENTUM;
        WHEN("it answers") {
            const std::string failure = failure_of([&] { bench.step(0); });
            THEN("the run ends with a word about it") {
                CHECK(contains(failure, "controller: scripted: the answer to tick 0 is another estimator's"));
            }
        }
    }
    GIVEN("one that was started anew with the other one, in real time") {
        Bench bench(true);
        bench.select(EstimatorKind::momentum);
        bench.link().start();
        bench.steps(0, 9);
        bench.controller.filter = HEXLOAD_FILTER_PAPER;
        WHEN("it answers") {
            const auto rows = bench.steps(10, 300);
            THEN("it is given again, and rows go on") {
                CHECK(bench.controller.filter == HEXLOAD_FILTER_MOMENTUM);
                CHECK(bench.counts().rejoins == 1);
                CHECK(rows.size() >= 280);
            }
        }
    }
}

SCENARIO("a changed load is an event of its tick, also where no answer is due") {
    GIVEN("a controller that detects another load at ticks 7 and 20, in either profile and pacing") {
        for (const bool real_time : {false, true}) {
            for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
                CAPTURE(real_time);
                CAPTURE(hexload_bus_profile_name(profile));
                Bench bench(real_time, profile);
                bench.select(EstimatorKind::momentum);
                bench.controller.changes = {7, 20};
                WHEN("40 ticks are run") {
                    bench.link().start();
                    bench.steps(0, 39);
                    THEN("both are known, with their times, and none is missing") {
                        CHECK(bench.link().load_changes_s() == std::vector<double>{0.007, 0.020});
                        CHECK(bench.counts().events_missing == 0);
                        CHECK(bench.reported.size() == (real_time ? 2 : 0));
                    }
                }
            }
        }
    }
    GIVEN("a controller two of whose events are lost") {
        Bench bench(false);
        bench.controller.changes = {7, 20, 30};
        bench.controller.lost_events = 2;
        WHEN("40 ticks are run") {
            bench.link().start();
            bench.steps(0, 39);
            THEN("the third reports that they are missing") {
                CHECK(bench.link().load_changes_s() == std::vector<double>{0.030});
                CHECK(bench.counts().events_missing == 2);
            }
        }
    }
    GIVEN("a controller that was started anew between two changes") {
        Bench bench(true);
        bench.controller.changes = {7, 200};
        bench.link().start();
        bench.steps(0, 9);
        bench.controller.state = HEXLOAD_APP_IDLE;
        WHEN("the run goes on") {
            bench.steps(10, 300);
            THEN("the second one, which it counts as its first, is not taken for a loss") {
                CHECK(bench.link().load_changes_s() == std::vector<double>{0.007, 0.200});
                CHECK(bench.counts().events_missing == 0);
            }
        }
    }
}

SCENARIO("in lockstep a silent controller is diagnosed") {
    GIVEN("a bus without a controller") {
        Bench bench(false);
        bench.controller.deaf_to = 1000;
        WHEN("the link starts") {
            const auto before = bench.now;
            const std::string failure = failure_of([&] { bench.link().start(); });
            THEN("it says so after its time-out") {
                CHECK(contains(failure, "silent: scripted: no controller acknowledges RESET within 2000 ms"));
                CHECK(bench.now - before == 2000ms);
            }
        }
    }
    GIVEN("a controller that does not hear the first fifteen commands") {
        Bench bench(false);
        bench.controller.deaf_to = 15;
        WHEN("the link starts") {
            const std::string failure = failure_of([&] { bench.link().start(); });
            THEN("it is heard in the end") {
                CHECK(failure == "no failure");
                CHECK(bench.steps(0, 0).size() == 1);
            }
        }
    }
    GIVEN("a controller that falls silent at tick 5") {
        Bench bench(false);
        bench.controller.silent_from = 5;
        bench.link().start();
        WHEN("the run gets there") {
            bench.steps(0, 4);
            const auto before = bench.now;
            const std::string failure = failure_of([&] { bench.step(5); });
            THEN("the message names the tick, after the time-out") {
                CHECK(contains(
                    failure,
                    "silent: scripted: the controller is silent since tick 5 (last answer to tick 4)"));
                CHECK(bench.now - before >= 2000ms);
                CHECK(bench.now - before <= 2001ms);
            }
        }
    }
}

SCENARIO("a controller that was told another mass of the load is diagnosed at the start") {
    for (const bool real_time : {false, true}) {
        GIVEN("a simulator whose platform file says 500 kg") {
            Bench bench(real_time, HEXLOAD_BUS_FD);
            bench.know(500.0F);
            WHEN("the controller has 900 kg, and says so") {
                bench.controller.known_mass_kg = 900.0F;
                const std::string failure = failure_of([&] { bench.link().start(); });
                THEN("the run does not begin") {
                    CHECK(contains(failure, "told another mass of the load than this simulator's"));
                }
            }
            WHEN("it has the same, or does not tell") {
                for (const float told_kg : {500.0F, 0.0F}) {
                    bench.controller.known_mass_kg = told_kg;
                    CHECK(failure_of([&] { bench.link().start(); }) == "no failure");
                }
            }
        }
    }
}

SCENARIO("a controller with another configuration does not start, and says so") {
    GIVEN("a controller that has one, and simulators in either pacing") {
        for (const bool real_time : {false, true}) {
            CAPTURE(real_time);
            Bench bench(real_time);
            bench.controller.configuration = 0xABCDEF;
            WHEN("the simulator works with another one") {
                bench.work_with(0xABCDEE);
                const std::string failure = failure_of([&] { bench.link().start(); });
                THEN("the run does not begin, and what to do is named") {
                    CHECK(contains(
                        failure, "controller: scripted: the controller refuses START: other configuration"));
                    CHECK(contains(failure, "give both the same platform and rig files and options"));
                }
            }
            WHEN("it works with the same, of which the bus carries 24 bits") {
                bench.work_with(0x12ABCDEF);
                CHECK(failure_of([&] { bench.link().start(); }) == "no failure");
            }
        }
    }
}

SCENARIO("what a controller acknowledges to others is not taken for a second controller") {
    GIVEN("runs in either profile and pacing, and another simulator that commands the same controller") {
        for (const bool real_time : {false, true}) {
            for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
                CAPTURE(real_time);
                CAPTURE(hexload_bus_profile_name(profile));
                Bench bench(real_time, profile);
                bench.link().start();
                bench.steps(0, 9);
                WHEN("its acknowledges come") {
                    const std::string other = hear_another(bench);
                    const std::string failure = failure_of([&] { bench.steps(10, 59); });
                    THEN("the run goes on, and it has been said once who it is") {
                        CHECK(failure == "no failure");
                        REQUIRE(bench.reported.size() == 1);
                        CHECK(contains(bench.reported[0], other + " commands the controller too"));
                    }
                }
            }
        }
    }
    GIVEN("a run in lockstep that another simulator stops") {
        Bench bench(false);
        bench.link().start();
        bench.steps(0, 9);
        const std::string other = hear_another(bench);
        bench.controller.state = HEXLOAD_APP_IDLE;
        WHEN("the controller answers that it has stopped") {
            const std::string failure = failure_of([&] { bench.steps(10, 99); });
            THEN("the reason names the other one") {
                CHECK(contains(failure, other + " commands it: end one of the two"));
            }
        }
    }
}

SCENARIO("a controller of the wrong profile is diagnosed at the start") {
    GIVEN("a controller that speaks classic and a simulator that speaks FD") {
        Bench bench(false, HEXLOAD_BUS_CLASSIC);
        bench.speak(HEXLOAD_BUS_FD);
        WHEN("the link starts") {
            const std::string failure = failure_of([&] { bench.link().start(); });
            THEN("both profiles and the option are named") {
                CHECK(contains(
                    failure,
                    "profile: scripted: the controller speaks the profile classic, this simulator fd"));
                CHECK(contains(failure, "--profile"));
            }
        }
    }
}

SCENARIO("a second controller on the bus is detected") {
    GIVEN("two acknowledges of each command") {
        Bench bench(false);
        bench.controller.doubles_acknowledges = true;
        WHEN("the link starts and runs") {
            const std::string failure = failure_of([&] {
                bench.link().start();
                bench.steps(0, 9);
            });
            THEN("it says so") {
                CHECK(contains(failure,
                               "second: scripted: two acknowledges of one command: a second controller"));
            }
        }
    }
    GIVEN("two answers to a tick that differ, in lockstep or in real time") {
        for (const bool real_time : {false, true}) {
            Bench bench(real_time);
            bench.controller.doubles_answers = bench.controller.doubles_differ = true;
            bench.link().start();
            WHEN("another tick is run") {
                const std::string failure = failure_of([&] { bench.steps(0, 1); });
                THEN("it says so at once") {
                    CHECK(contains(failure, "second: scripted: two answers to"));
                }
            }
        }
    }
    GIVEN("two answers to each tick, in either profile, in lockstep or in real time") {
        for (const bool real_time : {false, true}) {
            for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
                CAPTURE(real_time);
                CAPTURE(hexload_bus_profile_name(profile));
                Bench bench(real_time, profile);
                bench.controller.doubles_answers = true;
                bench.link().start();
                WHEN("a few ticks are run") {
                    const std::string failure = failure_of([&] { bench.steps(0, 29); });
                    THEN("it says so") {
                        CHECK(
                            contains(failure, "second: scripted: all that the controller sends comes twice"));
                        CHECK(contains(failure, "a second controller is on the bus"));
                    }
                }
            }
        }
    }
}

SCENARIO("a frame that comes twice now and then is no second controller") {
    GIVEN("a controller whose answers come twice at two ticks a second") {
        for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
            Bench bench(true, profile);
            bench.link().start();
            std::size_t answered = 0;
            WHEN("three seconds are run") {
                for (std::uint32_t tick = 0; tick < 3000; ++tick) {
                    bench.controller.doubles_answers = tick % 1000 == 100;
                    answered += bench.step(tick).size();
                }
                THEN("it goes on, and the frames are counted") {
                    CHECK(answered > 0);
                    CHECK(bench.counts().refused >= 3);
                    CHECK(bench.counts().missing == 0);
                }
            }
        }
    }
}

SCENARIO("a network that delivers frames twice or in another order is no second controller") {
    GIVEN("answers whose frames come in any order, in lockstep or in real time") {
        for (const bool real_time : {false, true}) {
            Bench bench(real_time);
            std::uint32_t turn = 0;
            bench.controller.network = [&turn](std::deque<hexload_bus_frame_t>& frames) {
                const auto earlier = [](const auto& a, const auto& b) { return a.id < b.id; };
                for (std::uint32_t n = 0; n < turn % 6; ++n) {
                    std::next_permutation(frames.begin(), frames.end(), earlier);
                }
                ++turn;
            };
            bench.link().start();
            WHEN("600 ticks are run") {
                const auto rows = bench.steps(0, 599);
                THEN("each has its row") {
                    CHECK(rows.size() == 600);
                    CHECK(bench.counts().missing == 0);
                }
            }
        }
    }
    GIVEN("a fifth of the frames twice, some of them a few frames later, in either profile") {
        for (const auto profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
            Bench bench(true, profile);
            std::uint32_t n = 0;
            std::deque<hexload_bus_frame_t> later;
            bench.controller.network = [&n, &later](std::deque<hexload_bus_frame_t>& frames) {
                const auto sent = std::exchange(frames, {});
                for (const hexload_bus_frame_t& frame : sent) {
                    frames.push_back(frame);
                    if (++n % 5 == 0) {
                        (n % 10 == 0 ? frames : later).push_back(frame);
                    }
                    if (n % 7 == 0 && !later.empty()) {
                        frames.push_back(later.front());
                        later.pop_front();
                    }
                }
            };
            bench.link().start();
            std::size_t answered = 0;
            WHEN("three seconds are run") {
                answered = bench.steps(0, 2999).size();
                THEN("it goes on, none is missing, and the doubled ones are counted") {
                    CHECK(answered == (profile == HEXLOAD_BUS_FD ? 3000 : 115));
                    CHECK(bench.counts().missing == 0);
                    CHECK(bench.counts().refused >= (profile == HEXLOAD_BUS_FD ? 1700 : 280));
                }
            }
        }
    }
    GIVEN("the last frame of an answer that comes after the next answer has begun") {
        Bench bench(true);
        std::deque<hexload_bus_frame_t> held;
        bench.controller.network = [&held](std::deque<hexload_bus_frame_t>& frames) {
            std::uint32_t tick = 0;
            std::copy_n(frames.front().data, sizeof tick, reinterpret_cast<std::uint8_t*>(&tick));
            if (!held.empty()) {
                frames.insert(frames.begin() + 1, held.front());
                held.clear();
            }
            if (tick == 40) {
                held.push_back(frames.back());
                frames.pop_back();
            }
        };
        bench.link().start();
        WHEN("100 ticks are run") {
            const auto rows = bench.steps(0, 99);
            THEN("that answer is missing, and the run goes on") {
                CHECK(rows.size() == 99);
                CHECK(bench.counts().missing == 1);
                CHECK(bench.counts().refused == 1);
            }
        }
    }
    GIVEN("an answer with another estimate beside the right one, and one whose last frame differs") {
        for (const int part : {0, 1, 2}) {
            for (const bool is_last : {false, true}) {
                CAPTURE(part);
                CAPTURE(is_last);
                Bench bench(true);
                hexload_bus_answer_t other{};
                other.tick = 20;
                other.state = HEXLOAD_APP_ESTIMATING;
                other.health = 1;
                other.estimate.value[0] = 7;
                other.estimate.sigma[0] = 1;
                hexload_bus_frame_t forged[HEXLOAD_BUS_ANSWER_FRAMES];
                REQUIRE(hexload_bus_encode_answer(HEXLOAD_BUS_FD, &other, 0, forged) == 3);
                bench.controller.network = [&](std::deque<hexload_bus_frame_t>& frames) {
                    if (std::equal(forged[part].data, forged[part].data + 4, frames.front().data)) {
                        frames.insert(is_last ? frames.end() : frames.begin() + part + 1, forged[part]);
                    }
                };
                bench.link().start();
                WHEN("the tick is run") {
                    const std::string failure = failure_of([&] { bench.steps(0, 20); });
                    THEN("it is refused") {
                        CHECK(contains(failure, "second: scripted: two answers to one tick, near tick 20"));
                    }
                }
            }
        }
    }
}

SCENARIO("in lockstep answers that do not fit end the run") {
    GIVEN("a controller that answers tick 7 with the answer to tick 9") {
        Bench bench(false);
        bench.controller.instead = {{7, 9}};
        bench.link().start();
        WHEN("the run gets there") {
            const std::string failure = failure_of([&] { bench.steps(0, 8); });
            THEN("both ticks are named") {
                CHECK(contains(
                    failure,
                    "controller: scripted: answer out of order: found one to tick 9, expected tick 7"));
            }
        }
    }
    GIVEN("a controller that goes into fault at tick 3") {
        Bench bench(false);
        bench.link().start();
        bench.steps(0, 2);
        bench.controller.state = HEXLOAD_APP_FAULT;
        bench.controller.fault = HEXLOAD_FAULT_SAMPLES_REFUSED;
        WHEN("it answers") {
            const std::string failure = failure_of([&] { bench.step(3); });
            THEN("the fault is named") {
                CHECK(contains(failure, "controller: scripted: the controller is in fault"));
                CHECK(contains(failure, hexload_app_fault_name(HEXLOAD_FAULT_SAMPLES_REFUSED)));
            }
        }
    }
    GIVEN("a controller that was restarted at tick 3") {
        Bench bench(false);
        bench.link().start();
        bench.steps(0, 2);
        bench.controller.state = HEXLOAD_APP_IDLE;
        WHEN("it answers") {
            const std::string failure = failure_of([&] { bench.step(3); });
            THEN("the restart is named") {
                CHECK(contains(failure, "controller: scripted: the controller has stopped at tick 3"));
            }
        }
    }
    GIVEN("a bus that goes down after tick 2") {
        Bench bench(false);
        bench.link().start();
        bench.steps(0, 2);
        bench.is_up = false;
        WHEN("tick 3 is sent") {
            const std::string failure = failure_of([&] { bench.step(3); });
            THEN("the bus is named") {
                CHECK(contains(failure, "bus: scripted: tick 3 cannot be sent: the bus is down"));
            }
        }
    }
}

SCENARIO("in real time every tick is answered or counted") {
    GIVEN("a controller that drops two answers and is three ticks late with two more") {
        Bench bench(true);
        bench.controller.unanswered = {10, 11};
        bench.controller.held = {{20, 23}, {21, 23}, {22, 23}, {23, 23}};
        bench.link().start();
        WHEN("40 ticks are run") {
            auto rows = bench.steps(0, 39);
            const auto rest = bench.link().finish();
            rows.insert(rows.end(), rest.begin(), rest.end());
            THEN("answers and missing add up, and late ones are counted") {
                const BusCounts counts = bench.counts();
                CHECK(counts.samples == 40);
                CHECK(counts.expected == 40);
                CHECK(counts.answers == 38);
                CHECK(counts.missing == 2);
                CHECK(counts.late == 2); // 20 and 21; 22 came with the next tick
                CHECK(rows.size() == 38);
            }
        }
    }
    GIVEN("a controller that sends 1500 answers at once, after the last tick") {
        Bench bench(true);
        for (std::uint32_t tick = 0; tick < 1500; ++tick) {
            bench.controller.held.emplace(tick, 1499);
        }
        bench.link().start();
        WHEN("the ticks are run") {
            const auto rows = bench.steps(0, 1499);
            THEN("those that are more than 1000 ticks late count as missing, and have no row") {
                CHECK(bench.counts().expected == 1500);
                CHECK(bench.counts().missing == 499);
                CHECK(bench.counts().answers == 1001);
                CHECK(bench.counts().late == 999); // 1498 and 1499 are in time
                CHECK(rows.size() == 1001);
            }
        }
    }
    GIVEN("a controller that speaks classic") {
        Bench bench(true, HEXLOAD_BUS_CLASSIC);
        bench.controller.unanswered = {10};
        bench.link().start();
        WHEN("40 ticks are run") {
            bench.steps(0, 39);
            bench.link().finish();
            THEN("answers are expected at every second tick") {
                CHECK(bench.counts().expected == 20);
                CHECK(bench.counts().answers == 19);
                CHECK(bench.counts().missing == 1);
            }
        }
    }
}

SCENARIO("in real time a controller that was restarted is started again") {
    GIVEN("a run of 10 ticks") {
        Bench bench(true);
        bench.link().start();
        bench.steps(0, 9);
        WHEN("the controller says that it is idle") {
            bench.controller.state = HEXLOAD_APP_IDLE;
            const auto while_idle = bench.step(10);
            const auto rows = bench.steps(11, 300);
            THEN("it gets START, rows go on, and the rejoin is reported and counted") {
                CHECK(while_idle.empty());
                CHECK(bench.controller.state == HEXLOAD_APP_ESTIMATING);
                CHECK(rows.size() >= 289);
                CHECK(bench.counts().rejoins == 1);
                REQUIRE(bench.reported.size() == 1);
                CHECK(contains(bench.reported[0], "the controller has been started again at tick"));
            }
        }
        WHEN("the controller says that it has missed samples") {
            bench.controller.state = HEXLOAD_APP_FAULT;
            bench.controller.fault = HEXLOAD_FAULT_SAMPLE_TIMEOUT;
            bench.steps(10, 300);
            THEN("it gets RESET and START") {
                CHECK(bench.controller.state == HEXLOAD_APP_ESTIMATING);
                CHECK(bench.counts().rejoins == 1);
            }
        }
        WHEN("the controller has a fault that a new start does not mend") {
            bench.controller.state = HEXLOAD_APP_FAULT;
            bench.controller.fault = HEXLOAD_FAULT_SECOND_CONTROLLER;
            const std::string failure = failure_of([&] { bench.steps(10, 12); });
            THEN("the run ends with its name") {
                CHECK(contains(failure, "second: scripted: the controller is in fault"));
            }
        }
    }
}

SCENARIO("in real time outages are survived, reported once each way and counted") {
    GIVEN("a run of 10 ticks") {
        Bench bench(true);
        bench.link().start();
        bench.steps(0, 9);
        WHEN("the bus is down for 20 ticks") {
            bench.is_up = false;
            bench.steps(10, 29);
            bench.is_up = true;
            const auto rows = bench.steps(30, 39);
            bench.link().finish();
            THEN("the samples of the outage are counted as not sent, and the others as answered") {
                const BusCounts counts = bench.counts();
                CHECK(counts.outages == 1);
                CHECK(counts.samples == 40);
                CHECK(counts.unsent == 20);
                CHECK(counts.answers == 20);
                CHECK(counts.missing == 0);
                CHECK(rows.size() == 10);
                REQUIRE(bench.reported.size() == 2);
                CHECK(contains(bench.reported[0], "the bus is down since tick 10"));
                CHECK(contains(bench.reported[1], "the bus is up again at tick 30"));
            }
        }
        WHEN("the controller falls silent for good") {
            bench.controller.silent_from = 10;
            bench.steps(10, 4000);
            bench.link().finish();
            THEN("that is reported once, and the run ends as silent with every tick counted") {
                REQUIRE(bench.reported.size() == 1);
                CHECK(contains(bench.reported[0], "the controller is silent since tick 10"));
                CHECK(bench.counts().ends_silent);
                CHECK(bench.counts().answers == 10);
                CHECK(bench.counts().missing == 3991);
            }
        }
    }
}
