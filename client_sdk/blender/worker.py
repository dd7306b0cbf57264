# SPDX-License-Identifier: Apache-2.0
"""What a bake does in a Blender of its own, on a copy of the .blend file, so that the user's neither waits nor changes:
the motion, and `carillon foley`. It prints a line of JSON for each stage, and one for the result or the fault."""

import json
import pathlib
import re
import shutil
import subprocess

import bpy

from . import bodies, motion, notes, programs, settings, shapes
from .programs import Fault

MARK = "carillon-bake: "
FEW = 10


# What the advice of `carillon foley`, which names its options, is in Blender.
ADVICE = {
    "SURFACE_OPEN": "the surface is not closed: close the mesh, or tick Repair in the physics properties, or give it "
                    "the material none",
    "MESH_SEVERAL_PIECES": "its surface has parts that do not touch: let them overlap by a millimetre, and unite them "
                           "by a Boolean modifier (the bake unites the parts of a Compound Parent), give those that "
                           "are only there to collide the material none, or separate them into bodies of their own",
    "NO_MODE_IN_BAND": "too small or too stiff to be heard: nothing else has a material, so that nothing sounds",
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
        tell(progress=0.02, text="Looking for the daemon")
        with programs.daemon() as server:
            programs.read_materials(server)
            gravity = _gravity(scene)
            found = motion.read(scene, lambda share, text: tell(progress=share, text=text))
            _check_materials(found)
            scene = bpy.context.scene
            found.write(folder / "motion.glb", scene)
            report = _foley(server, scene, found, gravity, folder)
        hints = [f"warning: {hint}" for hint in found.hints]
        hints += [f"warning: {body.name}: {hint}" for body in found.bodies for hint in body.hints]
        if not scene.carillon.stems:
            shutil.rmtree(folder / "stems", ignore_errors=True)
        tell(done=report + hints + notes.of(scene, found), how=found.how)
    except Fault as fault:
        tell(reason=fault.reason, message=fault.message, bodies=list(fault.bodies))


def _gravity(scene):
    """In m/s^2 of the time that is seen, y up."""
    world = scene.rigidbody_world
    share = world.effector_weights.gravity if world and world.effector_weights else 1
    slow = world.time_scale if world else 1
    x, y, z = scene.gravity if scene.use_gravity else (0, 0, 0)
    return [share * slow ** 2 * settings.metres_per_unit(scene) * g for g in (x, z, -y)]


def _check_materials(found):
    chosen = {body.name: bpy.data.objects[body.name].carillon.material or body.material for body in found.bodies}
    unknown = [name for name, material in chosen.items() if material not in ("", "none", *programs.materials())]
    if unknown:
        missing = ", ".join(f"{name}: no material has the name {chosen[name]}" for name in unknown)
        raise Fault("UNKNOWN_MATERIAL", f"{missing}: choose one of the list", unknown)
    if not any(material not in ("", "none") for material in chosen.values()):
        unheard = "; ".join(f"{names}: {why}" for names, why in bodies.unheard(bpy.context.scene).items())
        raise Fault("NO_MATERIAL", unheard or
                    "no object has a material of Carillon: choose one in Physics properties > Carillon, or give the "
                    "object a Blender material of that name")


def _causes(scene, found, name, reason):
    """What makes Blender move a body as no contacts do, and what to do about it."""
    body = next((body for body in found.bodies if body.name == name), None)
    causes = found.hints + (body.hints if body else [])
    for obj in scene.objects:
        held = obj.rigid_body_constraint
        if held and held.enabled and any(end and end.name == name for end in (held.object1, held.object2)):
            causes.append(f"{obj.name}, a constraint, holds it, which is not heard yet")
        if obj.name == name and obj.rigid_body and shapes.is_thinner_than_margin(obj.rigid_body, obj.dimensions):
            causes.append("it is thinner than the margin of 4 cm that the simulator gives it: tick Rigid Body > "
                          "Sensitivity > Collision Margin, and set 0.001 m")
        if obj.name == name and obj.rigid_body and obj.rigid_body.collision_shape == 'SPHERE' and (
                not bodies.are_spheres(scene)):
            meshes = [of.name for of in bodies.in_world(scene) if of.rigid_body.collision_shape == 'MESH' and
                      not (of.rigid_body.use_margin and of.rigid_body.collision_margin == 0)]
            if meshes:
                causes.append(f"spheres touch {', '.join(meshes)}, of the shape Mesh, without the margin that other "
                              "shapes keep: tick Rigid Body > Sensitivity > Collision Margin there, and set 0")
        if obj.field and obj.field.type != 'NONE':
            causes.append(f"{obj.name}, a force field, moves it, which is not heard yet")
    size = sum(g * g for g in _gravity(scene)) ** 0.5
    if scene.use_gravity and not 3 < size < 30:
        causes.append(f"gravity is {size:.3g} m/s^2: see Scene > Gravity, and Units > Unit Scale")
    if body and not body.mass:
        causes.append("it is keyed, and must move as a body falls and strikes: eased or bent keys do not, and a turn "
                      "by hand does not")
    obj = bpy.data.objects.get(name)
    if obj and obj.animation_data and obj.animation_data.action and obj.animation_data.action.fcurves.find(
            "rigid_body.kinematic"):
        causes.append("Animated is keyed, and a body that is moved at first and simulated later must move all the time "
                      "as bodies fall: keep it still or let it fall from the first frame on, or split the scene")
    if reason == "MOTION_WITHOUT_CONTACT" and not causes:
        causes.append("if a floor without a rigid body is there, give it the material none")
    return "; ".join(causes or ["the shapes or the steps of the simulator may be too coarse: raise Rigid Body World > "
                                "Substeps Per Frame, or set Rigid Body > Sensitivity > Collision Margin to 0.001 m"])


def _in_blender(text, found):
    """A message of `carillon foley` in the words of the panel: frames instead of seconds, settings instead of
    options."""
    first, rate = found.shown
    text = re.sub(r"near ([\d.e-]+) s\b", lambda at: f"near frame {first + float(at[1]) * rate:.1f}", text)
    text = re.sub(r"--wall (\d[\d.e-]*)", r"a Wall of \1 m", text)
    text = re.sub(r" \(--(floor|unit|mesh)\)", "", text)
    text = re.sub(r"^carillon: (?=try )", "", text, flags=re.MULTILINE)
    return re.sub(r"\(?--(wall|repair|material)\b\)?", lambda option: option[1].title(), text)


def _are_few(found):
    """True if the stems take so little time that they are rendered, wanted or not, to name bodies that nobody hears."""
    return len(found.bodies) <= FEW


def _words(scene, found, folder):
    chosen = scene.carillon
    # A movie ends with its last frame, so that the sound ends there, too.
    first, rate = found.shown
    words = ["--material-masses", "--out", folder / "sound.wav", "--length", str(found.length_s),
             "--tail", str(found.length_s),
             "--channels", chosen.channels, "--gain", f"{chosen.gain_db}dB",
             "--striker", chosen.striker, "--roughness", str(chosen.roughness)]
    words += ["--normalize"] if chosen.normalize else []
    words += ["--wait"] if chosen.radiation else []
    words += ["--frames-are-steps"] if found.steps else []
    words += ["--force"] if chosen.force else []
    words += ["--stems", folder / "stems"] if chosen.stems or _are_few(found) else []
    if chosen.use_camera and scene.camera:
        words += ["--listener", "camera"]
        words += [word for frame in found.cuts if frame > first for word in ("--cut", str((frame - first) / rate))]
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
         "--gravity=" + ",".join(map(str, gravity))], stdout=open(folder / "summary", "w", encoding="utf-8"),
        stderr=subprocess.PIPE, text=True, preexec_fn=programs.end_with_parent)
    lines, jobs = [], {}
    for line in process.stderr:
        line = line.strip()
        lines.append(line)
        notes.take_job(line, jobs)
        if line and not line.startswith(("carillon:", "warning:")):
            tell(progress=0.5, text=line)
    if process.wait() == 0:
        report = [_in_blender(line, found) for line in lines if "unexplained" in line or line.startswith("warning:")]
        return report + notes.of_sound(scene, folder, report[0], jobs)
    text = "\n".join(lines)
    refusal = re.search(r"^carillon: ([A-Z_]+): (.*)", text, re.MULTILINE | re.DOTALL)
    reason, message = refusal.groups() if refusal else ("FOLEY_FAILED", text)
    # Not "Cube" where "Cube.001" is named.
    named = {body.name for body in found.bodies
             if re.search(rf"(?<![\w.]){re.escape(body.name)}(?!\w|\.\w)", message)}
    named |= set(re.findall(r"^(.+?) +\d+ %  failed$", text, re.MULTILINE))  # the jobs of models
    named = sorted(named)
    what = re.sub(r"^\S*motion\.glb: ", "", message)
    if reason.startswith("MOTION_UN") or reason == "MOTION_WITHOUT_CONTACT":
        advice = _causes(scene, found, named[0] if named else "", reason) + "; or tick Bake All the Same"
        message = f"{what.split(': ')[0]}: {advice}"
    elif reason in ADVICE:
        about = f"{', '.join(named)}: " if named else ""
        message = motion.world_is_off(scene) if reason == "NO_MOTION" else ""
        message = message or about + ADVICE[reason]
    raise Fault(reason, _in_blender(message, found), named)
