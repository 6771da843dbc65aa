//! Whatever is done to a scene file, it gives a valid model or one error that names the file: no panic, no memory spent.

use std::sync::LazyLock;

use proptest::prelude::*;

/// The texts of all builtin scenes that are small enough to be read thousands of times.
static TEXTS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let small = files.into_iter().filter(|path| !path.ends_with("long-chain.toml") && !path.ends_with("tree.toml"));
    let mut texts: Vec<String> = small.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    texts.push(include_str!("../everything.toml").to_owned());
    texts.push(include_str!("../bodies.toml").to_owned());
    texts
});

const NUMBERS: [&str; 18] = [
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "-1",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-160",
    "1e160",
    "1e15",
    "99999999999",
    "9223372036854775807",
    "-9223372036854775808",
    "0.5",
    "\"a\"",
];

fn check(text: &str) {
    match scene::parse(text, "mangled.toml") {
        Ok(scene) => {
            scene.model.validate(&scene.state).unwrap();
            assert!(scene.run.dt > 0.0 && scene.run.dt.is_finite() && scene.run.steps > 0);
            assert!(scene.run.every > 0 && scene.probes.iter().all(|probe| probe.segment < scene.model.segments.len()));
        }
        Err(error) => {
            let error = error.to_string();
            assert!(error.starts_with("mangled.toml:"), "{error}");
            let line = error["mangled.toml:".len()..].split(':').next().unwrap();
            let line: usize = line.parse().unwrap();
            assert!((1..=text.lines().count() + 1).contains(&line), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }
}

/// Byte ranges of the numbers in a text.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | 'e');
    let mut found = Vec::new();
    let mut start = None;
    for (i, c) in text.char_indices() {
        match (start, is_number(c)) {
            (None, true) => start = Some(i),
            (Some(from), false) => {
                if text[from..i].parse::<f64>().is_ok() {
                    found.push(from..i);
                }
                start = None;
            }
            _ => {}
        }
    }
    found
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes(which: prop::sample::Index, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let mut bytes = which.get(&TEXTS[..]).clone().into_bytes();
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        check(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn cut_pieces(which: prop::sample::Index, a: prop::sample::Index, b: prop::sample::Index) {
        let text = which.get(&TEXTS[..]);
        let (a, b) = (a.index(text.len()), b.index(text.len()));
        check(&[&text[..a.min(b)], &text[a.max(b)..]].concat());
        check(&text[..a]);
    }

    #[test]
    fn swapped_lines(which: prop::sample::Index, swaps in prop::collection::vec(any::<(prop::sample::Index, prop::sample::Index)>(), 1..4)) {
        let mut lines: Vec<&str> = which.get(&TEXTS[..]).lines().collect();
        for (a, b) in swaps {
            let (a, b) = (a.index(lines.len()), b.index(lines.len()));
            lines.swap(a, b);
        }
        check(&lines.join("\n"));
    }

    #[test]
    fn repeated_lines(which: prop::sample::Index, from: prop::sample::Index, other: prop::sample::Index, to: prop::sample::Index) {
        let mut lines: Vec<&str> = which.get(&TEXTS[..]).lines().collect();
        let others: Vec<&str> = other.get(&TEXTS[..]).lines().collect();
        lines.insert(to.index(lines.len()), others[from.index(others.len())]);
        check(&lines.join("\n"));
    }

    #[test]
    fn strange_numbers(which: prop::sample::Index, places in prop::collection::vec((any::<prop::sample::Index>(), 0..NUMBERS.len()), 1..4)) {
        let mut text = which.get(&TEXTS[..]).clone();
        for (place, number) in places {
            let found = numbers(&text);
            text.replace_range(place.get(&found).clone(), NUMBERS[number]);
        }
        check(&text);
    }
}

#[test]
fn every_number_replaced_by_every_strange_one() {
    for text in TEXTS.iter() {
        for place in numbers(text) {
            for number in NUMBERS {
                let mut mangled = text.clone();
                mangled.replace_range(place.clone(), number);
                check(&mangled);
            }
        }
    }
}
