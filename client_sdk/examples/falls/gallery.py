#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the sounds and pictures of the documentation again: gallery.py --build BUILD

Leaves ten sounds as FLAC files with their spectrograms in docs/sounds, the pictures of modes, a pulse, decays,
a scene and a clip in docs/pictures, and the film docs/pictures/carillon.mp4 with its still.
./deploy/examples.sh gallery installs what it needs. The film needs an X server, such as Xvfb.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
SOUNDS, PICTURES = ROOT / "docs/sounds", ROOT / "docs/pictures"
SAMPLE_RATE_HZ = 48000

# name: body of `carillon example`, material, striker, size, seconds
STRIKES = {
    "bell_steel": ("bell", "bell_bronze", "steel", 1, 4),
    "bell_felt": ("bell", "bell_bronze", "felt", 1, 4),
    "bell_half": ("bell", "bell_bronze", "steel", 0.5, 3),
    "bowl_glass": ("bowl", "soda_lime_glass", "wood", 1, 3),
    "bowl_oak": ("bowl", "oak", "wood", 1, 1),
    "bar_maple": ("bar", "maple", "rubber", 1, 1),
    "bar_steel": ("bar", "structural_steel", "steel", 1, 4),
    "chime": ("chime", "aluminum_6061", "wood", 1, 5),
}
# The name of each sound, and the example that it is made of.
FALLS = {"blocks": "blocks", "rolling_bowl": "bowl"}
SCENE_HEARING = {"distance_gain": True, "propagation_delay": True, "panning": True}


def draw_spectrogram(axes, samples, rate_hz, most_hz=16000, least_db=-80):
    """The short-time spectrum, in dB of its peak."""
    import numpy
    size = 2048
    pieces = numpy.lib.stride_tricks.sliding_window_view(numpy.pad(samples, size // 2), size)[::size // 8]
    level = numpy.abs(numpy.fft.rfft(pieces * numpy.hanning(size))).T
    level = 20 * numpy.log10(level / level.max() + 1e-9)
    axes.imshow(level, origin="lower", aspect="auto", cmap="magma", vmin=least_db, vmax=0,
                extent=(0, len(samples) / rate_hz, 0, rate_hz / 2000))
    axes.set(xlabel="time, s", ylabel="frequency, kHz", ylim=(0, most_hz / 1000))


def save_flac(samples, rate_hz, path):
    """One channel of 16 bits."""
    import numpy
    words = numpy.round(samples * 32767).astype("<i2").tobytes()
    subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "s16le", "-ar", str(rate_hz), "-ac", "1", "-i", "-",
                    "-map_metadata", "-1", "-fflags", "+bitexact", "-compression_level", "12", path], input=words,
                   check=True)


