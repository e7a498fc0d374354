//! What the fuzzer found and is mended, each with the smallest input that showed it.

use super::shared::Target;

/// ufbx took the version from the first comment, here after it had begun to read by another one, and ended the process.
#[test]
fn a_text_fbx_changes_its_version_halfway() {
    Target::Fbx.run(
        b"FBXHeaderExtension: {\n FBXVersion: 7400\n}\nDocuments: {\n}\n; FBX 6.1.0 project file\nObjects: {\n Model: \"Model::a\", \"Limb\" {\n \
          Properties60: {\n Property: \"Lcl Rotation\", \"\", \"A\",0,0,0\n }\n }\n}\n",
    );
}

/// Names are read word by word; eight megabytes of one took half a minute.
#[test]
fn a_joint_has_a_name_of_megabytes() {
    let name = "LeftUpLeg_".repeat(1 << 18);
    Target::Sniff.run(format!("HIERARCHY ROOT {name} {{ OFFSET 0 0 0 }}").as_bytes());
}
