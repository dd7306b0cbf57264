# SPDX-License-Identifier: Apache-2.0
"""Carillon in Blender: materials on objects, and Bake Sound, which puts the sound of a scene into its sequencer
(docs/blender.md)."""

bl_info = {
    "name": "Carillon: sound of rigid bodies",
    "author": "The Carillon authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Scene and Physics > Carillon",
    "description": "Bakes the sound of rigid bodies and of keyed objects into the sequencer",
    "category": "Physics",
}


def register():
    from . import bake, freshness, panels, settings
    for module in (settings, bake, panels, freshness):
        module.register()


def unregister():
    from . import bake, freshness, panels, settings
    for module in (freshness, panels, bake, settings):
        module.unregister()
