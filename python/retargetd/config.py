"""The types of a config, made from its JSON Schema: `RETARGETD_UPDATE=1 python -m pytest python/tests -k config_types` writes them.

A checker then knows every field of a config that is written as a dictionary::

    spec: config.RetargetSpec = {"edit": {"fps": 30}, "ops": [{"op": "pelvis"}, {"op": "fk"}]}
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict, Union

__all__ = [
    "AdditivePoseFields",
    "Align",
    "Alpha",
    "AlphaCurve",
    "ArmClearanceFields",
    "ArmSpacingFields",
    "AutoWord",
    "Background",
    "CameraKind",
    "CarriedProp",
    "Carry",
    "ChainMap",
    "ClipChoice",
    "ComponentAxis",
    "CompressionSpec",
    "ContactCurve",
    "ContactFloor",
    "ContactFloorRule",
    "ContactsFields",
    "CopyBasePoseFields",
    "CurveRow",
    "CurvesFields",
    "CycleRange",
    "EditAxes",
    "EditSpec",
    "FilterFields",
    "FilterKind",
    "FilterOp",
    "FingersFields",
    "FkFields",
    "FloorFields",
    "Follow",
    "FractionRange",
    "FrameRange",
    "Grip",
    "GripHand",
    "HandContactFields",
    "HeightRule",
    "HelperJoints",
    "HoldSpec",
    "IkFields",
    "IkGoal",
    "IncludeSpec",
    "InterpolationSpec",
    "JointRow",
    "JointSource",
    "JointSpace",
    "JointsFields",
    "KeyInterpolation",
    "KeyTolerance",
    "KeysSpec",
    "KeysWord",
    "LayerMode",
    "LayerReference",
    "LayerSpec",
    "Layout",
    "LimitRange",
    "LimitsFields",
    "LoopRoot",
    "LoopSpec",
    "MirrorAxis",
    "MirrorChoice",
    "MirrorMode",
    "MirrorPlane",
    "MirrorSpec",
    "MorphCombine",
    "MorphFitSpec",
    "MorphRow",
    "MorphsSpec",
    "OneOrMany",
    "Op",
    "OtherCurves",
    "OutputChoice",
    "OutputSpec",
    "PelvisFields",
    "PelvisScale",
    "PelvisScaleRule",
    "Pin",
    "PinFields",
    "PinMode",
    "PinSide",
    "PlantFields",
    "PlantMode",
    "PoseChoice",
    "PoseEdit",
    "PoseSpec",
    "PropsFields",
    "RangeSpec",
    "ReachFields",
    "ReachGoal",
    "ReachPlace",
    "ReportChoice",
    "ReportDetail",
    "ReportSpec",
    "RestFrame",
    "RestRule",
    "RestSpec",
    "RetargetSpec",
    "RigSpec",
    "RootAction",
    "RootAxis",
    "RootMotionFields",
    "RootPlace",
    "RootSource",
    "RotationMode",
    "RotationOrder",
    "ScaleOrigin",
    "ScaleSourceFields",
    "SelfContactFields",
    "SeparateAxes",
    "Sheet",
    "SheetSize",
    "SheetWord",
    "StretchChainFields",
    "StrideDirection",
    "StrideFields",
    "Style",
    "TargetClipsSpec",
    "Task",
    "Threshold",
    "TranslationMode",
    "TuneChoice",
    "TuneSpec",
    "TwistFields",
    "UnitSpec",
    "View",
]

Align = Literal["auto", "off", "direction", "full"]
Alpha = Union[float, list[list[float]], "AlphaCurve"]
AutoWord = Literal["auto"]
Background = Literal["light", "dark", "transparent"]
CameraKind = Literal["front", "three_quarter", "side", "back", "top", "orbit"]
Carry = Literal["model", "parent"]
ClipChoice = Union[int, str]
ComponentAxis = Literal["x", "y", "z"]
CompressionSpec = Literal["none", "quantized", "meshopt"]
ContactFloor = Union[float, "ContactFloorRule"]
ContactFloorRule = Literal["adaptive", "any"]
EditAxes = Literal["model", "local"]
FilterKind = Literal["bell", "one_euro", "savitzky_golay", "butterworth", "median"]
Follow = Literal["auto", "figure", "hold"]
GripHand = Literal["right_hand", "left_hand"]
HeightRule = Literal["above_floor", "above_ground_joint", "above_origin"]
HelperJoints = Literal["follow", "keep"]
IkGoal = Literal["fk", "limb"]
IncludeSpec = Literal["full", "skeleton+animation"]
InterpolationSpec = Literal["linear", "cubic"]
JointSource = Union[str, list[str]]
JointSpace = Literal["model", "local"]
KeyInterpolation = Literal["auto", "linear", "cubic"]
KeysSpec = Union["KeysWord", "KeyTolerance"]
KeysWord = Literal["all", "needed"]
LayerMode = Literal["replace", "add"]
LayerReference = Literal["first_frame", "mean", "rest"]
Layout = Literal["single", "side_by_side", "overlay"]
LoopRoot = Literal["travel", "restart"]
MirrorAxis = Union["ComponentAxis", "SeparateAxes"]
MirrorChoice = Union[bool, "MirrorSpec"]
MirrorMode = Literal["model", "components"]
MirrorPlane = Literal["rest", "start"]
MorphCombine = Literal["sum", "max", "min", "product"]
OneOrMany = Union[str, list[str]]
Op = Union["PelvisFields", "FkFields", "ArmClearanceFields", "ContactsFields", "IkFields", "PlantFields", "FloorFields", "HandContactFields", "SelfContactFields", "FilterFields", "JointsFields", "PinFields", "CopyBasePoseFields", "AdditivePoseFields", "ArmSpacingFields", "StretchChainFields", "TwistFields", "LimitsFields", "FingersFields", "ReachFields", "StrideFields", "CurvesFields", "PropsFields", "ScaleSourceFields", "RootMotionFields"]
OtherCurves = Literal["keep", "drop"]
OutputChoice = Union["OutputSpec", list["OutputSpec"]]
PelvisScale = Union[float, "PelvisScaleRule"]
PelvisScaleRule = Literal["height", "legs", "stature", "limbs", "none"]
PinMode = Literal["keep_offset", "global", "local"]
PinSide = Literal["target", "source"]
PlantMode = Literal["auto", "always", "never", "grounding"]
PoseChoice = Literal["t", "a", "source", "rest"]
PoseEdit = dict[str, Any]
RangeSpec = Union[list[float], "FrameRange", "FractionRange", "CycleRange"]
ReachPlace = Literal["world", "chain"]
ReportChoice = Union["ReportDetail", "ReportSpec"]
ReportDetail = Literal["none", "summary", "full"]
RestRule = Literal["auto", "bind", "nodes", "solved"]
RestSpec = Union["RestRule", "RestFrame"]
RootAction = Literal["extract", "remove", "keep"]
RootAxis = Literal["left", "up", "front"]
RootPlace = Literal["below_pelvis", "rest_offset", "first_frame"]
RootSource = Literal["pelvis", "source_root"]
RotationMode = Literal["auto", "none", "interpolated", "one_to_one", "one_to_one_reversed", "match_chain", "match_scaled_chain", "copy_local"]
RotationOrder = Literal["auto", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]
ScaleOrigin = Literal["floor", "origin"]
Sheet = Union["SheetWord", "SheetSize"]
SheetWord = Literal["worst"]
StrideDirection = Literal["pelvis", "chest", "goals", "travel"]
Style = Literal["shaded", "skeleton", "both", "depth", "silhouette"]
TargetClipsSpec = Literal["keep", "drop"]
Task = Literal["retarget", "edit"]
TranslationMode = Literal["none", "globally_scaled", "absolute", "stretch_uniform", "stretch_by_segment", "orient_and_scale"]
TuneChoice = Union[bool, "TuneSpec"]
UnitSpec = Union[float, "AutoWord"]


class AlphaCurve(TypedDict, total=False):
    """An alpha that follows a curve of the source's clip: the weight of a morph or an expression."""

    curve: str
    gain: float
    offset: float


