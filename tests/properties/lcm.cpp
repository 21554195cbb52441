#include "transport/lcm_messages.hpp"

#include <hexload_lcm/session.hpp>

#include <doctest/doctest.h>

#include <functional>
#include <vector>

using namespace hexload;
using namespace std::chrono_literals;

namespace {

constexpr hexload_bus_filter_t both_filters[] = {HEXLOAD_FILTER_PAPER, HEXLOAD_FILTER_MOMENTUM};

int parameters_of(hexload_bus_filter_t filter) {
    return filter == HEXLOAD_FILTER_MOMENTUM ? 10 : 4;
}

// Every field has a value of its own.
hexload_bus_answer_t some_answer(hexload_bus_filter_t filter) {
    hexload_bus_answer_t answer{};
    answer.tick = 4'294'967'295U;
    answer.status = HEXLOAD_ERR_POSE;
    answer.state = HEXLOAD_APP_CONVERGED;
    answer.fault = HEXLOAD_FAULT_SAMPLES_REFUSED;
    answer.missing_legs = 0x2A;
    answer.filter = static_cast<std::uint8_t>(filter);
    answer.health = 0x1A5;
    answer.input = {HEXLOAD_INPUT_VELOCITY_SIGN, 2, 0};
    answer.refused = 123'456;
    for (int k = 0; k < parameters_of(filter); ++k) {
        answer.estimate.value[k] = static_cast<hexload_real_t>(1.5 + k);
        answer.estimate.sigma[k] = static_cast<hexload_real_t>(0.25 + k);
        answer.estimate.parameter_verdict[k] = static_cast<hexload_verdict_t>(k % 4);
    }
    answer.estimate.verdict = HEXLOAD_VERDICT_INCONSISTENT;
    answer.estimate.nis = 3.25F;
    answer.estimate.nis_mean = 2.75F;
    return answer;
}

} // namespace

TEST_CASE("the channel of a type has its name") {
    CHECK(message::channel_of<leg_sample_t>() == "HEXLOAD_LEG_SAMPLE");
    CHECK(message::channel_of<estimate_t>() == "HEXLOAD_ESTIMATE");
}

TEST_CASE("an option names LCM with or without a URL, and nothing else") {
    CHECK(message::url_of("lcm") == message::default_url);
    CHECK(message::url_of("lcm:memq://") == "memq://");
    for (const char* bad : {"", "lcm:", "lcmx", "udpm://239.255.76.67:7667", "can0"}) {
        CAPTURE(bad);
        CHECK_THROWS_AS(message::url_of(bad), message::UrlError);
    }
}

TEST_CASE("a URL that LCM does not know is refused with an example") {
    CHECK_THROWS_WITH_AS(message::Session("carrier-pigeon://"),
                         "carrier-pigeon://: found no way to open it, expected an LCM URL, e.g. "
                         "udpm://239.255.76.67:7667?ttl=0",
                         message::SessionError);
}

TEST_CASE("lost messages are counted, a restarted source is not a loss") {
    // GIVEN a channel that loses 2 and then 1 message, and whose source begins anew twice
    message::GapCounter counter;
    for (const std::int64_t sequence : {5, 6, 9, 10, 12, 0, 1, 1}) {
        counter.take(sequence);
    }
    // THEN what came before the first message is unknown, and the rest is accounted for
    CHECK(counter.received() == 8);
    CHECK(counter.lost() == 3);
    CHECK(counter.restarts() == 2);
}

TEST_CASE("messages arrive in order with numbers that follow one another") {
    // GIVEN a session whose messages come back to it
    message::Session session("udpm://239.255.76.67:7689?ttl=0");
    std::vector<std::int64_t> sequences;
    const message::GapCounter& counter = session.subscribe<leg_sample_t>(
        [&](const leg_sample_t& sample) { sequences.push_back(sample.sequence); });
    // WHEN more are sent than LCM's own limit of 30, before any is read
    message::Publisher<leg_sample_t> publisher(session);
    for (int k = 0; k < 100; ++k) {
        leg_sample_t sample{};
        CHECK(publisher.send(sample));
    }
    while (sequences.size() < 100 && session.handle(2000ms)) {
    }
    // THEN none is dropped
    REQUIRE(sequences.size() == 100);
    CHECK(sequences.front() == 0);
    CHECK(sequences.back() == 99);
    CHECK(counter.lost() == 0);
    CHECK(publisher.sent() == 100);
    CHECK(publisher.failed() == 0);
}

