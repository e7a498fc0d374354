# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves animation from any armature to any armature, by a retargetd service."""

from . import operators, panel, settings

_CLASSES = (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register():
    import bpy

    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.retargetd = bpy.props.PointerProperty(type=settings.RetargetdSettings)


def unregister():
    import bpy

    operators.stop()
    del bpy.types.Scene.retargetd
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