class CarriedProp(TypedDict, total=False):
    """A joint of the target that is carried as one of the source is."""

    source: str
    target: str
    holder: Union[str, None]
    scale: Union[float, None]


class ChainMap(TypedDict, total=False):
    """A source chain that drives a target chain."""

    source: str
    target: str
    also: list[str]
    rotation: Union[RotationMode, None]
    translation: Union[TranslationMode, None]
    rotation_alpha: Union[float, None]
    translation_alpha: Union[float, None]


class ContactCurve(TypedDict, total=False):
    """When a point touches by a curve of the source's clip: while its value is within both bounds."""

    curve: str
    below: Union[float, None]
    above: Union[float, None]


class CurveRow(TypedDict, total=False):
    """One row of `curves`."""

    source: str
    target: Union[str, None]
    drop: bool
    points: list[list[float]]
    gain: float
    offset: float
    clamp: Union[list[float], None]


class CycleRange(TypedDict, total=False):
    """Whole cycles of a clip whose poses come back."""

    cycles: int


class EditSpec(TypedDict, total=False):
    """Edits of the clip."""

    range: Union[RangeSpec, None]
    margin_seconds: float
    every: Union[int, None]
    warp: Union[list[list[float]], None]
    speed: Union[float, None]
    reverse: bool
    ping_pong: bool
    loop: Union[LoopSpec, None]
    hold: Union[HoldSpec, None]
    fps: Union[float, None]
    interpolation: InterpolationSpec
    start_seconds: Union[float, None]
    filter: Union[FilterOp, None]
    additive: Union[LayerReference, None]
    mirror: MirrorChoice


