# SPDX-License-Identifier: Apache-2.0
"""What the user sets: how an object sounds, and how the scene is baked. It is stored in the .blend file."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import freshness, programs


def find_materials(_settings, _context, text):
    """The catalogued names that contain what the user has typed."""
    words = text.lower().split()
    return [name for name in ["none", *programs.materials()] if all(word in name for word in words)]


def changed(_settings, context):
    if context.scene is not None:
        freshness.look_soon(context.scene)


class CarillonBody(bpy.types.PropertyGroup):
    """Object.carillon"""
    material: StringProperty(
        name="Material", search=find_materials, update=changed,
        description="What the body is made of. Empty: as the Blender material of the name of a catalogued one says; "
                    "none: silent, but others strike it")
    wall: FloatProperty(name="Wall", unit='LENGTH', min=0, precision=4, update=changed,
                        description="The body is hollow, with a wall of this thickness within its surface; 0: solid")
    repair: BoolProperty(name="Repair", update=changed,
                         description="Close a surface that is open or crosses itself before its sound is computed")
    fault: StringProperty(options={'HIDDEN'}, description="Why the last bake failed on this object")


class CarillonScene(bpy.types.PropertyGroup):
    """Scene.carillon"""
    channels: EnumProperty(name="Channels", items=[('1', "Mono", ""), ('2', "Stereo", "")], default='2', update=changed)
    use_camera: BoolProperty(name="Hear from the Camera", default=True, update=changed,
                             description="Distance and direction are those from the scene's camera")
    normalize: BoolProperty(name="Normalize", default=True, update=changed,
                            description="Scale the sound to its peak, and its stems alike. Otherwise a sample of full "
                                        "scale is 200 Pa")
    gain_db: FloatProperty(name="Gain", default=0, soft_min=-60, soft_max=60, update=changed,
                           description="Decibels added to the sound and to its stems")
    striker: EnumProperty(
        name="Silent Bodies", default='wood', update=changed,
        items=[(name, name.capitalize(), "") for name in ("steel", "wood", "rubber", "felt", "fingertip")],
        description="What silent bodies, such as floors, strike like: the softer, the duller is the sound")
    roughness: FloatProperty(name="Roughness", default=0.1, min=0, max=10, update=changed,
                             description="How much the force of what slides fluctuates, relative to itself")
    sub_frames: IntProperty(
        name="Sub-frames", default=0, min=0, max=100, update=changed,
        description="Poses for each frame. 0: each step of the simulation, up to 1000 poses a second; of keys, as "
                    "dense as they are")
    radiation: BoolProperty(
        name="Radiation", update=changed,
        description="Compute how the bodies radiate before they are heard, which takes seconds to minutes for a new "
                    "body. Otherwise levels and decays are not those of real bodies")
    stems: BoolProperty(name="Stems", update=changed,
                        description="Put the sound of each object, muted, on a channel of its own, too")
    channel: IntProperty(name="Strip Channel", default=1, min=1, max=32,
                         description="The channel of a new strip in the sequencer")
    force: BoolProperty(name="Bake All the Same", update=changed,
                        description="Bake contacts that do not explain the motion, and repair open surfaces")
    report: StringProperty(options={'HIDDEN'})
    fault: StringProperty(options={'HIDDEN'})
    baked: StringProperty(options={'HIDDEN'}, description="The digest of all that was baked")
    out_of_date: BoolProperty(options={'HIDDEN'}, description="The scene has changed since its sound was baked")


def metres_per_unit(scene):
    units = scene.unit_settings
    return 1.0 if units.system == 'NONE' else units.scale_length


def guessed_material(obj):
    """The catalogued name that the object's Blender material has, or an empty text."""
    slots = [slot.material.name for slot in obj.material_slots if slot.material]
    name = slots[0].split(".")[0].lower().replace(" ", "_").replace("-", "_") if slots else ""
    return name if name in programs.materials() else ""


classes = (CarillonBody, CarillonScene)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.Object.carillon = PointerProperty(type=CarillonBody)
    bpy.types.Scene.carillon = PointerProperty(type=CarillonScene)


def unregister():
    del bpy.types.Object.carillon, bpy.types.Scene.carillon
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
