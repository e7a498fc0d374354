# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the side bar of the 3D view."""

import bpy


class RETARGETD_UL_roles(bpy.types.UIList):
    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index):
        row = layout.row(align=True)
        row.label(text=item.name.replace("_", " "), icon="CHECKMARK" if item.confidence >= 0.9 else "QUESTION")
        row.label(text=item.source or "-")
        row.prop(item, "target", text="", emboss=False)
        row.label(text=f"{item.confidence:.0%}" if item.confidence else "")


class RETARGETD_UL_findings(bpy.types.UIList):
    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index):
        layout.label(text=item.text, icon="ERROR" if item.verdict == "fail" else "INFO")


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Retarget"


class RETARGETD_PT_main(_Panel, bpy.types.Panel):
    bl_label = "Retarget"

    def draw(self, context):
        settings = context.scene.retargetd
        layout = self.layout
        layout.use_property_split = True
        layout.prop(settings, "source_kind", expand=True)
        if settings.source_kind == "FILE":
            layout.prop(settings, "source_path")
        else:
            layout.prop(settings, "source")
        layout.prop(settings, "target")
        row = layout.row(align=True)
        row.operator("retargetd.add_actions", text=f"Actions: {len(settings.more_actions)} more")
        row.operator("retargetd.add_selected", text=f"Targets: {len(settings.more_targets)} more")
        row.operator("retargetd.clear", text="", icon="X")
        layout.prop(settings, "preset")
        column = layout.column(align=True)
        for name in ("align", "source_pose_is_rest", "target_pose_is_rest", "assign", "add_strip"):
            column.prop(settings, name)
        layout.operator("retargetd.retarget", icon="ARMATURE_DATA")
        if settings.status:
            layout.label(text=settings.status)


class RETARGETD_PT_mapping(_Panel, bpy.types.Panel):
    bl_label = "Mapping"
    bl_parent_id = "RETARGETD_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        settings = context.scene.retargetd
        self.layout.operator("retargetd.suggest")
        self.layout.template_list("RETARGETD_UL_roles", "", settings, "roles", settings, "role")
        row = self.layout.row(align=True)
        row.operator("retargetd.pick", icon="EYEDROPPER")
        row.operator("retargetd.save_rig", icon="FILE_TICK")


class RETARGETD_PT_findings(_Panel, bpy.types.Panel):
    bl_label = "Quality"
    bl_parent_id = "RETARGETD_PT_main"

    def draw(self, context):
        settings = context.scene.retargetd
        if settings.verdict:
            self.layout.label(text=f"Verdict: {settings.verdict}")
        self.layout.template_list("RETARGETD_UL_findings", "", settings, "findings", settings, "finding")
        self.layout.operator("retargetd.go_to", icon="FRAME_NEXT")


CLASSES = (RETARGETD_UL_roles, RETARGETD_UL_findings, RETARGETD_PT_main, RETARGETD_PT_mapping, RETARGETD_PT_findings)
