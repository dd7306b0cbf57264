# SPDX-License-Identifier: Apache-2.0
"""The bodies of a scene: which objects take part, their surfaces as evaluated, and what the simulation knows of
them."""

import dataclasses

import bmesh
import bpy
import numpy

from . import settings, shapes
from .programs import Fault


@dataclasses.dataclass
class Body:
    """A body in its own frame, whose axes are the object's and whose origin is the object's: there the simulator has
    the centre of mass. Lengths are metres."""
    name: str
    vertices: numpy.ndarray
    triangles: numpy.ndarray
    material: str            # as the Blender material says, or empty
    friction: float = 0.5
    mass: float = 0          # of the simulation, kg; 0: not simulated
    inertia: numpy.ndarray = None  # kg m^2, about the object's axes
    damping: tuple = (0, 0)  # the share of the velocity and of the angular one that is lost in a second
    collider: numpy.ndarray = None  # triangles (M, 3, 3) that the simulator collides, if they are others
    rounding: float = 0      # of the collider
    driven: bool = False     # moved by something else than contacts
    hints: list = dataclasses.field(default_factory=list)  # why its simulation may look odd, and what to do about it


def in_world(scene):
    """The rigid bodies of the scene's simulation."""
    world = scene.rigidbody_world
    if world is None or not world.enabled or world.collection is None:
        return []
    return [obj for obj in world.collection.objects if obj.rigid_body and obj.type == 'MESH']


def is_part(obj):
    """True for a child whose shape belongs to its parent's body."""
    parent = obj.parent
    return bool(parent and parent.rigid_body and parent.rigid_body.collision_shape == 'COMPOUND' and obj.rigid_body)


def is_free(obj):
    """True if the simulation moves the object, at least at times."""
    body = obj.rigid_body
    keyed = obj.animation_data and obj.animation_data.action and any(
        curve.data_path == "rigid_body.kinematic" for curve in obj.animation_data.action.fcurves)
    return body.type == 'ACTIVE' and body.enabled and (not body.kinematic or bool(keyed))


def are_spheres(scene):
    """True if all that the simulation moves are spheres, which touch a mesh without its margin."""
    return all(obj.rigid_body.collision_shape == 'SPHERE' for obj in in_world(scene)
               if is_free(obj) and not is_part(obj))


def taking_part(scene):
    """The objects that are bodies: all rigid bodies, and others for which a material is chosen."""
    rigid = [obj for obj in in_world(scene) if not is_part(obj)]
    others = [obj for obj in scene.objects
              if obj.type == 'MESH' and obj.carillon.material and obj not in rigid and not is_part(obj)]
    return sorted(rigid + others, key=lambda obj: obj.name)


def unheard(scene):
    """Names of objects that have a material of Carillon and are no mesh -> what to do about it."""
    found = {}
    for obj in scene.objects:
        shown = obj.instance_collection if obj.instance_type == 'COLLECTION' else None
        if obj.type != 'MESH' and any(of.carillon.material not in ("", "none")
                                      for of in (obj, *(shown.all_objects if shown else ()))):
            remedy = "Apply > Make Instances Real" if shown else "Convert > Mesh"
            found.setdefault(remedy, []).append(obj.name)
    return {", ".join(names): f"no mesh, and not heard: choose Object > {remedy}" for remedy, names in found.items()}


def check_scales(objects):
    """Refuses bodies that the simulator would turn over."""
    names = [obj.name for obj in objects if obj.rigid_body and is_free(obj) and (
        min(obj.scale) < 0 or obj.matrix_world.determinant() < 0)]
    if names:
        raise Fault("SCALE_NEGATIVE", f"{', '.join(names)}: the scale is negative, which the simulator takes for a "
                                      "turn: choose Object > Apply > Scale, and Mesh > Normals > Recalculate Outside",
                    names)


def rotation(matrices):
    """The rotations (..., 3, 3) of matrices whose columns are scaled, and may be mirrored or sheared."""
    linear = numpy.asarray(matrices, float)[..., :3, :3]
    left, _, right = numpy.linalg.svd(linear / numpy.linalg.norm(linear, axis=-2, keepdims=True))
    left[..., 2] *= numpy.sign(numpy.linalg.det(left @ right))[..., None]
    return left @ right


