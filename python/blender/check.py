"""Checks the Blender add-on in Blender itself (PyPI's `bpy`) against a real service, on real characters.

    python3.11 -m venv /tmp/bpy && /tmp/bpy/bin/pip install bpy==4.2.0
    /tmp/bpy/bin/python python/blender/check.py target/debug/retargetd

Real characters are looked for in ../shared/corpus, or where RETARGETD_SHARED points. Says what it measured; the exit code is 0 only if
everything is well.
"""

import hashlib
import os
import sys
import time
import zipfile
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
SHARED = Path(os.environ.get("RETARGETD_SHARED", HERE.parents[1].parent / "shared"))
sys.path.insert(0, str(HERE))

import retargetd_blender as addon  # noqa: E402
from retargetd_blender import actions, armatures, npz, operators, service, work  # noqa: E402

CHARACTERS = 20
failures = []


def check(is_well, text):
    print(("ok   " if is_well else "FAIL ") + text, flush=True)
    if not is_well:
        failures.append(text)


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def load(path):
    """Imports a file; its armatures."""
    before = set(bpy.data.objects)
    ending = path.suffix.lower()
    if ending in (".glb", ".gltf", ".vrm"):
        bpy.ops.import_scene.gltf(filepath=str(path))
    elif ending == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    else:
        bpy.ops.import_anim.bvh(filepath=str(path))
    return [one for one in bpy.data.objects if one not in before and one.type == "ARMATURE"]


def sampled(armature, frames):
    """World positions of all bones at frames."""
    scene, bones = bpy.context.scene, armatures.bones_of(armature)
    room = np.empty(16 * len(armature.pose.bones), np.float32)
    places = []
    for frame in frames:
        scene.frame_set(int(frame))
        evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        matrices = armatures.posed_matrices(evaluated, bones, room)
        places.append((np.array(armature.matrix_world) @ matrices)[:, :3, 3])
    return np.array(places), [bone.name for bone in bones]


def exhaust(steps):
    """Runs steps to their end; what they give, and the longest of them."""
    longest, begin = 0.0, time.monotonic()
    try:
        while True:
            next(steps)
            longest = max(longest, time.monotonic() - begin)
            time.sleep(0.001)
            begin = time.monotonic()
    except StopIteration as end:
        return end.value, max(longest, time.monotonic() - begin)


def made_armature(name):
    """A body with fingers: hips, spine, head, limbs, five fingers a hand, and the ends of head and toes; 65 bones."""
    data = bpy.data.armatures.new(name)
    armature = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = {}

    def bone(bone_name, head, tail, parent=None):
        made = data.edit_bones.new(bone_name)
        made.head, made.tail = head, tail
        made.parent = bones.get(parent)
        bones[bone_name] = made

    bone("Hips", (0, 0, 1.0), (0, 0, 1.1))
    for number, part in enumerate(("Spine", "Spine1", "Spine2", "Neck", "Head")):
        above = ("Hips", "Spine", "Spine1", "Spine2", "Neck")[number]
        bone(part, (0, 0, 1.1 + 0.12 * number), (0, 0, 1.22 + 0.12 * number), above)
    bone("HeadTop_End", (0, 0, 1.7), (0, 0, 1.75), "Head")
    for side, sign in (("Left", 1), ("Right", -1)):
        bone(f"{side}UpLeg", (0.1 * sign, 0, 0.95), (0.1 * sign, -0.01, 0.5), "Hips")
        bone(f"{side}Leg", (0.1 * sign, -0.01, 0.5), (0.1 * sign, 0, 0.08), f"{side}UpLeg")
        bone(f"{side}Foot", (0.1 * sign, 0, 0.08), (0.1 * sign, -0.12, 0.02), f"{side}Leg")
        bone(f"{side}ToeBase", (0.1 * sign, -0.12, 0.02), (0.1 * sign, -0.2, 0.02), f"{side}Foot")
        bone(f"{side}Toe_End", (0.1 * sign, -0.2, 0.02), (0.1 * sign, -0.22, 0.02), f"{side}ToeBase")
        bone(f"{side}Shoulder", (0.03 * sign, 0, 1.42), (0.15 * sign, 0, 1.44), "Spine2")
        bone(f"{side}Arm", (0.15 * sign, 0, 1.44), (0.42 * sign, 0, 1.44), f"{side}Shoulder")
        bone(f"{side}ForeArm", (0.42 * sign, 0, 1.44), (0.67 * sign, 0, 1.44), f"{side}Arm")
        bone(f"{side}Hand", (0.67 * sign, 0, 1.44), (0.75 * sign, 0, 1.44), f"{side}ForeArm")
        for place, finger in enumerate(("Thumb", "Index", "Middle", "Ring", "Pinky")):
            above, y = f"{side}Hand", -0.04 + 0.02 * place
            for joint in range(1, 5):
                start = 0.75 + 0.03 * (joint - 1)
                bone(f"{side}Hand{finger}{joint}", (start * sign, y, 1.44), ((start + 0.03) * sign, y, 1.44), above)
                above = f"{side}Hand{finger}{joint}"
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def made_action(armature, name, frames):
    """A walk on the spot, more or less."""
    room = armatures.bones_of(armature)
    world = armatures.arrays_of(armature, 1.0)
    count = len(room)
    times = np.arange(frames) / 24
    turned = np.tile(world["rest_rotations"], (frames, 1, 1)).astype(np.float64)
    swing = 0.4 * np.sin(2 * np.pi * times)
    for place, bone in enumerate(room):
        if bone.name.endswith(("UpLeg", "Arm", "Spine1")):
            half = swing * (1 if bone.name.startswith("Left") else -1) / 2
            x, y, z, w = world["rest_rotations"][place]
            s, c = np.sin(half), np.cos(half)
            # The rest rotation, and behind it a turn about the bone's own X.
            turned[:, place] = np.stack([x * c + w * s, y * c + z * s, z * c - y * s, w * c - x * s], axis=-1)
    moved = np.tile(world["rest_translations"], (frames, 1, 1))
    moved[:, 0, 1] -= times * 0.5
    arrays = {**world, "times": times, "translations": moved, "rotations": turned, "scales": np.ones((frames, count, 3))}
    return actions.new_action(armature, arrays, name)