class FilterOp(TypedDict, total=False):
    """Takes noise off the local rotations of the target's driven joints."""

    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    kind: FilterKind
    seconds: float
    min_frequency: float
    responsiveness: float
    reach_frames: int
    degree: int
    cutoff_hertz: float


class FractionRange(TypedDict, total=False):
    """Fractions of the duration."""

    fraction: list[float]


class FrameRange(TypedDict, total=False):
    """Frames from 0; both belong to it."""

    frames: list[int]


class Grip(TypedDict, total=False):
    """Two hands that hold the same thing."""

    dominant: GripHand
    within: float
    scale: Union[float, None]


class HoldSpec(TypedDict, total=False):
    """Stands still before and after."""

    before_seconds: float
    after_seconds: float


class JointRow(TypedDict, total=False):
    """One row of the table."""

    source: JointSource
    target: str
    position: bool
    rotation: bool
    space: JointSpace
    position_gain: float
    rotation_gain: float
    position_offset: list[float]
    rotation_offset: list[float]
    axis_order: str
    axis_offset: list[float]
    points_to: Union[str, None]


class KeyTolerance(TypedDict, total=False):
    """How much may be lost where keys are left out."""

    distance_meters: float
    shell_meters: float
    interpolation: KeyInterpolation


class LayerSpec(TypedDict, total=False):
    """Lays what was made over a clip that the file has already: the target's own for a retarget,...."""

    over: Union[ClipChoice, None]
    mode: LayerMode
    weight: float
    mask: Union[list[str], None]
    feather_joints: int
    reference: LayerReference
    at_seconds: Union[float, None]
    seam_seconds: float


class LimitRange(TypedDict, total=False):
    """How far a joint goes, in degrees from the T pose: pairs `[min, max]` with min from -180 to 0 and...."""

    bend: Union[list[Union[float, None]], None]
    side: Union[list[Union[float, None]], None]
    twist: Union[list[Union[float, None]], None]


class LoopSpec(TypedDict, total=False):
    """Makes the end flow into the start, and repeats."""

    times: int
    blend_seconds: float
    root: LoopRoot


class MirrorSpec(TypedDict, total=False):
    """How left and right are swapped."""

    mode: MirrorMode
    plane: MirrorPlane
    center_axis: Union[MirrorAxis, None]
    pelvis_axis: Union[MirrorAxis, None]
    pairs: list[list[str]]


class MorphFitSpec(TypedDict, total=False):
    """How weights are fitted to what meshes do."""

    bounds: list[float]
    regularization: float


class MorphRow(TypedDict, total=False):
    """One row: `target = clamp(gain · source + offset)`."""

    source: str
    target: str
    gain: float
    offset: float
    clamp: list[float]
    combine: MorphCombine


class MorphsSpec(TypedDict, total=False):
    """How morph weights and expressions are moved over."""

    enabled: bool
    by_name: bool
    fit: Union[MorphFitSpec, None]
    rows: list[MorphRow]


class PelvisFields(TypedDict, total=False):
    """Moves and turns the pelvis."""

    op: Literal["pelvis"]
    enabled: bool
    alpha: Alpha
    frames: Union[list[int], None]
    scale: PelvisScale
    source_height: HeightRule
    target_height: HeightRule
    origin: ScaleOrigin
    rotation_alpha: float
    translation_alpha: float
    scale_horizontal: float
    scale_vertical: float
    offset: list[float]
    blend_to_source: float
    blend_to_source_weights: list[float]
    local_offset: list[float]
    turn_offset: list[float]
    local_turn_offset: list[float]
    floor_constraint: float
    source_crotch: Union[float, None]
    target_crotch: Union[float, None]
    floor_falloff: float
    affect_ik_horizontal: float
    affect_ik_vertical: float


class FkFields(TypedDict, total=False):
    """Turns the chains by forward kinematics."""

    op: Literal["fk"]
    enabled: bool
    alpha: Alpha
    frames: Union[list[int], None]
    mask: Union[list[str], None]
    carry: Carry
    rotation: RotationMode
    translation: TranslationMode
    twist: bool
    shoulder: float
    rotation_alpha: float
    translation_alpha: float
    align_pole: float
    pole_offset: float
    keep_pole_offset: bool


