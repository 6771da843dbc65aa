//! Recordings of real cables, where there are some: in the folder that `REAL_CABLES` names.

use std::io::Write;
use std::path::PathBuf;

use identify::branched::{Branch, Tree};
use identify::recording::{Reading, files, read_all, read_flat};

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
    let Some(folder) = folder("deft/BDLO1") else { return };
    for (part, count) in [("train", 12), ("eval", 6)] {
        let paths = files(&[folder.join(part)]).unwrap();
        let recordings: Vec<_> = paths.iter().map(|path| read_flat(path, Reading::default()).unwrap()).collect();
        assert_eq!(recordings.len(), count);
        assert!(recordings.iter().all(|recording| (recording.frames(), recording.count()) == (500, 20)));
        let tree = Tree::of(&recordings).unwrap();
        let branches = [(4, 13..17), (8, 17..20)].map(|(junction, markers)| Branch { junction, markers }).to_vec();
        assert_eq!(tree, Tree { parent: 13, branches });
        for recording in recordings {
            tree.checked(recording).unwrap();
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
