//! Mistakes: one error that names the flag or file, the value and what is allowed; exit code 2; nothing on standard
//! output.

use std::fs;

use crate::common::{run, texts};

/// The first line of the error of arguments that are not accepted.
fn error(arguments: &[&str]) -> String {
    let output = run(arguments);
    let (code, out, err) = texts(&output);
    assert_eq!((code, out), (Some(2), ""), "{arguments:?}: {err}");
    assert_eq!(err.matches("error: ").count(), 1, "{arguments:?}: {err}");
    err.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn flags() {
    let whole = "it must be a whole number from 0 to 18446744073709551615";
    let guesses =
        "zero, previous, linear, quadratic, fischer, frozen, step-previous, step-linear, step-quadratic, step-adaptive";
    let learned = |flag, guess| {
        format!("{flag} needs a learned guess (--guess knn, gn, gn-best or gn-step), but the guess is {guess}")
    };
    for (arguments, expected) in [
        ("--dt=-1", "invalid value '-1' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--dt -1", "invalid value '-1' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--dt 0", "invalid value '0' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--dt nan", "invalid value 'nan' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--dt inf", "invalid value 'inf' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--tolerance -1e-6", "invalid value '-1e-6' for '--tolerance <TOLERANCE>': it must be a finite number > 0".to_owned()),
        (
            "--contact-tolerance 0",
            "invalid value '0' for '--contact-tolerance <CONTACT_TOLERANCE>': it must be a finite number > 0".to_owned(),
        ),
        ("--dt -1e-3", "invalid value '-1e-3' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--dt --json", "invalid value '--json' for '--dt <DT>': it must be a finite number > 0".to_owned()),
        ("--steps -3", format!("invalid value '-3' for '--steps <STEPS>': {whole}")),
        ("--steps 1.5", format!("invalid value '1.5' for '--steps <STEPS>': {whole}")),
        ("--steps 99999999999999999999", format!("invalid value '99999999999999999999' for '--steps <STEPS>': {whole}")),
        ("--threads 0", "invalid value '0' for '--threads <THREADS>': it must be a whole number from 1 to 1024".to_owned()),
        ("--threads 60000", "invalid value '60000' for '--threads <THREADS>': it must be a whole number from 1 to 1024".to_owned()),
        (
            "--formulation pbd",
            "invalid value 'pbd' for '--formulation <FORMULATION>': expected one of xpbd, newton".to_owned(),
        ),
        (
            "--integrator rk4",
            "invalid value 'rk4' for '--integrator <INTEGRATOR>': expected one of euler, bdf2".to_owned(),
        ),
        (
            "--guess knn --integrator bdf2",
            "--guess knn needs --integrator euler, from whose steps it has learned, but the integrator is bdf2".to_owned(),
        ),
        (
            "--guess best",
            format!("invalid value 'best' for '--guess <GUESS>': expected one of {guesses} (fischer-4: on the last 4 solutions), or a learned one: knn, gn, gn-best, gn-step"),
        ),
        (
            "--guess step-linear --formulation xpbd",
            "--guess step-linear needs --formulation newton, but the formulation is xpbd".to_owned(),
        ),
        (
            "--guess frozen --solver direct",
            "--guess frozen needs --solver cg, but the solver is direct, which has no use for a start".to_owned(),
        ),
        (
            "--guess knn --solver sparse",
            "--guess knn needs --solver cg, but the solver is sparse, which has no use for a start".to_owned(),
        ),
        (
            "--solver lu",
            "invalid value 'lu' for '--solver <SOLVER>': expected one of auto, direct, sparse, cg, cg-raw, cg-jacobi, cg-block-jacobi, cg-frozen".to_owned(),
        ),
        (
            "--guess knn --end-to-end --solver direct",
            "--end-to-end replaces all solves, but --solver direct asks for them".to_owned(),
        ),
        (
            "--guess knn --end-to-end --solver cg",
            "--end-to-end replaces all solves, but --solver cg-block-jacobi asks for them".to_owned(),
        ),
        (
            "--end-to-end=0",
            "invalid value '0' for '--end-to-end[=<PREDICTIONS>]': it must be a whole number from 1 to 1000".to_owned(),
        ),
        (
            "static net-on-sphere",
            "net-on-sphere: static analysis knows contacts with planes, spheres and capsules, but none between segments"
                .to_owned(),
        ),
        (
            "static heavy-cantilever --along",
            "heavy-cantilever: a path of equilibria needs something that changes over time: a motion, a load or gravity"
                .to_owned(),
        ),
        (
            "static net-on-sphere --branches",
            "net-on-sphere: the search for several equilibria knows no contacts, but the model has some (between segments: yes, obstacles: 1)"
                .to_owned(),
        ),
        (
            "static tree-10 --branches",
            "tree-10: the search for several equilibria needs a scene without wind, whose drag has no energy".to_owned(),
        ),
        ("--end-to-end", learned("--end-to-end", "the default")),
        ("--planar --guess zero", learned("--planar", "zero")),
        ("--data x --guess frozen --solver cg", "--data needs the guess knn, but asked for: frozen".to_owned()),
        ("--checkpoint x", "--checkpoint needs the guess gn, gn-best or gn-step, but asked for: none".to_owned()),
        ("--scenario rod", learned("--scenario", "the default")),
        ("--guess knn --scenario bush", "invalid value 'bush' for '--scenario <SCENARIO>': expected one of rod, helix, knot, tree".to_owned()),
        (
            "helix --planar --guess knn --end-to-end",
            "--planar needs a scene that lies and stays in a plane to which d1 or d2 of all segments is normal, but helix \
             does not"
                .to_owned(),
        ),
        (
            "strip --guess knn",
            "--guess knn learned from the paper's rods, but strip has inner damping; take another guess".to_owned(),
        ),
        ("--preconditioner jacobi --solver direct", "--preconditioner needs --solver cg, but the solver is direct".to_owned()),
        (
            "--linear-tolerance 1e-3 --solver sparse",
            "--linear-tolerance needs --solver cg, but the solver is sparse".to_owned(),
        ),
        (
            "--solver cg --preconditioner ilu",
            "invalid value 'ilu' for '--preconditioner <PRECONDITIONER>': expected one of raw, jacobi, block-jacobi, frozen"
                .to_owned(),
        ),
        ("--seed 3", "--seed needs a random scene (random-rod, random-helix, random-knot, random-tree), but the scene is bending-rod".to_owned()),
        ("--verbose", "unexpected argument '--verbose' found".to_owned()),
        (
            "helix --set rods.spring.radius_m=-1",
            "--set rods.spring.radius_m=-1: none of rods is called `spring` (there are helix; rods[0] is the first)".to_owned(),
        ),
        (
            "helix --set rods[0].radius_m=-1",
            "--set rods[0].radius_m=-1: rods[0].radius_m = -1, but it must be finite and > 0 [m]".to_owned(),
        ),
        (
            "random-rod --set run.dt_s=1",
            "--set run.dt_s=1: random-rod is drawn at random, without a file whose keys could be changed".to_owned(),
        ),
        ("--fps 0 --view", "invalid value '0' for '--fps <FPS>': it must be a finite number > 0".to_owned()),
        ("--fps 24 --every 2 --view", "the argument '--fps <FPS>' cannot be used with '--every <N>'".to_owned()),
        (
            "--fps 24",
            "--fps says which frames are kept in files, but no file is asked for: give --out, for example".to_owned(),
        ),
        ("view nowhere", "nowhere has no view.json, which a run with --view writes".to_owned()),
        (
            "export nowhere --export csv",
            "nowhere has no trajectory.safetensors, which a run with --trajectory writes".to_owned(),
        ),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        assert_eq!(error(&words), format!("error: {expected}"), "{arguments}");
    }
}

/// A flag of another command is named as such, and not taken for the name of a scene.
#[test]
fn flags_of_other_commands() {
    for (arguments, tip) in [
        (&["static", "helix", "--dt", "1"][..], Some("--dt is a flag of `simulate SCENE`")),
        (&["view", "x", "--rods", "a"], Some("--rods is a flag of `simulate SCENE`, `simulate export`")),
        (&["helix", "--nonsense"], None),
    ] {
        let output = run(arguments);
        let (code, _, err) = texts(&output);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.starts_with("error: unexpected argument '--") && !err.contains("as a value"), "{err}");
        let said = err.lines().find_map(|line| line.trim().strip_prefix("tip: "));
        assert_eq!(said, tip, "{err}");
    }
}