def fingerprint():
    """What every data block of the file holds, as far as Blender tells it."""
    found = {}
    for kind in ("objects", "armatures", "actions", "meshes", "materials", "scenes", "collections", "images", "node_groups"):
        for block in getattr(bpy.data, kind):
            words = hashlib.sha256()
            for attribute in sorted(block.bl_rna.properties.keys()):
                if attribute in ("rna_type", "session_uid", "is_evaluated", "users", "is_updated", "is_updated_data", "retargetd"):
                    continue
                words.update(f"{attribute}={_told(block, attribute)};".encode())
            found[kind, block.name_full] = words.hexdigest()
    return found


def _told(block, attribute):
    try:
        value = getattr(block, attribute)
    except (AttributeError, RuntimeError):
        return ""
    if isinstance(value, bpy.types.bpy_prop_collection):
        return [(getattr(one, "name", ""), [_plain(getattr(one, name, None)) for name in sorted(one.bl_rna.properties.keys()) if name != "rna_type"]) for one in list(value)[:200]]
    return _plain(value)


def _plain(value):
    if isinstance(value, bpy.types.bpy_struct):
        return getattr(value, "name", type(value).__name__)
    if isinstance(value, (int, float, str, bool)) or value is None:
        return value
    try:
        return [round(float(one), 6) for row in value for one in (row if hasattr(row, "__len__") else [row])]
    except (TypeError, ValueError):
        return type(value).__name__


