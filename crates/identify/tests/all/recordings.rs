//! Recordings of real cables, where there are some: in the folder that `REAL_CABLES` names.

use std::io::Write;
use std::path::PathBuf;

use identify::branched::{Branch, Tree};
use identify::recording::{Grips, Reading, files, read_all, read_flat};

fn folder(name: &str) -> Option<PathBuf> {
    let Some(root) = std::env::var_os("REAL_CABLES") else {
        // Not through `println!`, which a test that passes keeps to itself.
        let _ = writeln!(std::io::stderr(), "skipped: no recordings, REAL_CABLES is not set");
        return None;
    };
    let folder = PathBuf::from(root).join(name);
    assert!(folder.is_dir(), "REAL_CABLES: there is no folder {}", folder.display());
    Some(folder)
}

#[test]
fn tables_of_noodles_are_read() {
    let Some(folder) = folder("prb-noodle") else { return };
    for k in 1..=4 {
        let recording = identify::noodle::read(&folder.join(format!("traj{k}.csv")), 1.0).unwrap().recording;
        let last = *recording.time.last().unwrap();
        assert!(
            recording.time.len() > 3000 && (25.0..27.0).contains(&last),
            "{} frames, {last} s",
            recording.time.len()
        );
    }
}

#[test]
fn pickles_of_deft_are_read_and_tell_where_branches_begin() {
    let (ends, middle) = (Grips::Ends, Grips::Middle(2));
    for (name, grips, parent, branches) in [
        ("BDLO1", ends, 13, [(4, 13..17), (8, 17..20)]),
        ("BDLO1_mid_clamp", middle, 13, [(4, 13..17), (8, 17..20)]),
        ("BDLO2", ends, 12, [(4, 12..16), (7, 16..20)]),
        ("BDLO3", ends, 12, [(4, 12..14), (7, 14..17)]),
    ] {
        let Some(folder) = folder(&format!("deft/{name}")) else { continue };
        let branches = branches.map(|(junction, markers)| Branch { junction, markers }).to_vec();
        let expected = Tree { parent, branches, grips };
        for part in ["train", "eval"] {
            let paths = files(&[folder.join(part)]).unwrap();
            let recordings: Vec<_> = paths.iter().map(|path| read_flat(path, Reading::default()).unwrap()).collect();
            assert!(recordings.iter().all(|own| (own.frames(), own.count()) == (500, expected.count())));
            assert_eq!(Tree::of(&recordings, grips).unwrap(), expected, "{name}/{part}");
            for recording in recordings {
                expected.checked(recording).unwrap();
            }
        }
    }
}

#[test]
fn pickles_of_deform_are_read() {
    for (cable, markers) in [("DLO1", 13), ("DLO2", 12), ("DLO3", 12)] {
        let Some(folder) = folder(&format!("deform/{cable}")) else { continue };
        for (part, count) in [("train", 56), ("eval", 14)] {
            let (recordings, errors) = read_all(&files(&[folder.join(part)]).unwrap(), Reading::default());
            assert!(errors.is_empty(), "{errors:?}");
            assert_eq!(recordings.len(), count);
            assert!(recordings.iter().all(|recording| (recording.frames(), recording.count()) == (500, markers)));
        }
    }
}
