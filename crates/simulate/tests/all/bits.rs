//! The same bits from revision to revision, so that moves and renames show to be no more than that.
//!
//! Where numbers are meant to change, the new hashes stand in the message of the failure. They are those of x86-64 with AVX2 or more, and
//! of the sines and cosines of glibc.

use crate::common::json;

/// Scenes, and the hashes of the state after 30 steps with AVX2 and with AVX-512: faer's factors, which nets and contacts take, differ in the
/// last bits.
const HASHES: [(&str, [&str; 2]); 10] = [
    ("bending-rod", ["5d47bf821ea75eee", "5d47bf821ea75eee"]),
    ("helix", ["60036805ff5d7791", "60036805ff5d7791"]),
    ("slack-rod", ["cb73be9f4cea061e", "cb73be9f4cea061e"]),
    ("stiff-rod", ["90462672c175dde1", "90462672c175dde1"]),
    ("tree-10", ["b6d0c3281c78f8e1", "b6d0c3281c78f8e1"]),
    ("net", ["97e8995f35aef75e", "d919eeacf9785d95"]),
    ("heap-5", ["1508158adbabf95c", "6c0478b64c165a34"]),
    ("helix-on-plane", ["66013c0f19a248d3", "7ef71040b7cce5d4"]),
    ("drum", ["c2a71f7641e36a7b", "7b6093c353afa835"]),
    ("suture", ["4556fff350853488", "4556fff350853488"]),
];

#[test]
#[cfg(target_arch = "x86_64")]
fn ten_scenes_have_the_bits_that_they_had() {
    let mut others = String::new();
    for (scene, stored) in HASHES {
        let summary = json(&[scene, "--steps", "30"]);
        let hash = &summary["final_state_hash"].as_str().expect("a hash")[..16];
        if !stored.contains(&hash) {
            others += &format!("    (\"{scene}\", \"{hash}\"),\n");
        }
    }
    assert!(others.is_empty(), "other bits; where they are meant to change, the new ones are\n{others}");
}