TEST_CASE("a message that claims more than it holds is refused and counted") {
    estimate_t message = transport::estimate_message(some_answer(HEXLOAD_FILTER_PAPER));
    std::vector<std::uint8_t> encoded(static_cast<std::size_t>(message.getEncodedSize()));
    REQUIRE(message.encode(encoded.data(), 0, static_cast<int>(encoded.size())) > 0);
    int heard = 0;
    hexload::message::Taker<estimate_t> taker;
    taker.handler = [&heard](const estimate_t&) { ++heard; };
    taker.take(encoded);
    CHECK(heard == 1);
    constexpr std::size_t name_at = 24; // behind fingerprint, sequence and tick
    const std::size_t count_at = name_at + 4 + message.filter.size() + 1;
    for (const std::size_t at : {count_at, name_at}) {
        for (const std::uint8_t first :
             std::initializer_list<std::uint8_t>{0x7F, 0xFF, 0x80}) { // 2^31 - 1, -1, -2^31
            auto claims = encoded;
            std::fill_n(claims.begin() + static_cast<std::ptrdiff_t>(at), 4, std::uint8_t{0xFF});
            claims[at] = first;
            taker.take(claims);
        }
        taker.take(std::span(encoded).first(at));
    }
    // and a text of no length, which has not even its end, of a negative one and of the most negative one:
    // the verdict, before the two numbers at the end
    const std::size_t verdict_at = encoded.size() - 8 - message.verdict.size() - 1 - 4;
    for (const std::uint8_t first : std::initializer_list<std::uint8_t>{0, 0xFF, 0x80}) {
        auto without_end = encoded;
        std::fill_n(without_end.begin() + static_cast<std::ptrdiff_t>(verdict_at), 4, std::uint8_t{0});
        without_end[verdict_at] = first;
        taker.take(without_end);
    }
    CHECK(heard == 1);
    CHECK(taker.counter.refused() == 11);
}

TEST_CASE("an answer of either filter is the same after its two messages") {
    for (const hexload_bus_filter_t filter : both_filters) {
        CAPTURE(hexload_bus_filter_name(filter));
        const hexload_bus_answer_t answer = some_answer(filter);
        const estimate_t estimate = transport::estimate_message(answer);
        const auto again = transport::answer_of(estimate, transport::health_message(answer, 7));
        REQUIRE(again);
        CHECK(estimate.filter == hexload_bus_filter_name(filter));
        CHECK(estimate.count == parameters_of(filter));
        CHECK(again->tick == answer.tick);
        CHECK(again->status == answer.status);
        CHECK(again->state == answer.state);
        CHECK(again->fault == answer.fault);
        CHECK(again->missing_legs == answer.missing_legs);
        CHECK(again->filter == answer.filter);
        CHECK(again->health == answer.health);
        CHECK(again->input.cause == answer.input.cause);
        CHECK(again->input.leg == answer.input.leg);
        CHECK(again->refused == answer.refused);
        for (int k = 0; k < parameters_of(filter); ++k) {
            CHECK(again->estimate.value[k] == answer.estimate.value[k]);
            CHECK(again->estimate.sigma[k] == answer.estimate.sigma[k]);
            CHECK(again->estimate.parameter_verdict[k] == answer.estimate.parameter_verdict[k]);
        }
        CHECK(again->estimate.verdict == answer.estimate.verdict);
        CHECK(again->estimate.nis == answer.estimate.nis);
        CHECK(again->estimate.nis_mean == answer.estimate.nis_mean);
    }
}

TEST_CASE("health is reported in words") {
    hexload_bus_answer_t answer = some_answer(HEXLOAD_FILTER_PAPER);
    CHECK(transport::health_message(answer, 7).samples_missing == 7);
    // and its health bits 0, 2, 5, 7 and 8 are reported in words
    CHECK(transport::health_message(answer, 7).health ==
          std::string(hexload_health_name(HEXLOAD_HEALTH_LEG_OUT_OF_STROKE)) + ", " +
              hexload_health_name(HEXLOAD_HEALTH_RATE_RESEEDED) + ", " +
              hexload_health_name(HEXLOAD_HEALTH_COVARIANCE_BOUNDED) + ", " +
              hexload_health_name(HEXLOAD_HEALTH_INCONSISTENT) + ", " +
              hexload_health_name(static_cast<hexload_health_bit_t>(8)));
    // and so is its input fault, with the leg
    CHECK(transport::health_message(answer, 7).input_fault ==
          std::string("leg 3: ") + hexload_input_fault_text(HEXLOAD_INPUT_VELOCITY_SIGN));
    answer.input = {HEXLOAD_INPUT_KNOWN_MASS, HEXLOAD_LEGS, static_cast<hexload_real_t>(4905.2)};
    CHECK(transport::health_message(answer, 7).input_fault.starts_with(
        "the legs carry 4905 N more than the known mass explains: "));
    answer.input.excess_n = static_cast<hexload_real_t>(-490.6);
    CHECK(transport::health_message(answer, 7).input_fault.starts_with(
        "the legs carry 491 N less than the known mass explains: "));
}