def split(matrices):
    """Positions (F, 3) and orientations w, x, y, z (F, 4) of world matrices (F, 4, 4). Of q and -q it takes the one
    nearer to the orientation before."""
    r = numpy.moveaxis(rotation(matrices), 0, -1)
    a, b, c = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    d, e, f = r[1, 0] + r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2]
    squares = numpy.stack([1 + r[0, 0] + r[1, 1] + r[2, 2], 1 + r[0, 0] - r[1, 1] - r[2, 2],
                           1 - r[0, 0] + r[1, 1] - r[2, 2], 1 - r[0, 0] - r[1, 1] + r[2, 2]])
    s = squares
    rows = numpy.array([[s[0], a, b, c], [a, s[1], d, e], [b, d, s[2], f], [c, e, f, s[3]]])
    # Of the four rows, which are multiples of each other, that of the largest component loses no digits.
    turns = rows[squares.argmax(0), :, numpy.arange(rows.shape[2])]
    turns /= numpy.linalg.norm(turns, axis=1, keepdims=True)
    signs = numpy.where((turns[1:] * turns[:-1]).sum(1) < 0, -1, 1)
    turns[1:] *= numpy.cumprod(signs)[:, None]
    return numpy.asarray(matrices, float)[:, :3, 3], turns


def _surface(obj):
    """Vertices (N, 3) and triangles (M, 3) of an object in its own frame, with its modifiers if it is evaluated."""
    mesh = obj.to_mesh()
    mesh.calc_loop_triangles()
    vertices = numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.vertices.foreach_get("co", vertices)
    triangles = numpy.empty(3 * len(mesh.loop_triangles), numpy.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    obj.to_mesh_clear()
    return vertices.reshape(-1, 3).astype(float), triangles.reshape(-1, 3)


def _placed(obj, depsgraph, back):
    """The surface in the frame that `back` leads to from the world; one that is inside out, as by a mirror or flipped
    normals, is turned, since its volume gives the mass."""
    vertices, triangles = _surface(obj.evaluated_get(depsgraph))
    matrix = back @ numpy.asarray(obj.matrix_world, float)
    placed = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if len(triangles) and numpy.linalg.det((placed - placed.mean(0))[triangles]).sum() < 0:
        triangles = triangles[:, ::-1]
    return placed, triangles


def deforms(obj, scene, frames):
    """True if the mesh of an object changes between frames."""
    if obj.data.shape_keys is None and not obj.modifiers:
        return False
    first = None
    for frame in frames:
        scene.frame_set(int(frame))
        vertices = _surface(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))[0]
        first = vertices if first is None else first
        if len(vertices) != len(first) or (
                len(first) and numpy.abs(vertices - first).max() > 1e-3 * numpy.ptp(first, 0).max()):
            return True
    return False


def _hints(obj, vertices, final):
    """Of the mesh that the simulator takes, and of the mesh with all modifiers."""
    rigid = obj.rigid_body
    scale = obj.matrix_world.to_scale()
    if is_free(obj) and max(scale) > 1.01 * min(scale):
        yield ("its scale is not applied, and the simulator turns it as if it had none: Object > Apply > Scale, if it "
               "turns too slowly or too fast")
    away = numpy.abs(numpy.ptp(vertices, 0) - numpy.ptp(final, 0)).max() if len(vertices) and len(final) else 0
    if rigid.mesh_source != 'FINAL' and away > 1e-3 * numpy.ptp(final, 0).max():
        yield ("the simulator takes its mesh before the modifiers: choose Final in Rigid Body > Collisions > Source")
    if shapes.is_off_centre(rigid, vertices):
        yield (f"the simulator puts the shape {rigid.collision_shape.title()} around the object's origin, which is not "
               "in the middle of its mesh: Object > Set Origin > Origin to Geometry")
    if rigid.collision_shape == 'MESH' and is_free(obj):
        yield "with the shape Mesh what moves jitters in Blender's simulator: choose Convex Hull, or Compound Parent"


def _concatenated(surfaces):
    vertices, triangles = zip(*surfaces)
    first = numpy.cumsum([0, *map(len, vertices)])
    return numpy.concatenate(vertices), numpy.concatenate([part + at for part, at in zip(triangles, first)])


