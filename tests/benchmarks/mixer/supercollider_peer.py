# SPDX-License-Identifier: Apache-2.0
"""scsynth's Klank, rendering offline: the synth definition and the score are written here, byte by byte, so that no
client of it is needed."""

import os
import resource
import statistics
import struct
import subprocess

AUDIO_RATE = 2


def cpu_seconds(command, **options):
    """CPU seconds, of the user's side, that a command takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, **options)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def rate(run, short_s, long_s, times=3):
    """Seconds of sound a CPU second: run(seconds) returns CPU seconds; its fixed costs cancel out. The median."""
    return statistics.median((long_s - short_s) / max(run(long_s) - run(short_s), 1e-6) for _ in range(times))


def _name(text):
    return bytes([len(text)]) + text.encode()


def _ugen(name, rate, inputs, output_count):
    data = _name(name) + struct.pack(">biih", rate, len(inputs), output_count, 0)
    for source, index in inputs:
        data += struct.pack(">ii", source, index)
    return data + bytes([rate]) * output_count


def synth_definition(modes):
    """Impulse -> Klank -> Out. Constants first: 0, 1, then each mode's frequency, amplitude and ringing time."""
    constants = [0.0, 1.0] + [value for f, t60, a in modes for value in (f, a, t60)]
    constant = [(-1, i) for i in range(len(constants))]
    ugens = [
        _ugen("Impulse", AUDIO_RATE, [constant[0], constant[0]], 1),
        _ugen("Klank", AUDIO_RATE, [(0, 0), constant[1], constant[0], constant[1]] + constant[2:], 1),
        _ugen("Out", AUDIO_RATE, [constant[0], (1, 0)], 0),
    ]
    data = _name("klank") + struct.pack(">i", len(constants))
    data += struct.pack(f">{len(constants)}f", *constants)
    data += struct.pack(">iii", 0, 0, len(ugens)) + b"".join(ugens) + struct.pack(">h", 0)
    return b"SCgf" + struct.pack(">ih", 2, 1) + data


def _padded(data):
    return data + b"\0" * (4 - len(data) % 4)


def _message(address, types, *values):
    data = _padded(address.encode()) + _padded(b"," + types.encode())
    for kind, value in zip(types, values):
        if kind == "i":
            data += struct.pack(">i", value)
        elif kind == "s":
            data += _padded(value.encode())
        else:
            data += struct.pack(">i", len(value)) + value + b"\0" * (-len(value) % 4)
    return data


def _bundle(time_s, messages):
    data = b"#bundle\0" + struct.pack(">Q", int(time_s * 2 ** 32))
    for message in messages:
        data += struct.pack(">i", len(message)) + message
    return struct.pack(">i", len(data)) + data


def render(folder, modes, synth_count, seconds):
    """CPU seconds to render `synth_count` synths of these modes; the sound is folder/klank.wav."""
    begin = [_message("/d_recv", "b", synth_definition(modes))]
    start = [_message("/s_new", "siii", "klank", 1000 + i, 1, 0) for i in range(synth_count)]
    score = _bundle(0, begin + start) + _bundle(seconds, [_message("/c_set", "ii", 0, 0)])
    path = folder / "score.osc"
    path.write_bytes(score)
    return cpu_seconds(
        ["scsynth", "-N", path, "_", folder / "klank.wav", "48000", "WAV", "float", "-o", "1", "-i", "0", "-m",
         "262144", "-D", "0"], env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})


def throughput(folder, population, synth_count=4):
    """Modes that one core renders in real time."""
    run = lambda seconds: render(folder, population, synth_count, seconds)
    return len(population) * synth_count * rate(run, 1, 6)
