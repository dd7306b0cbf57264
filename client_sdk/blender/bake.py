# SPDX-License-Identifier: Apache-2.0
"""Bake Sound: runs worker.py in a Blender of its own, shows its progress, and puts the result into the sequencer."""

import contextlib
import json
import os
import pathlib
import queue
import shutil
import signal
import subprocess
import tempfile
import threading
import time

import bpy

from . import freshness, programs, strip, worker
from .programs import Fault

current = None  # the bake that runs, if any


class Bake:
    """A bake of the scene of a context."""

    def __init__(self, context):
        self.scene = context.scene
        self.baked = freshness.digest(self.scene)
        self.share, self.text, self.result = 0.01, "Opening a copy in a second Blender", None
        programs.find("carillon")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="carillon-bake-"))
        copy = self.folder / "copy.blend"
        bpy.ops.wm.save_as_mainfile(filepath=os.fspath(copy), copy=True, compress=False)
        package = pathlib.Path(__file__).parent
        code = (f"import sys, importlib; sys.path.insert(0, {os.fspath(package.parent)!r}); "
                f"importlib.import_module({package.name + '.worker'!r}).main({os.fspath(self.folder)!r})")
        scripts = ["--enable-autoexec"] if context.preferences.filepaths.use_scripts_auto_execute else []
        self.log = open(self.folder / "log", "w", encoding="utf-8")
        self.process = subprocess.Popen(
            [bpy.app.binary_path, "--background", "--factory-startup", *scripts, os.fspath(copy),
             "--python-exit-code", "1", "--python-expr", code],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self.log, text=True, start_new_session=True,
            preexec_fn=programs.end_with_parent,
            env=os.environ | {"TMPDIR": os.fspath(self.folder)})  # so that nothing is left of a bake that is ended
        self.lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            if line.startswith(worker.MARK):
                self.lines.put(json.loads(line[len(worker.MARK):]))

    def poll(self):
        """Takes in what the worker says; False once it has ended."""
        ended = self.process.poll() is not None
        if ended:
            time.sleep(0.05)  # the last lines are still read
        while not self.lines.empty():
            said = self.lines.get()
            if "progress" in said:
                self.share, self.text = said["progress"], said["text"]
            else:
                self.result = said
        return not ended

    def finish(self):
        """Puts the sound into the sequencer and returns the report; raises the fault of the worker."""
        if self.result is None:
            raise Fault("BAKE_ENDED", "the Blender in the background ended: " +
                        (self.folder / "log").read_text(errors="replace").strip()[-500:])
        if "reason" in self.result:
            raise Fault(self.result["reason"], self.result["message"], self.result["bodies"])
        placed = strip.keep(self.scene, self.folder)
        self.scene.carillon.baked = self.baked
        freshness.look(self.scene)
        return "\n".join([*self.result["done"], *placed, "From " + self.result["how"]])

    def end(self):
        """Ends the worker with all that it has started, and removes the files."""
        if self.process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait()
        self.log.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class CARILLON_OT_bake(bpy.types.Operator):
    """Compute the sound of the scene's bodies, and put it into the sequencer"""
    bl_idname = "carillon.bake"
    bl_label = "Bake Sound"

    @classmethod
    def poll(cls, _context):
        return current is None

    def execute(self, context):
        """From a script: waits for the end."""
        if not self._start(context):
            return {'CANCELLED'}
        while current.poll():
            time.sleep(0.05)
        return self._finish(context)

    def invoke(self, context, _event):
        if not self._start(context):
            return {'CANCELLED'}
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context, event):
        if event.type != 'TIMER':
            return {'PASS_THROUGH'}
        _redraw(context)
        if current is not None and current.poll():
            return {'PASS_THROUGH'}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(context) if current is not None else {'CANCELLED'}

    def _start(self, context):
        global current
        context.scene.carillon.fault = context.scene.carillon.report = ""
        for obj in context.scene.objects:
            obj.carillon.fault = ""
        try:
            current = Bake(context)
        except Fault as fault:
            self._show(context.scene, fault)
        return current is not None

    def _finish(self, context):
        global current
        bake, current = current, None
        try:
            bake.scene.carillon.report = bake.finish()
        except Fault as fault:
            self._show(bake.scene, fault)
            return {'CANCELLED'}
        finally:
            bake.end()
            _redraw(context)
        self.report({'INFO'}, bake.scene.carillon.report)
        return {'FINISHED'}

    def _show(self, scene, fault):
        scene.carillon.fault = str(fault)
        for name in fault.bodies:
            if name in bpy.data.objects:
                bpy.data.objects[name].carillon.fault = str(fault)
        self.report({'WARNING'}, str(fault))


class CARILLON_OT_cancel(bpy.types.Operator):
    """End the bake; the sound of the last one stays"""
    bl_idname = "carillon.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context):
        return current is not None

    def execute(self, _context):
        unregister_running()
        return {'FINISHED'}


def unregister_running():
    global current
    bake, current = current, None
    if bake is not None:
        bake.end()


def _redraw(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()


classes = (CARILLON_OT_bake, CARILLON_OT_cancel)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    unregister_running()
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