/// What `evaluate` measures is no scene, whatever follows.
#[test]
fn measuring_commands_name_the_program_that_has_them() {
    for name in ["compare", "guesses", "steps", "stress"] {
        let expected = format!("error: `simulate {name}` is `evaluate {name}` now: cargo run -p evaluate -- {name}");
        assert_eq!(error(&[name]), expected);
        assert_eq!(error(&[name, "helix", "--json"]), expected);
    }
}

#[cfg(not(feature = "gn"))]
#[test]
fn networks_that_the_program_does_not_have() {
    let absent = "this program was built without networks; build it with `--features gn`";
    for (arguments, flag) in [
        (&["--guess", "gn"][..], "'gn' for '--guess <GUESS>'"),
        (&["--guess", "gn-best", "--solver", "cg", "--checkpoint", "x"], "'gn-best' for '--guess <GUESS>'"),
    ] {
        assert_eq!(error(arguments), format!("error: invalid value {flag}: {absent}"));
    }
}

#[test]
fn scenes() {
    let unknown = |name: &str, meant: &str| {
        let hint = "(`simulate list` shows all; the name of a file ends in .toml)";
        assert_eq!(error(&[name]), format!("error: there is no scene `{name}`{meant} {hint}"));
    };
    for (name, meant) in [
        ("bend", "`bend-45`"),
        ("helx", "`helix`"),
        ("tree70", "`tree-70`"),
        ("knto", "`knot`"),
        ("random_rod", "`random-rod`"),
        ("lst", "the command `list`"),
        ("veiw", "the command `view`"),
    ] {
        unknown(name, &format!("; did you mean {meant}?"));
    }
    unknown("qqq", "");
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let missing = path("missing.toml");
    assert_eq!(
        error(&[&missing]),
        format!(
            "error: cannot read the scene {missing}: No such file or directory (os error 2) (`simulate list` shows the scenes \
             that come with the program)"
        )
    );
    let directory = path("");
    assert_eq!(error(&[&directory]), format!("error: cannot read the scene {directory}: Is a directory (os error 21)"));
    let scene = path("scene.toml");
    let shape = "shape.straight = { length_m = 4, segments = 30 }";
    for (text, expected) in [
        (
            format!("[[rods]]\n{shape}\nradius_m = -0.1\n"),
            ":3: rods[0].radius_m = -0.1, but it must be finite and > 0 [m]",
        ),
        (
            format!("[run]\nsteps = 0\n[[rods]]\n{shape}\n"),
            ":2: run.steps = 0, but it must be a whole number from 1 to 1000000000",
        ),
        (
            format!("[[rods]]\n{shape}\nclamp = \"start-face\"\n"),
            ":3: rods[0].clamp = \"start-face\", but it must be a list: [...]",
        ),
        ("gravity_m_s2 = 3\n".to_owned(), ":1: gravity_m_s2 = 3, but it must be three numbers: [x, y, z]"),
        ("[[rods]\n".to_owned(), ":1: not valid TOML"),
    ] {
        fs::write(&scene, &text).expect("a scene");
        let found = error(&[&scene]);
        assert!(found.starts_with(&format!("error: {scene}{expected}")), "{found}");
    }
    fs::write(&scene, format!("[[rods]]\n{shape}\n\nthickness = 2\n")).expect("a scene");
    let found = error(&[&scene]);
    assert!(
        found.starts_with(&format!("error: {scene}:4: rods[0].thickness is not a known key; expected one of")),
        "{found}"
    );
    assert!(found.contains("`radius_m`"), "{found}");
    fs::write(&scene, [0xff, 0xfe, 0x00]).expect("a scene");
    assert_eq!(error(&[&scene]), format!("error: cannot read the scene {scene}: stream did not contain valid UTF-8"));
}

