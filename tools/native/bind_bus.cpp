#include "bindings.hpp"

#include "bus/answer_assembly.h"
#include "bus/bus.h"
#include "bus/sample_assembly.h"

#include "platform_file/input_error.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace nb = nanobind;
using hexload::platform::InputError;

namespace {

using Legs = std::array<double, HEXLOAD_LEGS>;
using Parameters = std::vector<double>; // as many as the filter has
using Codes = std::vector<unsigned>;

hexload_bus_profile_t profile_of(const std::string& name) {
    for (const hexload_bus_profile_t profile : {HEXLOAD_BUS_FD, HEXLOAD_BUS_CLASSIC}) {
        if (name == hexload_bus_profile_name(profile)) {
            return profile;
        }
    }
    throw InputError("profile: found " + name + ", expected fd or classic");
}

// A frame in Python: (id, is_fd, data).
nb::tuple to_python(const hexload_bus_frame_t& frame) {
    return nb::make_tuple(frame.id, frame.is_fd, nb::bytes(frame.data, frame.length));
}

hexload_bus_frame_t from_python(const nb::tuple& frame) {
    const auto data = nb::cast<nb::bytes>(frame[2]);
    if (data.size() > HEXLOAD_BUS_FRAME_BYTES) {
        throw InputError("frame: found " + std::to_string(data.size()) + " bytes, expected 64 or fewer");
    }
    hexload_bus_frame_t result{.id = nb::cast<std::uint32_t>(frame[0]),
                               .data = {},
                               .length = static_cast<std::uint8_t>(data.size()),
                               .is_fd = nb::cast<bool>(frame[1])};
    std::copy_n(static_cast<const std::uint8_t*>(data.data()), data.size(), result.data);
    return result;
}

nb::list to_python(std::span<const hexload_bus_frame_t> frames, int count) {
    if (count < 0) {
        throw InputError(hexload_bus_status_name(static_cast<hexload_bus_status_t>(count)));
    }
    nb::list list;
    for (const hexload_bus_frame_t& frame : frames.first(static_cast<std::size_t>(count))) {
        list.append(to_python(frame));
    }
    return list;
}

template <std::size_t size> std::array<double, size> as_doubles(const hexload_real_t (&values)[size]) {
    std::array<double, size> result;
    std::copy_n(values, size, result.begin());
    return result;
}

hexload_real_t as_real(double value) {
    return static_cast<hexload_real_t>(value);
}

std::size_t parameter_count(std::uint8_t filter) {
    constexpr std::size_t load = HEXLOAD_LOAD_DIM;
    constexpr std::size_t paper = HEXLOAD_PAPER_DIM;
    return filter == HEXLOAD_FILTER_MOMENTUM ? load : paper;
}

// The parameters of a filter: that many numbers, or codes.
template <typename Values> Values parameters(const nb::dict& fields, const char* name, std::uint8_t filter) {
    Values values = nb::cast<Values>(fields[name]);
    if (values.size() != parameter_count(filter)) {
        throw InputError(std::string(name) + ": found " + std::to_string(values.size()) +
                         " entries, expected " + std::to_string(parameter_count(filter)));
    }
    return values;
}

template <std::size_t size, std::size_t capacity>
void copy_to(const std::array<double, size>& values, hexload_real_t (&out)[capacity]) {
    static_assert(size <= capacity);
    std::transform(values.begin(), values.end(), out, as_real);
}

template <typename Number> Number field(const nb::dict& fields, const char* name) {
    return nb::cast<Number>(fields[name]);
}

nb::tuple encode_sample(const std::string& profile, std::uint32_t tick, const Legs& displacement_m,
                        const Legs& velocity_m_s, const Legs& force_n) {
    hexload_leg_sample_t sample{};
    std::array<hexload_bus_frame_t, HEXLOAD_BUS_SAMPLE_FRAMES> frames;
    std::uint32_t saturated = 0;
    sample.tick = tick;
    copy_to(displacement_m, sample.displacement_m);
    copy_to(velocity_m_s, sample.velocity_m_s);
    copy_to(force_n, sample.force_n);
    const int count = hexload_bus_encode_sample(profile_of(profile), &sample, frames.data(), &saturated);
    return nb::make_tuple(to_python(frames, count), saturated);
}

// Codes of the bus: a leg is 1 to 6, and 0 none in particular.
hexload_input_fault_t input_fault(const nb::dict& fields) {
    const auto leg_code = field<std::uint32_t>(fields, "input_leg");
    return {static_cast<hexload_input_cause_t>(field<unsigned>(fields, "input_cause")),
            leg_code > 0 ? leg_code - 1 : static_cast<std::uint32_t>(HEXLOAD_LEGS), 0};
}

void add_input_fault(nb::dict& fields, const hexload_input_fault_t& input) {
    fields["input_cause"] = static_cast<unsigned>(input.cause);
    fields["input_leg"] = input.leg < HEXLOAD_LEGS ? input.leg + 1 : 0U;
}

nb::list encode_answer(const std::string& profile, const nb::dict& fields, int page) {
    hexload_bus_answer_t answer{};
    std::array<hexload_bus_frame_t, HEXLOAD_BUS_ANSWER_FRAMES> frames;
    answer.tick = field<std::uint32_t>(fields, "tick");
    answer.status = field<std::int8_t>(fields, "status");
    answer.state = field<std::uint8_t>(fields, "state");
    answer.fault = field<std::uint8_t>(fields, "fault");
    answer.missing_legs = field<std::uint8_t>(fields, "missing_legs");
    answer.health = field<std::uint16_t>(fields, "health");
    answer.input = input_fault(fields);
    answer.refused = field<std::uint32_t>(fields, "refused");
    answer.filter = field<std::uint8_t>(fields, "filter");
    std::ranges::transform(parameters<Parameters>(fields, "value", answer.filter), answer.estimate.value,
                           as_real);
    std::ranges::transform(parameters<Parameters>(fields, "sigma", answer.filter), answer.estimate.sigma,
                           as_real);
    std::ranges::transform(parameters<Codes>(fields, "parameter_verdict", answer.filter),
                           answer.estimate.parameter_verdict,
                           [](unsigned code) { return static_cast<hexload_verdict_t>(code); });
    answer.estimate.verdict = static_cast<hexload_verdict_t>(field<unsigned>(fields, "verdict"));
    answer.estimate.nis = static_cast<hexload_real_t>(field<double>(fields, "nis"));
    answer.estimate.nis_mean = static_cast<hexload_real_t>(field<double>(fields, "nis_mean"));
    return to_python(frames, hexload_bus_encode_answer(profile_of(profile), &answer, page, frames.data()));
}

nb::dict as_dict(const hexload_bus_answer_t& answer) {
    const std::size_t count = parameter_count(answer.filter);
    nb::dict fields;
    fields["tick"] = answer.tick;
    fields["status"] = static_cast<int>(answer.status);
    fields["state"] = answer.state;
    fields["fault"] = answer.fault;
    fields["missing_legs"] = answer.missing_legs;
    fields["filter"] = answer.filter;
    fields["health"] = answer.health;
    add_input_fault(fields, answer.input);
    fields["refused"] = answer.refused;
    fields["value"] = Parameters(answer.estimate.value, answer.estimate.value + count);
    fields["sigma"] = Parameters(answer.estimate.sigma, answer.estimate.sigma + count);
    fields["parameter_verdict"] =
        Codes(answer.estimate.parameter_verdict, answer.estimate.parameter_verdict + count);
    fields["verdict"] = static_cast<unsigned>(answer.estimate.verdict);
    fields["nis"] = static_cast<double>(answer.estimate.nis);
    fields["nis_mean"] = static_cast<double>(answer.estimate.nis_mean);
    return fields;
}

nb::tuple encode_command(std::uint8_t kind, std::uint8_t sequence, float argument, std::uint8_t source,
                         std::uint16_t session, std::uint32_t configuration) {
    const hexload_bus_command_t command{.kind = kind,
                                        .source = source,
                                        .session = session,
                                        .sequence = sequence,
                                        .argument = argument,
                                        .configuration = configuration};
    hexload_bus_frame_t frame;
    const hexload_bus_status_t status = hexload_bus_encode_command(&command, &frame);
    if (status != HEXLOAD_BUS_OK) {
        throw InputError(hexload_bus_status_name(status));
    }
    return to_python(frame);
}

// What a decoder found: the status' name and, when it is "ok", the fields.
nb::tuple found(hexload_bus_status_t status, const nb::dict& fields) {
    const nb::object result = status == HEXLOAD_BUS_OK ? nb::object(fields) : nb::none();
    return nb::make_tuple(hexload_bus_status_name(status), result);
}

nb::tuple decode_command(const nb::tuple& bytes) {
    const hexload_bus_frame_t frame = from_python(bytes);
    hexload_bus_command_t command{};
    const hexload_bus_status_t status = hexload_bus_decode_command(&frame, &command);
    nb::dict fields;
    fields["kind"] = command.kind;
    fields["source"] = command.source;
    fields["session"] = command.session;
    fields["sequence"] = command.sequence;
    fields["argument"] = static_cast<double>(command.argument);
    fields["configuration"] = command.configuration;
    return found(status, fields);
}

nb::tuple encode_acknowledge(const nb::dict& fields) {
    const hexload_bus_acknowledge_t acknowledge{
        .kind = field<std::uint8_t>(fields, "kind"),
        .source = field<std::uint8_t>(fields, "source"),
        .session = field<std::uint16_t>(fields, "session"),
        .sequence = field<std::uint8_t>(fields, "sequence"),
        .counter = field<std::uint8_t>(fields, "counter"),
        .result = field<std::uint8_t>(fields, "result"),
        .state = field<std::uint8_t>(fields, "state"),
        .fault = field<std::uint8_t>(fields, "fault"),
        .profile = field<std::uint8_t>(fields, "profile"),
        .known_mass_crc = field<std::uint8_t>(fields, "known_mass_crc"),
    };
    hexload_bus_frame_t frame;
    hexload_bus_encode_acknowledge(&acknowledge, &frame);
    return to_python(frame);
}

nb::tuple decode_acknowledge(const nb::tuple& bytes) {
    const hexload_bus_frame_t frame = from_python(bytes);
    hexload_bus_acknowledge_t acknowledge{};
    const hexload_bus_status_t status = hexload_bus_decode_acknowledge(&frame, &acknowledge);
    nb::dict fields;
    fields["kind"] = acknowledge.kind;
    fields["source"] = acknowledge.source;
    fields["session"] = acknowledge.session;
    fields["sequence"] = acknowledge.sequence;
    fields["counter"] = acknowledge.counter;
    fields["result"] = acknowledge.result;
    fields["state"] = acknowledge.state;
    fields["fault"] = acknowledge.fault;
    fields["profile"] = acknowledge.profile;
    fields["known_mass_crc"] = acknowledge.known_mass_crc;
    return found(status, fields);
}

nb::tuple encode_status(const nb::dict& fields, int page) {
    hexload_bus_controller_status_t status{};
    std::ranges::copy(field<std::array<std::uint8_t, 3>>(fields, "version"), status.version);
    status.counter = field<std::uint8_t>(fields, "counter");
    status.profile = field<std::uint8_t>(fields, "profile");
    status.state = field<std::uint8_t>(fields, "state");
    status.fault = field<std::uint8_t>(fields, "fault");
    status.tick = field<std::uint32_t>(fields, "tick");
    status.overruns = field<std::uint32_t>(fields, "overruns");
    status.stack_margin_bytes = field<std::uint32_t>(fields, "stack_margin_bytes");
    status.time_margin_us = field<std::int32_t>(fields, "time_margin_us");
    status.samples_missing = field<std::uint32_t>(fields, "samples_missing");
    status.frames_refused = field<std::uint32_t>(fields, "frames_refused");
    status.samples_refused = field<std::uint32_t>(fields, "samples_refused");
    status.load_changes = field<std::uint16_t>(fields, "load_changes");
    status.input = input_fault(fields);
    status.input.excess_n = static_cast<hexload_real_t>(field<float>(fields, "excess_force_n"));
    status.known_mass_kg = field<float>(fields, "known_mass_kg");
    status.configuration = field<std::uint32_t>(fields, "configuration");
    hexload_bus_frame_t frame;
    hexload_bus_encode_status(&status, page, &frame);
    return to_python(frame);
}

// The status after a page was put over one of zeros.
nb::tuple decode_status(const nb::tuple& bytes) {
    const hexload_bus_frame_t frame = from_python(bytes);
    hexload_bus_controller_status_t status{};
    const hexload_bus_status_t result = hexload_bus_decode_status(&frame, &status);
    nb::dict fields;
    fields["version"] = std::array<unsigned, 3>{status.version[0], status.version[1], status.version[2]};
    fields["counter"] = status.counter;
    fields["profile"] = status.profile;
    fields["state"] = status.state;
    fields["fault"] = status.fault;
    fields["tick"] = status.tick;
    fields["overruns"] = status.overruns;
    fields["stack_margin_bytes"] = status.stack_margin_bytes;
    fields["time_margin_us"] = status.time_margin_us;
    fields["samples_missing"] = status.samples_missing;
    fields["frames_refused"] = status.frames_refused;
    fields["samples_refused"] = status.samples_refused;
    fields["load_changes"] = status.load_changes;
    add_input_fault(fields, status.input);
    fields["excess_force_n"] = static_cast<double>(status.input.excess_n);
    fields["known_mass_kg"] = static_cast<double>(status.known_mass_kg);
    fields["configuration"] = status.configuration;
    return found(result, fields);
}

nb::tuple encode_load_change(std::uint32_t tick, std::uint16_t load_changes) {
    const hexload_bus_load_change_t change{.tick = tick, .load_changes = load_changes};
    hexload_bus_frame_t frame;
    hexload_bus_encode_load_change(&change, &frame);
    return to_python(frame);
}

nb::tuple decode_load_change(const nb::tuple& bytes) {
    const hexload_bus_frame_t frame = from_python(bytes);
    hexload_bus_load_change_t change{};
    const hexload_bus_status_t status = hexload_bus_decode_load_change(&frame, &change);
    nb::dict fields;
    fields["tick"] = change.tick;
    fields["load_changes"] = change.load_changes;
    return found(status, fields);
}

class SampleAssembly {
  public:
    explicit SampleAssembly(const std::string& profile) {
        hexload_sample_assembly_init(&assembly_, profile_of(profile));
    }

