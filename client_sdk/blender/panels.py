# SPDX-License-Identifier: Apache-2.0
"""The panels: Carillon in the scene's properties and in the sequencer's sidebar, and in the physics of an object."""

import shutil
import textwrap

import bpy

from . import bake, settings


def _write(layout, text, icon='NONE', width=60):
    """Text over several lines, as a label has only one."""
    for line in text.splitlines():
        for number, part in enumerate(textwrap.wrap(line, width) or [""]):
            layout.label(text=part, icon=icon if number == 0 else 'BLANK1')


def _draw_bake(layout, context):
    scene, chosen = context.scene, context.scene.carillon
    if bake.current is not None:
        _write(layout, f"{bake.current.share:4.0%}  {bake.current.text}", 'TIME')
        layout.operator("carillon.cancel", icon='X')
        return
    layout.operator("carillon.bake", icon='SOUND')
    if chosen.fault:
        _write(layout, chosen.fault, 'ERROR')
    elif chosen.out_of_date:
        _write(layout, "Out of date: the scene has changed since", 'ERROR')
    if chosen.report:
        _write(layout, chosen.report, 'CHECKMARK')
    render = scene.render
    if chosen.baked and not render.use_sequencer:
        _write(layout, "Movies are silent: switch on Output > Post Processing > Sequencer", 'INFO')
    if chosen.baked and render.image_settings.file_format == 'FFMPEG' and render.ffmpeg.audio_codec == 'NONE':
        _write(layout, "Movies are silent: choose Output > Encoding > Audio Codec", 'INFO')


class CARILLON_PT_scene(bpy.types.Panel):
    bl_idname = "CARILLON_PT_scene"
    bl_label = "Carillon"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "scene"

    def draw(self, context):
        layout, chosen = self.layout, context.scene.carillon
        if shutil.which("carillon") is None:
            _write(layout, "The programs of Carillon are not found: install the packages carillon, carillond and "
                           "carillon-precompute", 'ERROR')
        _draw_bake(layout, context)
        layout.use_property_split = True
        for name in ("use_camera", "channels", "normalize", "gain_db", "striker", "roughness", "radiation",
                     "sub_frames", "channel", "stems", "force"):
            layout.prop(chosen, name)


class CARILLON_PT_sequencer(bpy.types.Panel):
    bl_idname = "CARILLON_PT_sequencer"
    bl_label = "Carillon"
    bl_space_type = 'SEQUENCE_EDITOR'
    bl_region_type = 'UI'
    bl_category = "Carillon"

    def draw(self, context):
        _draw_bake(self.layout, context)


class CARILLON_PT_object(bpy.types.Panel):
    bl_idname = "CARILLON_PT_object"
    bl_label = "Carillon"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "physics"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == 'MESH'

    def draw(self, context):
        layout, obj = self.layout, context.object
        of = obj.carillon
        layout.use_property_split = True
        layout.prop(of, "material")
        guess = "" if of.material else settings.guessed_material(obj)
        if guess and obj.rigid_body:
            _write(layout, f"{guess}, as its Blender material says", 'INFO')
        elif not of.material:
            _write(layout, "Silent: no material" if obj.rigid_body else "Takes no part: no material", 'INFO')
        layout.prop(of, "wall")
        layout.prop(of, "repair")
        if of.fault:
            _write(layout, of.fault, 'ERROR')


classes = (CARILLON_PT_scene, CARILLON_PT_sequencer, CARILLON_PT_object)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
