"""A Rerun recording of ours: how it names itself, and that errors in it are errors."""

import rerun as rr

APPLICATION = "trundle"


def new_recording(recording_id: str | None = None) -> rr.RecordingStream:
    """Return a stream without a sink yet; streams with the same id are one recording to the viewer."""
    rr.set_strict_mode(True)
    stream = rr.RecordingStream(APPLICATION, recording_id=recording_id, send_properties=False)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    return stream