    nb::tuple add(const nb::tuple& bytes) {
        const hexload_bus_frame_t frame = from_python(bytes);
        hexload_leg_sample_t sample{};
        const hexload_bus_status_t status = hexload_sample_assembly_add(&assembly_, &frame, &sample);
        nb::dict fields;
        fields["tick"] = sample.tick;
        fields["displacement_m"] = as_doubles(sample.displacement_m);
        fields["velocity_m_s"] = as_doubles(sample.velocity_m_s);
        fields["force_n"] = as_doubles(sample.force_n);
        return found(status, fields);
    }

  private:
    hexload_sample_assembly_t assembly_{};
};

class AnswerAssembly {
  public:
    explicit AnswerAssembly(const std::string& profile) {
        hexload_answer_assembly_init(&assembly_, profile_of(profile));
    }

    nb::tuple add(const nb::tuple& bytes, std::uint32_t near_tick) {
        const hexload_bus_frame_t frame = from_python(bytes);
        hexload_bus_answer_t answer{};
        const hexload_bus_status_t status =
            hexload_answer_assembly_add(&assembly_, &frame, near_tick, &answered_tick_, &answer);
        return found(status, as_dict(answer));
    }

    std::uint32_t answered_tick() const {
        return answered_tick_;
    }

    bool is_in_order() const {
        return (assembly_.parts & (assembly_.parts + 1U)) == 0;
    }