class ArmClearanceFields(TypedDict, total=False):
    """Swings arms out of a body that is thicker than the source's."""

    op: Literal["arm_clearance"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    depth: float
    max_degrees: float
    smoothing_seconds: float


class ContactsFields(TypedDict, total=False):
    """Finds where feet and hands rest on something in the source."""

    op: Literal["contacts"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    detect: bool
    height_on: float
    height_off: float
    speed_on: float
    speed_off: float
    speed_land: float
    least_seconds: float
    gap_seconds: float
    smoothing_seconds: float
    floor: ContactFloor
    set: dict[str, list[list[float]]]
    curves: dict[str, ContactCurve]
    add: dict[str, list[list[float]]]
    remove: dict[str, list[list[float]]]


class IkFields(TypedDict, total=False):
    """Sets goals for the ends of limbs and reaches them."""

    op: Literal["ik"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    goal: IkGoal
    blend_to_source: float
    blend_to_source_weights: list[float]
    blend_to_source_rotation: float
    offset: list[float]
    local_offset: list[float]
    rotation_offset: list[float]
    scale_vertical: float
    extension: float
    softness: float
    stretch: float
    align_pole: float
    pole_offset: float
    keep_pole_offset: bool


class PlantFields(TypedDict, total=False):
    """Keeps feet where they stand."""

    op: Literal["plant"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    mode: PlantMode
    blend_seconds: float
    level: bool
    steady: bool
    pull_pelvis: bool
    sideways_cost: float


class FloorFields(TypedDict, total=False):
    """Keeps soles as far above the floor as the source's are."""

    op: Literal["floor"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    swing: float
    falloff_height: float
    falloff_distance: float
    adaptive: bool
    shift_pelvis: bool
    trunk: bool
    hands: bool


class HandContactFields(TypedDict, total=False):
    """Brings hands together that touch each other."""

    op: Literal["hand_contact"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    reach: float
    smoothing_seconds: float


class SelfContactFields(TypedDict, total=False):
    """Keeps hands that touch the body touching it."""

    op: Literal["self_contact"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    reach: float
    keep_touch: bool
    push_out: bool
    smoothing_seconds: float


class FilterFields(TypedDict, total=False):
    """Takes noise off rotations."""

    op: Literal["filter"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    kind: FilterKind
    seconds: float
    min_frequency: float
    responsiveness: float
    reach_frames: int
    degree: int
    cutoff_hertz: float


class JointsFields(TypedDict, total=False):
    """Drives joints one by one from a table."""

    op: Literal["joints"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    rows: list[JointRow]


class PinFields(TypedDict, total=False):
    """Lets joints follow another joint."""

    op: Literal["pin"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    pins: list[Pin]


class CopyBasePoseFields(TypedDict, total=False):
    """Copies joints of equal names as they are."""

    op: Literal["copy_base_pose"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    below: Union[str, None]
    position: bool
    rotation: bool
    driven: bool


class AdditivePoseFields(TypedDict, total=False):
    """Adds a constant change of pose."""

    op: Literal["additive_pose"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    degrees: dict[str, list[float]]
    clip: Union[ClipChoice, None]
    frame: int


class ArmSpacingFields(TypedDict, total=False):
    """Turns arms away from the body or toward it."""

    op: Literal["arm_spacing"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    degrees: float


class StretchChainFields(TypedDict, total=False):
    """Makes chains longer or shorter."""

    op: Literal["stretch_chain"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    match_source: float
    scale: float


class TwistFields(TypedDict, total=False):
    """Shares the twist of limbs out among twist joints."""

    op: Literal["twist"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    gain: float


class LimitsFields(TypedDict, total=False):
    """Takes back what bends farther than bodies do."""

    op: Literal["limits"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    relative: bool
    begin: float
    ranges: dict[str, LimitRange]


class FingersFields(TypedDict, total=False):
    """Bends and spreads fingers more or less."""

    op: Literal["fingers"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    curl: float
    spread: float
    curl_offset: float


class ReachFields(TypedDict, total=False):
    """Gets ends of chains to goals with the help of the body."""

    op: Literal["reach"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    goals: list[ReachGoal]
    pelvis: float
    stiffness: dict[str, float]
    iterations: int
    damping: float


class StrideFields(TypedDict, total=False):
    """Makes steps longer or shorter."""

    op: Literal["stride"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    forward: float
    sideways: float
    splay: float
    direction: StrideDirection
    moves_pelvis: bool
    smoothing_seconds: float


class CurvesFields(TypedDict, total=False):
    """Carries custom properties over."""

    op: Literal["curves"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    others: OtherCurves
    rows: list[CurveRow]


class PropsFields(TypedDict, total=False):
    """Keeps things in hands."""

    op: Literal["props"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    props: list[CarriedProp]
    grips: list[Grip]


class ScaleSourceFields(TypedDict, total=False):
    """Scales the source's motion."""

    op: Literal["scale_source"]
    enabled: bool
    alpha: Alpha
    mask: Union[list[str], None]
    frames: Union[list[int], None]
    factor: float
    pivot: Union[str, None]
    on_floor: bool


RootMotionFields = TypedDict(
    "RootMotionFields",
    {
        'op': 'Literal["root_motion"]',
        'enabled': 'bool',
        'alpha': 'Alpha',
        'mask': 'Union[list[str], None]',
        'frames': 'Union[list[int], None]',
        'action': 'RootAction',
        'joint': 'Union[str, None]',
        'from': 'RootSource',
        'source_joint': 'Union[str, None]',
        'axes': 'list[RootAxis]',
        'turn': 'bool',
        'place': 'RootPlace',
        'smoothing_seconds': 'float',
    },
    total=False,
)


class OutputSpec(TypedDict, total=False):
    """One output."""

    format: Union[str, None]
    include: IncludeSpec
    target_clips: TargetClipsSpec
    clip_name: Union[str, None]
    keys: KeysSpec
    rotation_order: RotationOrder
    compression: CompressionSpec
    view: Union[View, None]


class Pin(TypedDict, total=False):
    """One joint that follows another."""

    joint: str
    to: str
    side: PinSide
    mode: PinMode
    position: bool
    rotation: bool
    offset: list[float]
    rotation_offset: list[float]
    carries_children: bool


class PoseSpec(TypedDict, total=False):
    """The pose of a character, as a file, instead of a retargeted clip."""

    to: PoseChoice


class ReachGoal(TypedDict, total=False):
    """One end and where it should be."""

    end: str
    source: Union[str, None]
    place: ReachPlace
    depth: int
    weight: float
    axes: list[float]
    offset: list[float]


class ReportSpec(TypedDict, total=False):
    """How much is measured, and from which value on it is called bad."""

    detail: ReportDetail
    thresholds: dict[str, Threshold]


class RestFrame(TypedDict, total=False):
    """A frame of a clip."""

    clip: ClipChoice
    frame: int


class RigSpec(TypedDict, total=False):
    """What is known about one rig."""

    root: Union[str, None]
    character: Union[str, None]
    ground: Union[str, None]
    rest: RestSpec
    pose: list[PoseEdit]
    keep_pose: list[str]
    points_at: dict[str, str]
    axes: Union[str, None]
    unit: Union[UnitSpec, None]
    chains: dict[str, list[str]]
    roles: dict[str, OneOrMany]
    role_names: dict[str, list[list[str]]]
    helper_joints: HelperJoints


class SeparateAxes(TypedDict, total=False):
    """Axes for rotation and translation; what is left out is found."""

    rotation: Union[ComponentAxis, None]
    translation: Union[ComponentAxis, None]


class SheetSize(TypedDict, total=False):
    """How many frames a sheet has."""

    columns: int
    rows: int


class Threshold(TypedDict, total=False):
    """From which value on a metric is called bad, in the metric's own unit."""

    warn_above: float
    fail_above: float


class TuneSpec(TypedDict, total=False):
    """What is searched, and how long."""

    max_evaluations: int
    bounds: Union[dict[str, list[float]], None]


class View(TypedDict, total=False):
    """How a figure is seen."""

    size: list[int]
    camera: CameraKind
    follow: Follow
    turn_degrees: float
    fps: Union[float, None]
    range: Union[list[float], None]
    at_seconds: Union[float, None]
    background: Background
    style: Style
    sheet: Union[Sheet, None]
    layout: Layout
    marks: bool
    labels: bool
    floor: bool


class RetargetSpec(TypedDict, total=False):
    """How a clip is to be moved from one rig to another."""

    version: Union[int, None]
    task: Task
    source: RigSpec
    target: RigSpec
    clip: Union[ClipChoice, None]
    align: Align
    map: Union[list[ChainMap], None]
    pose: Union[PoseSpec, None]
    ops: Union[list[Op], None]
    morphs: MorphsSpec
    edit: EditSpec
    layer: Union[LayerSpec, None]
    output: Union[OutputChoice, None]
    report: ReportChoice
    tune: Union[TuneChoice, None]
    strict: bool
