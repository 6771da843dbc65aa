//! What a scene file has: the rows of the table of a campaign.

use toml::{Table, Value};

use crate::case::Case;

/// Names of what a case has: its formulation, integrator and solver, and keys of its scene file that say what it shows.
pub fn features(case: &Case) -> Vec<String> {
    let way = &case.way;
    let mut found = vec![
        format!("formulation {}", way.formulation),
        format!("integrator {}", way.integrator),
        format!("solver {}", way.solver),
    ];
    let Ok(table) = case.text.parse::<Table>() else { return found };
    if !table.contains_key("contact") && !table.contains_key("obstacles") {
        found.push("contacts: none".to_owned());
    }
    for key in ["air", "damping", "bodies", "nets", "joins", "copies", "gravity_over_time"] {
        if table.contains_key(key) {
            found.push(key.to_owned());
        }
    }
    if let Some(contact) = table.get("contact") {
        found.push("contact between rods".to_owned());
        surface(contact, &mut found);
    }
    let entries = |key: &str| table.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    for obstacle in entries("obstacles") {
        let shape = obstacle.get("shape").and_then(Value::as_table).and_then(|shape| shape.keys().next());
        found.extend(shape.map(|shape| format!("obstacle {shape}")));
        if obstacle.get("motion").is_some() {
            found.push("obstacle that moves".to_owned());
        }
        surface(&obstacle, &mut found);
    }
    for rod in entries("rods") {
        let shape = rod.get("shape").and_then(Value::as_table).and_then(|shape| shape.keys().next());
        found.extend(shape.map(|shape| format!("shape {shape}")));
        for key in [
            "section",
            "pieces",
            "stretch",
            "inner_damping",
            "branch_of",
            "branch_joint",
            "clamp",
            "loads",
            "tree",
            "strands",
            "heap",
        ] {
            if rod.get(key).is_some() {
                found.push(key.to_owned());
            }
        }
        let of_rod = |key: &str| rod.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
        for (key, name) in [("grips", "grip"), ("motions", "motion")] {
            for entry in of_rod(key) {
                let is_timed = entry.get("from_s").is_some() || entry.get("until_s").is_some();
                found.push(if is_timed { format!("{name} with times") } else { name.to_owned() });
            }
        }
    }
    found.sort();
    found.dedup();
    found
}

fn surface(of: &Value, found: &mut Vec<String>) {
    let friction = match of.get("friction") {
        None => "friction none",
        Some(Value::Table(_)) => "friction { at_rest, sliding }",
        Some(_) => "friction number",
    };
    found.push(friction.to_owned());
    if of.get("restitution").is_some() {
        found.push("restitution".to_owned());
    }
}
