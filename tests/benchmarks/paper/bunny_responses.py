# SPDX-License-Identifier: Apache-2.0
"""The paper's figure 4: the bunny cut open, and its responses to an impulse on its nose and on its back."""

import pathlib

import bench
import figures
import mode_shapes
import numpy
import programs

CUT_Z_M = .01  # of the plane of the section, to which z is normal; y is up, and the nose looks along -x
BACK_X_M = .025
IMPULSE_NS, CONTACT_S, SPAN_S = 1e-3, 2e-4, 1.0
VIEW = (12, -65)


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
            spectra[name] = figures.spectrum(studio.render(heard, [blow], SPAN_S)[0], scaled=False)
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
    mode_shapes.draw_body(body, turned, numpy.asarray(triangles), VIEW)
    body.set_title("as it is struck")
    draw_section(figure.add_subplot(grid[:, 1]), vertices, triangles)
    for k, (name, (hz, amplitude)) in enumerate(spectra.items()):
        axis = figure.add_subplot(grid[k, 2])
        axis.fill_between(hz, amplitude, color="tab:blue")
        axis.set(xlim=(0, figures.HIGHEST_HZ), ylim=(0, 1.05), ylabel=name)
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
