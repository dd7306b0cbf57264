# SPDX-License-Identifier: Apache-2.0
"""A film of thirty seconds: a mesh, its modes, a strike, and two scenes, each with its sound. VTK draws the frames,
Pillow their words, and ffmpeg packs them."""

import argparse
import subprocess

import run
import video

RATE_HZ = 48000
MESH_S, MODE_S, STRIKE_S = 4, 2.6, 6
SCENES = (("blocks", 3.5, "a ball and six wooden blocks, in Bullet; every sound is computed"),
          ("bowl", 7.5, "a bowl of metal falls, and rolls on its rim until it lies"))
MODES = (0, 2, 8)
STRIP, WIDTH, HEIGHT = 90, video.WIDTH, video.HEIGHT
BEND = 0.1  # of the body's size
WINDOW = 2048


def mode_tone(frequency_hz, decay_per_s, seconds):
    """A mode that rings alone."""
    import numpy
    time_s = numpy.arange(int(seconds * RATE_HZ)) / RATE_HZ
    tone = 0.25 * numpy.exp(-decay_per_s * time_s) * numpy.sin(2 * numpy.pi * frequency_hz * time_s)
    return faded(numpy.repeat(tone[:, None], 2, axis=1))


def faded(samples, seconds=0.1):
    """The samples, whose end fades out."""
    import numpy
    count = int(seconds * RATE_HZ)
    samples = samples.copy()
    samples[-count:] *= numpy.linspace(1, 0, count)[:, None]
    return samples


def fitted(samples, seconds):
    import numpy
    count = int(seconds * RATE_HZ)
    samples = samples[:count]
    return faded(numpy.concatenate([samples, numpy.zeros((count - len(samples), 2))]))