def _united(surfaces):
    """The surface around all of several closed ones, which may touch or overlap, by Blender's exact union."""
    size = numpy.ptp(numpy.concatenate([vertices for vertices, _ in surfaces]), 0).max()
    grid = max(1e-6 * size, 1e-30)  # on which faces that touch but for rounding lie in one plane
    others = bpy.data.collections.new("parts")
    parts = []
    for vertices, triangles in surfaces:
        mesh = bpy.data.meshes.new("part")
        mesh.from_pydata((numpy.round(vertices / grid) * grid).tolist(), [], triangles.tolist())
        parts.append(bpy.data.objects.new("part", mesh))
    for part in parts[1:]:
        others.objects.link(part)
    union = parts[0].modifiers.new("union", 'BOOLEAN')
    union.operation, union.solver, union.operand_type, union.collection = 'UNION', 'EXACT', 'COLLECTION', others
    scene = bpy.data.scenes.new("union")  # since a change in the scene itself may start its simulation anew
    scene.collection.objects.link(parts[0])
    scene.collection.children.link(others)
    layer = scene.view_layers[0]
    layer.update()
    united = bmesh.new()
    united.from_object(parts[0], layer.depsgraph)
    bmesh.ops.dissolve_degenerate(united, dist=10 * grid, edges=united.edges[:])
    bmesh.ops.triangulate(united, faces=united.faces[:])
    vertices = numpy.array([vertex.co[:] for vertex in united.verts], float)
    triangles = numpy.array([[vertex.index for vertex in face.verts] for face in united.faces], numpy.int32)
    united.free()
    bpy.data.scenes.remove(scene)
    for part in parts:
        bpy.data.meshes.remove(part.data)
    bpy.data.collections.remove(others)
    return vertices, triangles


def _read_simulated(body, obj, parts, depsgraph, scene):
    """Sets what the simulation has of a rigid body. Its shape is of the mesh before modifiers, unless its source is the
    final one; a compound shape is that of its parts."""
    rigid, scale, time_scale = obj.rigid_body, settings.metres_per_unit(scene), scene.rigidbody_world.time_scale
    of = obj.evaluated_get(depsgraph) if rigid.mesh_source == 'FINAL' else obj
    vertices, triangles = _surface(of)
    body.friction = rigid.friction
    body.hints = list(_hints(obj, vertices, _surface(obj.evaluated_get(depsgraph))[0]))
    if parts:
        vertices, triangles = _concatenated(parts)
        body.collider = scale * vertices[triangles]
    elif rigid.collision_shape != 'COMPOUND':
        own_scale = numpy.linalg.norm(numpy.asarray(obj.matrix_world, float)[:3, :3], axis=0)
        body.collider, rounding = shapes.collider(rigid, vertices, triangles, own_scale)
        body.rounding = 0 if rigid.collision_shape == 'MESH' and are_spheres(scene) else scale * rounding
        body.collider = None if body.collider is None else scale * body.collider
    if is_free(obj):
        body.mass = rigid.mass
        body.inertia = scale ** 2 * shapes.moments(rigid, vertices)
        body.damping = [1 - (1 - share) ** time_scale for share in (rigid.linear_damping, rigid.angular_damping)]


def read(obj, scene, depsgraph, moves, simulated):
    """The body of an object at the frame of `depsgraph`."""
    scale = settings.metres_per_unit(scene)
    back = numpy.eye(4)
    back[:3, :3] = rotation(obj.matrix_world).T
    back[:3, 3] = -back[:3, :3] @ numpy.asarray(obj.matrix_world, float)[:3, 3]
    children = [child for child in obj.children_recursive if child.type == 'MESH' and is_part(child)]
    parts = [_placed(child, depsgraph, back) for child in children]
    heard = [_placed(obj, depsgraph, back)]
    heard += [part for child, part in zip(children, parts) if child.carillon.material != "none"]
    heard = [(vertices, triangles) for vertices, triangles in heard if len(triangles)] or heard[:1]
    material = settings.guessed_material(obj)
    sounds = (obj.carillon.material or material) not in ("", "none")
    vertices, triangles = _united(heard) if sounds and len(heard) > 1 else _concatenated(heard)
    body = Body(obj.name, scale * vertices, triangles, material)
    if not len(body.triangles):
        raise Fault("BODY_WITHOUT_SURFACE", f"{obj.name} has no face: give it a mesh, or no rigid body", [obj.name])
    rigid = obj.rigid_body
    if rigid and simulated:
        _read_simulated(body, obj, parts, depsgraph, scene)
    if not body.mass:
        body.driven = moves and (simulated or obj.carillon.material == "none")
    return body