/// Bodies that overlap at the start: the pair that does so most, in the words of the scene and of the model.
#[test]
fn overlaps() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cross.toml").to_str().expect("UTF-8").to_owned();
    let rod = |start: &str, direction: &str| {
        let shape = format!("{{ length_m = 2, segments = 4, start_m = {start}, direction = {direction} }}");
        format!("[[rods]]\nradius_m = 0.05\nshape.straight = {shape}\n")
    };
    let write = |text: &str| fs::write(&file, format!("{text}{}", rod("[0, 0, 0]", "[1, 0, 0]"))).expect("a scene");
    let crossing = rod("[0.3, -0.8, 0.08]", "[0, 1, 0]");
    let advice = "move them apart, or allow it (`contact.allow_overlap`)";
    write(&format!("contact = {{}}\n{crossing}"));
    let found = error(&[&file]);
    let expected = "segment 1 of rod-0 and segment 0 of rod-1 overlap by 0.02 m at the start";
    assert_eq!(found, format!("error: {file}:2: {expected}; {advice}"));
    assert_eq!(error(&[&file, "--json", "--contacts", "alternating"]), found);
    write("[[obstacles]]\nshape.plane.point_m = [0, 0, 0.02]\n");
    let expected = "segment 0 of rod-0 overlaps obstacle-0 (a plane) by 0.07 m at the start, and 3 other pairs too";
    assert_eq!(error(&[&file]), format!("error: {file}:3: {expected}; {advice}"));
    // Small enough to be within the tolerance, or allowed.
    assert_eq!(run(&[&file, "--contact-tolerance", "2", "--steps", "1"]).status.code(), Some(0));
    write(&format!("contact.allow_overlap = true\n{crossing}"));
    assert_eq!(run(&[&file, "--steps", "1"]).status.code(), Some(0));
}

/// A place that cannot be written to is found out before the run, however long that would be.
#[test]
fn places_to_write() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let long = ["bending-rod", "--steps", "1000000000", "--out"];
    let file = path("file");
    fs::write(&file, "keep me").expect("a file");
    assert_eq!(
        error(&[&long[..], &[&file]].concat()),
        format!("error: --out: cannot create the directory {file}: not a directory")
    );
    assert_eq!(fs::read_to_string(&file).expect("a file"), "keep me");
    for name in ["trajectory.safetensors", "summary.json"] {
        let out = path(&format!("out-{name}"));
        let taken = format!("{out}/{name}");
        fs::create_dir_all(&taken).expect("a folder");
        let found = error(&[&long[..], &[&out]].concat());
        let way_out = "move it, or choose another folder";
        assert_eq!(found, format!("error: --out: {taken} is in the way and is not from an earlier run: {way_out}"));
        assert_eq!(fs::read_dir(&out).expect("a folder").count(), 1, "no temporary file stays");
    }
    assert!(error(&["--out", ""]).starts_with("error: "));
}
