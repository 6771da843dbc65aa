//! A scene's text, and the files that it names.

use std::fs;
use std::path::Path;

#[test]
fn files_that_a_text_names_may_be_called_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("a")).unwrap();
    fs::write(folder.path().join("a/way.csv"), "time_s,shift_x_m,shift_y_m,shift_z_m\n0,0,0,0\n1,0,0,0.1\n").unwrap();
    let rod = |y: i32, name: &str| {
        format!(
            "[[rods]] # one\nclamp = [\"start-segment\"]\nshape.straight = {{ start_m = [0, {y}, 0], length_m = 1, segments = 3 }}\n\
             motions = [{{ at = \"end-face\", file = {name} }}]\n"
        )
    };
    let text = |names: [&str; 2]| format!("run.from = 'other run@3'\n{}{}", rod(0, names[0]), rod(1, names[1]));
    let file = folder.path().join("s.toml");
    fs::write(&file, text(["\"a/way.csv\"", "'a/way.csv'"])).unwrap();
    let scene = scene::load(&file).unwrap();
    let own = scene.text.as_ref().unwrap();
    let path = folder.path().join("a/way.csv");
    assert_eq!(own.files(), [path.as_path()], "each once");
    let renamed = own.with_names(&[(&path, "b \"1\".csv".to_owned())]);
    let run = folder.path().join("other run@3");
    let expected =
        text([r#"'b "1".csv'"#, r#"'b "1".csv'"#]).replace("'other run@3'", &format!("\"{}\"", run.display()));
    assert_eq!(renamed, expected);

    // In another folder it is the same scene.
    let other = tempfile::tempdir().unwrap();
    fs::copy(&path, other.path().join("b \"1\".csv")).unwrap();
    fs::write(other.path().join("s.toml"), renamed).unwrap();
    let again = scene::load(other.path().join("s.toml")).unwrap();
    assert_eq!((again.model, again.state, again.from), (scene.model, scene.state, scene.from));
}

#[test]
fn scenes_that_name_nothing_are_their_text() {
    let scene = scene::builtin("helix").unwrap();
    let text = scene.text.unwrap();
    assert!(text.files().is_empty());
    let again = scene::parse(&text.with_names(&[(Path::new("x"), "y".to_owned())]), "helix.toml").unwrap();
    assert_eq!(again.model, scene.model);
    let refined = scene::builtin_refined("helix", 2.try_into().unwrap()).unwrap();
    assert_eq!(refined.text, None, "of other segments than the text's");
}
