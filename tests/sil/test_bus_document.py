"""The CAN contract keeps what it promises: documented signals, bus load, quantisation; its document is up to date."""

import pytest

from hexload.io.end_to_end import UNCHECKED, checksum
from hexload_dev import bus_document as verb


@pytest.fixture(scope="module")
def contract():
    return verb.load_contract()


def signals(contract):
    return [(message, signal) for message in contract.messages for signal in message.signals]


def protected(contract):
    return [message for message in contract.messages if message.frame_id not in UNCHECKED]


def test_the_committed_document_is_the_generated_one():
    assert verb.DOCUMENT.read_text() == verb.document(), "write it anew: tools/hexload bus-document"


def test_every_frame_says_what_it_is_who_sends_it_and_in_which_profile(contract):
    for message in contract.messages:
        assert message.comment, message.name
        assert message.senders in (["SIMULATOR"], ["CONTROLLER"]), message.name
        assert message.is_fd == (verb.profile(message) == "fd"), message.name
        assert message.is_fd == (message.length > 8), message.name  # the C code tells FD frames by that


def test_every_signal_has_comment_range_and_a_unit_or_names_of_its_codes(contract):
    for message, signal in signals(contract):
        name = f"{message.name}.{signal.name}"
        assert signal.comment, name
        assert signal.minimum is not None and signal.maximum is not None and signal.minimum <= signal.maximum, name
        assert bool(signal.unit) != bool(signal.choices), name
        assert signal.byte_order == "little_endian", name


def test_every_range_fits_into_its_bits(contract):
    for message, signal in signals(contract):
        if signal.is_float:
            continue
        least = -(2 ** (signal.length - 1)) if signal.is_signed else 0
        most = 2 ** (signal.length - signal.is_signed) - 1
        assert least <= round(float(signal.minimum) / float(signal.scale)), f"{message.name}.{signal.name}"
        highest = signal.maximum if signal.scale == 1 else round(float(signal.maximum) / float(signal.scale))
        assert most >= highest, f"{message.name}.{signal.name}"


def test_every_frame_has_its_checksum_and_counter_where_the_profile_has_them(contract):
    # GIVEN that the C code writes and reads them there
    for message in protected(contract):
        signals = {signal.name: (signal.start, signal.length) for signal in message.signals}
        if message.is_fd:
            assert signals["crc32"] == (8 * message.length - 32, 32), message.name
            assert signals["tick"] == (0, 32), message.name
        else:
            assert signals["crc8"] == (0, 8), message.name
            counter = "tick_low" if message.name.startswith("LegSample") else "counter"
            assert signals[counter] == (8, 4), message.name


def test_no_two_frames_have_the_same_data_id(contract):
    for is_fd in (False, True):
        # GIVEN frames of one format, of one content WHEN they are sealed THEN their checksums differ
        identifiers = [message.frame_id for message in protected(contract) if message.is_fd == is_fd]
        checksums = {checksum(identifier, bytes(64 if is_fd else 8)) for identifier in identifiers}
        assert len(checksums) == len(identifiers)


def test_no_two_counters_have_the_same_checksum_and_fewer_than_four_flipped_bits_are_found(contract):
    # GIVEN a leg frame WHEN any one, two or three of its bits are flipped, checksum and counter among them
    data = bytes(8)
    flips = [1 << bit for bit in range(64)]
    # the checksum is linear: what each bit changes in it, and in the byte where it stands
    syndromes = {}
    sound = checksum(0x081, data)
    for flip in flips:
        flipped = flip.to_bytes(8, "little")
        syndromes[flip] = checksum(0x081, flipped) ^ sound ^ flipped[0]
    # THEN the checksum is wrong: no sum of up to three such changes is 0
    found = list(syndromes.values())
    pairs = {a ^ b for n, a in enumerate(found) for b in found[:n]}
    assert 0 not in found and 0 not in pairs and not pairs & set(found)


def test_longest_frames_are_those_of_the_standards(contract):
    # Davis et al. 2007, "Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised"
    assert verb.classic_bits(8) == 135
    assert verb.classic_bits(0) == 55
    # By hand, n = 64: 17 + 4 + 13 bits; 5 + 512 + 129 + 4 + 21 + 7 bits
    assert verb.fd_bits(64) == verb.FdBits(nominal=34, data=678)
    # The shorter checksum, n = 16: 5 + 128 + 33 + 4 + 17 + 6
    assert verb.fd_bits(16) == verb.FdBits(nominal=34, data=193)


@pytest.mark.parametrize("filter_name", ["paper", "momentum"])
def test_the_bus_is_less_than_ninety_percent_busy_in_either_profile(contract, filter_name):
    assert 0.5 < verb.bus_load(contract, "classic", filter_name) < verb.MOST_LOAD
    assert 0.3 < verb.bus_load(contract, "fd", filter_name) < verb.MOST_LOAD


def test_both_filters_load_the_classic_bus_alike(contract):
    # GIVEN that the document has one table for both
    assert verb.messages_of(contract, "classic", "paper") == verb.messages_of(contract, "classic", "momentum")


@pytest.mark.parametrize("filter_name, parameters", [("paper", 4), ("momentum", 10)])
def test_an_answer_has_a_page_for_each_number_and_for_what_the_document_counts(contract, filter_name, parameters):
    # GIVEN the pages that a round has: health, values, sigmas, NIS, its mean, status, refused; verdicts apart for ten
    expected = 1 + 2 * parameters + 2 + 1 + 1 + (filter_name == "momentum")
    # THEN the document counts as many, and the contract has a signal for each number
    assert verb.ANSWER_PAGES[filter_name] == expected
    page = contract.get_message_by_name("AnswerPage")
    of_load = [signal for signal in page.signals if "load_" in signal.name]
    assert len(of_load) == 30


def test_quantisation_is_below_a_tenth_of_the_nominal_noise(contract):
    found = list(verb.quantisations(contract))
    assert len(found) == 2 * 18  # three channels of six legs in two profiles
    for quantisation in found:
        assert quantisation.ratio < verb.MOST_QUANTISATION, quantisation


def test_all_legs_have_the_steps_and_ranges_of_the_first(contract):
    # GIVEN that the C code takes the steps of all legs from the first
    fd = contract.get_message_by_name("LegSampleFd")
    for kind in ("displacement", "velocity", "force"):
        legs = [fd.get_signal_by_name(f"{kind}_{leg}") for leg in range(1, 7)]
        assert len({(leg.scale, leg.offset, leg.minimum, leg.maximum, leg.length) for leg in legs}) == 1
    classic = [contract.get_message_by_name(f"LegSample{leg}") for leg in range(1, 7)]
    layouts = {
        tuple((s.name, s.start, s.length, s.scale, s.offset, s.minimum, s.maximum, s.is_signed) for s in leg.signals)
        for leg in classic
    }
    assert len(layouts) == 1