TEST_CASE("an answer with an unknown word, another filter or an impossible tick is refused") {
    const hexload_bus_answer_t answer = some_answer(HEXLOAD_FILTER_MOMENTUM);
    const std::string unknown_word = "asleep";
    const estimate_t estimate = transport::estimate_message(answer);
    const health_t health = transport::health_message(answer, 0);
    const auto is_refused = [&](auto change) {
        estimate_t e = estimate;
        health_t h = health;
        change(e, h);
        return !transport::answer_of(e, h);
    };
    CHECK_FALSE(is_refused([](estimate_t&, health_t&) {}));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.verdict = unknown_word; }));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.parameter_verdict[2] = unknown_word; }));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.name[0] = unknown_word; }));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.count = 0; }));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.filter = unknown_word; }));
    CHECK(is_refused([&](estimate_t& e, health_t&) { e.filter = "paper"; })); // which has no ten parameters
    CHECK(is_refused([&](estimate_t&, health_t& h) { h.state = unknown_word; }));
    CHECK(is_refused([&](estimate_t&, health_t& h) { h.fault = unknown_word; }));
    CHECK(is_refused([&](estimate_t&, health_t& h) { h.status = unknown_word; }));
    CHECK(is_refused([&](estimate_t&, health_t& h) { h.tick = -1; }));
    CHECK(is_refused([&](estimate_t&, health_t& h) { h.tick = 4'294'967'296; }));
}

TEST_CASE(
    "samples, commands, events and acknowledges are the same after the wire, out-of-range ones are refused") {
    hexload_leg_sample_t sample{};
    sample.tick = 77;
    for (int leg = 0; leg < HEXLOAD_LEGS; ++leg) {
        sample.displacement_m[leg] = 0.125F + static_cast<float>(leg);
        sample.velocity_m_s[leg] = 10.5F + static_cast<float>(leg);
        sample.force_n[leg] = -100.25F - static_cast<float>(leg);
    }
    leg_sample_t told = transport::leg_sample_message(sample);
    const auto sample_again = transport::leg_sample_of(told);
    REQUIRE(sample_again);
    CHECK(sample_again->tick == 77);
    CHECK(sample_again->displacement_m[5] == sample.displacement_m[5]);
    CHECK(sample_again->velocity_m_s[4] == sample.velocity_m_s[4]);
    CHECK(sample_again->force_n[3] == sample.force_n[3]);
    told.tick = -1;
    CHECK_FALSE(transport::leg_sample_of(told));

    command_t command = transport::command_message({.kind = HEXLOAD_COMMAND_SET_KNOWN_MASS,
                                                    .source = HEXLOAD_SOURCE_MONITOR,
                                                    .session = 4095,
                                                    .sequence = 255,
                                                    .argument = 512.5F,
                                                    .configuration = 0x12345678},
                                                   9);
    CHECK(command.tick == 9);
    const auto command_again = transport::command_of(command);
    REQUIRE(command_again);
    CHECK(command_again->kind == HEXLOAD_COMMAND_SET_KNOWN_MASS);
    CHECK(command_again->sequence == 255);
    CHECK(command_again->argument == 512.5F);
    CHECK(command_again->source == HEXLOAD_SOURCE_MONITOR);
    CHECK(command_again->session == 4095);
    CHECK(command_again->configuration == 0x345678);
    for (const auto& spoil : {std::function<void(command_t&)>([](command_t& c) { c.id = 256; }),
                              std::function<void(command_t&)>([](command_t& c) { c.source = -1; }),
                              std::function<void(command_t&)>([](command_t& c) { c.session = 4096; }),
                              std::function<void(command_t&)>([](command_t& c) { c.configuration = -1; })}) {
        command_t other = command;
        spoil(other);
        CHECK_FALSE(transport::command_of(other));
    }

    load_change_t change = transport::load_change_message({4'294'967'295U, 65'535});
    CHECK(change.tick == 4'294'967'295);
    const auto change_again = transport::load_change_of(change);
    REQUIRE(change_again);
    CHECK(change_again->tick == 4'294'967'295U);
    CHECK(change_again->load_changes == 65'535);
    change.load_changes = 65'536;
    CHECK_FALSE(transport::load_change_of(change));
    change = {};
    change.tick = -1;
    CHECK_FALSE(transport::load_change_of(change));

    const hexload_bus_acknowledge_t acknowledge{.kind = HEXLOAD_COMMAND_START,
                                                .source = HEXLOAD_SOURCE_SIMULATOR,
                                                .session = 77,
                                                .sequence = 8,
                                                .counter = 0,
                                                .result = HEXLOAD_RESULT_WRONG_STATE,
                                                .state = HEXLOAD_APP_FAULT,
                                                .fault = HEXLOAD_FAULT_SAMPLE_TIMEOUT,
                                                .profile = HEXLOAD_BUS_FD,
                                                .known_mass_crc = 0};
    acknowledge_t reply = transport::acknowledge_message(acknowledge, 5);
    CHECK(reply.done == 0);
    const auto reply_again = transport::acknowledge_of(reply);
    REQUIRE(reply_again);
    CHECK(reply_again->kind == acknowledge.kind);
    CHECK(reply_again->sequence == acknowledge.sequence);
    CHECK(reply_again->source == acknowledge.source);
    CHECK(reply_again->session == acknowledge.session);
    CHECK(reply_again->result == acknowledge.result);
    CHECK(reply_again->state == acknowledge.state);
    CHECK(reply_again->fault == acknowledge.fault);
    reply.result = reply.state;
    CHECK_FALSE(transport::acknowledge_of(reply));
}