class Gallery:
    def __init__(self, client, options, folder):
        self.client, self.options, self.folder = client, options, folder
        self.models = {}

    def strike_of(self, body):
        """(mesh file, point, impulse) of an example."""
        file = self.folder / f"{body}.obj"
        words = [self.options.build / "bin/carillon", "--json", "example", body, "--out", file]
        printed = json.loads(subprocess.run(words, check=True, capture_output=True).stdout)
        _, point, _, impulse = printed["strike"].split()
        return file, [float(x) for x in point.split(",")], [float(x) for x in impulse.split(",")]

    def model(self, body, material, **settings):
        key = (body, material, str(settings))
        if key not in self.models:
            self.models[key] = self.client.create_model(self.strike_of(body)[0], material, **settings)
            self.models[key].wait_for_transfer()
        return self.models[key]

    def strike(self, name):
        """The mono sound of a strike with a peak of -3 dB of full scale."""
        import carillon
        body, material, striker, size, seconds = STRIKES[name]
        _, point, impulse = self.strike_of(body)
        trace = carillon.Trace()
        struck = trace.add(self.model(body, material), size=size)
        point = [size * x for x in point]
        trace.step(0.0, impacts=carillon.Impacts(struck, [point], [impulse], striker=striker))
        # Modes end at -140 dB of full scale.
        peak_pa = self.client.render(trace).summary.peak_pa
        sound = self.client.render(trace, full_scale_pa=2 * peak_pa, sample_rate_hz=SAMPLE_RATE_HZ).normalized(0.7)
        samples = sound.mono[:seconds * SAMPLE_RATE_HZ]
        fade = SAMPLE_RATE_HZ // 20
        samples[-fade:] *= [1 - i / fade for i in range(fade)]
        return samples

    def draw_sound(self, name, samples, title):
        from matplotlib import pyplot
        import numpy
        figure, (wave, picture) = pyplot.subplots(2, 1, sharex=True, figsize=(7, 3.6), layout="constrained",
                                                  height_ratios=(1, 2.5))
        wave.plot(numpy.arange(len(samples)) / SAMPLE_RATE_HZ, samples, linewidth=0.3)
        wave.set(title=title, yticks=[])
        draw_spectrogram(picture, samples, SAMPLE_RATE_HZ)
        save(figure, SOUNDS / f"{name}.png")

    def sounds(self):
        for name, (body, material, striker, size, _) in STRIKES.items():
            title = f"{body} of {material.replace('_', ' ')}, struck with {striker}"
            self.keep(name, self.strike(name), title if size == 1 else f"{size} of the {title}")
        for name, example in FALLS.items():
            self.keep(name, self.fall(example).normalized(0.7).mono, f"{example} in Bullet")

    def keep(self, name, samples, title):
        save_flac(samples, SAMPLE_RATE_HZ, SOUNDS / f"{name}.flac")
        self.draw_sound(name, samples, title)
        print(f"{name}: {len(samples) / SAMPLE_RATE_HZ:.1f} s", flush=True)

    def fall(self, example, seconds=None):
        """The sound of an example of run.py."""
        import run
        options = argparse.Namespace(name=example, engine="bullet", rate=1000, seconds=seconds, max_frequency=None,
                                     build=self.options.build)
        trace = self.folder / f"{example}.contacts"
        run.record_example(self.client, options, self.folder, trace)
        self.await_transfers(trace)
        return run.render(self.client, trace)

    def await_transfers(self, trace):
        """Without them the bodies of a trace would sound by the paper's coupling."""
        import carillon
        for name in {body.modal_model for body in carillon.Trace.read(trace).objects}:
            self.client.model(name).wait_for_transfer()

    def modes(self):
        """Four modes of the bell, bent by an eighth of its size."""
        from matplotlib import pyplot
        model = self.model("bell", "bell_bronze")
        figure, grid = pyplot.subplots(1, 4, figsize=(10, 2.7), subplot_kw={"projection": "3d"}, layout="constrained")
        for axes, mode in zip(grid, (0, 2, 4, 8)):
            draw_shape(axes, model.arrays, mode)
            axes.set_title(f"mode {mode}: {model.frequencies()[mode]:.0f} Hz", fontsize=10)
        save(figure, PICTURES / "modes.png")

    def decays(self):
        """What material and air take from each mode, of a bell and a bar."""
        from matplotlib import pyplot
        figure, grid = pyplot.subplots(1, 2, figsize=(9, 3), sharey=True, layout="constrained")
        for axes, (body, material) in zip(grid, (("bell", "bell_bronze"), ("bar", "structural_steel"))):
            model = self.model(body, material)
            hertz, decays = model.modes()
            axes.loglog(hertz, decays, ".", label="material")
            axes.loglog(hertz, model.radiation_decays(), "x", markersize=4, label="radiation")
            axes.set(title=f"{body} of {material.replace('_', ' ')}", xlabel="frequency of the mode, Hz",
                     ylim=(1e-3, 1e3))
            axes.grid(alpha=0.3)
        grid[0].set_ylabel("decay rate, 1/s")
        grid[0].legend()
        save(figure, PICTURES / "decays.png")

    def scene(self):
        """The bell of the ten-minute pages, to the right and ahead of its listener, and both channels."""
        import carillon
        from matplotlib import pyplot
        import numpy
        model = self.model("bell", "bell_bronze")
        trace = carillon.Trace(hearing=SCENE_HEARING, listener=((0, 0, 2), (1, 0, 0, 0)))
        bell = trace.add(model, pose=(1, 0, 0), radiation="modes_only")
        _, point, impulse = self.strike_of("bell")
        trace.step(0, impacts=carillon.Impacts(bell, [point], [impulse]))
        sound = self.client.render(trace, channel_count=2, normalize=True)
        figure, (plan, wave) = pyplot.subplots(1, 2, figsize=(9, 2.8), layout="constrained", width_ratios=(1, 2))
        plan.plot(0, 2, "ko")
        plan.annotate("listener", (0, 2), (0.1, 2.15))
        plan.annotate("", (0, 1.4), (0, 2), arrowprops={"arrowstyle": "->"})
        plan.plot(1, 0, "o", color="#b08d57", markersize=12)
        plan.annotate("bell", (1, 0), (1.15, 0.05))
        plan.set(xlim=(-1, 2), ylim=(2.6, -0.5), xlabel="x, m", ylabel="z, m", aspect="equal", title="from above")
        count = SAMPLE_RATE_HZ // 40
        milliseconds = numpy.arange(count) / SAMPLE_RATE_HZ * 1000
        wave.plot(milliseconds, sound.samples[:count, 1], linewidth=0.7, color="C1", label="right")
        wave.plot(milliseconds, sound.samples[:count, 0], linewidth=0.7, color="C0", label="left")
        wave.set(xlabel="time, ms", yticks=[], title="the sound arrives after 2.24 m, louder on the right")
        wave.legend()
        save(figure, PICTURES / "scene.png")

    def clip(self):
        """A clip of fallen blocks, with the blows of its record."""
        import carillon
        from matplotlib import pyplot
        import numpy
        trace = carillon.Trace.read(self.folder / "blocks.contacts")
        sound = self.client.render(trace, tell_blows=True, normalize=True)
        figure, (wave, picture) = pyplot.subplots(2, 1, sharex=True, figsize=(8, 3.6), layout="constrained",
                                                  height_ratios=(1, 1.4))
        wave.plot(numpy.arange(len(sound.mono)) / SAMPLE_RATE_HZ, sound.mono, linewidth=0.3)
        wave.set(yticks=[], title="six blocks and a ball: the sound, and the impulses of its record")
        for blow in sound.blows:
            strength = numpy.linalg.norm([blow.impulse_newton_seconds.x, blow.impulse_newton_seconds.y,
                                          blow.impulse_newton_seconds.z])
            picture.plot([blow.time_s] * 2, [1e-5, strength], color=f"C{blow.object % 10}", linewidth=1)
        picture.set(yscale="log", xlim=(0, 0.7), ylim=(1e-5, None), xlabel="time, s", ylabel="impulse, N s")
        save(figure, PICTURES / "clip.png")


