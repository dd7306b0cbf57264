# SPDX-License-Identifier: Apache-2.0
"""The paper's figure 3: mode shapes of the bowl, exaggerated."""

import bench
import numpy
import programs

EXAGGERATED = .14  # of the body's size


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
