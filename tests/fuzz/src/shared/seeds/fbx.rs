//! FBX, as text by hand and in binary by our own writer.

use retargetd::{
    formats::{self, Compression, Format, Limits, WriteOptions},
    model::{Control, Reporter},
};

use super::{Seed, written};

/// Seconds in the unit of the format.
const TICKS: i64 = 46_186_158_000;

pub(super) fn all() -> Vec<Seed> {
    let text = text();
    vec![
        ("text".to_owned(), text.clone()),
        ("text_again".to_owned(), again(&text)),
        ("old_text".to_owned(), OLD.as_bytes().to_vec()),
        written("walk", Format::Fbx, Compression::None),
    ]
}

/// What is read from the text, written in binary: mesh, skin, shape, and the clip.
///
/// # Panics
/// When the text above cannot be read.
fn again(text: &[u8]) -> Vec<u8> {
    let (control, mut reporter) = (Control::new(), Reporter::new());
    let scene =
        formats::read(text, Format::Fbx, &Limits::default(), &control, &mut reporter).expect("the text is good");
    let clip = scene.clips.first().expect("it has a clip");
    let options = WriteOptions::new(Format::Fbx);
    formats::write(&scene, clip, &options, &control, &mut reporter).expect("it can be written")
}

/// Two joints with pivots, a mesh bound to them, a shape, a take with two layers.
fn text() -> Vec<u8> {
    let curve = |id: u32, values: &str| {
        format!(
            "AnimationCurve: {id}, \"AnimCurve::\", \"\" {{\n KeyVer: 4008\n KeyTime: *2 {{\n a: 0,{TICKS}\n }}\n \
             KeyValueFloat: *2 {{\n a: {values}\n }}\n KeyAttrFlags: *2 {{\n a: 8456,2\n }}\n KeyAttrDataFloat: *8 {{\n \
             a: 0,0,218434821,0,0,0,0,0\n }}\n KeyAttrRefCount: *2 {{\n a: 1,1\n }}\n}}\n"
        )
    };
    let node = |id: u32, name: &str| {
        format!(
            "AnimationCurveNode: {id}, \"AnimCurveNode::{name}\", \"\" {{\n Properties70: {{\n P: \"d|X\", \"Number\", \"\", \"A\",0\n \
             P: \"d|Y\", \"Number\", \"\", \"A\",0\n P: \"d|Z\", \"Number\", \"\", \"A\",0\n }}\n}}\n"
        )
    };
    let curves = [node(40, "T"), node(41, "R"), curve(42, "0,5"), curve(43, "0,270")].concat();
    format!("{HEADER}{OBJECTS}{curves}}}\n{CONNECTIONS}").into_bytes()
}

const HEADER: &str = "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n FBXHeaderVersion: 1003\n FBXVersion: 7400\n}\n\
    GlobalSettings:  {\n Version: 1000\n Properties70:  {\n P: \"UpAxis\", \"int\", \"Integer\", \"\",2\n \
    P: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n P: \"FrontAxis\", \"int\", \"Integer\", \"\",1\n \
    P: \"FrontAxisSign\", \"int\", \"Integer\", \"\",-1\n P: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n \
    P: \"CoordAxisSign\", \"int\", \"Integer\", \"\",1\n P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",2.54\n \
    P: \"TimeMode\", \"enum\", \"\", \"\",6\n }\n}\n";

