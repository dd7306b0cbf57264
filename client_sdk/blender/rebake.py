# SPDX-License-Identifier: Apache-2.0
"""Simulates a scene again with each of its steps as a frame. At n times the frame rate with an n-th of the steps in a
frame, the simulator takes the same steps: bit for bit the same animation."""

import bpy
import numpy

from . import bodies

MOST_FRAMES_PER_S = 1000


def frames_per_s(scene):
    return scene.render.fps / scene.render.fps_base


def divisor(scene):
    """The number of frames that each frame becomes: a divisor of its steps, so that none is cut."""
    steps = scene.rigidbody_world.substeps_per_frame
    return max(n for n in range(1, steps + 1) if steps % n == 0 and (n == 1 or
                                                                  n * frames_per_s(scene) <= MOST_FRAMES_PER_S))


def _step(fps, base, time_scale, steps):
    """The length of a step as the simulator computes it, in single precision."""
    single = numpy.float32
    return single(single(1) / single(fps / base)) * single(time_scale) / single(steps)


def _exact_time_scale(scene, n):
    """The time scale by which a step at n times the frame rate is the same number, to its last bit."""
    world, render = scene.rigidbody_world, scene.render
    wanted = _step(render.fps, render.fps_base, world.time_scale, world.substeps_per_frame)
    up = down = numpy.float32(world.time_scale)
    for _ in range(8):
        for scale in (up, down):
            if _step(n * render.fps, render.fps_base, scale, world.substeps_per_frame // n) == wanted:
                return float(scale)
        up, down = numpy.nextafter(up, numpy.float32(2 * up)), numpy.nextafter(down, numpy.float32(0))
    return world.time_scale


def views(scene):
    """Frames and the cameras that markers give the scene from there on, in the order of time."""
    bound = [(marker.frame, marker.camera) for marker in scene.timeline_markers if marker.camera]
    return sorted(bound, key=lambda view: view[0])


def cuts(scene):
    """The frames at which the scene's camera becomes another."""
    found = views(scene)
    return tuple(frame for (_, before), (frame, camera) in zip(found, found[1:]) if camera != before)


def poses(scene, objects, frames):
    """World matrices (O, F, 4, 4) of objects at frames in their order; None among them stands for the scene's camera.
    The scene is simulated as far as its cache does not have it."""
    found = numpy.empty((len(objects), len(frames), 4, 4), numpy.float32)
    for k, frame in enumerate(frames):
        scene.frame_set(int(frame), subframe=float(frame % 1))
        for i, obj in enumerate(objects):
            obj = obj or scene.camera
            found[i, k] = obj.matrix_world if obj else numpy.eye(4)
    return found


def _stretch(curve, first, n):
    for key in curve.keyframe_points:
        for point in (key.co, key.handle_left, key.handle_right):
            point[0] = first + (point[0] - first) * n


def _driven_places(places, steps):
    """Places (S, 3) of a driven body after each step, as the simulator computes them, in single precision and with its
    sums, from its places (F, 3) at the frames."""
    one, shares = numpy.float32(1), numpy.cumsum(numpy.full(steps, 1 / steps, numpy.float32), dtype=numpy.float32)
    found = [places[0]]
    for place in places[1:]:
        last = found[-1]
        found.extend((one - share) * last + share * place for share in shares)
    return numpy.array(found, numpy.float32)


def _key(action, path, table, first):
    """Keys a property at each frame."""
    frames = first + numpy.arange(len(table))
    for axis in range(table.shape[1]):
        curve = action.fcurves.new(path, index=axis)
        curve.keyframe_points.add(len(frames))
        curve.keyframe_points.foreach_set("co", numpy.stack([frames, table[:, axis]], 1).ravel())
        curve.keyframe_points.foreach_set("interpolation", [1] * len(frames))
        curve.update()


def _drive(obj, matrices, first, n, steps):
    """Replaces what moves an object by keys of its place after each step."""
    action = bpy.data.actions.new("driven")
    old = obj.animation_data.action if obj.animation_data else None
    for curve in [curve for curve in old.fcurves if curve.data_path.startswith("rigid_body.")] if old else []:
        copy = action.fcurves.new(curve.data_path, index=curve.array_index)
        copy.keyframe_points.add(len(curve.keyframe_points))
        for key, of in zip(copy.keyframe_points, curve.keyframe_points):
            key.co, key.interpolation = (first + (of.co[0] - first) * n, of.co[1]), of.interpolation
    _key(action, "location", _driven_places(matrices[:, :3, 3], steps)[::steps // n], first)
    # Its turn and scale stay as they are, to the last bit, unless something moves them.
    if obj.parent or obj.constraints or numpy.ptp(matrices[:, :3, :3], axis=0).max() > 0:
        turns = bodies.split(matrices)[1]
        at = numpy.arange((len(turns) - 1) * n + 1) / n
        between = numpy.stack([numpy.interp(at, numpy.arange(len(turns)), turns[:, i]) for i in range(4)], 1)
        obj.rotation_mode = 'QUATERNION'
        _key(action, "rotation_quaternion", between, first)
        obj.scale = numpy.linalg.norm(matrices[0][:3, :3], axis=0)
        obj.parent = None
        for constraint in list(obj.constraints):
            obj.constraints.remove(constraint)
    obj.delta_location = (0, 0, 0)
    obj.animation_data_clear()
    obj.animation_data_create().action = action
    return action


def resimulate(scene, free, driven, driven_poses, first, last, n):
    """World matrices (O, F, 4, 4) of the free objects from frame `first` to `last`, at n frames for each. The file,
    which is a copy, is changed and read anew: what referred to its data is no longer valid."""
    world, render = scene.rigidbody_world, scene.render
    with bpy.context.temp_override(scene=scene, point_cache=world.point_cache):
        bpy.ops.ptcache.free_bake()
    steps = world.substeps_per_frame
    done = {_drive(obj, matrices, first, n, steps) for obj, matrices in zip(driven, driven_poses)}
    for action in set(bpy.data.actions) - done:
        for curve in action.fcurves:
            _stretch(curve, first, n)
    world.time_scale = _exact_time_scale(scene, n)
    render.fps *= n
    world.substeps_per_frame //= n
    end = first + (last - first) * n
    scene.frame_end = end
    world.point_cache.frame_start, world.point_cache.frame_end = first, end
    # Blender 3.4 stops the bodies once more after keys were edited, unless it reads the file anew.
    names = [obj.name for obj in free]
    bpy.context.view_layer.update()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    return poses(bpy.context.scene, [bpy.data.objects[name] for name in names], range(first, end + 1))
