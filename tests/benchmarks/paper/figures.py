# SPDX-License-Identifier: Apache-2.0
"""The paper's figures: 3, mode shapes of the bowl, exaggerated; 4, the bunny cut open, and its responses to an impulse
on its nose and on its back; 5, the spectra of blocks and boxes, from strikes that the daemon renders."""

import pathlib

import bench
import numpy
import programs

RATE_HZ, HIGHEST_HZ, SPAN_S = 48000, 5000, 1.0
EXAGGERATED = .14  # of the bowl's size
CUT_Z_M = .01  # of the plane of the section, to which z is normal; y is up, and the nose looks along -x
BACK_X_M = .025
IMPULSE_NS, CONTACT_S = 1e-3, 2e-4
VIEW = (12, -65)
# A corner, struck aslant. A collision of bodies ten times as large at the same speed lasts ten times as long.
STRUCK, BLOW = (.9, .8, 1.), (.3, .5, -1.)


def strike(studio, folder, row, side_m):
    """What is heard of a cube that is struck, as the paper renders it: its coupling, damping and Gaussian."""
    heard = programs.Heard(studio.import_model(folder / f"{row.name}.model"), row.material.figures())
    impulse = IMPULSE_NS * (side_m / .05)**3
    blow = programs.Blow(tuple(side_m * x for x in STRUCK), tuple(impulse * x for x in BLOW),
                         CONTACT_S * side_m / .05)
    sound, _ = studio.render(heard, [blow], SPAN_S)
    return sound


def spectrum(sound, scaled=True):
    """(Hz, amplitude) up to 5000 Hz; the greatest amplitude is 1 if it is `scaled`."""
    padded = numpy.zeros(int(RATE_HZ * SPAN_S))
    padded[:min(len(padded), len(sound))] = sound[:len(padded)]
    hz = numpy.fft.rfftfreq(len(padded), 1 / RATE_HZ)
    amplitude = numpy.abs(numpy.fft.rfft(padded))
    shown = hz <= HIGHEST_HZ
    return hz[shown], amplitude[shown] / (amplitude[shown].max() if scaled else 1)


def draw(spectra, path):
    pyplot = bench.pyplot()
    figure, axes = pyplot.subplots(1, len(spectra), figsize=(9, 2.8), layout="constrained")
    for axis, (title, (hz, amplitude)) in zip(axes, spectra.items()):
        axis.fill_between(hz, amplitude, color="tab:blue")
        axis.set_xlim(0, HIGHEST_HZ)
        axis.set_ylim(0, 1.05)
        axis.set_xlabel("frequency, Hz")
        axis.set_title(title)
    axes[0].set_ylabel("amplitude over its greatest")
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def figure5(rows, folder, path):
    """Draws it; returns for each body the frequency of its highest peak and that below which half its energy lies,
    in Hz."""
    spectra, found = {}, {}
    with programs.studio() as studio:
        for name, side_m, title in (("blocks", .05, "block of 5 cm"), ("boxes", .5, "box of 50 cm")):
            spectra[title] = hz, amplitude = spectrum(strike(studio, pathlib.Path(folder), rows[name], side_m))
            energy = numpy.cumsum(amplitude**2)
            found[name] = hz[amplitude.argmax()], hz[numpy.searchsorted(energy, energy[-1] / 2)]
    draw(spectra, path)
    return found


def arrays_of(folder, name):
    """Arrays of a decomposed model as the Python client reads them."""
    import carillon
    with programs.studio() as studio:
        model = studio.import_model(folder / f"{name}.model")
        with carillon.connect(studio.daemon.server) as client:
            return client.model(model).arrays


def moved(vertices, displacement):
    """The body with a displacement of (vertices, 3) whose greatest is a share of the body's size."""
    size = (vertices.max(axis=0) - vertices.min(axis=0)).max()
    return vertices + displacement * (EXAGGERATED * size / numpy.linalg.norm(displacement, axis=1).max())