def draw_shape(axes, arrays, mode):
    import numpy
    vertices, shape, triangles = arrays["vertices"], arrays["shapes"][:, :, mode], arrays["triangles"]
    bent = vertices + shape * (0.125 * numpy.ptp(vertices, axis=0).max() / numpy.abs(shape).max())
    surface = axes.plot_trisurf(*bent.T, triangles=triangles, cmap="viridis", linewidth=0)
    moved = numpy.linalg.norm(shape, axis=1)
    surface.set_array(moved[triangles].mean(axis=1))
    axes.set_box_aspect(numpy.ptp(bent, axis=0), zoom=1.4)
    axes.set_axis_off()


def pulse():
    """A contact of 0.2 ms as a raised cosine and as a Gaussian, and the spectra by which they excite modes."""
    from matplotlib import pyplot
    import numpy
    duration_s = 2e-4
    time_s = numpy.linspace(-1, 1, 2001) * 2e-4
    raised = numpy.where(numpy.abs(time_s) < duration_s / 2, 1 + numpy.cos(2 * numpy.pi * time_s / duration_s), 0)
    gaussian = numpy.exp(-0.5 * (time_s / (duration_s / 4))**2)
    frequency_hz = numpy.linspace(0, 20000, 1000)
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(8, 2.8), layout="constrained")
    for force, label in ((raised, "raised cosine"), (gaussian, "Gaussian")):
        force = force / numpy.trapz(force, time_s)
        left.plot(time_s * 1e3, force / 1000, label=label)
        spectrum = numpy.abs(numpy.trapz(force * numpy.exp(-2j * numpy.pi * frequency_hz[:, None] * time_s), time_s))
        right.plot(frequency_hz / 1000, 20 * numpy.log10(spectrum + 1e-9))
    left.set(xlabel="time, ms", ylabel="force, kN for 1 N s", title="a contact of 0.2 ms")
    left.legend()
    right.set(xlabel="frequency of the mode, kHz", ylabel="excitation, dB", ylim=(-80, 3), title="what modes get of it")
    save(figure, PICTURES / "pulse.png")


def save(figure, path):
    from matplotlib import pyplot
    from PIL import Image
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
    # Fewer colours make the file a third as large.
    Image.open(path).convert("RGB").quantize(96).save(path, optimize=True)
    print(path.relative_to(ROOT), path.stat().st_size, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--only", nargs="*", default=("pulse", "sounds", "modes", "decays", "scene", "clip",
                                                      "film"))
    options = parser.parse_args()
    options.build = options.build.resolve()
    sys.path[:0] = [str(options.build / "client_sdk/python"), str(ROOT / "client_sdk/python"),
                    str(ROOT / "tests/integration")]
    os.environ.update(CARILLON_BIN_DIR=str(options.build / "bin"), CARILLON_BUILD_DIR=str(options.build))
    os.environ.setdefault("MPLCONFIGDIR", tempfile.gettempdir())
    import matplotlib
    matplotlib.use("Agg")
    import carillon
    from daemon import Daemon
    SOUNDS.mkdir(exist_ok=True)
    folder = options.build / "gallery"
    (folder / "data").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="carillon-") as name:  # the socket's path must be short
        pathlib.Path(name, "data").symlink_to(folder / "data")
        daemon = Daemon(name, "--transfers")
        try:
            with carillon.connect(daemon.server) as client:
                gallery = Gallery(client, options, folder)
                for part in options.only:
                    if part == "pulse":
                        pulse()
                    elif part == "film":
                        import film
                        film.make(gallery, PICTURES)
                    else:
                        getattr(gallery, part)()
        finally:
            daemon.stop()


if __name__ == "__main__":
    main()
