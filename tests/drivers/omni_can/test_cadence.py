"""The beat of messages without stamps, from arrivals that are late, early, bunched or missing."""

from itertools import pairwise

from drivers.interface.seeds import stream
from drivers.omni_can.cadence import Cadence

MS = 1_000_000
PERIOD_NS = 10 * MS


def heard(arrivals_ns):
    cadence = Cadence(PERIOD_NS)
    return [cadence.captured_ns(arrived_ns) for arrived_ns in arrivals_ns]


def test_random_delays_and_a_drifting_crystal_leave_a_fraction_of_their_jitter():
    random = stream(3, "cadence")
    sent = [round(i * PERIOD_NS * (1 + 100e-6)) for i in range(3000)]
    stamps = heard([sent_ns + round(float(random.exponential(0.5)) * MS) for sent_ns in sent])
    errors_ms = [(stamp_ns - sent_ns) / MS for stamp_ns, sent_ns in zip(stamps, sent, strict=True)][50:]
    assert min(errors_ms) >= 0.0
    assert max(errors_ms) < 1.5  # the delays reach 4 ms
    assert all(after > before for before, after in pairwise(stamps))


def test_a_bunch_is_spread_to_its_beat():
    bunched = [0, 10 * MS, 38 * MS, 38 * MS + 1, 40 * MS, 50 * MS]
    stamps = heard(bunched)
    assert all(abs(stamp_ns - i * PERIOD_NS) < MS // 2 for i, stamp_ns in enumerate(stamps))


def test_after_a_loss_or_a_pause_the_beat_is_found_again():
    for pause in (1, 7):  # periods
        sent = [i * PERIOD_NS for i in range(10)] + [(i + pause) * PERIOD_NS for i in range(10, 30)]
        stamps = heard(sent)
        assert stamps[15:] == sent[15:]
        assert all(stamp_ns <= sent_ns for stamp_ns, sent_ns in zip(stamps, sent, strict=True))


def test_a_sender_that_is_quicker_than_agreed_is_believed():
    sent = [i * PERIOD_NS // 2 for i in range(50)]
    assert heard(sent) == sent
