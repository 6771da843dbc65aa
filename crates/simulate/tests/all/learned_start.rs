//! Where `simulate static` begins.

#[cfg(feature = "gn")]
use serde_json::Value;

use crate::common::{CABLE_BETWEEN_GRIPS, json, run, texts};

#[cfg(feature = "gn")]
fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key}: {report}"))
}

#[test]
#[cfg(feature = "gn")]
fn a_cable_between_two_grips_begins_where_a_network_proposes() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cable.toml");
    std::fs::write(&file, CABLE_BETWEEN_GRIPS).unwrap();
    let file = file.to_str().unwrap();
    let [learned, drawn] = [&["static", file][..], &["static", file, "--start", "drawn"]].map(json);
    for report in [&learned, &drawn] {
        assert_eq!((&report["converged"], &report["stable"]), (&true.into(), &true.into()), "{report}");
    }
    assert!(learned["learned_start_solves"].is_u64() && drawn["learned_start_solves"].is_null());
    // What is left to do is to go from the sine of joints' angles to the angles, and to see that it is at rest.
    assert!(number(&learned, "linear_solves") <= 4.0, "{learned}");
    assert!(number(&drawn, "linear_solves") > number(&learned, "linear_solves"), "{drawn}");
    let [low, high] = [&learned, &drawn].map(|report| number(report, "energy_end_j"));
    assert!(low <= high + 1e-9 * high.abs(), "{low} J, {high} J");
    assert!(texts(&run(&["static", file])).1.contains("near the lowest equilibrium, which a network proposed"));
    // What the network does not know begins as drawn.
    for scene in ["heavy-cantilever", "hung-cable", "clamped-ends"] {
        assert!(json(&["static", scene])["learned_start_solves"].is_null(), "{scene}");
    }
}

#[test]
#[cfg(not(feature = "gn"))]
fn without_networks_a_search_begins_as_drawn_and_a_learned_start_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cable.toml");
    std::fs::write(&file, CABLE_BETWEEN_GRIPS).unwrap();
    let file = file.to_str().unwrap();
    assert_eq!(json(&["static", file])["learned_start_solves"], serde_json::Value::Null);
    let refused = run(&["static", file, "--start", "learned"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(texts(&refused).2.contains("--start learned needs the cargo feature gn"), "{refused:?}");
}
