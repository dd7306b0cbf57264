# SPDX-License-Identifier: Apache-2.0
"""scsynth's Klank, rendering offline: the synth definition and the score are written here, byte by byte, so that no
client of it is needed."""

import math
import os
import struct

import measuring

AUDIO_RATE = 2
SCALAR_RATE = 0


def _name(text):
    return bytes([len(text)]) + text.encode()


def _ugen(name, rate, inputs, output_count):
    data = _name(name) + struct.pack(">biih", rate, len(inputs), output_count, 0)
    for source, index in inputs:
        data += struct.pack(">ii", source, index)
    return data + bytes([rate]) * output_count


def synth_definition(modes, dynamic=False):
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
    return measuring.cpu_seconds(
        ["scsynth", "-N", path, "_", folder / "klank.wav", "48000", "WAV", "float", "-o", "1", "-i", "0", "-m",
         "262144", "-D", "0"], env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})


def throughput(folder, population, synth_count=4):
    """Modes that one core renders in real time."""
    run = lambda seconds: render(folder, population, synth_count, seconds)
    return len(population) * synth_count * measuring.rate(run, 1, 6)


def exact(population, frame_count, sample_rate=48000):
    """What Klank computes, in double: y(n) = x(n) + b1 y(n-1) + b2 y(n-2), output half of y(n) - y(n-2)... of each
    mode, with its own coefficients."""
    import numpy
    from scipy import signal
    impulse = numpy.zeros(frame_count)
    impulse[0] = 1
    total = numpy.zeros(frame_count)
    for frequency, t60, amplitude in population:
        omega = frequency * 2 * math.pi / sample_rate
        r = math.exp(math.log(0.001) / (t60 * sample_rate))
        cost = 2 * r * math.cos(omega) / (1 + r * r)
        total += amplitude * 0.25 * signal.lfilter([1, 0, -1], [1, -2 * r * cost, r * r], impulse)
    return total