const OBJECTS: &str = "Objects:  {\n\
    NodeAttribute: 10, \"NodeAttribute::\", \"LimbNode\" {\n TypeFlags: \"Skeleton\"\n}\n\
    Model: 1, \"Model::Hips\", \"LimbNode\" {\n Version: 232\n Properties70: {\n \
    P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",1,2,40\n P: \"RotationActive\", \"bool\", \"\", \"\",1\n \
    P: \"PreRotation\", \"Vector3D\", \"Vector\", \"\",0,0,90\n P: \"PostRotation\", \"Vector3D\", \"Vector\", \"\",10,0,0\n \
    P: \"RotationPivot\", \"Vector3D\", \"Vector\", \"\",1,0,0\n P: \"InheritType\", \"enum\", \"\", \"\",1\n }\n}\n\
    Model: 2, \"Model::ns:Spine\", \"LimbNode\" {\n Version: 232\n Properties70: {\n \
    P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",10,0,0\n P: \"RotationOrder\", \"enum\", \"\", \"\",5\n \
    P: \"RotationActive\", \"bool\", \"\", \"\",1\n P: \"Lcl Scaling\", \"Lcl Scaling\", \"\", \"A\",1,2,1\n \
    P: \"InheritType\", \"enum\", \"\", \"\",2\n }\n}\n\
    Model: 3, \"Model::Body\", \"Mesh\" {\n Version: 232\n Properties70: {\n \
    P: \"GeometricTranslation\", \"Vector3D\", \"Vector\", \"\",0,0,1\n }\n}\n\
    Geometry: 20, \"Geometry::Body\", \"Mesh\" {\n Vertices: *9 {\n a: 0,0,0,1,0,0,0,1,0\n }\n PolygonVertexIndex: *3 {\n a: 0,1,-3\n }\n}\n\
    Geometry: 21, \"Geometry::Smile\", \"Shape\" {\n Version: 100\n Indexes: *1 {\n a: 1\n }\n Vertices: *3 {\n a: 0,0,1\n }\n}\n\
    Deformer: 30, \"Deformer::Skin\", \"Skin\" {\n Version: 101\n}\n\
    Deformer: 31, \"SubDeformer::Hips\", \"Cluster\" {\n Version: 100\n Indexes: *2 {\n a: 0,1\n }\n Weights: *2 {\n a: 1,0.5\n }\n \
    Transform: *16 {\n a: 1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n }\n TransformLink: *16 {\n a: 1,0,0,0,0,1,0,0,0,0,1,0,1,2,40,1\n }\n}\n\
    Deformer: 32, \"Deformer::Shapes\", \"BlendShape\" {\n Version: 100\n}\n\
    Deformer: 33, \"SubDeformer::Smile\", \"BlendShapeChannel\" {\n Version: 100\n DeformPercent: 0\n FullWeights: *1 {\n a: 100\n }\n}\n\
    AnimationStack: 50, \"AnimStack::Take 001\", \"\" {\n Properties70: {\n P: \"LocalStop\", \"KTime\", \"Time\", \"\",46186158000\n }\n}\n\
    AnimationLayer: 51, \"AnimLayer::Base\", \"\" {\n}\n\
    AnimationLayer: 52, \"AnimLayer::More\", \"\" {\n Properties70: {\n P: \"Weight\", \"Number\", \"\", \"A\",50\n }\n}\n";

const CONNECTIONS: &str = "Connections:  {\nC: \"OO\",1,0\nC: \"OO\",2,1\nC: \"OO\",3,0\nC: \"OO\",10,1\nC: \"OO\",20,3\nC: \"OO\",30,20\n\
    C: \"OO\",31,30\nC: \"OO\",1,31\nC: \"OO\",32,20\nC: \"OO\",33,32\nC: \"OO\",21,33\nC: \"OO\",51,50\nC: \"OO\",52,50\nC: \"OO\",40,51\n\
    C: \"OO\",41,52\nC: \"OP\",40,1,\"Lcl Translation\"\nC: \"OP\",41,2,\"Lcl Rotation\"\nC: \"OP\",42,40,\"d|X\"\nC: \"OP\",43,41,\"d|Y\"\n\
    C: \"OP\",43,33,\"DeformPercent\"\n}\n";

/// Version 6.1, where objects are connected by their names and a take holds its curves.
const OLD: &str = "; FBX 6.1.0 project file\nFBXHeaderExtension:  {\n FBXHeaderVersion: 1003\n FBXVersion: 6100\n}\n\
    Objects:  {\n Model: \"Model::Hips\", \"Limb\" {\n Version: 232\n Properties60:  {\n \
    Property: \"Lcl Translation\", \"Lcl Translation\", \"A+\",0,90,0\n Property: \"Lcl Rotation\", \"Lcl Rotation\", \"A+\",0,0,0\n \
    Property: \"RotationOrder\", \"enum\", \"\",2\n }\n }\n Model: \"Model::Spine\", \"Limb\" {\n Version: 232\n Properties60:  {\n \
    Property: \"Lcl Translation\", \"Lcl Translation\", \"A+\",0,10,0\n }\n }\n}\n\
    Connections:  {\n Connect: \"OO\", \"Model::Hips\", \"Model::Scene\"\n Connect: \"OO\", \"Model::Spine\", \"Model::Hips\"\n}\n\
    Takes:  {\n Current: \"Take 001\"\n Take: \"Take 001\" {\n FileName: \"Take_001.tak\"\n LocalTime: 0,46186158000\n \
    ReferenceTime: 0,46186158000\n Model: \"Model::Hips\" {\n Version: 1.1\n Channel: \"Transform\" {\n Channel: \"T\" {\n \
    Channel: \"X\" {\n Default: 0\n KeyVer: 4005\n KeyCount: 2\n Key: 0,0,L,46186158000,5,U,s,0,0,n\n }\n }\n }\n }\n }\n}\n";
