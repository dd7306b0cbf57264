#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs one example: simulates it in an engine, renders its contacts, and draws what is heard.

Leaves NAME-ENGINE.contacts, .wav (stereo, each body from its place), -spectrogram.png and -spectrum.png,
and with --video NAME-ENGINE.mp4.
"""

import argparse
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
SAMPLE_RATE_HZ = 48000


def draw_spectrogram(axes, samples, sample_rate_hz):
    """Draws the spectrogram of one channel, in dB of full scale. Returns the image."""
    import numpy
    # A noise far below the scale stands for digital silence, which has no level in dB.
    dither = numpy.random.default_rng(0).normal(scale=1e-10, size=len(samples))
    seconds = len(samples) / sample_rate_hz
    _, _, _, image = axes.specgram(samples + dither, NFFT=2048, noverlap=1536, Fs=sample_rate_hz / 1000, scale="dB",
                                   cmap="magma", vmin=-140, vmax=-50)
    image.set_extent((0, seconds, 0, sample_rate_hz / 2000))
    axes.set_xlim(0, seconds)
    return image


def draw(sound, stem, title):
    """The spectrogram and the spectrum of the mean of both channels."""
    os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
    import matplotlib
    matplotlib.use("Agg")
    import numpy
    from matplotlib import pyplot
    figure, (wave, picture) = pyplot.subplots(2, 1, sharex=True, figsize=(10, 6), layout="constrained",
                                              height_ratios=(1, 3))
    times = numpy.arange(len(sound.samples)) / sound.sample_rate_hz
    wave.plot(times, sound.samples, linewidth=0.3, label=("left", "right"))
    wave.legend(loc="upper right")
    wave.set_ylabel("full scale")
    wave.set_title(title)
    image = draw_spectrogram(picture, sound.mono, sound.sample_rate_hz)
    picture.set_xlabel("time, s")
    picture.set_ylabel("frequency, kHz")
    figure.colorbar(image, ax=picture, label="dB")
    figure.savefig(f"{stem}-spectrogram.png", dpi=80)
    pyplot.close(figure)
    figure, axes = pyplot.subplots(figsize=(10, 4), layout="constrained")
    frequencies = numpy.fft.rfftfreq(len(sound.mono), 1 / sound.sample_rate_hz)
    magnitudes = numpy.abs(numpy.fft.rfft(sound.mono))
    axes.semilogx(frequencies[1:], 20 * numpy.log10(magnitudes[1:] / magnitudes.max() + 1e-9), linewidth=0.5)
    axes.set_xlim(20, SAMPLE_RATE_HZ / 2)
    axes.set_ylim(-90, 3)
    axes.set_xlabel("frequency, Hz")
    axes.set_ylabel("dB of the greatest")
    axes.set_title(title)
    axes.grid(which="both", alpha=0.3)
    figure.savefig(f"{stem}-spectrum.png", dpi=80)
    pyplot.close(figure)


def place_listener(path, extent_m):
    """Lets a trace be heard in stereo from two and a half times its extent away."""
    import carillon
    from carillon.v1 import hearing_pb2
    import falls
    trace = carillon.Trace.read(path)
    trace.header.hearing.CopyFrom(hearing_pb2.Hearing(distance_gain=True, panning=True))
    ears = ((0, -2.5 * extent_m, 0.5 * extent_m), falls.about((1, 0, 0), 90))
    trace.header.listener.CopyFrom(carillon.contacts.to_pose(ears))
    trace.write(path)


def render(client, path):
    """In stereo, and softer than it is where that would be beyond full scale."""
    import carillon
    trace = carillon.Trace.read(path)
    while True:
        sound = client.render(trace, sample_rate_hz=SAMPLE_RATE_HZ, channel_count=2, tail_s=0.5)
        if not sound.summary.limited_frame_count:
            trace.write(path)
            return sound
        for body in trace.objects:
            body.gain = (body.gain if body.HasField("gain") else 1) / 4


def record_example(client, options, folder, trace):
    """Leaves the contact trace of the example, heard from before it. Returns its scene."""
    import falls
    import scene_makers
    if options.name == "chimes":
        import chimes
        chimes.record(client, trace, folder, seconds=options.seconds, build=options.build)
        place_listener(trace, chimes.EXTENT_M)
        return chimes.scene()
    scene = scene_makers.EXAMPLES[options.name](folder)
    if options.max_frequency:
        for body in scene["bodies"]:
            if "material" in body:
                body["max_frequency_hz"] = min(options.max_frequency, body.get("max_frequency_hz", math.inf))
    falls.record(options.engine, falls.create_models(client, scene, folder), trace, rate=options.rate,
                 seconds=options.seconds, build=options.build)
    place_listener(trace, scene["extent_m"])
    return scene


def film(options, scene, folder, stem):
    """Leaves the video of the example beside its sound."""
    import video
    how = {"seconds": options.seconds, "build": options.build}
    if options.name == "chimes":
        import chimes
        frames = video.frames_of(scene, chimes.poses(folder, **how))
    else:
        frames = video.poses_of(options.engine, scene, rate=options.rate, **how)
    video.make(scene, frames, folder, stem.with_suffix(".wav"), stem.with_suffix(".mp4"))


def run(client, options, folder):
    """Leaves all files of the example in the folder. Returns the sound."""
    stem = folder / f"{options.name}-{options.engine}"
    trace, wav = stem.with_suffix(".contacts"), stem.with_suffix(".wav")
    scene = record_example(client, options, folder, trace)
    sound = render(client, trace)
    findings = sound.summary.findings
    print(f"{stem.name}: {findings.blow_count} blows, {findings.load_count} loads, peak {sound.peak:.3g} of full scale")
    sound.normalized().save(wav)
    draw(sound, stem, f"{options.name.replace('_', ' ')} in {options.engine}")
    if options.video:
        film(options, scene, folder, stem)
    return sound


def run_with_daemon(options, folder):
    """Runs the example with a daemon of its own. The models stay in the folder for the next run."""
    import carillon
    from daemon import Daemon
    with tempfile.TemporaryDirectory(prefix="carillon-") as name:  # the socket's path must be short
        pathlib.Path(name, "data").symlink_to(folder / "models")
        daemon = Daemon(name)
        try:
            with carillon.connect(daemon.server) as client:
                run(client, options, folder)
        except subprocess.CalledProcessError as error:
            sys.exit(f"run.py: {pathlib.Path(error.cmd[0]).name} could not simulate {options.name} in "
                     f"{options.engine}: its message is above")
        finally:
            daemon.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name")
    parser.add_argument("--engine", default="bullet")
    parser.add_argument("--rate", type=int, default=1000, help="steps a second")
    parser.add_argument("--seconds", type=float, help="simulated time, if not what the scene says")
    parser.add_argument("--max-frequency", type=float, metavar="HZ",
                        help="compute no modes above it: less sound in less time (not for chimes)")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--video", action="store_true", help="make a video, too; needs an X server, such as Xvfb")
    parser.add_argument("--out", type=pathlib.Path, help="a folder; BUILD/examples unless named")
    options = parser.parse_args()
    options.build = options.build.resolve()
    sys.path[:0] = [str(options.build / "client_sdk/python"), str(ROOT / "client_sdk/examples/falls"),
                    str(ROOT / "client_sdk/python"), str(ROOT / "tests/integration")]
    os.environ.update(CARILLON_BIN_DIR=str(options.build / "bin"), CARILLON_BUILD_DIR=str(options.build))
    # They need the paths above.
    import falls
    import scene_makers
    names = (*scene_makers.EXAMPLES, "chimes")
    if options.name not in names or options.engine not in falls.ENGINES:
        parser.error(f"the examples are {', '.join(names)}, the engines {', '.join(falls.ENGINES)}")
    if options.name == "chimes" and options.engine != "bullet":
        parser.error("the chimes hang on joints; their program has Bullet")
    if options.seconds is not None and not options.seconds > 0:
        parser.error("--seconds must be above zero")
    folder = (options.out or options.build / "examples").resolve()
    try:
        (folder / "models").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"--out: {error}")
    run_with_daemon(options, folder)


if __name__ == "__main__":
    main()