def characters(count):
    kinds = (".glb", ".fbx", ".bvh")
    corpus = SHARED / "corpus"
    if not corpus.is_dir():
        print(f"skipped: {corpus} is not there")
        return []
    folders = ("mixamo", "cc0-stylised", "unreal", "readyplayerme", "creatures", "bvh", "cmu-rig", "rigify-blender", "misc-rigs")
    found = [path for folder in folders for path in sorted((corpus / folder).rglob("*")) if path.suffix in kinds and path.stat().st_size < 4 << 20]
    return found[:: max(1, len(found) // (3 * count))]


def check_registration():
    addon.register()
    addon.unregister()
    addon.register()
    check(hasattr(bpy.types, "RETARGETD_PT_main"), f"registers in Blender {bpy.app.version_string}, twice")
    manifest = (HERE / "retargetd_blender/blender_manifest.toml").read_text()
    wanted = ("schema_version", "id", "version", "name", "tagline", "maintainer", "type", "license", "blender_version_min")
    check(all(f"\n{field} = " in "\n" + manifest for field in wanted), "the manifest has every field that must be there")
    archive = Path(bpy.app.tempdir or "/tmp") / "retargetd_blender.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted((HERE / "retargetd_blender").glob("*")):
            if path.is_file():
                file.write(path, path.name)
    check(archive.stat().st_size <= 100_000, f"the zip has {archive.stat().st_size / 1000:.1f} kB")


def check_round_trip():
    worst, count = 0.0, 0
    for path in characters(CHARACTERS):
        empty()
        try:
            armature = load(path)[0]
        except (RuntimeError, IndexError):
            continue
        scene = bpy.context.scene
        motion = work.Motion(scene, armature, armature.animation_data.action if armature.animation_data else None)
        try:
            exhaust(motion.steps())
        except armatures.Unusable as error:
            print(f"     {path.name}: {error}")
            continue
        arrays = motion.make_arrays()
        frames = [motion.first_frame + share * (len(arrays["times"]) - 1) // 4 for share in range(5)]
        before, _ = sampled(armature, frames)
        action = actions.new_action(armature, npz.decode(npz.encode(arrays)), "again", motion.first_frame)
        actions.assign(armature, action)
        after, _ = sampled(armature, frames)
        apart = np.abs(before - after).max() / max(np.ptp(before[0], axis=0).max(), 1e-9)
        worst, count = max(worst, float(apart)), count + 1
        if apart > 1e-4:
            print(f"     {path.name}: {apart:.1e} of the figure")
        if count == CHARACTERS:
            break
    if count:
        check(worst <= 1e-4, f"round trip of {count} characters: at most {worst:.1e} of the figure")


def check_speed(reach):
    """The best of three, since other programs may want the cores too."""
    timed = [timed_run(reach) for _ in range(3)]
    exported, imported, total, longest = (min(column) for column in zip(*timed))
    text = f"1,000 frames x 65 bones: export {exported:.2f} s, import {imported:.2f} s, all {total:.2f} s, longest step {longest * 1000:.0f} ms"
    everything = ", ".join(f"{row[2]:.2f}" for row in timed)
    check(total <= 2.0, f"{text} (best of {everything} s; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores)")


def timed_run(reach):
    """Seconds for sampling, for writing an action, for everything with the service, and of its longest step."""
    empty()
    source, target = made_armature("Source"), made_armature("Target")
    assert len(source.data.bones) == 65
    target.location.x = 2
    action = made_action(source, "long", 1000)
    actions.assign(source, action)
    scene, settings = bpy.context.scene, bpy.context.scene.retargetd
    settings.source, settings.target, settings.assign = source, target, False
    begin = time.monotonic()
    motion = work.Motion(scene, source, action)
    exhaust(motion.steps())
    exported = time.monotonic() - begin
    arrays = motion.make_arrays()
    begin = time.monotonic()
    actions.new_action(target, arrays, "import")
    imported = time.monotonic() - begin
    begin = time.monotonic()
    made, longest = exhaust(work.run(scene, settings, reach))
    total = time.monotonic() - begin
    assert len(made) == 1 and len(next(actions.curves_of(made[0].action)).keyframe_points) == 1000
    return exported, imported, total, longest


def check_changes(reach):
    empty()
    source, target = made_armature("Source"), made_armature("Target")
    target.rotation_euler.z = 1.0
    actions.assign(source, made_action(source, "walk", 30))
    other = made_action(target, "other", 10)
    actions.assign(target, other)
    limit = target.pose.bones["Head"].constraints.new("LIMIT_ROTATION")
    limit.use_limit_x = True
    target.driver_add("location", 2).driver.expression = "0.0"
    scene, settings = bpy.context.scene, bpy.context.scene.retargetd
    settings.source, settings.target, settings.assign = source, target, False
    scene.frame_set(7)
    before = fingerprint()
    made, _ = exhaust(work.run(scene, settings, reach))
    after = fingerprint()
    new = set(after) - set(before)
    changed = [key for key in before if before[key] != after.get(key)]
    check(new == {("actions", made[0].action.name)} and not changed, f"one new action, nothing else differs ({changed or 'none'})")
    check(scene.frame_current == 7 and target.animation_data.action == other, "the frame and the target's own action stay")


def check_against_glb(url, client):
    """The service's GLB of the same pair, imported, stands where the add-on's action puts the armature."""
    corpus = SHARED / "corpus"
    # The add-on sends no mesh: of a target whose soles are far from its toe bones, the pelvis is a little higher or lower.
    names = ("ue4_names_apose.glb", "makehuman_game_engine_tpose.glb", "makehuman_mixamo_names_rest.glb")
    pairs = [(source, target) for source in ("Soldier.glb", "Xbot.glb") for target in names]
    for source_path, target_path in pairs:
        source_file = next(corpus.rglob(Path(source_path).name), None) if corpus.is_dir() else None
        target_file = next(corpus.rglob(Path(target_path).name), None) if corpus.is_dir() else None
        if source_file is None or target_file is None:
            print(f"skipped: {source_path} or {target_path} is not there")
            continue
        empty()
        source, target = load(source_file)[0], load(target_file)[0]
        scene, settings = bpy.context.scene, bpy.context.scene.retargetd
        settings.source, settings.target, settings.preset, settings.align = source, target, "plain_fk", False
        made, _ = exhaust(work.run(scene, settings, lambda: client))
        motion = work.Motion(scene, source, source.animation_data.action)
        exhaust(motion.steps())
        config = {**work.config_of(settings), "output": {"format": "glb", "target_clips": "drop"}}
        files = [("source", "source.npz", npz.encode(motion.make_arrays())), ("target", target_file.name, target_file.read_bytes())]
        data, _ = client.retarget(files, config, lambda: False)
        frames = list(range(int(made[0].first_frame), int(made[0].first_frame) + len(motion.make_arrays()["times"]), 7))
        actions.assign(target, made[0].action)
        ours, names = sampled(target, frames)
        place = Path(bpy.app.tempdir or "/tmp") / "result.glb"
        place.write_bytes(data)
        imported = load(place)[0]
        if imported.animation_data is None or imported.animation_data.action is None:
            actions.assign(imported, bpy.data.actions[-1])
        # The importer puts the first key on frame 0 or 1, by its version.
        first = imported.animation_data.action.frame_range[0]
        theirs, their_names = sampled(imported, [first + frame - frames[0] for frame in frames])
        order = [their_names.index(name) for name in names if name in their_names]
        distances = np.abs(ours[:, [names.index(their_names[place]) for place in order]] - theirs[:, order]).max(axis=(0, 2))
        distances /= np.ptp(ours[0], axis=0).max()
        apart = distances.max()
        if apart > 1e-4:
            print("     " + ", ".join(f"{their_names[order[place]]} {distances[place]:.1e}" for place in np.argsort(-distances)[:6]))
        check(apart <= 1e-4, f"{source_file.name} on {target_file.name}: {apart:.1e} of the figure from the service's GLB ({len(order)} bones)")


def check_batch(reach):
    empty()
    source = made_armature("Source")
    targets = [made_armature("One"), made_armature("Two")]
    made = [made_action(source, f"clip {number:02}", 12 + number % 5) for number in range(50)]
    actions.assign(source, made[0])
    scene, settings = bpy.context.scene, bpy.context.scene.retargetd
    settings.source, settings.target, settings.assign = source, targets[0], False
    settings.more_targets.add().target = targets[1]
    for action in made[1:]:
        settings.more_actions.add().action = action
    begin = time.monotonic()
    done, _ = exhaust(work.run(scene, settings, reach))
    check(len(done) == 100 and len({one.action.name for one in done}) == 100, f"50 actions x 2 armatures in {time.monotonic() - begin:.1f} s")
    check(source.animation_data.action == made[0], "the source plays what it played")


def check_operators(url):
    empty()
    source, target = made_armature("Source"), made_armature("Target")
    actions.assign(source, made_action(source, "walk", 20))
    settings = bpy.context.scene.retargetd
    settings.source, settings.target = source, target
    operators.service_of = lambda context: lambda: service.Service(url)
    check(bpy.ops.retargetd.suggest() == {"FINISHED"} and len(settings.roles) > 15, f"a mapping of {len(settings.roles)} parts")
    settings.role = next(place for place, row in enumerate(settings.roles) if row.name == "head")
    target.data.bones.active = target.data.bones["Neck"]
    check(bpy.ops.retargetd.pick() == {"FINISHED"} and settings.roles[settings.role].target == "Neck", "the eyedropper takes the active bone")
    settings.roles[settings.role].target = settings.roles[settings.role].found
    settings.target_pose_is_rest = True
    check(bpy.ops.retargetd.retarget() == {"FINISHED"} and target.animation_data.action is not None, f"retargets: {settings.status}")
    check(bpy.ops.retargetd.save_rig(name="check_rig") == {"FINISHED"}, "the mapping is kept as a rig template")
    if settings.findings:
        went = bpy.ops.retargetd.go_to() == {"FINISHED"}
        worst, bone = settings.findings[settings.finding], target.data.bones.active
        chosen = [one.name for one in target.pose.bones if (one if hasattr(one, "select") else one.bone).select]
        is_there = bpy.context.scene.frame_current == worst.frame and (not worst.bone or chosen == [bone.name] == [worst.bone])
        check(went and is_there, f"goes to frame {worst.frame} and bone {worst.bone!r}: {worst.text}")
    before = len(bpy.data.actions)
    operators.service_of = lambda context: lambda: service.Service("http://127.0.0.1:9")
    try:
        bpy.ops.retargetd.retarget()
        text = ""
    except RuntimeError as error:
        text = str(error).strip()
    check(text.count("does not answer") == 1 and len(bpy.data.actions) == before, f"a service that is gone: {text!r}, and no action")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    check_registration()
    check_round_trip()
    own = service.OwnService()
    url = own.start(os.path.abspath(sys.argv[1]))
    client = service.Service(url)
    try:
        check(client.is_ready(), f"the add-on starts a service at {url}")
        reach = lambda: client  # noqa: E731
        check_changes(reach)
        check_speed(reach)
        check_against_glb(url, client)
        check_batch(reach)
        check_operators(url)
    finally:
        own.stop()
    addon.unregister()
    print(f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
