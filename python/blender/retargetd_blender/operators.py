# SPDX-License-Identifier: GPL-3.0-or-later
"""What the buttons do."""

import time
import urllib.parse

import bpy

from . import actions, armatures, work
from .service import OwnService, Refused, Service, Task

_own = OwnService()


def stop():
    """Ends the service that was started here."""
    _own.stop()


def service_of(context):
    """How to reach the service; called in a thread, since it may have to be started."""
    addon = context.preferences.addons.get(__package__)
    preferences = addon.preferences if addon else None
    program = bpy.path.abspath(preferences.program) if preferences and preferences.program else ""
    url = preferences.url if preferences else "http://127.0.0.1:8080"
    key = preferences.key if preferences else ""
    # Since 4.2; who works offline reaches this machine and no other.
    is_online = getattr(bpy.app, "online_access", True)

    def reach():
        if program:
            return Service(_own.start(program))
        host = urllib.parse.urlsplit(url).hostname or ""
        if not is_online and host not in ("localhost", "127.0.0.1", "::1"):
            raise Refused("Blender works offline: allow online access in the preferences, or use a service on this machine")
        return Service(url, key)

    return reach


class _Stepped(bpy.types.Operator):
    """Something that takes a while, in steps; Esc ends it."""

    def steps(self, context):
        raise NotImplementedError

    def execute(self, context):
        """Without a window, all at once."""
        steps = self.steps(context)
        try:
            while True:
                next(steps)
                time.sleep(0.001)
        except StopIteration as end:
            return self.finish(context, end.value)
        except (armatures.Unusable, Refused) as refused:
            return self.refuse(context, refused)

    def invoke(self, context, _event):
        self._steps = self.steps(context)
        self._timer = context.window_manager.event_timer_add(0.02, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._steps.close()
            self._end(context)
            context.scene.retargetd.status = "canceled"
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            context.scene.retargetd.status = next(self._steps)
        except StopIteration as end:
            self._end(context)
            return self.finish(context, end.value)
        except (armatures.Unusable, Refused) as refused:
            self._end(context)
            return self.refuse(context, refused)
        for area in context.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
        return {"RUNNING_MODAL"}

    def _end(self, context):
        context.window_manager.event_timer_remove(self._timer)

    def refuse(self, context, refused):
        context.scene.retargetd.status = str(refused)
        self.report({"ERROR"}, str(refused))
        return {"CANCELLED"}

    def finish(self, context, result):
        raise NotImplementedError


class RETARGETD_OT_retarget(_Stepped):
    bl_idname = "retargetd.retarget"
    bl_label = "Retarget"
    bl_description = "Makes one new action for every action and target. Esc ends it"
    bl_options = {"REGISTER", "UNDO"}

    def steps(self, context):
        return work.run(context.scene, context.scene.retargetd, service_of(context))

    def finish(self, context, made):
        settings = context.scene.retargetd
        settings.findings.clear()
        rate = actions.scene_rate(context.scene)
        verdicts = []
        for one in made:
            verdicts.append((one.report.get("measures") or {}).get("verdict", "not_applicable"))
            for verdict, text, frame, bone in work.findings_of(one.report, one.first_frame, rate):
                row = settings.findings.add()
                row.name, row.verdict, row.text, row.frame, row.bone = one.target.name, verdict, text, frame, bone
        order = ("fail", "warn", "pass", "not_applicable")
        settings.verdict = min(verdicts, key=order.index, default="not_applicable")
        settings.status = f"{len(made)} new actions"
        self.report({"INFO"}, f"{len(made)} new actions, verdict {settings.verdict}")
        return {"FINISHED"}


class RETARGETD_OT_suggest(_Stepped):
    bl_idname = "retargetd.suggest"
    bl_label = "Find mapping"
    bl_description = "Says which bones of the target are what, and how sure that is"

    def steps(self, context):
        scene, settings = context.scene, context.scene.retargetd
        if settings.target is None:
            raise armatures.Unusable("choose a target")
        if settings.source_kind == "FILE":
            files = work.file_source(settings.source_path)
        elif settings.source is None:
            raise armatures.Unusable("choose a source")
        else:
            still = armatures.arrays_of(settings.source, scene.unit_settings.scale_length)
            files = [("source", "source.npz", lambda: _one_frame(still))]
        files += work.target_files(scene, settings, settings.target)
        reach = service_of(context)
        task = Task(lambda _is_canceled, _tell: reach().suggest(work.encoded(files), None))
        while not task.is_done():
            yield "asks for a mapping"
        if task.error:
            raise armatures.Unusable(task.error)
        return task.result

    def finish(self, context, proposal):
        settings = context.scene.retargetd
        settings.roles.clear()
        for role in proposal["roles"]:
            row = settings.roles.add()
            row.name = role["role"]
            row.source, row.target = _joined(role["source"]), _joined(role["target"])
            row.found = row.target
            row.confidence = role["confidence"] or 0.0
        settings.status = f"{len(settings.roles)} parts found"
        return {"FINISHED"}


def _one_frame(arrays):
    """Arrays of a rig at rest, as a motion of one frame: what is asked for needs a clip."""
    moved = {key: arrays[f"rest_{key}"][None] for key in ("translations", "rotations", "scales")}
    return {**arrays, **moved, "times": work.np.zeros(1)}


def _joined(joints):
    return joints or "" if not isinstance(joints, list) else ", ".join(joints)


class RETARGETD_OT_pick(bpy.types.Operator):
    bl_idname = "retargetd.pick"
    bl_label = "Use the active bone"
    bl_description = "The active bone of the target is this part"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        settings = context.scene.retargetd
        bone = settings.target.data.bones.active if settings.target else None
        if bone is None or not 0 <= settings.role < len(settings.roles):
            self.report({"WARNING"}, "select a bone of the target, and a row of the mapping")
            return {"CANCELLED"}
        settings.roles[settings.role].target = bone.name
        return {"FINISHED"}


class RETARGETD_OT_save_rig(bpy.types.Operator):
    bl_idname = "retargetd.save_rig"
    bl_label = "Save as rig template"
    bl_description = "The service keeps the mapping of the target, and recognizes such rigs by it from now on"

    name: bpy.props.StringProperty(name="Name", default="my_rig")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        roles = {row.name: [name.strip() for name in row.target.split(",")] for row in context.scene.retargetd.roles if row.target}
        has_feet = "left_hind_foot" in roles
        reach = service_of(context)
        try:
            reach().put_rig(self.name, {"kind": "quadruped" if has_feet else "biped", "roles": roles})
        except Refused as refused:
            self.report({"ERROR"}, str(refused))
            return {"CANCELLED"}
        self.report({"INFO"}, f"the service keeps the rig '{self.name}'")
        return {"FINISHED"}


class RETARGETD_OT_go_to(bpy.types.Operator):
    bl_idname = "retargetd.go_to"
    bl_label = "Go to worst frame"
    bl_description = "Shows the frame where this measure is worst, and selects the bone"

    def execute(self, context):
        settings = context.scene.retargetd
        if not 0 <= settings.finding < len(settings.findings):
            return {"CANCELLED"}
        row = settings.findings[settings.finding]
        context.scene.frame_set(row.frame)
        target = bpy.data.objects.get(row.name)
        bone = target.data.bones.get(row.bone) if target else None
        if bone is not None:
            for other in target.pose.bones:
                # Blender 5 keeps with the pose what is selected.
                chosen = other if hasattr(other, "select") else other.bone
                chosen.select = other.name == bone.name
            target.data.bones.active = bone
        return {"FINISHED"}


class RETARGETD_OT_add_target(bpy.types.Operator):
    bl_idname = "retargetd.add_selected"
    bl_label = "Add selected armatures"
    bl_description = "Every selected armature is a target too"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        settings = context.scene.retargetd
        known = {settings.target, settings.source, *(row.target for row in settings.more_targets)}
        for chosen in context.selected_objects:
            if chosen.type == "ARMATURE" and chosen not in known:
                settings.more_targets.add().target = chosen
        return {"FINISHED"}


class RETARGETD_OT_add_actions(bpy.types.Operator):
    bl_idname = "retargetd.add_actions"
    bl_label = "Add all actions"
    bl_description = "Every action that moves bones of the source is retargeted"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        settings = context.scene.retargetd
        if settings.source is None:
            return {"CANCELLED"}
        known = {row.action for row in settings.more_actions}
        names = {bone.name for bone in settings.source.data.bones}
        for action in bpy.data.actions:
            if action not in known and actions.moves(action, names):
                settings.more_actions.add().action = action
        return {"FINISHED"}


class RETARGETD_OT_clear(bpy.types.Operator):
    bl_idname = "retargetd.clear"
    bl_label = "Clear"
    bl_description = "Only the source's own action, and only the one target"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        context.scene.retargetd.more_actions.clear()
        context.scene.retargetd.more_targets.clear()
        return {"FINISHED"}


CLASSES = (
    RETARGETD_OT_retarget,
    RETARGETD_OT_suggest,
    RETARGETD_OT_pick,
    RETARGETD_OT_save_rig,
    RETARGETD_OT_go_to,
    RETARGETD_OT_add_target,
    RETARGETD_OT_add_actions,
    RETARGETD_OT_clear,
)
