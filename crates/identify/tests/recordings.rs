//! Recordings of real cables, where there are some: the folder that `REAL_CABLES` names, or `../shared/real` beside the
//! repository.

use std::io::Write;
use std::path::PathBuf;

use identify::recording::{Reading, files, read_all};

fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("REAL_CABLES")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")), PathBuf::from);
    let folder = root.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    // Not through `println!`, which a test that passes keeps to itself.
    let _ = writeln!(std::io::stderr(), "skipped: no recordings at {}", folder.display());
    None
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
