# SPDX-License-Identifier: Apache-2.0
"""What Blender's simulator has in place of a mesh: the shape that it collides, and the moments of inertia that it gives
it. Both were measured: the moments are those of the shape without the object's scale."""

import bmesh
import numpy

# The radius by which the simulator rounds a hull within its faces, and a mesh beyond them.
USUAL_MARGIN = 0.04


def _hull(points):
    """Triangles (M, 3, 3) of the convex hull, outside by the right hand; none if it encloses nothing."""
    mesh = bmesh.new()
    for point in points:
        mesh.verts.new(point)
    bmesh.ops.convex_hull(mesh, input=mesh.verts, use_existing_faces=False)
    bmesh.ops.triangulate(mesh, faces=mesh.faces)
    bmesh.ops.recalc_face_normals(mesh, faces=mesh.faces)
    found = numpy.array([[vertex.co[:] for vertex in face.verts] for face in mesh.faces], float).reshape(-1, 3, 3)
    mesh.free()
    return found


def _planes(triangles):
    """Outward normals (N, 3) and distances (N) from the origin of the planes of triangles, each plane once."""
    normals = numpy.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    sizes = numpy.linalg.norm(normals, axis=1)
    large = sizes > 1e-9 * sizes.max()
    normals = normals[large] / sizes[large, None]
    planes = numpy.column_stack([normals, (normals * triangles[large, 0]).sum(1)])
    return planes[numpy.unique(numpy.round(planes, 5), axis=0, return_index=True)[1]]


def _shrunk(triangles, margin):
    """The corners of a hull whose planes are moved inward, or None if nothing is left of it. They are the planes of
    the hull's dual."""
    centre = triangles.reshape(-1, 3).mean(0)
    planes = _planes(triangles)
    distances = planes[:, 3] - planes[:, :3] @ centre - margin
    if distances.min() <= 0:
        return None
    dual = _planes(_hull(planes[:, :3] / distances[:, None]))
    return centre + dual[:, :3] / dual[:, 3:]


def _box(half):
    """Triangles of a box about the origin."""
    return _hull([[half[axis] * (1 if number >> axis & 1 else -1) for axis in range(3)] for number in range(8)])


def _core(radius):
    """Triangles of a solid that is next to nothing beside a radius: rounded by this radius it is a sphere."""
    corners = 1e-5 * radius * numpy.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return corners[[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]]


def collider(rigid, vertices, triangles, scale):
    """What the simulator collides: triangles (M, 3, 3) in units of the scene, or None for the mesh itself; and the
    radius by which it is rounded. `vertices` are without the scale."""
    shape, size = rigid.collision_shape, numpy.ptp(vertices, 0)
    if shape == 'BOX':
        return _box(size / 2 * scale), 0.0
    if shape == 'SPHERE':
        radius = size.max() / 2 * scale[0]
        return _core(radius), radius
    if shape == 'MESH':
        return vertices[triangles] * scale, rigid.collision_margin if rigid.use_margin else USUAL_MARGIN
    if shape != 'CONVEX_HULL' or size.min() <= 1e-6:
        return None, 0.0
    hull = _hull(vertices)
    if rigid.use_margin:
        return hull * scale, rigid.collision_margin
    inner = _shrunk(hull, USUAL_MARGIN)
    if inner is None:
        return hull * scale, 0.0
    return _hull(inner) * scale, USUAL_MARGIN * scale.min()


def is_off_centre(rigid, vertices):
    """True if the simulator's shape lies elsewhere than the mesh: it puts all but hulls and meshes around the origin of
    the object."""
    away = numpy.linalg.norm(vertices.min(0) + vertices.max(0)) / 2
    return rigid.collision_shape in {'BOX', 'SPHERE', 'CAPSULE', 'CYLINDER', 'CONE'} and (
        away > 0.05 * numpy.ptp(vertices, 0).max())


def is_thinner_than_margin(rigid, dimensions):
    """True of a shape that the simulator may keep away from what it touches, since its margin has no room within."""
    return not rigid.use_margin and (rigid.collision_shape == 'MESH' or (
        rigid.collision_shape in {'BOX', 'CYLINDER'} and min(dimensions) < 2 * USUAL_MARGIN))


def moments(rigid, vertices):
    """Moments of inertia about the object's axes, in kilograms times the square of the scene's unit."""
    shape, mass, size = rigid.collision_shape, rigid.mass, numpy.ptp(vertices, 0)
    squares = size ** 2
    if shape == 'SPHERE':
        return numpy.full(3, 0.1 * mass * squares.max())
    if shape == 'CYLINDER':
        across = mass * (squares[0] / 16 + squares[2] / 12)
        return numpy.array([across, across, mass * squares[0] / 8])
    if shape == 'MESH':  # each vertex is a point of the same mass
        about = numpy.mean(vertices ** 2, 0)
        return mass * (about.sum() - about)
    if shape == 'CONVEX_HULL' and size.min() > 1e-6:
        inner = None if rigid.use_margin else _shrunk(_hull(vertices), USUAL_MARGIN)
        margin = rigid.collision_margin if rigid.use_margin else USUAL_MARGIN if inner is not None else 0
        squares = (numpy.ptp(vertices if inner is None else inner, 0) + 2 * margin) ** 2
    return mass / 12 * (squares.sum() - squares)
