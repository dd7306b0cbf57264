# SPDX-License-Identifier: Apache-2.0
"""What a bake does in a Blender of its own, on a copy of the .blend file, so that the user's neither waits nor changes:
the motion, and `carillon foley`. It prints a line of JSON for each stage, and one for the result or the fault."""

import json
import pathlib
import re
import subprocess

import bpy

from . import motion, programs, settings
from .programs import Fault

MARK = "carillon-bake: "


# What the advice of `carillon foley`, which names its options, is in Blender.
ADVICE = {
    "SURFACE_OPEN": "close its mesh, or tick Repair in its physics properties, or give it the material none",
    "NO_MODE_IN_BAND": "it is too small or too stiff to be heard: give it a Wall, a softer material, or the material "
                       "none",
    "MOTION_UNEXPLAINED": "its motion is not that of a body that falls and strikes: see docs/blender.md, or tick Bake "
                          "All the Same",
    "MOTION_WITHOUT_CONTACT": "nothing is near where its motion changes: give the floor the material none, or see that "
                              "the scene's unit is right",
    "NO_MOTION": "nothing that takes part moves: give what moves a rigid body or a material",
}


def tell(**what):
    print(MARK + json.dumps(what), flush=True)


def main(folder):
    """Bakes the active scene into sound.wav, stems and motion.glb in `folder`."""
    settings.register()
    folder = pathlib.Path(folder)
    scene = bpy.context.scene
    try:
        with programs.daemon() as server:
            programs.read_materials(server)
            gravity = _gravity(scene)
            found = motion.read(scene, lambda share, text: tell(progress=share, text=text))
            _check_materials(found)
            scene = bpy.context.scene
            found.write(folder / "motion.glb", scene)
            report = _foley(server, scene, found, gravity, folder)
        tell(done=report, how=found.how)
    except Fault as fault:
        tell(reason=fault.reason, message=fault.message, body=fault.body)


def _gravity(scene):
    """In m/s^2 of the time that is seen, y up."""
    world = scene.rigidbody_world
    share = world.effector_weights.gravity if world and world.effector_weights else 1
    slow = world.time_scale if world else 1
    x, y, z = scene.gravity if scene.use_gravity else (0, 0, 0)
    return [share * slow ** 2 * settings.metres_per_unit(scene) * g for g in (x, z, -y)]


def _check_materials(found):
    for body in found.bodies:
        chosen = bpy.data.objects[body.name].carillon.material
        if chosen and chosen != "none" and chosen not in programs.materials():
            raise Fault("MATERIAL_UNKNOWN", f"{body.name}: no material has the name {chosen}: choose one of the list",
                        body.name)


def _words(scene, found, folder):
    chosen = scene.carillon
    # A movie ends with its last frame, so that the sound ends there, too.
    length = str((found.matrices.shape[1] - 1) / found.frames_per_s)
    words = ["--material-masses", "--out", folder / "sound.wav", "--length", length, "--tail", length,
             "--channels", chosen.channels, "--gain", f"{chosen.gain_db}dB",
             "--striker", chosen.striker, "--roughness", str(chosen.roughness)]
    words += ["--normalize"] if chosen.normalize else []
    words += ["--frames-are-steps"] if found.steps else []
    words += ["--force"] if chosen.force else []
    words += ["--stems", folder / "stems"] if chosen.stems else []
    words += ["--listener", "camera"] if chosen.use_camera and scene.camera else []
    for body in found.bodies:
        of = bpy.data.objects[body.name].carillon
        pattern = re.sub(r"([\\*?\[])", r"\\\1", body.name)
        words += ["--material", f"{pattern}={of.material}"] if of.material else []
        words += ["--wall", f"{pattern}={of.wall * settings.metres_per_unit(scene):.9g}"] if of.wall > 0 else []
        words += ["--repair", pattern] if of.repair else []
    return words


def _foley(server, scene, found, gravity, folder):
    tell(progress=0.3, text="Finding the contacts")
    process = subprocess.Popen(
        [programs.find("carillon"), *server, "foley", folder / "motion.glb", *_words(scene, found, folder),
         "--gravity=" + ",".join(map(str, gravity))], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    lines = []
    for line in process.stderr:
        line = line.strip()
        lines.append(line)
        if line and not line.startswith(("carillon:", "warning:")):
            tell(progress=0.5, text=line)
    if process.wait() == 0:
        return [line for line in lines if "unexplained" in line or line.startswith("warning:")]
    text = "\n".join(lines)
    refusal = re.search(r"^carillon: ([A-Z_]+): (.*)", text, re.MULTILINE | re.DOTALL)
    reason, message = refusal.groups() if refusal else ("FOLEY_FAILED", text)
    named = [body.name for body in found.bodies if re.search(rf"(?<!\w){re.escape(body.name)}(?!\w)", message)]
    named += re.findall(r"^(.+?) +\d+ %  failed$", text, re.MULTILINE)  # the job of a model
    body = max(named, key=len, default="")
    if reason in ADVICE:
        what = re.sub(r"^\S*motion\.glb: ", "", message).split(": ")
        message = ": ".join([*what[:2 if what[0] == body else 1], ADVICE[reason]])
    raise Fault(reason, message, body)