def spectrogram(samples, columns):
    """The picture of a sound, STRIP rows high: RGB, low frequencies below."""
    import matplotlib
    import numpy
    mono = numpy.pad(samples.mean(axis=1), WINDOW // 2)
    starts = numpy.linspace(0, len(mono) - WINDOW, columns).astype(int)
    pieces = numpy.stack([mono[start:start + WINDOW] for start in starts]) * numpy.hanning(WINDOW)
    level = numpy.abs(numpy.fft.rfft(pieces))[:, :WINDOW // 4].T  # up to 12 kHz
    level = 20 * numpy.log10(level / max(level.max(), 1e-9) + 1e-9)
    rows = numpy.linspace(0, len(level) - 1, STRIP).astype(int)[::-1]
    return (255 * matplotlib.colormaps["magma"](1 + level[rows] / 80)[:, :, :3]).astype("uint8")


class BodyStage:
    """The window in which one body turns and bends."""

    def __init__(self, arrays):
        import numpy
        import vtk
        from vtk.util import numpy_support
        self.vertices = arrays["vertices"] - arrays["vertices"].mean(axis=0)
        self.size = float(numpy.ptp(self.vertices, axis=0).max())
        self.renderer, self.window = video.stage(vtk, {"extent_m": 2.1 * self.size, "look_at_m": (0, 0, 0)})
        self.body = video.as_surface(vtk, self.vertices, arrays["triangles"])
        self.points = self.body.GetPoints()
        self.to_vtk, self.to_numpy = numpy_support.numpy_to_vtk, numpy_support.vtk_to_numpy
        mapper, self.actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        normals = vtk.vtkPolyDataNormals()
        normals.SetInputData(self.body)
        normals.SetFeatureAngle(60)
        mapper.SetInputConnection(normals.GetOutputPort())
        mapper.SetScalarRange(0, 1)
        table = vtk.vtkLookupTable()
        import matplotlib
        table.SetNumberOfTableValues(64)
        for i in range(64):
            table.SetTableValue(i, *matplotlib.colormaps["viridis"](i / 63))
        mapper.SetLookupTable(table)
        self.actor.SetMapper(mapper)
        self.mapper, self.vtk = mapper, vtk
        self.actor.GetProperty().SetSpecular(0.3)
        self.actor.GetProperty().SetAmbient(0.3)
        self.renderer.AddActor(self.actor)

    def frame(self, degrees, edges=False, moved=None):
        """The picture of the body, turned about z, and bent by `moved` (vertices x 3, metres, or None)."""
        import numpy
        vertices = self.vertices if moved is None else self.vertices + moved
        self.points.SetData(self.to_vtk(numpy.ascontiguousarray(vertices), deep=True))
        self.mapper.SetScalarVisibility(moved is not None)
        if moved is not None:
            strength = numpy.linalg.norm(moved, axis=1) / (BEND * self.size)
            self.body.GetPointData().SetScalars(self.to_vtk(strength, deep=True))
        self.body.Modified()
        self.actor.GetProperty().SetColor(0.69, 0.55, 0.34)
        self.actor.GetProperty().SetEdgeVisibility(edges)
        self.actor.GetProperty().SetEdgeColor(0.15, 0.12, 0.08)
        self.actor.SetOrientation(0, 0, degrees)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        image = self.vtk.vtkWindowToImageFilter()
        image.SetInput(self.window)
        image.ReadFrontBufferOff()
        image.Update()
        pixels = self.to_numpy(image.GetOutput().GetPointData().GetScalars())
        return pixels.reshape(HEIGHT, WIDTH, 3)[::-1]


def lettered(pixels, title, below, strip=None, fraction=0.0):
    """The frame with its words, and the spectrogram of what has been heard so far."""
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont
    pixels = pixels.copy()
    if strip is not None:
        heard = int(fraction * WIDTH)
        pixels[:-STRIP] = pixels[STRIP // 2:-STRIP // 2].copy()
        pixels[-STRIP:] = 8
        pixels[-STRIP:, :heard] = strip[:, :heard]
    image = Image.fromarray(pixels)
    draw = ImageDraw.Draw(image)
    font = f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans.ttf"
    draw.text((16, 12), title, (255, 255, 255), ImageFont.truetype(font, 20))
    draw.text((16, 40), below, (190, 195, 205), ImageFont.truetype(font, 13))
    return image.tobytes()


def parts_of_bell(gallery):
    """(frames, samples) of mesh, modes and strike."""
    import numpy
    model = gallery.model("bell", "bell_bronze")
    arrays = model.arrays
    stage = BodyStage(arrays)
    count = int(MESH_S * video.FRAMES_PER_S)
    words = f"{len(arrays['triangles']):,} triangles of bronze: bell.obj, --material bell_bronze"
    yield [lettered(stage.frame(0.6 * i, edges=True), "1  A mesh and a material", words)
           for i in range(count)], numpy.zeros((int(MESH_S * RATE_HZ), 2))
    frequencies, decays = model.modes()
    decays = decays + model.radiation_decays()
    turn = 0.6 * count
    for mode in MODES:
        tone = mode_tone(frequencies[mode], decays[mode], MODE_S)
        strip, shape = spectrogram(tone, WIDTH), arrays["shapes"][:, :, mode]
        bend, frames = shape * (BEND * stage.size / numpy.abs(shape).max()), []
        count = int(MODE_S * video.FRAMES_PER_S)
        for i in range(count):
            swing = numpy.sin(2 * numpy.pi * i / 20) * numpy.exp(-decays[mode] * i / video.FRAMES_PER_S)
            words = f"{frequencies[mode]:.0f} Hz, 60 dB lower after {6.91 / decays[mode]:.1f} s; slow and magnified"
            frames.append(lettered(stage.frame(turn, moved=swing * bend),
                                   "2  Its modes, each with a frequency and decay", words, strip, i / count))
            turn += 0.6
        yield frames, tone
    samples = fitted(numpy.repeat(gallery.strike("bell_steel")[:, None], 2, axis=1), STRIKE_S)
    strip, frames, count = spectrogram(samples, WIDTH), [], int(STRIKE_S * video.FRAMES_PER_S)
    for i in range(count):
        moved = sum(arrays["shapes"][:, :, mode] * numpy.sin(0.3 * (1 + k) * i + k)
                    * numpy.exp(-decays[mode] * i / video.FRAMES_PER_S) for k, mode in enumerate(MODES))
        scale = 0.3 * BEND * stage.size / numpy.abs(arrays["shapes"][:, :, list(MODES)]).max()
        frames.append(lettered(stage.frame(turn, moved=scale * moved), "3  A strike excites them all",
                               f"steel, 0.02 N s, at the rim; {model.mode_count} modes, and how each radiates into air",
                               strip, i / count))
        turn += 0.6
    yield frames, samples


def part_of_scene(gallery, name, seconds, words):
    """(frames, samples) of a scene that falls in Bullet."""
    import numpy
    options = argparse.Namespace(name=name, engine="bullet", rate=1000, seconds=None, max_frequency=None,
                                 build=gallery.options.build)
    trace = gallery.folder / f"{name}.contacts"
    scene = run.record_example(gallery.client, options, gallery.folder, trace)
    gallery.await_transfers(trace)
    samples = fitted(run.render(gallery.client, trace).normalized(0.7).samples, seconds)
    poses = video.poses_of("bullet", scene, rate=1000, seconds=None, build=gallery.options.build)
    count = int(seconds * video.FRAMES_PER_S)
    poses = [poses[min(i, len(poses) - 1)] for i in range(count)]
    strip, frames = spectrogram(samples, WIDTH), []

    def take(pixels):
        frame = numpy.frombuffer(pixels, "uint8").reshape(HEIGHT, WIDTH, 3)[::-1]
        frames.append(lettered(frame, "4  A physics engine sends its contacts", words, strip, len(frames) / count))

    video.draw(scene, gallery.folder, poses, take)
    return frames, samples


def make(gallery, folder):
    """Writes carillon.mp4, and its still film.png."""
    import numpy
    from PIL import Image
    parts = [*parts_of_bell(gallery), *(part_of_scene(gallery, *scene) for scene in SCENES)]
    frames = [frame for part, _ in parts for frame in part]
    sound = numpy.concatenate([samples for _, samples in parts])
    wave = gallery.folder / "film.f32"
    wave.write_bytes(sound.astype("<f4").tobytes())
    words = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
             f"{WIDTH}x{HEIGHT}", "-framerate", str(video.FRAMES_PER_S), "-i", "-", "-f", "f32le", "-ar", str(RATE_HZ),
             "-ac", "2", "-i", str(wave), "-c:v", "libx264", "-preset", "slow", "-pix_fmt", "yuv420p", "-crf", "28",
             "-c:a", "aac", "-b:a", "96k", "-movflags", "+faststart", str(folder / "carillon.mp4")]
    subprocess.run(words, input=b"".join(frames), check=True)
    still = frames[len(parts[0][0]) + 5]  # where the first mode bends the body most
    scene = parts[-2][0][int(0.9 * video.FRAMES_PER_S)]
    both = Image.new("RGB", (2 * WIDTH, HEIGHT))
    both.paste(Image.frombytes("RGB", (WIDTH, HEIGHT), still), (0, 0))
    both.paste(Image.frombytes("RGB", (WIDTH, HEIGHT), scene), (WIDTH, 0))
    both.quantize(128).save(folder / "film.png", optimize=True)
    print(f"carillon.mp4: {len(frames) / video.FRAMES_PER_S:.1f} s, {(folder / 'carillon.mp4').stat().st_size} bytes",
          flush=True)