  private:
    hexload_answer_assembly_t assembly_{};
    std::uint32_t answered_tick_ = 0;
};

} // namespace

void bind_bus(nb::module_& module) {
    nb::module_ bus = module.def_submodule(
        "bus", "The firmware's CAN codec. A frame is a tuple (id, is_fd, data); decoders return the name of "
               "the status and,\nwhen that is \"ok\", a dict of what bus.h calls the fields, else None.");
    bus.def("encode_sample", &encode_sample, nb::arg("profile"), nb::arg("tick"), nb::arg("displacement_m"),
            nb::arg("velocity_m_s"), nb::arg("force_n"),
            "(frames, number of saturated channels). ValueError: a channel is not finite.");
    bus.def("encode_answer", &encode_answer, nb::arg("profile"), nb::arg("answer"), nb::arg("page"),
            "Frames of an answer: all (fd) or one page (classic). ValueError: a number is not finite.");
    bus.def("encode_command", &encode_command, nb::arg("kind"), nb::arg("sequence"), nb::arg("argument"),
            nb::arg("source") = static_cast<unsigned>(HEXLOAD_SOURCE_UNKNOWN), nb::arg("session") = 0,
            nb::arg("configuration") = 0);
    bus.def("decode_command", &decode_command, nb::arg("frame"));
    bus.def("encode_acknowledge", &encode_acknowledge, nb::arg("acknowledge"));
    bus.def("decode_acknowledge", &decode_acknowledge, nb::arg("frame"));
    bus.def("encode_status", &encode_status, nb::arg("status"), nb::arg("page"));
    bus.def("decode_status", &decode_status, nb::arg("frame"), "Fields of the other pages are 0.");
    bus.def("encode_load_change", &encode_load_change, nb::arg("tick"), nb::arg("load_changes"));
    bus.def("decode_load_change", &decode_load_change, nb::arg("frame"));
    nb::class_<SampleAssembly>(bus, "SampleAssembly", "Leg samples from frames.")
        .def(nb::init<const std::string&>(), nb::arg("profile"))
        .def("add", &SampleAssembly::add, nb::arg("frame"));
    nb::class_<AnswerAssembly>(bus, "AnswerAssembly", "Answers from frames.")
        .def(nb::init<const std::string&>(), nb::arg("profile"))
        .def("add", &AnswerAssembly::add, nb::arg("frame"), nb::arg("near_tick"))
        .def_prop_ro(
            "answered_tick", &AnswerAssembly::answered_tick,
            "Of the last frame that was taken: the tick that it answers, or had just been processed.")
        .def_prop_ro("is_in_order", &AnswerAssembly::is_in_order,
                     "Whether no frame is missing before those of the answer that have come.");
}