def draw_body(axis, vertices, triangles, view):
    """`view` = elevation and azimuth in degrees; z is up."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    corners = vertices[triangles]
    normal = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= numpy.maximum(numpy.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    elevation, azimuth = numpy.radians(view)
    eye = numpy.array([numpy.cos(elevation) * numpy.cos(azimuth), numpy.cos(elevation) * numpy.sin(azimuth),
                       numpy.sin(elevation)])
    light = eye + (.3, -.2, .6)
    shade = .25 + .7 * numpy.clip(normal @ (light / numpy.linalg.norm(light)), 0, 1)
    seen = normal @ eye > 0
    colours = numpy.outer(shade[seen], (.85, .8, .7))
    axis.add_collection3d(Poly3DCollection(corners[seen], facecolors=colours, edgecolors=colours, linewidths=.4))
    middle, reach = (vertices.max(axis=0) + vertices.min(axis=0)) / 2, numpy.ptp(vertices, axis=0).max() / 2
    for limit, at in zip((axis.set_xlim, axis.set_ylim, axis.set_zlim), middle):
        limit(at - .75 * reach, at + .75 * reach)
    axis.set_box_aspect((1, 1, 1))
    axis.view_init(*view)
    axis.set_axis_off()


def distinct(eigenvalues, count):
    """Indices of the first modes that differ by more than 1 % in frequency from the one before."""
    frequencies = numpy.sqrt(eigenvalues)
    new = numpy.concatenate([[True], frequencies[1:] > 1.01 * frequencies[:-1]])
    return numpy.flatnonzero(new)[:count]


def figure3(folder, row, solved, path):
    """The bowl at rest and in three modes, from aside and from above, with their natural frequencies."""
    body = arrays_of(folder, row.name)
    vertices, triangles = body["vertices"], body["triangles"]
    modes = distinct(body["eigenvalues"], 3)
    pyplot = bench.pyplot()
    figure, axes = pyplot.subplots(2, 4, figsize=(9.6, 4.4), layout="constrained", squeeze=False,
                                   subplot_kw={"projection": "3d"})
    for column, mode in enumerate([None, *modes]):
        shown = vertices if mode is None else moved(vertices, body["shapes"][:, :, mode])
        axes[0, column].set_title("at rest" if mode is None else f"{solved.modes[mode]['frequency_hz']:.0f} Hz")
        for axis, view in zip(axes[:, column], ((25, -60), (89, -90))):
            draw_body(axis, shown, triangles, view)
    figure.savefig(path, dpi=66)
    pyplot.close(figure)


def struck_points(vertices):
    """{name: (point, impulse in N s)} of the blows; each pushes inwards."""
    above = vertices[numpy.abs(vertices[:, 0] - BACK_X_M) < .005]
    return {"nose": (vertices[vertices[:, 0].argmin()], (IMPULSE_NS, 0., 0.)),
            "back": (above[above[:, 1].argmax()], (0., -IMPULSE_NS, 0.))}


def responses(folder, row, points):
    """{name: (Hz, amplitude)} as the paper renders it; both have one scale, and the greatest of all is 1."""
    spectra = {}
    with programs.studio() as studio:
        heard = programs.Heard(studio.import_model(pathlib.Path(folder) / f"{row.name}.model"), row.material.figures())
        for name, (point, impulse) in points.items():
            blow = programs.Blow(tuple(map(float, point)), impulse, CONTACT_S)
            spectra[name] = spectrum(studio.render(heard, [blow], SPAN_S)[0], scaled=False)
    greatest = max(amplitude.max() for _, amplitude in spectra.values())
    return {name: (hz, amplitude / greatest) for name, (hz, amplitude) in spectra.items()}


def section(vertices, triangles, height):
    """The segments in which the plane z = height cuts the surface: (count, 2 ends, x and y)."""
    above = vertices[:, 2] > height
    segments = []
    for triangle in numpy.asarray(triangles)[numpy.ptp(above[triangles].astype(int), axis=1) > 0]:
        ends = []
        for i, j in zip(triangle, numpy.roll(triangle, -1)):
            if above[i] != above[j]:
                share = (height - vertices[i, 2]) / (vertices[j, 2] - vertices[i, 2])
                ends.append(vertices[i, :2] + share * (vertices[j, :2] - vertices[i, :2]))
        segments.append(ends)
    return numpy.array(segments)


def filled(segments, x, y):
    """Whether each point of the grid (len(y), len(x)) is in the material: a ray from it along x crosses the contour an
    odd number of times."""
    inside = numpy.zeros((len(y), len(x)), bool)
    for (x0, y0), (x1, y1) in segments:
        rows = numpy.flatnonzero((y0 > y) != (y1 > y))
        crossing = x0 + (y[rows] - y0) * (x1 - x0) / (y1 - y0) if len(rows) else rows
        inside[rows] ^= x[None, :] < numpy.asarray(crossing)[:, None]
    return inside


def draw_section(axis, vertices, triangles):
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y = (numpy.linspace(low[a] - .004, high[a] + .004, 400) for a in (0, 1))
    axis.imshow(filled(section(vertices, triangles, CUT_Z_M), x, y), origin="lower", cmap="Greys", vmax=1.6,
                extent=1000 * numpy.array([x[0], x[-1], y[0], y[-1]]))
    axis.set_title("cut open")
    axis.set_xlabel("mm")


def figure4(folder, row, path):
    """Draws it. Returns {name: [Hz of the three highest peaks]}."""
    vertices, triangles = row.fine()
    points = struck_points(vertices)
    spectra = responses(folder, row, points)
    pyplot = bench.pyplot()
    figure = pyplot.figure(figsize=(9, 3.2), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(1, 1, 1.6))
    body = figure.add_subplot(grid[:, 0], projection="3d")
    turned = numpy.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], axis=1)  # y up becomes z up
    draw_body(body, turned, numpy.asarray(triangles), VIEW)
    body.set_title("as it is struck")
    draw_section(figure.add_subplot(grid[:, 1]), vertices, triangles)
    for k, (name, (hz, amplitude)) in enumerate(spectra.items()):
        axis = figure.add_subplot(grid[k, 2])
        axis.fill_between(hz, amplitude, color="tab:blue")
        axis.set(xlim=(0, HIGHEST_HZ), ylim=(0, 1.05), ylabel=name)
        (x, y, z), label = points[name][0], f" {name}"
        body.text(x, -z, y, "•" + label, color="tab:red", zorder=100)
    axis.set_xlabel("frequency, Hz")
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
    return {name: highest_peaks(*spectrum) for name, spectrum in spectra.items()}


def highest_peaks(hz, amplitude, count=3):
    """Frequencies of the highest local maxima, the highest first."""
    inner = amplitude[1:-1]
    tops = 1 + numpy.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]))
    return [float(hz[top]) for top in tops[amplitude[tops].argsort()[::-1][:count]]]
