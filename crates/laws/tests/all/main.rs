//! All tests of the crate's public side as one program, which builds faster than one program a file.

use std::path::Path;

use laws::{Campaign, Case, Checked, KNOWN, Law, Way, campaign, check, draw, shrink};

#[test]
fn the_same_seed_draws_the_same_scenes_and_others_draw_others() {
    for index in 0..20 {
        assert_eq!(draw(5, index), draw(5, index));
        assert_ne!(draw(5, index), draw(6, index));
        assert_ne!(draw(5, index), draw(5, index + 1));
    }
}

#[test]
fn known_faults_are_still_there() {
    for known in KNOWN {
        let case = known.case().unwrap();
        let checked = check(&case).unwrap();
        assert!(checked.breaks(known.law).is_some(), "mended, strike it off: {}: {}", known.law, known.why);
    }
}

#[test]
fn a_case_is_read_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let with_files = (0..200).map(|index| draw(1, index)).find(|case| !case.files.is_empty()).unwrap();
    for (name, text) in &with_files.files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("case.toml");
    std::fs::write(&path, with_files.file()).unwrap();
    assert_eq!(Case::load(&path).unwrap(), with_files);
    std::fs::write(&path, "[[rods]]\n").unwrap();
    assert!(Case::load(&path).unwrap_err().to_string().contains("the first line must be"));
    assert!(Case::load(Path::new("nowhere.toml")).unwrap_err().to_string().contains("cannot read nowhere.toml"));
}

#[test]
fn a_scene_that_is_refused_says_why_and_breaks_nothing() {
    let text = "[[rods]]\nradius_m = -1\nshape.straight = { length_m = 1, segments = 2 }\n";
    let case = Case { text: text.to_owned(), files: Vec::new(), way: Way::default() };
    match check(&case).unwrap() {
        Checked::Refused(words) => assert!(words.contains("radius_m = -1"), "{words}"),
        Checked::Ran(report) => panic!("{report:?}"),
    }
    let (same, how) = shrink(&case, Law::Energy).unwrap();
    assert_eq!((same, how), (case, None));
}

#[test]
fn what_is_found_does_not_depend_on_threads() {
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tell = |_: &[laws::Failure]| true;
        let found =
            pool.install(|| campaign(&Campaign { seed: 2, first: 10, count: 15, shrinks: false }, &tell)).unwrap();
        (found.all, found.steps, found.contacts, found.features)
    };
    let one = of(1);
    assert_eq!(one.0.scenes, 15);
    assert_eq!(one, of(3));
}
