# SPDX-License-Identifier: Apache-2.0
"""Knows whether a scene has changed since its sound was baked: a digest of all that determines its motion and its
sound, which does not depend on the current frame."""

import hashlib

import bpy
import numpy
from bpy.app.handlers import persistent

from . import bodies, rebake, strip

# What only says how Blender shows a thing, or what follows from other things.
SHOWN_ONLY = {"name", "show_expanded", "show_in_editmode", "show_on_cage", "is_active", "show_viewport", "show_render"}
PLACE = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "rotation_mode", "scale",
         "delta_location", "delta_rotation_euler", "delta_scale")


def digest(scene):
    """A digest that changes whenever an animation, a shape, a material or a setting changes."""
    seen = hashlib.sha256()

    def add(*what):
        seen.update(repr(what).encode())

    render, world = scene.render, scene.rigidbody_world
    add(scene.frame_start, scene.frame_end, render.fps, render.fps_base, scene.gravity[:], scene.use_gravity,
        scene.unit_settings.system, scene.unit_settings.scale_length)
    if world:
        _add_plain(add, world, _curves(scene, add))
        add(world.point_cache.frame_start, world.point_cache.frame_end, world.effector_weights.gravity)
    chosen = scene.carillon
    add([(key, getattr(chosen, key)) for key in ("channels", "use_camera", "normalize", "gain_db", "striker",
                                                 "roughness", "sub_frames", "stems", "force")])
    for obj in bodies.taking_part(scene):
        _add_body(add, seen, obj)
    if scene.camera and chosen.use_camera:
        for frame, camera in rebake.views(scene) or [(None, scene.camera)]:
            add(frame)
            _add_place(add, camera)
    return seen.hexdigest()


def _add_body(add, seen, obj):
    of = obj.carillon
    add(obj.name, of.material, of.wall, of.repair, [slot.material and slot.material.name
                                                    for slot in obj.material_slots])
    _add_place(add, obj)
    if obj.rigid_body:
        _add_plain(add, obj.rigid_body, _curves(obj, lambda *_: None))
    for modifier in obj.modifiers:
        add(modifier.type, modifier.show_viewport)
        _add_plain(add, modifier, ())
    for part in [obj, *(child for child in obj.children_recursive if bodies.is_part(child))]:
        if part is not obj:
            _add_place(add, part)
            add(part.carillon.material == "none")
        if part.type == 'MESH':
            points = numpy.empty(3 * len(part.data.vertices), numpy.float32)
            part.data.vertices.foreach_get("co", points)
            corners = numpy.empty(len(part.data.loops), numpy.int32)
            part.data.loops.foreach_get("vertex_index", corners)
            seen.update(points.tobytes() + corners.tobytes())


def _add_place(add, obj):
    """Adds what says where an object is and how it moves, that of its parents included."""
    while obj:
        paths = _curves(obj, add)
        add([tuple(getattr(obj, path)) if path != "rotation_mode" else obj.rotation_mode
             for path in PLACE if path not in paths], [row[:] for row in obj.matrix_parent_inverse])
        for constraint in obj.constraints:
            _add_plain(add, constraint, ())
        if obj.type == 'CAMERA':
            add(obj.name)
        obj = obj.parent


def _curves(owner, add):
    """Adds the keys of an owner, and returns what they move."""
    animation = owner.animation_data
    if animation is None:
        return ()
    curves = [*(animation.action.fcurves if animation.action else ()), *animation.drivers]
    for curve in curves:
        add(curve.data_path, curve.array_index, [(*key.co, *key.handle_left, *key.handle_right, key.interpolation)
                                                 for key in curve.keyframe_points])
        if getattr(curve, "driver", None):
            add(curve.driver.expression)
    return {curve.data_path for curve in curves}


def _add_plain(add, owner, moved):
    """Adds all properties of plain values that nothing moves, and the names of the objects pointed to."""
    moved = {path.rsplit(".", 1)[-1] for path in moved}
    for prop in owner.bl_rna.properties:
        name = prop.identifier
        if prop.is_readonly or name in SHOWN_ONLY or name in moved:
            continue
        if prop.type in {'BOOLEAN', 'INT', 'FLOAT', 'STRING', 'ENUM'}:
            value = getattr(owner, name)
            add(name, tuple(value) if getattr(prop, "is_array", False) else value)
        elif prop.type == 'POINTER':
            add(name, getattr(getattr(owner, name), "name", None))


def look(scene):
    """Marks the sound of a scene as out of date, or as good again."""
    chosen = scene.carillon
    stale = bool(chosen.baked) and (chosen.baked != digest(scene) or not strip.is_there(scene))
    if chosen.out_of_date != stale:
        chosen.out_of_date = stale
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()


def look_soon(scene):
    """Looks once, a moment after the last change."""
    if not scene.carillon.baked:
        return
    if bpy.app.timers.is_registered(_look_at_all):
        bpy.app.timers.unregister(_look_at_all)
    bpy.app.timers.register(_look_at_all, first_interval=0.3)


def _look_at_all():
    for scene in bpy.data.scenes:
        look(scene)


@persistent
def _on_change(scene, _depsgraph=None):
    look_soon(scene)


def register():
    bpy.app.handlers.depsgraph_update_post.append(_on_change)


def unregister():
    bpy.app.handlers.depsgraph_update_post.remove(_on_change)
    if bpy.app.timers.is_registered(_look_at_all):
        bpy.app.timers.unregister(_look_at_all)
