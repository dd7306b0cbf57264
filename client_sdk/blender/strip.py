# SPDX-License-Identifier: Apache-2.0
"""The sound of a scene as strips of its sequencer."""

import os
import pathlib
import re
import shutil

import bpy

from .programs import Fault

KEY = "carillon"  # the custom property of a strip: "sound", or the name of a stem
BAKED = "carillon_start"  # that of the frame at which its bake put it


def _strips(scene):
    editor = scene.sequence_editor or scene.sequence_editor_create()
    return getattr(editor, "strips", None) or editor.sequences


def is_there(scene):
    """True if the sequencer has the sound of a bake."""
    return scene.sequence_editor is not None and any(strip.get(KEY) == "sound" for strip in _strips(scene))


def folder_of(scene):
    """Where the files of a scene are kept: beside the .blend file, or for an unsaved one in Blender's own folder for
    temporary files, whence they are packed into the .blend file."""
    base = pathlib.Path(bpy.data.filepath).parent if bpy.data.filepath else pathlib.Path(bpy.app.tempdir)
    name = pathlib.Path(bpy.data.filepath).stem or "unsaved"
    return base / "carillon" / re.sub(r"[/\\]", "_", f"{name}-{scene.name}")


def keep(scene, made):
    """Moves sound.wav and the stems from the folder `made` to the scene's, and puts them into the sequencer in place of
    those of an earlier bake, whose channel, volume and place they keep. Returns lines for the report."""
    folder = folder_of(scene)
    try:
        shutil.rmtree(folder / "stems", ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        for path in (made / "sound.wav", made / "motion.glb", made / "stems"):
            if path.exists():
                shutil.move(path, folder / path.name) if path.is_dir() else shutil.copy(path, folder / path.name)
    except OSError as error:
        raise Fault("OUTPUT_NOT_WRITABLE", f"{folder}: {error.strerror}: choose another folder by File > Save As")
    before = {strip[KEY]: _placed(strip) for strip in _strips(scene) if KEY in strip}
    for strip in [strip for strip in _strips(scene) if KEY in strip]:
        sound = strip.sound
        _strips(scene).remove(strip)
        if sound and sound.users == 0:
            bpy.data.sounds.remove(sound)
    channel = _add(scene, "sound", folder / "sound.wav", before, scene.carillon.channel)
    last = channel
    for stem in sorted((folder / "stems").glob("*.wav")):
        last = _add(scene, re.sub(r"^\d+-", "", stem.stem), stem, before, last + 1, mute=True)
    if "sound" in before or channel == scene.carillon.channel:
        return []
    return [f"The strip is on channel {channel}: other strips are on channel {scene.carillon.channel}"]


def _free_channel(scene, channel, start):
    """The first channel from `channel` on where no strip is during a sound that starts at a frame."""
    end = start + scene.frame_end - scene.frame_start + 1
    taken = {strip.channel for strip in _strips(scene) if strip.frame_final_start < end and
             strip.frame_final_end > start}
    return next((free for free in range(channel, 33) if free not in taken), 32)


def _placed(strip):
    return {"channel": strip.channel, "volume": strip.volume, "mute": strip.mute, "pan": strip.pan,
            "moved": round(strip.frame_start - strip.get(BAKED, strip.frame_start))}


def _add(scene, name, path, before, channel, mute=False):
    """Adds a strip and returns its channel."""
    kept = before.get(name, {"channel": channel, "mute": mute})
    start = scene.frame_start + kept.get("moved", 0)
    strip = _strips(scene).new_sound("Carillon" if name == "sound" else f"Carillon {name}", os.fspath(path),
                                     _free_channel(scene, kept["channel"], start), start)
    strip[KEY], strip[BAKED] = name, scene.frame_start
    for key, value in kept.items():
        if key not in ("channel", "moved"):
            setattr(strip, key, value)
    if bpy.data.filepath:
        strip.sound.filepath = bpy.path.relpath(os.fspath(path))
    else:
        strip.sound.pack()
    return strip.channel
