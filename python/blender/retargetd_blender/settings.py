# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user chooses: where the service is, and what goes onto what."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

PRESETS = (
    ("default", "Default", "Rotations are copied, and feet stay where they stand"),
    ("plain_fk", "Plain FK", "Rotations and the way of the pelvis, nothing else"),
)


def is_armature(_, candidate):
    return candidate.type == "ARMATURE"


class RetargetdPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    url: StringProperty(name="Service", default="http://127.0.0.1:8080", description="Address of a running service")
    key: StringProperty(name="Key", subtype="PASSWORD", description="Sent to the service where it asks for one")
    program: StringProperty(
        name="Program", subtype="FILE_PATH", description="The retargetd program: started when it is needed, in place of the service above"
    )

    def draw(self, _context):
        self.layout.prop(self, "program")
        column = self.layout.column()
        column.enabled = not self.program
        column.prop(self, "url")
        column.prop(self, "key")


class RetargetdAction(bpy.types.PropertyGroup):
    action: PointerProperty(type=bpy.types.Action, name="Action")


class RetargetdTarget(bpy.types.PropertyGroup):
    target: PointerProperty(type=bpy.types.Object, name="Armature", poll=is_armature)


class RetargetdRole(bpy.types.PropertyGroup):
    """One row of the mapping."""

    source: StringProperty()
    target: StringProperty(name="Bones", description="Bones of the target, from the body outward, with commas; none: it has no such part")
    found: StringProperty()
    confidence: FloatProperty()


class RetargetdFinding(bpy.types.PropertyGroup):
    """One measure that does not pass."""

    verdict: StringProperty()
    text: StringProperty()
    frame: IntProperty()
    bone: StringProperty()


class RetargetdSettings(bpy.types.PropertyGroup):
    source_kind: EnumProperty(
        name="Source",
        items=(("OBJECT", "Armature", "An armature of this file and its actions"), ("FILE", "File", "An animation file")),
    )
    source: PointerProperty(type=bpy.types.Object, name="Armature", poll=is_armature)
    source_path: StringProperty(name="File", subtype="FILE_PATH")
    more_actions: CollectionProperty(type=RetargetdAction)
    target: PointerProperty(type=bpy.types.Object, name="Target", poll=is_armature)
    more_targets: CollectionProperty(type=RetargetdTarget)
    preset: EnumProperty(name="Preset", items=PRESETS)
    align: BoolProperty(name="Align rest poses", default=True, description="Off where both rest poses look alike already")
    source_pose_is_rest: BoolProperty(name="Source: pose is rest", description="What is measured from is the source's pose as it is now")
    target_pose_is_rest: BoolProperty(name="Target: pose is rest", description="What is measured from is the target's pose as it is now")
    assign: BoolProperty(name="Assign", default=True, description="Has the target play the result; else there is a new action and nothing else changes")
    add_strip: BoolProperty(name="NLA strip", description="Puts the result into a track of its own")
    roles: CollectionProperty(type=RetargetdRole)
    role: IntProperty()
    findings: CollectionProperty(type=RetargetdFinding)
    finding: IntProperty()
    verdict: StringProperty()
    status: StringProperty()


CLASSES = (RetargetdPreferences, RetargetdAction, RetargetdTarget, RetargetdRole, RetargetdFinding, RetargetdSettings)
